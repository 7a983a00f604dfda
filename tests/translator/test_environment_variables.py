"""Environment variables: environment over file over default, each variable, and what is wrong."""

import dataclasses

import pytest

from relume.translator import read_text
from relume.translator.diagnostics import SceneError
from relume.translator.document import Document
from relume.translator.environment_variables import ALIASES
from relume.translator.gravity import GRAVITY_BLOCKS
from relume.translator.keywords import rows
from relume.translator.objects import SceneObject

BALL = "OBJECT\nsphere 0 0 0 1\n"

CASES = [
    ("IMAGE_X", "640*0.25", "image", (160, 240)),
    ("IMAGE_Y", "2^7", "image", (320, 128)),
    ("SUFFIX_SYMBOL", "_night 2*3", "suffix", "_night 2*3"),
    ("IMAGEDUMP", "1.5", "image_dump", 1.5),
    ("TIMELIMIT", "1/60", "time_limit", 1 / 60),
    ("SAMPLING", "10*2", "sampling", 20),
    ("SAMPLING", "", "sampling", 8),
    ("OMP_NUM_THREADS", "4,2", "thread", 4),
    ("SUPERSAMPLING", "4", "supersampling", 4),
    ("OMP_NUM_THREADS", "3", "thread", 3),
    ("NEXTEVENTESTIMATION", "1", "next_event_estimation", True),
    ("LUMINANCE_CUTOFF", "0.5", "luminance_cutoff", 0.5),
    ("LUMINANCE_CUTTOFF", "0.5", "luminance_cutoff", 0.5),
    ("ENVLIGHT_R", "0.1", "ambient", (0.1, 0, 0)),
    ("ENVLIGHT_G", "0.1", "ambient", (0, 0.1, 0)),
    ("ENVLIGHT_B", "0.1", "ambient", (0, 0, 0.1)),
    ("METROPOLIS", "2", "metropolis", True),
    ("ERPT", "1", "erpt", True),
    ("MUTATION", "sqrt(16)", "mutation", 4),
    ("MLTSAMPLE", "0.1", "mlt_sample", 0.1),
    ("PRESAMPLE", "0.1", "mlt_sample", 0.1),
    ("MLTRESAMPLE", "1", "mlt_resampling", True),
]


@pytest.mark.parametrize(("name", "text", "field", "value"), CASES, ids=lambda x: str(x))
def test_each_variable(name, text, field, value):
    """Sets its field, as an expression, and nothing else."""
    document = read_text("", environ={name: text})
    assert getattr(document, field) == value
    assert document == dataclasses.replace(Document(), **{field: value})


def test_all_variables_are_tested():
    """`CASES` has one for each variable of the tables, and for each other spelling."""
    table = {name for row in rows(Document) for name in row.environment}
    assert {name for name, *_ in CASES} == table | set(ALIASES)
    assert {name for row in rows(SceneObject) for name in row.environment} == {"USE_BSSRDF"}
    blocks = [row for block in GRAVITY_BLOCKS.values() for row in rows(block)]
    variables = [name for row in blocks for name in row.environment]
    assert variables == ["BLACK_HOLE_Z", "WORM_HOLE_Z"]  # tested in test_gravity.py


def test_the_dipole_of_every_object():
    """`USE_BSSRDF` goes over the `BSSRDF` of each object."""
    text = BALL + "BSSRDF\n1\n\n" + BALL
    assert [b.bssrdf for b in read_text(text, environ={}).objects] == [True, True]
    changed = read_text(text, environ={"USE_BSSRDF": "0"})
    assert [b.bssrdf for b in changed.objects] == [False, False]


def test_precedence():
    """Environment over file over default, also where the file repeats itself afterwards."""
    text = "SAMPLING\n3\nIMAGE\n64 48\nSAMPLING\n4\n"
    assert read_text("", environ={}).sampling == 8
    assert read_text(text, environ={}).sampling == 4
    document = read_text(text, environ={"SAMPLING": "5", "IMAGE_Y": "10"})
    assert (document.sampling, document.image) == (5, (64, 10))
    notes = {report.line: report.note for report in document.lines.all}
    assert notes[5] == "overridden by the environment variable SAMPLING"
    assert notes[3] == "overridden by the environment variable IMAGE_Y"


def test_the_process_environment_is_the_default(monkeypatch):
    """Without `environ`, the variables are those of the process."""
    monkeypatch.setenv("SAMPLING", "7")
    assert read_text("SAMPLING\n3\n").sampling == 7


def test_variables_of_the_scene_are_unknown_there():
    """The file's `VAR`s are no names for the environment."""
    with pytest.raises(SceneError, match="unknown name 'a'"):
        read_text("VAR a\n1\n", environ={"SAMPLING": "a"})


@pytest.mark.parametrize(
    ("name", "text", "kind", "message"),
    [
        ("SAMPLING", "2.5", "value", "expects one whole number, found '2.5'"),
        ("SAMPLING", "1 2", "value", "expects one whole number"),
        ("SAMPLING", "0", "range", "must be 1 to"),
        ("SAMPLING", "many", "syntax", "unknown name 'many'"),
        ("IMAGE_X", "1e9", "range", "must be 1 to 16384"),
        ("IMAGE_X", "9^9^9^9", "value", "no finite value"),
        ("NEXTEVENTESTIMATION", "0.5", "value", "expects one whole number"),
        ("TIMELIMIT", "1/0", "value", "no finite value"),
        ("PRESAMPLE", "0", "range", "environment variable PRESAMPLE must be above 0"),
        ("ENVLIGHT_R", "-1", "range", "must be at least 0"),
    ],
)
def test_values_that_are_wrong(name, text, kind, message):
    """The variable is named as it was spelt; there is no line to name."""
    with pytest.raises(SceneError) as caught:
        read_text("", environ={name: text})
    (problem,) = caught.value.problems
    assert (problem.line, problem.column, problem.kind) == (0, 0, kind)
    assert f"environment variable {name}" in problem.message and message in problem.message
