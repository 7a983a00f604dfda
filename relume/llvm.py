"""Choose the LLVM library that Dr.Jit compiles with, before anything imports drjit.

Dr.Jit reads ``DRJIT_LIBLLVM_PATH`` once, while it is imported, and takes the first library of the
system where the variable is unset. LLVM 14 and older are then refused; 15 and 16 abort the whole
process at the first kernel, which nothing can catch. `install` therefore sets the variable first:

1. to what the user set it to;
2. else to the library inside the wheel karellen-llvm-core (Linux x86-64);
3. else to a system library of version 17 or newer;
4. else to a name that does not exist, so that Dr.Jit starts without its LLVM variants.

A library that is not known to work is probed in a subprocess that renders a tiny scene. The verdict
is kept in the user's cache folder for as long as the file and the Dr.Jit version stay the same.
"""

from __future__ import annotations

import functools
import glob
import importlib.metadata
import os
import re
import sys
import sysconfig
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from relume import probe

VARIABLE = probe.VARIABLE
NOTHING = "no usable LLVM library (see: relume doctor)"
WHEEL = "karellen-llvm-core"
OLDEST = 17
TESTED = range(18, 24)  # major versions rendered with on Dr.Jit 1.5
WINDOWS = {"mitsuba": ((3, 9), (3, 10)), "drjit": ((1, 5), (1, 6))}
ADVICE = (
    "Install the package karellen-llvm-core (Linux x86-64), or a system LLVM of version 18 or "
    f"newer, or set {VARIABLE} to such a library."
)


class VersionError(ImportError):
    """Mitsuba or Dr.Jit is missing or outside the versions that relume works with."""


@dataclass(frozen=True)
class Library:
    """One LLVM library and what is known of it.

    Attributes:
        path: file name as Dr.Jit is to load it; None where there is none.
        source: ``user``, ``wheel``, ``system`` or ``none``.
        version: numbers of the version, most significant first; None if unknown.
        usable: whether Dr.Jit renders with it.
        reason: a sentence that says why it is usable or not.
        rejected: the candidates of higher precedence that are not usable.
    """

    path: str | None
    source: str
    version: tuple[int, ...] | None = None
    usable: bool = False
    reason: str = ""
    rejected: tuple[Library, ...] = ()


def check_versions() -> None:
    """Check that the installed Mitsuba and Dr.Jit are versions that relume works with.

    Raises:
        VersionError: a package is missing or outside its window; the message says what to install.
    """
    for package, (oldest, end) in WINDOWS.items():
        window = f"{package} >={dotted(oldest)},<{dotted(end)}"
        try:
            found = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found = None
        if found is None or not oldest <= _numbers(found) < end:
            raise VersionError(
                f"relume needs {window}, but "
                + (f"{package} {found} is installed" if found else f"{package} is not installed")
                + f"; install it with: {sys.executable} -m pip install '{window}'"
            )


@functools.cache
def install() -> Library:
    """Choose the LLVM library and point Dr.Jit at it; later calls return the same choice.

    Warns:
        RuntimeWarning: the user's library is not usable, or drjit was imported earlier and has
            loaded a library that is not usable.

    Returns:
        The choice; not `usable` where the machine has no usable library.
    """
    if "drjit" in sys.modules:
        choice = already_loaded()
        if not choice.usable:
            warnings.warn(choice.reason, RuntimeWarning, stacklevel=3)
        return choice
    choice = choose()
    os.environ[VARIABLE] = choice.path or NOTHING
    for library in choice.rejected:
        if library.source == "user":
            instead = f"using {choice.path} instead" if choice.usable else "no other was found"
            warnings.warn(
                f"{VARIABLE}={library.path}: {library.reason}; {instead}",
                RuntimeWarning,
                stacklevel=3,
            )
    return choice


def choose() -> Library:
    """Pick the first usable library: the user's, the wheel's, then the system's.

    Returns:
        The choice; with `path` None and source ``none`` where nothing is usable.
    """
    rejected: list[Library] = []
    for candidate in candidates():
        library = judge(candidate)
        if library.usable:
            return replace(library, rejected=tuple(rejected))
        rejected.append(library)
    found = ", ".join(str(library.path) for library in rejected)
    found = f"found, but not usable: {found}" if found else "none found"
    reason = f"no usable LLVM library ({found}). {ADVICE}"
    return Library(None, "none", reason=reason, rejected=tuple(rejected))


def candidates() -> Iterator[Library]:
    """The libraries of this machine, not judged, highest precedence first.

    They are found one by one, as looking further costs time.
    """
    wheel = wheel_library()
    user = os.environ.get(VARIABLE)
    if user and user != NOTHING and not (wheel and os.path.realpath(user) == wheel.path):
        path = os.path.abspath(user) if os.path.dirname(user) else user
        yield Library(path, "user", _version_in(path))
    if wheel:
        yield wheel
    yield from system_libraries()


