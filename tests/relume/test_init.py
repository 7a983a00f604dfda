"""`import relume`: its names, what it costs, and what may lie beside the script."""

import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import relume
from relume import llvm, version

ROOT = Path(__file__).parents[2]
PLUGINS = ("bsdfs", "emitters", "integrators", "phasefunctions", "samplers", "sensors", "textures")
PACKAGED = (*PLUGINS, "relume", "scenes", "translator", "__init__.py", "pyproject.toml")


def python(*words, cwd, **environment):
    """Run Python in a folder; returns its standard output."""
    command = [sys.executable, "-W", "error", *map(str, words)]
    done = subprocess.run(
        command, cwd=cwd, env=os.environ | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


# ---- names


@pytest.mark.parametrize("name", relume.__all__)
def test_every_public_name_is_there(name):
    assert getattr(relume, name) is not None and name in dir(relume)


def test_type_checkers_see_the_same_names():
    """The imports for type checkers name the home that `__getattr__` looks in."""
    text = Path(relume.__file__).read_text()
    text = text.partition("TYPE_CHECKING:")[2].partition("__version__")[0]
    told = {
        name: home
        for home, names in re.findall(r"from (\S+) import (.+)", text)
        for name in names.split(", ")
    }
    assert told == relume._HOMES
    assert sorted([*told, "__version__"]) == relume.__all__


def test_another_name_is_refused():
    with pytest.raises(AttributeError, match="module 'relume' has no attribute 'rendr'"):
        relume.rendr  # noqa: B018


def test_the_version_is_the_installed_one():
    assert relume.__version__ == importlib.metadata.version("relume")


def test_a_checkout_that_is_not_installed_has_the_version_that_it_will_have(monkeypatch, tmp_path):
    def missing(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", missing)
    assert re.fullmatch(r"\d+\.\d+\.\d+\+checkout", relume.__version__)
    assert version._of_checkout(tmp_path) == "0+unknown"


def test_it_is_typed():
    assert Path(relume.__file__).with_name("py.typed").exists()


# ---- cost


def modules_after(code, folder):
    """Names of the modules loaded after some code, in a process of its own."""
    told = python("-c", f"{code}\nimport sys, json\nprint(json.dumps(list(sys.modules)))",
                  cwd=folder, **{llvm.VARIABLE: llvm.install().path})  # fmt: skip
    return set(json.loads(told.splitlines()[-1]))


def test_importing_relume_loads_little_more_than_mitsuba(tmp_path):
    """What is loaded is what costs: numpy, rich, the plugins and the workbench wait for their use.

    Of the standard library it loads what finds the LLVM library.
    """
    more = modules_after("import relume", tmp_path) - modules_after("import mitsuba", tmp_path)
    ours = {name for name in more if name.partition(".")[0] == "relume"}
    files = ("cache", "llvm", "plugins", "probe", "registration", "turns")
    assert ours == {"relume", *(f"relume.{name}" for name in (*PLUGINS, *files))}
    foreign = {name.partition(".")[0] for name in more - ours} - sys.stdlib_module_names
    assert foreign == set()
    assert len(more) < 100


# ---- beside the script


@pytest.fixture
def foreign(tmp_path):
    """A user's folder with files that have the names of ours, and end the process."""
    for name in ("registration", "bsdfs", "llvm", "probe", "plugins"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a foreign file was imported')\n")
    for name in ("translator", "emitters", "scenes", "integrators"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise SystemExit('a foreign folder')\n")
    return tmp_path


def test_files_of_the_user_are_not_taken_for_ours(foreign):
    script = foreign / "script.py"
    script.write_text(
        "import relume.workbench.comparing, relume.translator, relume.bsdfs, relume.cluster.farm\n"
        "import mitsuba as mi\nmi.set_variant('llvm_ad_rgb')\nmi.load_dict({'type': 'ward'})\n"
    )
    python(script, cwd=foreign)
    python("-c", script.read_text(), cwd=foreign)


@pytest.mark.parametrize("module", ["bsdfs", "translator", "session", "workbench.statistics"])
def test_any_module_chooses_llvm_first(tmp_path, module):
    """In a process whose environment names no library, as a user's."""
    code = f"import os, relume.{module}\nprint(os.environ['{llvm.VARIABLE}'])"
    assert python("-c", code, cwd=tmp_path, **{llvm.VARIABLE: ""}).strip() == llvm.install().path


# ---- a checkout named relume


@pytest.fixture(params=["link", "copy"])
def above(request, tmp_path):
    """A folder with a checkout in it that is named relume."""
    if request.param == "link":
        (tmp_path / "relume").symlink_to(ROOT)
    else:
        ignored = shutil.ignore_patterns("__pycache__", ".*")
        (tmp_path / "relume").mkdir()
        for name in PACKAGED:
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            options = {"ignore": ignored} if (ROOT / name).is_dir() else {}
            copy(ROOT / name, tmp_path / "relume" / name, **options)
    return tmp_path


def test_in_the_folder_above_a_checkout_named_relume(above):
    code = """
import relume, mitsuba as mi
from relume import bsdfs, translator
from relume.translator.parser import read
mi.set_variant("llvm_ad_rgb")
mi.load_dict({"type": "ward"})
assert relume.SceneError and read and relume.translator is translator
print(relume.__file__, bsdfs.__file__, translator.__file__)
"""
    files = python("-c", code, cwd=above).split()
    places = [above / "relume" / name for name in ("relume", "bsdfs", "translator")]
    assert [Path(file) for file in files] == [place / "__init__.py" for place in places]
    scene = above / "relume" / "scenes" / "cornell.txt"
    told = json.loads(python("-m", "relume", "check", "--json", scene, cwd=above))
    assert [result["status"] for result in told] == ["ok"]


def test_in_a_checkout_all_comes_from_there(above):
    """Not the folders of plugins from where another checkout is installed."""
    code = "from relume import bsdfs, translator\nprint(bsdfs.__file__, translator.__file__)"
    files = python("-c", code, cwd=above / "relume").split()
    places = [above / "relume" / name for name in ("bsdfs", "translator")]
    if above.joinpath("relume").is_symlink():
        places = [place.resolve() for place in places]
    assert [Path(file) for file in files] == [place / "__init__.py" for place in places]


def test_pytest_in_a_checkout_named_relume(above):
    """Its folder has an `__init__.py`, which pytest could take for the package."""
    tests = above / "relume" / "tests"
    if not tests.exists():
        tests.mkdir()
        shutil.copy(ROOT / "tests" / "conftest.py", tests)
        shutil.copy(ROOT / "tests" / "test_registration.py", tests)
    told = python("-m", "pytest", "-p", "no:cacheprovider", "tests/test_registration.py",
                  "-k", "prints_nothing", cwd=above / "relume")  # fmt: skip
    assert "1 passed" in told
