"""`relume merge`: one picture of passes that were rendered apart."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from relume import fingerprint, output, passes_file
from relume.destination import PASSES
from relume.passes import PassPlan, PassSet
from relume.passes_file import Header


class CannotMerge(ValueError):
    """Files that do not belong together; the message names them and says why."""


def merge(
    parts: Sequence[str | Path], out: str | Path, console: Console
) -> tuple[tuple[Path, ...], PassSet]:
    """Merge files of passes.

    Args:
        parts: the files.
        out: the picture; a name that ends with `.passes.exr` takes the passes themselves.
        console: for what was found.

    Returns:
        Paths of the files written, and the `PassSet` of what is missing.

    Raises:
        CannotMerge: two files are of different renders, or share a pass.
        NoPasses: a file holds no passes.
        OutputError: the picture cannot be written.
    """
    parts, out = list(dict.fromkeys(parts)), Path(out)
    if any(out.exists() and Path(part).exists() and out.samefile(part) for part in parts):
        raise CannotMerge(f"{out} is one of the parts")
    output.check_format(out)
    output.check_writable(out)
    header, missing = checked(parts)
    accumulator = passes_file.read(parts[0])
    for part in parts[1:]:
        accumulator.merge(passes_file.read(part))
    console.print(
        f"passes {accumulator.done.ranges()}: {accumulator.spp} of {header.spp} samples per pixel",
        highlight=False,
    )
    if len(missing):
        console.print(f"[yellow]passes {missing.ranges()} are missing[/]", highlight=False)
    if out.name.endswith(PASSES):
        passes_file.write(out, accumulator, header)
        return (out,), missing
    written = output.write_image(out, accumulator.image(), header.gamma, header.comment)
    return written.paths, missing


def checked(parts: Sequence[str | Path]) -> tuple[Header, PassSet]:
    """Check that files belong together and share no pass, before their sums are read.

    Args:
        parts: the files.

    Returns:
        Their common `Header`, and the `PassSet` that none of them holds.

    Raises:
        CannotMerge, NoPasses: as `merge`.
    """
    headers = {part: passes_file.read_header(part) for part in parts}
    first, *_ = headers.values()
    owned: list[tuple[str | Path, PassSet]] = []
    done = PassSet()
    for part, header in headers.items():
        found = list(fingerprint.differences(header.render, first.render))
        if found:
            raise CannotMerge(f"{part} does not belong to {parts[0]}: {'; '.join(found)}")
        for start, stop, _ in header.done.runs:
            for other, passes in owned:
                if shared := passes.between(start, stop).ranges():
                    raise CannotMerge(f"{part} and {other} share the passes {shared}")
        owned.append((part, header.done))
        done = done.union(header.done)
    whole = dataclasses.replace(
        first,
        seconds=sum(header.seconds for header in headers.values()),
        spp=max(header.spp for header in headers.values()),
    )
    plan = PassPlan(whole.spp, whole.render[fingerprint.PER_PASS])
    return whole, plan.passes().without(done)
