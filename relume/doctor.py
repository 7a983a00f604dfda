"""Find out what works on this machine: versions, the LLVM library, variants; and what to do."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from relume import llvm, probe
from relume.cores import available_cores
from relume.llvm import Library

PACKAGES = (
    "relume", "mitsuba", "drjit", llvm.WHEEL, "numpy", "scipy", "OpenEXR", "pillow", "rich",
    "click", "matplotlib", "Jinja2", "platformdirs", "flip-evaluator",
)  # fmt: skip
NEEDED = "llvm_ad_rgb"
VARIANTS = (NEEDED, "llvm_ad_spectral", "scalar_rgb")


@dataclass(frozen=True)
class Variant:
    """A Mitsuba variant.

    Attributes:
        name: as `mitsuba.set_variant` takes it.
        works: whether it rendered a tiny scene in a subprocess.
        reason: why not; empty if it works.
    """

    name: str
    works: bool
    reason: str = ""


@dataclass(frozen=True)
class Report:
    """What was found.

    Attributes:
        system: operating system, machine and version of Python.
        versions: version of each package, None where it is not installed.
        cores: processors that this process may use.
        llvm: the library that this process uses.
        candidates: every library found, newly probed.
        variants: the variants tried.
        advice: sentences that say what to do; empty if nothing is to be done.
    """

    system: str
    versions: dict[str, str | None]
    cores: int
    llvm: Library
    candidates: tuple[Library, ...]
    variants: tuple[Variant, ...]
    advice: tuple[str, ...]

    @property
    def healthy(self) -> bool:
        """Whether the variant that relume renders with works."""
        return any(variant.name == NEEDED and variant.works for variant in self.variants)


def run() -> int:
    """Examine the machine and print what was found.

    Returns:
        Exit status: 0 if `llvm_ad_rgb` works, else 1.
    """
    found = report()
    print_report(found)
    return 0 if found.healthy else 1


def report() -> Report:
    """Examine the machine; every library and variant is tried in a subprocess."""
    chosen = llvm.install()
    names = [*VARIANTS, *(["cuda_ad_rgb"] if has_gpu() else [])]
    variants = tuple(_try_variant(name, chosen.path) for name in names)
    return Report(
        system=f"{platform.platform()}, Python {platform.python_version()}",
        versions={package: _version(package) for package in PACKAGES},
        cores=available_cores(),
        llvm=chosen,
        candidates=tuple(llvm.judge(library, afresh=True) for library in _libraries(chosen)),
        variants=variants,
        advice=tuple(_advice(chosen, variants)),
    )


def has_gpu() -> bool:
    """Tell whether an NVIDIA driver is installed."""
    return Path("/proc/driver/nvidia/version").exists() or bool(shutil.which("nvidia-smi"))


def print_report(found: Report) -> None:
    """Print a report to standard output."""
    from rich.markup import escape
    from rich.table import Table

    from relume.consoles import console

    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")

    def section(title: str, rows: Iterable[tuple[str, str]]) -> None:
        table.add_row(f"[bold]{title}[/]")
        for name, text in rows:
            table.add_row(f"  {escape(name)}", escape(text))

    def outcome(good: bool, text: str = "") -> str:
        return ("works" if good else "does not work") + (f": {text}" if text else "")

    section("Machine", [("system", found.system), ("cores", str(found.cores))])
    versions = found.versions.items()
    section("Packages", [(name, version or "not installed") for name, version in versions])
    section(
        "LLVM library",
        [("chosen", found.llvm.path or "none of these"), ("why", found.llvm.reason)]
        + [
            (library.source, f"{library.path}: {outcome(library.usable, library.reason)}")
            for library in found.candidates
        ],
    )
    section("Variants", [(v.name, outcome(v.works, v.reason)) for v in found.variants])
    advice = enumerate(found.advice, 1)
    section("To do", [(f"{number}.", text) for number, text in advice] or [("nothing", "")])
    console().print(table)


def _libraries(chosen: Library) -> Collection[Library]:
    """List the machine's libraries, each once: by now the environment names the chosen one."""
    known = [*chosen.rejected, *([chosen] if chosen.path else [])]
    libraries: dict[str, Library] = {}
    for library in [*known, *llvm.candidates()]:
        libraries.setdefault(os.path.realpath(str(library.path)), library)
    return libraries.values()


def _try_variant(name: str, library: str | None) -> Variant:
    if library is None and name.startswith("llvm"):
        return Variant(name, False, "there is no usable LLVM library")
    try:
        probe.render(name, library or llvm.NOTHING)
    except probe.Failed as failed:
        return Variant(name, False, str(failed))
    return Variant(name, True)


def _advice(chosen: Library, variants: Iterable[Variant]) -> Iterator[str]:
    """Say what to do, most urgent first."""
    working = [variant.name for variant in variants if variant.works]
    for library in chosen.rejected:
        if library.source == "user":
            yield f"Unset {llvm.VARIABLE}, or set it to another library: {library.reason}."
    if not working:
        yield "No variant works: reinstall Mitsuba (make clean setup, or pip install mitsuba)."
    elif NEEDED not in working:
        yield f"{NEEDED} does not work. {llvm.ADVICE}"
        if "scalar_rgb" in working:
            yield "Until then scalar_rgb renders, much slower, scenes whose features work there."


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None
