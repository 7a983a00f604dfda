"""The report behind `relume check`."""

import warnings

import pytest
from rich.console import Console

import relume
from relume import checking
from relume.translator.outcomes import OUTCOMES, explanation


def result(status):
    return {"file": "x", "status": status, "errors": [], "lines": [], "notes": [], "plan": None}


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
        report = checking.check_file(room("CAMERA_UPVEC\n0 1e-200 0"))
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
    assert plan["plugins"] == ["schlickglass", "screencamera", "surfacepath"]
    assert (plan["width"], plan["height"], plan["sensor"]) == (32, 24, "screencamera")


def test_unsupported_lines_make_the_file_unsupported(room):
    report = checking.check_file(room("BLACKHOLE 0 0 0\n\nparticipatingMedia\n1"))
    assert report["status"] == "unsupported"
    lines = [line for line in report["lines"] if line["outcome"] == "unsupported"]
    assert {line["keyword"] for line in lines} == {"participatingMedia"}
    assert all(x["note"] for x in lines)


def test_lines_have_the_codes_of_their_notes(room):
    """All that explains a line is found by its code, remarks and lowered lines alike."""
    lines = checking.check_file(room("DEPTH\n3\nLENS\n0 5"))["lines"]
    codes = {line["keyword"]: line["codes"] for line in lines if line["codes"]}
    assert codes["LENS"] == ["pinhole"] and codes["DEPTH"] == ["roulette", "roulette-depth"]
    assert all(bool(line["note"]) == bool(line["codes"]) for line in lines)


def test_the_table_shows_codes_beside_notes(room):
    """A code that its note begins with, as those of the dialects, is not told twice."""
    console = Console(record=True, width=200)
    checking.print_results([checking.check_file(room("TIMELIMIT\n1\nLENS\n0 5"))], console)
    text = console.export_text()
    assert "radius 0 or less: a pinhole [pinhole]" in text
    assert "timelimit: hours" in text and "[timelimit]" not in text
    assert "relume check --explain CODE" in text


def test_codes_are_explained():
    """The text of docs/outcomes.md below the code."""
    assert checking.explained("pinhole") == f"pinhole\n\n{explanation('pinhole')}"


def test_unknown_codes_suggest_others_and_list_all():
    with pytest.raises(KeyError) as caught:
        checking.explained("pin-hole")
    said = str(caught.value)
    assert "did you mean 'pinhole'" in said and all(code in said for code in OUTCOMES)


LAMP = """\
OBJECT
uvplane -2 6 -2
U 4 0 0
V 0 0 4
emission 6 5 4
reflection diffuse
parallel_light 1
parallel_light_dir {direction}
{more}
"""


@pytest.mark.parametrize(
    "direction, more, said",
    [
        ("0 0 0", "", "parallel_light_dir of length 0"),
        ("1 0 0", "", "parallel_light_dir lies in the plane of the light"),
        ("1 0 -2", "", "parallel_light_dir lies in the plane of the light"),
        ("0 1 0", "rotation 90 0 0", "parallel_light_dir lies in the plane of the light"),
        ("1 -0.001 0", "", None),
        ("1 0 0", "rotation 0 0 45", None),
    ],
)
def test_a_parallel_light_that_render_refuses_is_an_error(room, tmp_path, direction, more, said):
    """With its line; whatever else is in order, render takes."""
    path = room(objects=LAMP.format(direction=direction, more=more))
    report = checking.check_file(path)
    line = path.read_text().splitlines().index(f"parallel_light_dir {direction}") + 1
    if said:
        (error,) = report["errors"]
        assert said in error["message"] and error["line"] == line
        with pytest.raises(relume.SceneError, match=said):
            relume.render(path)
    else:
        assert report["status"] == "ok" and relume.render(path, spp=1).shape == (24, 32, 3)


@pytest.mark.parametrize(
    "mesh, said",
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "'9' names no vertex"),
        ("v 0 0 0\nv 1e400 0 0\nv 0 1 0\nf 1 2 3\n", "'1e400' is not a finite number"),
        ("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n", None),
    ],
)
def test_a_mesh_that_render_refuses_is_an_error(room, tmp_path, mesh, said):
    """With the line of the mesh; faces before their vertices are in order for both."""
    (tmp_path / "a.obj").write_text(mesh)
    path = room(objects="OBJECT\nobjfile a.obj\ncolor 1 1 1\nreflection diffuse\n")
    report = checking.check_file(path)
    if said:
        (error,) = report["errors"]
        assert said in error["message"] and "a.obj:" in error["message"]
        with pytest.raises(relume.SceneError, match=said):
            relume.render(path)
    else:
        assert report["status"] == "ok" and relume.render(path, spp=1).shape == (24, 32, 3)


@pytest.mark.parametrize("name", ["sub/A.OBJ", "Sub\\a.Obj", '"Sub/a.obj"', "'sub/A.obj'"])
def test_names_in_quotes_and_in_other_letters_are_found_beside_the_scene(room, tmp_path, name):
    (tmp_path / "Sub").mkdir()
    (tmp_path / "Sub" / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    path = room(objects=f"OBJECT\nobjfile {name}\ncolor 1 1 1\nreflection diffuse\n")
    assert checking.check_file(path)["errors"] == []


def test_a_missing_file_names_the_remedy(room):
    path = room(objects="OBJECT\nobjfile a.obj\ncolor 1 1 1\nreflection diffuse\n")
    (error,) = checking.check_file(path)["errors"]
    assert "looked in the working directory, the folder of the scene" in error["message"]
    assert "--asset-path DIR looks below DIR" in error["message"]


@pytest.mark.parametrize(
    "line, found",
    [
        ("sphere 0 0 0\u30001", "'<full-width blank U+3000>1'"),
        ("\u3000sphere 0 0 0 1", "'<full-width blank U+3000>sphere'"),
    ],
)
def test_a_full_width_blank_is_named(room, line, found):
    """It looks like a blank in an editor, and separates nothing."""
    report = checking.check_file(room(objects=f"OBJECT\n{line}\nreflection diffuse\n"))
    assert found in report["errors"][0]["message"]


DARK_LAMP = "OBJECT\nsphere 0 3 0 1\nemission 0 0 0\ncolor 0 0 0\nreflection diffuse\n"
BALL = "OBJECT\nsphere 0 0 -9 1\ncolor 0.5 0.5 0.5\nreflection diffuse\n\n"


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("", ["no-light"]),
        (BALL + DARK_LAMP, ["no-light"]),
        ("BACKGROUND\n0 0 0\n\n" + BALL, ["no-light"]),
        ("BACKGROUND\n1 1 1\n", ["no-surface"]),
        ("BACKGROUND\n1 1 1\n\n" + BALL, []),
        ("ENVLIGHT\n0.1 0.1 0.1\n\n" + BALL, []),
        (BALL + DARK_LAMP.replace("emission 0 0 0", "emission 0 0 1e-3"), []),
        ("OBJECT\ninfinity_light 0 -1 0\nemission 1 1 1\n", ["no-surface"]),
    ],
)
def test_pictures_without_light_or_surfaces_are_told(tmp_path, text, codes):
    path = tmp_path / "scene.txt"
    path.write_text(text)
    report = checking.check_file(path, environ={})
    assert [note["code"] for note in report["notes"]] == codes
    console = Console(record=True, width=200)
    checking.print_results([report], console)
    assert all(f"[{code}]" in console.export_text(clear=False) for code in codes)