def wheel_library() -> Library | None:
    """The library inside the wheel karellen-llvm-core, wherever that was installed, or None."""
    try:
        wheel = importlib.metadata.distribution(WHEEL)
    except importlib.metadata.PackageNotFoundError:
        return None
    paths = [str(wheel.locate_file(file)) for file in wheel.files or () if _named(file.name)]
    for scheme in sysconfig.get_scheme_names() if not paths else ():
        paths += glob.glob(os.path.join(sysconfig.get_path("data", scheme), "lib", "libLLVM*.so*"))
    paths = sorted({os.path.realpath(path) for path in paths if os.path.isfile(path)})
    return Library(paths[0], "wheel", _numbers(wheel.version)) if paths else None


def system_libraries() -> list[Library]:
    """LLVM libraries of the system, each file once: tested versions first, then newest first."""
    paths = {
        os.path.realpath(path)
        for directory in system_directories()
        for path in glob.glob(os.path.join(directory, "*LLVM*"))
        if _named(os.path.basename(path)) and os.path.isfile(path)
    }

    def preference(library: Library) -> tuple:
        version = library.version or (0,)
        return version[0] not in TESTED, tuple(-number for number in version), library.path

    return sorted((Library(path, "system", _version_in(path)) for path in paths), key=preference)


def system_directories() -> list[str]:
    """The directories (patterns expanded) where systems keep LLVM."""
    patterns = [
        *os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep),
        os.path.join(sys.base_prefix, "lib"),
        "/usr/lib/*-linux-gnu*",
        "/usr/lib/llvm*/lib",
        "/usr/lib/llvm/*/lib*",
        "/usr/lib64/llvm*/lib",
        "/usr/lib64",
        "/usr/lib",
        "/usr/local/lib",
        "/opt/homebrew/opt/llvm*/lib",
        "/usr/local/opt/llvm*/lib",
        os.path.join(os.environ.get("PROGRAMFILES", "/none"), "LLVM", "bin"),
    ]
    return [path for pattern in patterns if pattern for path in glob.glob(pattern)]


def judge(library: Library, *, afresh: bool = False) -> Library:
    """Say whether a library is usable: by its version, by an earlier verdict, or by a probe.

    Args:
        library: a candidate.
        afresh: probe it whatever is known of it.

    Returns:
        The same with `usable`, `reason` and, where it was probed, `version` filled in.
    """
    if library.version and library.version[0] < OLDEST:
        known = f"LLVM {dotted(library.version)} is too old, {OLDEST} or newer is needed"
        return replace(library, reason=known)
    wheel = library.source == "wheel"
    if wheel and library.version and library.version[0] in TESTED and not afresh:
        known = f"LLVM {dotted(library.version)} of the package {WHEEL}, a tested version"
        return replace(library, usable=True, reason=known)
    assert library.path is not None
    found = probe.verdict(library.path, afresh=afresh)
    version = found.version or library.version
    return replace(library, version=version, usable=found.usable, reason=found.reason)


def already_loaded() -> Library:
    """The library of a Dr.Jit that was imported before relume.

    Its source is ``user`` where the environment names it.
    """
    import drjit as dr

    early = f"{'mitsuba' if 'mitsuba' in sys.modules else 'drjit'} was imported before relume"
    user = os.environ.get(VARIABLE)
    if not dr.has_backend(dr.JitBackend.LLVM):
        reason = f"{early} and found no LLVM library; {remedy()}"
        return Library(None, "none", reason=reason)
    path = _mapped_library()
    if path is None:
        return Library(user, "user" if user else "system", dr.detail.llvm_version(), True, early)
    wheel = wheel_library()
    if wheel and wheel.path and os.path.samefile(path, wheel.path):
        return judge(wheel)
    library = judge(Library(path, "user" if user else "system", _version_in(path)))
    if library.usable:
        return library
    reason = f"{early} and loaded {path}: {library.reason}; {remedy()}"
    return replace(library, reason=reason)


def remedy() -> str:
    """What helps where Dr.Jit was imported too early: a library that is here, or one to get."""
    choice = choose()
    if choice.usable:
        return (
            "import relume before mitsuba and drjit, or set the environment variable "
            f"{VARIABLE}={choice.path} before Python starts"
        )
    return f"import relume first. {ADVICE}"


def _mapped_library() -> str | None:
    """The path of the LLVM library mapped into this process, None if that is unknown."""
    try:
        maps = Path("/proc/self/maps").read_text()
    except OSError:
        return None
    for line in maps.splitlines():
        path = line.partition("/")[2]
        if _named(path.rpartition("/")[2]):
            return "/" + path
    return None


def _named(name: str) -> bool:
    """Tell whether a file name is that of LLVM's shared library."""
    return bool(re.fullmatch(r"libLLVM(-[\d.]+)?\.(so|dylib)(\.\d[\w.+-]*)?|LLVM-C\.dll", name))


def _version_in(path: str) -> tuple[int, ...] | None:
    """Read the version in the file name of an LLVM library, None if it has none."""
    match = re.match(r"libLLVM(?:-|\.so\.)(\d+(?:\.\d+)*)", os.path.basename(path))
    return _numbers(match[1]) if match else None


def _numbers(version: str) -> tuple[int, ...]:
    """Read the release numbers of a version: ``3.9.1rc2`` is (3, 9, 1)."""
    match = re.match(r"\d+(?:\.\d+)*", version)
    return tuple(int(number) for number in match[0].split(".")) if match else ()


def dotted(version: tuple[int, ...]) -> str:
    """Write release numbers as a version."""
    return ".".join(map(str, version))
