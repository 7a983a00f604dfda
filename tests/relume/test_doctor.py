"""`relume doctor` on this machine, and on machines where something is missing."""

import dataclasses

import pytest

from relume import doctor, llvm, probe


@pytest.fixture(scope="module")
def here():
    return doctor.report()


@pytest.fixture
def ill(monkeypatch):
    """Replace the outcome of every subprocess and the libraries of the machine."""

    def prepare(chosen, working):
        def render(variant, library):
            if variant not in working:
                raise probe.Failed("it ends the whole process (SIGABRT)", lasting=True)

        monkeypatch.setattr(probe, "render", render)
        monkeypatch.setattr(llvm, "install", lambda: chosen)
        monkeypatch.setattr(llvm, "candidates", lambda: iter(()))
        monkeypatch.setattr(doctor, "has_gpu", lambda: False)

    return prepare


def test_this_machine_is_healthy(here):
    assert here.healthy and here.cores >= 1
    assert {variant.name for variant in here.variants if variant.works} >= set(doctor.VARIANTS)
    assert all(here.versions[package] for package in ("relume", "mitsuba", "drjit", "numpy"))
    assert here.llvm.usable


def test_every_library_is_listed_once_with_its_verdict(here):
    paths = [library.path for library in here.candidates]
    assert here.llvm.path in paths and len(paths) == len(set(paths))
    assert all(library.reason for library in here.candidates)


def test_the_print_names_what_was_found_and_keeps_brackets(here, capsys):
    strange = dataclasses.replace(here, advice=("install [bold]this[/bold]",))
    doctor.print_report(strange)
    text = capsys.readouterr().out
    for part in ("mitsuba", "llvm_ad_rgb", "cores", "why", "[bold]this[/bold]"):
        assert part in text


def test_without_llvm_the_exit_status_is_1_and_says_how_to_get_it(ill, capsys):
    ill(llvm.Library(None, "none", reason="no usable LLVM library"), ["scalar_rgb"])
    assert doctor.run() == 1
    text = " ".join(capsys.readouterr().out.split())
    assert "Install the package karellen-llvm-core" in text and "scalar_rgb renders" in text


def test_with_nothing_that_works_mitsuba_is_to_be_reinstalled(ill):
    ill(llvm.Library("/lib/x", "system", (18,), True), [])
    found = doctor.report()
    assert not found.healthy and "reinstall Mitsuba" in found.advice[0]


def test_a_users_library_that_was_passed_over_is_named(ill):
    bad = llvm.Library("/bad", "user", reason="it ends the whole process")
    ill(llvm.Library("/good", "wheel", (23,), True, rejected=(bad,)), doctor.VARIANTS)
    found = doctor.report()
    assert found.healthy and "Unset DRJIT_LIBLLVM_PATH" in found.advice[0]
    assert [library.path for library in found.candidates] == ["/bad", "/good"]


def test_cuda_is_tried_only_where_there_is_a_driver(ill, monkeypatch):
    ill(llvm.Library("/good", "wheel", (23,), True), [*doctor.VARIANTS, "cuda_ad_rgb"])
    assert "cuda_ad_rgb" not in [variant.name for variant in doctor.report().variants]
    monkeypatch.setattr(doctor, "has_gpu", lambda: True)
    assert doctor.report().variants[-1] == doctor.Variant("cuda_ad_rgb", True)
