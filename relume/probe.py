"""Render a tiny scene in a subprocess, to learn what would end this process.

The verdict on an LLVM library is kept in the user's cache folder, under the file's name, time and
size and the version of Dr.Jit.
"""

from __future__ import annotations

import importlib.metadata
import json
import os
import sys
from pathlib import Path
from typing import NamedTuple

from relume import cache

VARIABLE = "DRJIT_LIBLLVM_PATH"
SECONDS = 120
REFUSED = 43  # exit status of the subprocess when the variant is not available
SCRIPT = f"""
import json, math, sys
variant, *sys.path[:] = sys.argv[1:]
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except ImportError:
    pass
import drjit as dr
import mitsuba as mi
try:
    mi.set_variant(variant)
except ImportError as error:
    print(error, file=sys.stderr)
    sys.exit({REFUSED})
scene = mi.cornell_box()
scene["sensor"]["film"].update(width=4, height=4)
mean = float(mi.render(mi.load_dict(scene), spp=4).numpy().mean())
assert math.isfinite(mean) and mean > 0, f"the picture has mean {{mean}}"
print(json.dumps(dr.detail.llvm_version() if variant.startswith("llvm") else None))
"""


class Failed(Exception):
    """The subprocess did not render.

    Attributes:
        lasting: whether another try on the same machine would end the same.
    """

    def __init__(self, message: str, *, lasting: bool) -> None:
        super().__init__(message)
        self.lasting = lasting


class Verdict(NamedTuple):
    """What is known of an LLVM library.

    Attributes:
        version: its numbers, most significant first; None if unknown.
        usable: whether Dr.Jit renders with it.
        reason: why, or why not.
    """

    version: tuple[int, ...] | None
    usable: bool
    reason: str


def render(variant: str, library: str) -> list[int] | None:
    """Render a few pixels under a variant in a subprocess with an empty Dr.Jit kernel cache.

    Args:
        variant: a Mitsuba variant.
        library: what ``DRJIT_LIBLLVM_PATH`` is set to there.

    Returns:
        The version of LLVM, for an LLVM variant.

    Raises:
        Failed: the variant is not available, the process ended, or the picture made no sense.
    """
    import subprocess  # here, as most starts need no probe and importing takes longer than they do
    import tempfile

    if not sys.executable:
        raise Failed("there is no Python interpreter to probe with", lasting=False)
    search = [os.path.abspath(entry) for entry in sys.path if entry]
    # A home of its own: a kernel that another library left in the cache would prove nothing.
    with tempfile.TemporaryDirectory(prefix="relume-probe-") as home:
        changes = {VARIABLE: library, "HOME": home}
        if not variant.startswith("cuda"):
            changes["CUDA_VISIBLE_DEVICES"] = ""
        try:
            run = subprocess.run(
                [sys.executable, "-c", SCRIPT, variant, *search],
                env=os.environ | changes,
                cwd=home,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=SECONDS,
            )
        except subprocess.TimeoutExpired:
            raise Failed(f"no picture within {SECONDS} s", lasting=False) from None
        except OSError as error:
            raise Failed(f"the probe did not start: {error}", lasting=False) from None
    if run.returncode == 0:
        return json.loads(run.stdout.splitlines()[-1])
    raise _failure(run.returncode, run.stderr.decode(errors="replace").strip())


def _failure(status: int, stderr: str) -> Failed:
    """Say what an exit status other than 0 means."""
    import signal

    lines = stderr.splitlines() or ["no message"]
    if status == REFUSED:
        return Failed(f"Dr.Jit refuses it: {lines[0][:300]}", lasting=True)
    if status == 1:
        return Failed(f"the probe failed: {lines[-1][:300]}", lasting=False)
    stopped = (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGKILL", None))
    name = signal.Signals(-status).name if status < 0 else f"exit status {status}"
    return Failed(f"it ends the whole process ({name})", lasting=-status not in stopped)


def verdict(library: str, *, afresh: bool = False) -> Verdict:
    """Tell whether Dr.Jit renders with an LLVM library: from the cache, else by a probe.

    Args:
        library: file name of the library.
        afresh: probe it even if there is a verdict in the cache.
    """
    key = _key(library)
    if key and not afresh and (known := _recall(key)):
        return known
    try:
        version = render("llvm_ad_rgb", library)
        found = Verdict(tuple(version or ()) or None, True, "a tiny scene rendered with it")
    except Failed as failed:
        found = Verdict(None, False, str(failed))
        if not failed.lasting:
            return found
    if key:
        _remember(key, found)
    return found


def cache_file() -> Path:
    """The file that keeps the verdicts."""
    return cache.folder() / "llvm.json"


def _key(library: str) -> str | None:
    """The name of a library file in the cache; None where it could not be told from a later one."""
    try:
        file = os.stat(library)
    except OSError:
        return None
    drjit = importlib.metadata.version("drjit")
    return f"{os.path.realpath(library)}|{file.st_mtime_ns}|{file.st_size}|drjit {drjit}"


def _read() -> dict:
    try:
        kept = json.loads(cache_file().read_text())
    except (OSError, ValueError):
        return {}
    return kept if isinstance(kept, dict) else {}


def _recall(key: str) -> Verdict | None:
    """The verdict kept under a key; None if there is none that makes sense."""
    match _read().get(key):
        case [list() | None as version, bool(usable), str(reason)]:
            return Verdict(tuple(version or ()) or None, usable, reason)
    return None


def _remember(key: str, found: Verdict) -> None:
    """Keep a verdict; a cache that cannot be written costs a probe at each start, which is said."""
    import tempfile
    import warnings

    file = cache_file()
    try:
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=file.parent) as directory:
            fresh = Path(directory, file.name)
            fresh.write_text(json.dumps(_read() | {key: found}, indent=1))
            os.replace(fresh, file)
    except OSError as error:
        said = f"cannot keep in {file} whether LLVM works ({error.strerror}): each start tries it"
        warnings.warn(said, RuntimeWarning, stacklevel=2)
