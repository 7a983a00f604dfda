"""Wheel and source distribution: what they hold, and that one can be made from the other."""

import email
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("bsdfs", "emitters", "integrators", "phasefunctions", "samplers", "scenes",
            "sensors", "textures", "translator")  # fmt: skip
CHECKOUT = (*PACKAGES, "docs", "relume", "studies", "tests", "__init__.py", "CHANGELOG.md",
            "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "MANIFEST.in", "Makefile", "README.md",
            "constraints.txt", "pyproject.toml")  # fmt: skip
UNSEEN = shutil.ignore_patterns("__pycache__", ".*", "_build")


def build(kind, checkout, target):
    """Build offline, as pip does without isolation; returns the file."""
    code = f"from setuptools.build_meta import build_{kind} as build\nprint(build({str(target)!r}))"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=checkout, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return target / done.stdout.splitlines()[-1]


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    """The source distribution of a copy of the checkout, unpacked."""
    folder = tmp_path_factory.mktemp("sdist")
    checkout = folder / "checkout"
    checkout.mkdir()
    for name in CHECKOUT:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, checkout / name, ignore=UNSEEN)
        else:
            shutil.copy(ROOT / name, checkout)
    archive = build("sdist", checkout, folder)
    with tarfile.open(archive) as tar:
        tar.extractall(folder, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
    return folder / archive.name.removesuffix(".tar.gz")


@pytest.fixture(scope="module")
def wheel(sdist, tmp_path_factory):
    """The wheel, made from the source distribution."""
    with zipfile.ZipFile(build("wheel", sdist, tmp_path_factory.mktemp("wheel"))) as file:
        yield file


def files_below(folder, *parts):
    """Names of the files of a checkout, relative to it, as posix paths."""
    return {
        file.relative_to(folder).as_posix()
        for part in parts
        for file in [folder / part, *(folder / part).rglob("*")]
        if file.is_file() and "__pycache__" not in file.parts and "_build" not in file.parts
        and not any(name.startswith(".") for name in file.relative_to(folder).parts)
    }  # fmt: skip


def test_the_source_distribution_holds_the_checkout(sdist):
    made = {"PKG-INFO", "setup.cfg"}
    held = {name for name in files_below(sdist, ".") if not name.startswith("relume.egg-info/")}
    assert held - made == files_below(ROOT, *CHECKOUT)


def test_the_wheel_brings_one_name(wheel):
    info = next(name.partition("/")[0] for name in wheel.namelist() if ".dist-info/" in name)
    assert wheel.read(f"{info}/top_level.txt").split() == [b"relume"]
    assert {name.partition("/")[0] for name in wheel.namelist()} == {"relume", info}


def test_the_wheel_holds_every_file_of_the_package(wheel):
    """Python, scenes with their assets, the mark of types; nothing else."""
    inside = files_below(ROOT / "relume", ".") | files_below(ROOT, *PACKAGES)
    held = {name.partition("/")[2] for name in wheel.namelist() if name.startswith("relume/")}
    assert held == inside
    assert {"py.typed", "scenes/cornell.txt", "scenes/assets/vase.obj", "bsdfs/ward.py"} <= held


def test_the_metadata_say_whose_it_is(wheel):
    info = next(name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    told = email.message_from_bytes(wheel.read(info))
    assert told["License-Expression"] == "BSD-3-Clause" and told["License-File"] == "LICENSE"
    assert told["Author"] == "the relume authors" and told["Keywords"]
    assert told["Project-URL"] is None and told["Home-page"] is None
    assert "Typing :: Typed" in told.get_all("Classifier")
    text = wheel.read(info.replace("METADATA", "licenses/LICENSE")).decode()
    assert text.startswith("BSD 3-Clause License") and "the relume authors" in text


def test_the_version_is_the_same_wherever_it_is_told(wheel):
    version = next(n for n in wheel.namelist() if n.endswith("METADATA")).split("-")[1]
    version = version.removesuffix(".dist")
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"\n## [{version}] - " in (ROOT / "CHANGELOG.md").read_text()


def test_the_command_is_installed(wheel):
    entry = next(name for name in wheel.namelist() if name.endswith("entry_points.txt"))
    assert b"relume = relume.cli:main" in wheel.read(entry)
