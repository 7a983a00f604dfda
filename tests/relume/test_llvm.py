"""The choice of the LLVM library: precedence, probing, memory of verdicts, and version windows.

Libraries that abort are stood in for by a probe script that aborts, so that the tests need no
particular system; where Debian's LLVM 14 or 15 is installed, the real ones are tried as well.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from relume import llvm, probe

ROOT = Path(__file__).parents[2]
ABORTS = "import os; os.abort()"
RENDERS = "print('[19, 1, 0]')"
OLD = [path for path in llvm.system_libraries() if path.version and path.version[0] in (14, 15)]

FRESH_PROCESS = f"""
import sys, types
package = types.ModuleType("relume")
package.__path__ = [{str(ROOT / "relume")!r}]
sys.modules["relume"] = package
from relume import llvm
"""


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """A machine without the wheel, without system libraries and with an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv(llvm.VARIABLE, raising=False)
    monkeypatch.setattr(llvm, "wheel_library", lambda: None)
    monkeypatch.setattr(llvm, "system_directories", lambda: [str(tmp_path / "lib")])
    (tmp_path / "lib").mkdir()
    return monkeypatch


def library_file(tmp_path, name):
    path = tmp_path / "lib" / name
    path.write_text("not a library")
    return str(path)


def run(code, **environment):
    """Run Python code in a process of its own; its last line of output is JSON."""
    environment = os.environ | {key: str(value) for key, value in environment.items()}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    return json.loads(done.stdout.splitlines()[-1]), done.stderr.decode()


def test_nothing_found_says_what_to_do(machine):
    choice = llvm.choose()
    assert (choice.path, choice.source, choice.usable) == (None, "none", False)
    assert "karellen-llvm-core" in choice.reason and llvm.VARIABLE in choice.reason


def test_the_users_library_wins_over_the_wheel(machine, tmp_path):
    machine.setattr(probe, "SCRIPT", RENDERS)
    machine.setattr(llvm, "wheel_library", lambda: llvm.Library("/w", "wheel", (23, 1)))
    machine.setenv(llvm.VARIABLE, library_file(tmp_path, "mine.so"))
    choice = llvm.choose()
    assert choice.source == "user" and choice.version == (19, 1, 0) and choice.usable


def test_a_users_library_that_aborts_is_reported_and_passed_over(machine, tmp_path):
    machine.setattr(probe, "SCRIPT", ABORTS)
    machine.setattr(llvm, "wheel_library", lambda: llvm.Library("/w", "wheel", (23, 1)))
    machine.setenv(llvm.VARIABLE, library_file(tmp_path, "mine.so"))
    choice = llvm.choose()
    assert choice.source == "wheel" and choice.usable
    assert [library.source for library in choice.rejected] == ["user"]
    assert "ends the whole process" in choice.rejected[0].reason


def test_the_wheels_own_path_in_the_environment_is_the_wheel(machine):
    machine.undo()
    wheel = llvm.wheel_library()
    if wheel is None:
        pytest.skip("no wheel for this platform")
    machine.setenv(llvm.VARIABLE, wheel.path)
    assert llvm.choose().source == "wheel"


def test_the_path_set_for_a_machine_without_library_is_no_choice_of_the_user(machine):
    machine.setenv(llvm.VARIABLE, llvm.NOTHING)
    assert not list(llvm.candidates())


def test_system_libraries_in_order_of_trust(machine, tmp_path):
    names = ["libLLVM-14.so.1", "libLLVM.so.17.0", "libLLVM.so.24.1", "libLLVM-18.so.1"]
    for name in [*names, "libLLVM.so.21.1-rust-1.9-stable", "libLLVMSupport.a", "libLLVM.txt"]:
        library_file(tmp_path, name)
    (tmp_path / "lib" / "libLLVM.so").symlink_to("libLLVM.so.24.1")
    versions = [library.version[0] for library in llvm.system_libraries()]
    assert versions == [21, 18, 24, 17, 14]


def test_a_version_below_17_is_refused_without_running_it(machine, tmp_path):
    machine.setattr(probe, "render", None)  # calling it would raise
    library_file(tmp_path, "libLLVM-16.so.1")
    choice = llvm.choose()
    assert not choice.usable and "LLVM 16 is too old" in choice.rejected[0].reason


def test_a_verdict_is_remembered_until_the_file_changes(machine, tmp_path):
    path = library_file(tmp_path, "libLLVM.so.19.1")
    machine.setattr(probe, "SCRIPT", ABORTS)
    assert not llvm.choose().usable
    machine.setattr(probe, "SCRIPT", RENDERS)
    assert not llvm.choose().usable
    Path(path).write_text("another library")
    assert llvm.choose().usable
    machine.setattr(probe, "SCRIPT", ABORTS)
    assert llvm.choose().usable
    assert not llvm.judge(llvm.Library(path, "system", (19, 1)), afresh=True).usable


def test_a_failure_of_the_probe_itself_is_not_remembered(machine, tmp_path):
    library_file(tmp_path, "libLLVM.so.19.1")
    for passing in ("raise MemoryError", "import os; os.kill(os.getpid(), 9)"):
        machine.setattr(probe, "SCRIPT", passing)
        assert not llvm.choose().usable
    machine.setattr(probe, "SCRIPT", "import time; time.sleep(60)")
    machine.setattr(probe, "SECONDS", 0.2)
    assert "no picture within" in llvm.choose().rejected[0].reason
    machine.undo()
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize("content", ["", "{", "[]", '{"k": 1}', "\0", '{"k": [1, 2, 3]}'])
def test_a_damaged_cache_is_as_good_as_none(machine, tmp_path, content):
    path = library_file(tmp_path, "libLLVM.so.19.1")
    probe.cache_file().parent.mkdir(parents=True)
    probe.cache_file().write_text(content.replace('"k"', json.dumps(probe._key(path))))
    machine.setattr(probe, "SCRIPT", RENDERS)
    assert llvm.choose().usable


