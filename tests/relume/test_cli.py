"""The command line: exit statuses, JSON, and errors that a user can read."""

import json
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner

from relume.cli import main

UNSUPPORTED = "BLACKHOLE 0 0 0\n\nparticipatingMedia\n1"
TYPO = "SAMPLNG\n16\n\nOBJECT\nsphere 0 0 0\nreflection difuse\n"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A function that runs the command in an empty folder."""
    folder = tmp_path / "cwd"
    folder.mkdir()
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "120")

    def invoke(*arguments):
        return CliRunner().invoke(main, [str(argument) for argument in arguments])

    return invoke


@pytest.fixture
def broken(tmp_path):
    path = tmp_path / "broken.txt"
    path.write_text(TYPO)
    return path


# ---- check


def test_exit_status_0_all_translated_1_errors_3_unsupported(run, room, broken):
    good, other = room(), room(UNSUPPORTED, name="unsupported.txt")
    assert run("check", good).exit_code == 0
    assert run("check", other).exit_code == 3
    assert run("check", broken).exit_code == 1
    assert run("check", good, other).exit_code == 3
    assert run("check", good, other, broken).exit_code == 1


def test_a_folder_stands_for_the_files_below_it(run, room, broken):
    room(UNSUPPORTED, name="unsupported.txt")
    (broken.parent / "deeper").mkdir()
    room(name="deeper/room.txt")
    results = json.loads(run("check", broken.parent, "--json").stdout)
    statuses = {result["file"]: result["status"] for result in results}
    assert statuses == {
        str(broken.parent / name): status
        for name, status in (
            ("broken.txt", "error"),
            ("deeper/room.txt", "ok"),
            ("unsupported.txt", "unsupported"),
        )
    }


def test_a_folder_has_a_line_for_each_file_and_a_summary(run, room, broken):
    folder = broken.parent
    room(UNSUPPORTED, name="unsupported.txt")
    room(name="room.txt")
    lines = run("check", folder).stdout.splitlines()
    assert lines == [
        f"{folder / 'broken.txt'}: error: 1:1: 'SAMPLNG' is no keyword; did you mean 'SAMPLING'?"
        " (and 2 more)",
        f"{folder / 'room.txt'}: ok",
        f"{folder / 'unsupported.txt'}: unsupported: line 19, participatingMedia: where space bends"
        " there are no media (and 1 more)",
        "3 files: 1 ok, 1 error, 1 unsupported",
    ]
    for words, seen in ((("-v",), True), (("--brief",), False)):
        text = run("check", folder, *words).stdout
        assert "participatingMedia" in text and ("CAMERA_POS" in text) == seen


def test_a_mitsuba_scene_has_nothing_to_check(run, tmp_path):
    (tmp_path / "a.xml").write_text("<scene version='3.0.0'/>")
    result = run("check", tmp_path / "a.xml")
    assert result.exit_code == 1 and "relume render takes it" in result.stdout


def test_a_folder_without_scenes_is_an_error(run):
    result = run("check", ".")
    assert result.exit_code == 1 and "no scene files found" in result.output


def test_shape_of_the_json(run, room, broken):
    results = json.loads(run("check", room(UNSUPPORTED), broken, "missing.txt", "--json").stdout)
    assert [result["status"] for result in results] == ["unsupported", "error", "error"]
    for result in results:
        assert list(result) == ["file", "status", "errors", "lines", "notes", "plan"]
        for error in result["errors"]:
            assert list(error) == ["line", "column", "message", "kind"]
        for line in result["lines"]:
            assert list(line) == ["line", "keyword", "outcome", "note", "codes"]
            assert line["outcome"] in ("translated", "approximated", "ignored", "unsupported")
    good, wrong, missing = results
    assert good["errors"] == [] and wrong["plan"] is None and missing["lines"] == []
    assert missing["errors"] == [
        {"line": 0, "column": 0, "message": "no such file", "kind": "file"}
    ]
    plan = good["plan"]
    assert (plan["variant"], plan["integrator"], plan["spp"]) == ("llvm_ad_rgb", "curvedspace", 4)
    assert set(plan["reasons"]) >= {"variant", "integrator", "sensor", "spp"}


def test_every_line_with_content_is_in_the_json(run, room):
    path = room()
    (result,) = json.loads(run("check", path, "--json").stdout)
    lines = path.read_text().split("\n")
    filled = [k for k, line in enumerate(lines, 1) if line and not line.startswith("#")]
    assert [line["line"] for line in result["lines"]] == filled


def test_the_table_names_lines_reasons_and_the_plan(run, room):
    text = run("check", room(UNSUPPORTED)).stdout
    for part in ("unsupported", "participatingMedia", "no media", "plan: 32x24, 4 spp"):
        assert part in text
    brief = run("check", room(UNSUPPORTED), "--brief").stdout
    assert "CAMERA_POS" in text and "CAMERA_POS" not in brief
    assert "participatingMedia" in brief


def test_text_of_a_scene_is_no_markup(run, room):
    result = run("check", room("[bold]x[/bold]\n[/nonsense]"))
    assert result.exit_code == 0
    assert "[bold]x[/bold]" in result.stdout and "[/nonsense]" in result.stdout


def test_a_missing_file_of_a_scene_is_an_error_of_kind_asset(run, room, tmp_path):
    path = room(objects="OBJECT\nobjfile Models\\Bunny.OBJ\ncolor 1 1 1\nreflection diffuse\n")
    (result,) = json.loads(run("check", path, "--json").stdout)
    assert [error["kind"] for error in result["errors"]] == ["asset"]
    folder = tmp_path / "elsewhere" / "models"
    folder.mkdir(parents=True)
    (folder / "bunny.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (result,) = json.loads(run("check", path, "--json", "--asset-path", folder.parent).stdout)
    assert result["errors"] == []


def test_a_code_is_explained_without_a_scene(run):
    result = run("check", "--explain", "lamp-not-shown")
    assert result.exit_code == 0 and "> the lamp itself is not shown" in result.stdout
    result = run("check", "--explain", "lamp-not-show")
    assert result.exit_code == 2 and "did you mean 'lamp-not-shown'" in result.stderr
    assert run("check").exit_code == 2


# ---- errors of users


def test_all_errors_of_a_file_at_once_with_suggestions(run, broken):
    result = run("render", broken)
    assert result.exit_code == 1 and result.stdout == ""
    assert result.stderr.splitlines() == [
        f"{broken}:1:1: 'SAMPLNG' is no keyword; did you mean 'SAMPLING'?",
        f"{broken}:5:13: sphere expects 4 values, found 3 in '0 0 0'",
        f"{broken}:6:12: unknown reflection 'difuse'; did you mean 'diffuse'?",
    ]


@pytest.mark.parametrize(
    "arguments, status, said",
    [
        (["render", "missing.txt"], 1, "missing.txt: no such file"),
        (["render", "."], 2, "several scenes need a folder"),
        (["render", "binary.txt"], 1, "NUL byte"),
        (["render", "ROOM", "--variant", "nope"], 1, "unknown variant 'nope'; Mitsuba has"),
        (["render", "GLASS", "--variant", "scalar_rgb"], 1, "does not run the plugins"),
        (["render", "ROOM", "--integrator", "nope"], 1, "integrator 'nope'"),
        (["render", "ROOM", "--integrator", "diffuse"], 1, "it is no integrator"),
        (["render", "ROOM", "--integrator", "samplescale"], 1, "one nested sampling integrator"),
        (["render", "ROOM", "--size", "1x"], 2, "expected WIDTHxHEIGHT, such as 640x480"),
        (["render", "ROOM", "--size", "0x10"], 1, "expected sides of 1 to"),
        (["render", "ROOM", "--size", "999999x999999"], 1, "expected sides of 1 to"),
        (["render", "ROOM", "--spp", "0"], 2, "--spp"),
        (["render", "ROOM", "--spp", "9" * 30], 1, "expected 1 to"),
        (["render", "ROOM", "--seed", "-1"], 2, "--seed"),
        (["render", "ROOM", "--time-limit", "nan"], 2, "nan is no number of seconds"),
        (["render", "ROOM", "--time-limit", "-1"], 2, "--time-limit"),
        (["render", "ROOM", "--dialect", "latin"], 2, "--dialect"),
        (["render", "ROOM", "--asset-path", "nowhere"], 2, "nowhere"),
        (["render", "ROOM", "-o", "binary.txt/a.png"], 1, "cannot write binary.txt/a.png"),
        (["convert", "ROOM"], 2, "either -o FILE.xml or --python"),
        (["convert", "ROOM", "-o", "."], 1, "is a folder"),
        (["convert", "ROOM", "-o", "binary.txt/a.xml"], 1, "binary.txt"),
        (["convert", "missing.txt", "--python"], 1, "no such file"),
        (["nonsense"], 2, "nonsense"),
    ],
)
def test_errors_are_one_readable_line(run, room, tmp_path, arguments, status, said):
    (tmp_path / "cwd" / "binary.txt").write_bytes(b"IMAGE\0\1\2")
    glass = "OBJECT\nsphere 0 1 2 1\ncolor 1 1 1\nreflection reflection\n"
    scenes = {"ROOM": room(), "GLASS": room(objects=glass, name="glass.txt")}
    result = run(*(scenes.get(argument, argument) for argument in arguments))
    assert result.exit_code == status
    assert said in result.stderr and "Traceback" not in result.stderr and result.stdout == ""
    if status == 1:
        assert len(result.stderr.strip().splitlines()) == 1


def test_a_variant_that_this_machine_cannot_run(run, room):
    result = run("render", room(), "--variant", "cuda_ad_rgb", "-o", "a.png")
    if result.exit_code:
        assert result.exit_code == 1 and "cuda_ad_rgb does not work here" in result.stderr
    else:
        pytest.skip("this machine has a GPU")


# ---- the command itself


def test_render_prints_the_files_it_wrote(run, room):
    result = run("render", room(), "-o", "a.exr", "--size", "8x6", "--spp", "2", "--seed", "1")
    assert (result.exit_code, result.stdout) == (0, "a.exr\n")


@pytest.mark.parametrize("name", main.commands)
def test_every_option_has_a_help(name):
    """Also those that a command shares with others."""
    options = [p for p in main.commands[name].params if isinstance(p, click.Option)]
    assert [option.opts[0] for option in options if not option.help] == []


def test_help_and_version():
    code = "from relume.cli import main; main()"
    for arguments, said in ((["--help"], "doctor"), (["--version"], "version")):
        command = [sys.executable, "-c", code, *arguments]
        run = subprocess.run(command, capture_output=True, text=True, check=True)
        assert said in run.stdout and run.stderr == ""
