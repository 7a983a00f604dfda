"""The report behind `relume check`."""

import warnings

import pytest

from relume import checking


def result(status):
    return {"file": "x", "status": status, "errors": [], "lines": [], "plan": None}


@pytest.mark.parametrize(
    "statuses, expected",
    [
        ((), 0),
        (("ok",), 0),
        (("ok", "unsupported"), 3),
        (("unsupported", "error", "ok"), 1),
    ],
)
def test_exit_status(statuses, expected):
    assert checking.exit_status([result(status) for status in statuses]) == expected


def test_lines_come_in_order_and_once(room):
    report = checking.check_file(room("SAMPLING\n9\nVAR a\n1\nVAR a\n2"))
    numbers = [line["line"] for line in report["lines"]]
    assert numbers == sorted(set(numbers)) and report["status"] == "ok"
    outcomes = {(line["keyword"], line["outcome"]) for line in report["lines"]}
    assert ("SAMPLING", "ignored") in outcomes and ("VAR", "ignored") in outcomes


def test_errors_of_the_text_and_of_files_come_together(room):
    objects = "OBJECT\nobjfile missing.obj\ncolour 1 1 1\ncolor 1 1\n"
    report = checking.check_file(room(objects=objects))
    assert [error["kind"] for error in report["errors"]] == ["asset", "keyword", "syntax"]
    assert report["status"] == "error" and report["plan"] is None


def test_a_camera_that_looks_nowhere_is_an_error_without_a_warning(room):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        report = checking.check_file(room("CAMERA_UPVEC\n0 0 0"))
    assert report["status"] == "error" and not caught


def test_an_error_of_the_environment_has_no_line(room):
    report = checking.check_file(room(), environ={"SAMPLING": "many"})
    (error,) = report["errors"]
    assert (error["line"], error["column"]) == (0, 0) and "SAMPLING" in error["message"]


def test_a_fault_of_the_translator_is_reported_and_not_raised(room, monkeypatch):
    """One file of a folder of hundreds must not end the report on all others."""

    def fail(*_):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(checking.translator, "translate", fail)
    report = checking.check_file(room())
    assert report["status"] == "error" and report["errors"][0]["kind"] == "scene"
    assert "ZeroDivisionError: division by zero" in report["errors"][0]["message"]


def test_the_plan_names_the_plugins_used(room):
    glass = "OBJECT\nsphere 0 1 2 1\ncolor 1 1 1\nreflection reflection\n"
    plan = checking.check_file(room("LENS\n1 5", objects=glass))["plan"]
    assert plan["plugins"] == ["schlickglass", "screencamera"]
    assert (plan["width"], plan["height"], plan["sensor"]) == (32, 24, "screencamera")


def test_unsupported_lines_make_the_file_unsupported(room):
    report = checking.check_file(room(objects="OBJECT\nsphere 0 0 0 1\nbackground 1\n"))
    assert report["status"] == "unsupported"
    (line,) = (l for l in report["lines"] if l["outcome"] == "unsupported")
    assert line["keyword"] == "background" and line["note"]