def test_an_unwritable_cache_does_no_harm(machine, tmp_path):
    library_file(tmp_path, "libLLVM.so.19.1")
    (tmp_path / "cache").write_text("a file where the directory should be")
    machine.setattr(probe, "SCRIPT", RENDERS)
    with pytest.warns(RuntimeWarning, match="each start tries it"):
        assert llvm.choose().usable


OUTSIDE = [
    *(("mitsuba", version) for version in ("3.8.0", "3.10.0", "3.10.0.dev1", "4.0", None)),
    *(("drjit", version) for version in ("1.4.9", "1.6.0", "1.6.0.dev1", "2.0", None)),
]


@pytest.mark.parametrize("package, version", OUTSIDE)
def test_a_version_outside_the_window_is_refused_by_name(monkeypatch, package, version):
    def installed(name):
        found = {"mitsuba": "3.9.7", "drjit": "1.5.7", package: version}[name]
        if found is None:
            raise llvm.importlib.metadata.PackageNotFoundError
        return found

    monkeypatch.setattr(llvm.importlib.metadata, "version", installed)
    window = {"mitsuba": ">=3.9,<3.10", "drjit": ">=1.5,<1.6"}[package]
    with pytest.raises(ImportError) as refused:
        llvm.check_versions()
    assert f"relume needs {package} {window}, but {package} " in str(refused.value)
    assert f"pip install '{package} {window}'" in str(refused.value)


def test_the_installed_versions_are_inside_the_windows():
    llvm.check_versions()


def test_the_chosen_library_renders_here():
    choice = llvm.install()
    assert choice.usable, choice.reason
    assert probe.render("llvm_ad_rgb", choice.path)[0] >= llvm.OLDEST


def test_without_any_library_scalar_variants_work_and_llvm_ones_fail_politely(tmp_path):
    """Dr.Jit must not find a system library by itself, as that one may abort."""
    code = f"""{FRESH_PROCESS}
import json
llvm.wheel_library = lambda: None
llvm.system_directories = list
llvm.install()
import mitsuba as mi
try:
    mi.set_variant("llvm_ad_rgb")
    refused = False
except ImportError:
    refused = True
mi.set_variant("scalar_rgb")
scene = mi.cornell_box()
scene["sensor"]["film"].update(width=4, height=4)
image = mi.TensorXf(mi.render(mi.load_dict(scene), spp=4)).array
print(json.dumps([refused, max(image) > 0]))
"""
    result, _ = run(code, **{llvm.VARIABLE: "", "XDG_CACHE_HOME": tmp_path})
    assert result == [True, True]


@pytest.mark.skipif(not OLD, reason="no LLVM 14 or 15 on this machine")
@pytest.mark.parametrize("library", OLD, ids=lambda library: f"LLVM {library.version[0]}")
@pytest.mark.parametrize("named", [True, False], ids=["named", "renamed"])
def test_old_libraries_of_debian_never_take_the_process_down(tmp_path, library, named):
    """Also under a name that hides the version, where only the probe can tell."""
    path = Path(library.path)
    if not named:
        path = tmp_path / "library.so"
        path.symlink_to(library.path)
    code = f"""{FRESH_PROCESS}
import json
choice = llvm.install()
import mitsuba as mi
mi.set_variant("llvm_ad_rgb" if choice.usable else "scalar_rgb")
print(json.dumps([choice.source, [other.reason for other in choice.rejected]]))
"""
    (source, reasons), stderr = run(code, **{llvm.VARIABLE: path, "XDG_CACHE_HOME": tmp_path})
    assert source != "user"
    expected = "too old" if named else ("refuses it", "ends the whole process")
    assert any(part in reasons[0] for part in ([expected] if named else expected))
    assert f"{llvm.VARIABLE}={path}" in stderr


def test_drjit_imported_first_with_a_good_library_is_fine():
    code = "import json, drjit, relume; print(json.dumps(relume.llvm.install().usable))"
    usable, stderr = run(code, **{llvm.VARIABLE: llvm.install().path})
    assert usable and "RuntimeWarning" not in stderr


def test_drjit_imported_first_without_library_is_told_to_import_relume_first():
    code = "import json, drjit, relume; print(json.dumps(relume.llvm.install().usable))"
    usable, stderr = run(code, **{llvm.VARIABLE: "/dev/null"})
    assert not usable and "drjit was imported before relume" in stderr
    assert "import relume before mitsuba and drjit" in stderr or "import relume first" in stderr


@pytest.mark.skipif(not llvm.install().usable, reason="no usable LLVM on this machine")
def test_the_remedy_for_mitsuba_imported_first_helps():
    """Proves: the library that the warning names is one with which the same program works."""
    code = "import json, mitsuba, relume; print(json.dumps(relume.llvm.install().usable))"
    usable, stderr = run(code, **{llvm.VARIABLE: "/dev/null"})
    assert not usable and "mitsuba was imported before relume" in stderr
    path = stderr.split(f"{llvm.VARIABLE}=")[1].split(" before Python starts")[0]
    usable, stderr = run(code, **{llvm.VARIABLE: path})
    assert usable and "RuntimeWarning" not in stderr
