"""The user's cache folder on each system, and where it cannot be written."""

import sys
from pathlib import Path

import pytest

from relume import cache


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
