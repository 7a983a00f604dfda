"""The user's cache folder on each system, and where it cannot be written."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from relume import cache, probe


@pytest.fixture
def system(monkeypatch, tmp_path):
    """A function that makes the process one of another system, with a home of its own."""

    def change(platform):
        for name in list(sys.modules):
            if name.partition(".")[0] == "platformdirs":
                monkeypatch.delitem(sys.modules, name)
        monkeypatch.setattr(sys, "platform", platform)
        monkeypatch.setenv("HOME", str(tmp_path))
        monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
        return tmp_path

    yield change
    for name in list(sys.modules):
        if name.partition(".")[0] == "platformdirs":
            del sys.modules[name]


def test_on_linux(system, monkeypatch):
    home = system("linux")
    assert cache.folder() == home / ".cache" / "relume"
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert cache.folder() == Path("/somewhere/relume")
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache.folder() == home / ".cache" / "relume"


def test_on_macos(system):
    home = system("darwin")
    assert cache.folder() == home / "Library" / "Caches" / "relume"


@pytest.mark.parametrize("home", ["", "/proc/none", "/dev/null"])
def test_a_home_that_cannot_be_written_is_named_all_the_same(system, monkeypatch, home):
    """Nothing is made or raised: whoever writes there is told."""
    system("linux")
    monkeypatch.setenv("HOME", home)
    assert cache.folder().parts[-2:] == (".cache", "relume")


@pytest.mark.parametrize("home", ["/proc/none", "/dev/null"])
def test_commands_work_without_their_cache_and_say_so(room, tmp_path, home):
    """Dr.Jit tells that it keeps no kernels, a chart that it keeps no reference."""
    environment = {k: v for k, v in os.environ.items() if k != "XDG_CACHE_HOME"}
    environment |= {"HOME": home, "MPLCONFIGDIR": str(tmp_path)}
    code = "from relume.cli import main; main()"
    path = room(spp=1, width=8, height=6)

    def run(*words):
        command = [sys.executable, "-c", code, *map(str, words)]
        return subprocess.run(
            command, capture_output=True, text=True, env=environment, cwd=tmp_path
        )

    done = run("render", path, "-o", "a.exr")
    assert (done.returncode, done.stdout) == (0, "a.exr\n") and "kernel cache" in done.stderr
    done = run("chart", path, "--method", "path", "--seconds", 0.1, "--runs", 4)
    assert done.returncode == 0 and "charts/room.svg" in done.stdout, done.stderr
    assert "warning: the reference is not kept: cannot write" in done.stderr


def test_a_verdict_that_cannot_be_kept_is_said(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "file" / "relume")
    with pytest.warns(RuntimeWarning, match=r"cannot keep in .*llvm\.json .* each start tries it"):
        probe._remember("library", probe.Verdict(None, True, "it renders"))
