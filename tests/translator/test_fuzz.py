"""Mutated scene files: no crash, no hang, and every failure is a `SceneError` with a place.

The mutations are drawn from a generator with a fixed seed, so the files are the same in every run.
Warnings are errors here, so a number that overflows on its way is a failure as well.
"""

import random
import time

import pytest

from relume.translator import read_text, translate
from relume.translator.diagnostics import ERROR_KINDS, SceneError
from relume.translator.document import Document
from relume.translator.forms.reflections import REFLECTIONS
from relume.translator.keywords import rows
from relume.translator.objects import SceneObject
from relume.translator.shapes import SHAPES

CASES = 1000
LIMIT = 10.0
"""Longest time for one file [s of processor time]: more than any takes, far less than a hang."""

WORDS = [
    *(row.name for cls in (Document, SceneObject) for row in rows(cls)),
    *(f"{name} 1 2 3 4" for name in SHAPES),
    *(f"reflection {name}" for name in REFLECTIONS),
    *("OBJECT", "BLACKHOLE", "WORMHOLE 1 2 3", "CAMERA_MATRIX", "rotation 1 2 3", "U 1 0 0"),
]
NUMBERS = [
    "0", "-0", "-1", "1e-300", "1e300", "-1e300", "1e400", "nan", "inf", "9^9^9^9", "1/0", "0/0",
    "5e-324", "1.7976931348623157e308", "99999999999999999999", "1000000", "((((1))))", "(" * 500,
    "sqrt(-1)", "0x", "%", "%%", "%PATH%", "1 #", "#", "１", "1,2", "a", "pi", "e", "1\t2", "-", "",
    "1" * 500, "0b36:zz", "0.0000001", "180", "90", "16384", "2147483648", "-2147483649",
]
BYTES = [
    b"\0", b"\xff", b"\x82\xa0", b"\x81", b"\xef\xbb\xbf", b"\r", b"\n", b"\n\n", b"\t", b" ",
    b"\x0c", b"\x1b[31m", "ソ".encode("cp932"), "é".encode(), b"..\\..\\", b"/dev/zero",
]


def mutate_lines(lines, rng):
    """One change of whole lines or words."""
    at = rng.randrange(len(lines) + 1)
    line = rng.choice(lines) if lines else ""
    change = rng.randrange(6)
    if change == 0:
        del lines[at : at + rng.randrange(1, 4)]
    elif change == 1:
        lines.insert(at, line)
    elif change == 2:
        lines.insert(at, rng.choice(WORDS))
    elif change == 3:
        lines.insert(at, rng.choice(["", " ", "#", "#OBJECT", rng.choice(NUMBERS)]))
    elif at < len(lines):
        words = lines[at].split(" ")
        k = rng.randrange(len(words))
        if change == 4:
            words[k] = rng.choice(NUMBERS)
        else:
            letters = list(words[k])
            rng.shuffle(letters)
            words[k] = "".join(letters)
        lines[at] = " ".join(words)


def mutate(data, rng):
    """The bytes of a scene file with some changes."""
    lines = data.decode("cp932", errors="replace").replace("\r\n", "\n").split("\n")
    for _ in range(rng.choice([1, 1, 2, 4, 16])):
        mutate_lines(lines, rng)
    text = rng.choice(["\n", "\n", "\r\n"]).join(lines)
    data = text.encode(rng.choice(["utf-8", "cp932"]), "replace")
    if rng.random() < 0.2:
        at = rng.randrange(len(data) + 1)
        data = data[:at] + rng.choice(BYTES) + data[at:]
    if rng.random() < 0.05:
        data = data[: rng.randrange(len(data) + 1)]
    return data


def problems(data, dialect):
    """The errors of a file, found while it is read or translated; empty where there are none."""
    try:
        translate(read_text(data, "fuzz.txt", environ={}), dialect)
    except SceneError as error:
        assert error.problems
        return error.problems
    return []


def check(data, dialect="manual"):
    """Read and translate bytes; returns whether they were in order."""
    start = time.process_time()
    found = problems(data, dialect)
    assert time.process_time() - start < LIMIT
    lines = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(b"\n") + 1
    for problem in found:
        assert problem.kind in ERROR_KINDS
        assert 0 <= problem.line <= lines
        assert (problem.column >= 1) == (problem.line >= 1)
        assert 0 < len(problem.message) < 1000
        assert problem.message.isprintable()
    return not found


def test_mutated_scenes(scene_files):
    """Lines deleted, doubled and inserted, words shuffled, numbers replaced by absurd ones."""
    rng = random.Random(20)
    originals = [path.read_bytes() for path in scene_files]
    good = 0
    for k in range(CASES):
        data = mutate(rng.choice(originals), rng)
        print(f"case {k}: {data!r}")  # shown if it fails
        good += check(data, rng.choice(["manual", "prender"]))
    assert good > CASES / 20  # the mutations are mild enough to reach the translation


def test_random_bytes():
    """No scene at all."""
    rng = random.Random(21)
    for _ in range(200):
        check(rng.randbytes(rng.randrange(400)))
        check(bytes(rng.choices(b"OBJECTspherecolor 0123456789.-+*/^()%#\n", k=300)))


def test_words_and_numbers_at_random():
    """Files made of nothing but keywords and numbers, most of them in the wrong place."""
    rng = random.Random(22)
    for _ in range(300):
        lines = [rng.choice(WORDS + NUMBERS) for _ in range(rng.randrange(60))]
        check("\n".join(lines).encode())


@pytest.mark.parametrize("number", NUMBERS)
def test_every_keyword_with_absurd_values(number):
    """Each keyword of the scene and of an object with a number that is no use to it."""
    for row in rows(Document):
        values = " ".join([number] * max(1, row.arity))
        check(f"{row.name}\n{values}\n".encode())
        check(f"{row.name} {values}\n".encode())
    for row in rows(SceneObject):
        values = " ".join([number] * max(1, row.arity))
        for shape in ("sphere 0 0 0 1", "uvplane 0 0 0\nU 1 0 0\nV 0 1 0"):
            check(f"OBJECT\n{shape}\nemission 1 1 1\n{row.name} {values}\n".encode())
            check(f"OBJECT\n{shape}\n{row.name}\n{values}\n".encode())
    for name, row in SHAPES.items():
        vectors = "".join(f"{v} {number} {number} 1\n" for v in row.vectors)
        check(f"OBJECT\n{name} {' '.join([number] * row.arity)}\n{vectors}".encode())
