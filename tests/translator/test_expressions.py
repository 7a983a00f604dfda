"""Expressions: every function, precedence, blanks, literals, and errors with their column.

Expected values are those of Python's own `math` on the same doubles, which is what the language's
functions are defined by; angles in degrees are exact at multiples of 90 up to rounding.
"""

import math
import time

import pytest

from relume.translator.expressions import (
    BINARY_FUNCTIONS,
    CONSTANTS,
    FUNCTIONS,
    MAX_DEPTH,
    ExpressionError,
    clip,
    evaluate,
)


def values(text, variables=None):
    return [value for value, _ in evaluate(text, variables)[0]]


def error(text, variables=None):
    with pytest.raises(ExpressionError) as caught:
        evaluate(text, variables)
    return caught.value


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sqrt(2)", math.sqrt(2)),
        ("exp(1.5)", math.exp(1.5)),
        ("log(10)", math.log(10)),
        ("sin(0.5)", math.sin(0.5)),
        ("cos(0.5)", math.cos(0.5)),
        ("tan(0.5)", math.tan(0.5)),
        ("asin(0.5)", math.asin(0.5)),
        ("acos(0.5)", math.acos(0.5)),
        ("atan(0.5)", math.atan(0.5)),
        ("floor(-1.5)", -2),
        ("ceil(-1.5)", -1),
        ("sind(30)", 0.5),
        ("cosd(60)", 0.5),
        ("tand(45)", 1),
        ("dasin(0.5)", 30),
        ("dacos(0.5)", 60),
        ("datan(1)", 45),
        ("pow(2,10)", 1024),
        ("atan2(1,-1)", 3 * math.pi / 4),
        ("datan2(1,-1)", 135),
    ],
)
def test_functions(text, expected):
    """Each function at one point; the list is complete (see the next test)."""
    assert values(text) == [pytest.approx(expected, rel=1e-15)]


def test_all_functions_are_tested():
    """`test_functions` has a case for every function of the language."""
    cases = {mark.args[1][k][0] for mark in test_functions.pytestmark for k in range(20)}
    assert {case.partition("(")[0] for case in cases} == {*FUNCTIONS, *BINARY_FUNCTIONS}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1+2*3", 7),
        ("(1+2)*3", 9),
        ("2*3^2", 18),
        ("-2^2", 4),  # the sign binds closer than the power (spec section 2)
        ("0-2^2", -4),
        ("2^-1", 0.5),
        ("2^3^2", 512),  # right associative
        ("8/4/2", 1),
        ("8-4-2", 2),
        ("8/4*2", 4),
        ("--3", 3),
        ("+-+3", -3),
        ("7%3", 1),
        ("-7%3", 2),  # a - floor(a/b) b
        ("7%-3", -2),
        ("7.5%2", 1.5),
        ("10660+10", 10670),
        ("20*1.3333", 26.666),
        ("-358+50", -308),
        ("a*2", 6),
        ("X+50*cos(T*pi/180)", 26),
        ("e", math.e),
        ("2*pi", 2 * math.pi),
        ("sqrt(pow(3,2)+pow(4,2))", 5),
        ("((((5))))", 5),
    ],
)
def test_precedence(text, expected):
    """Operators as the grammar of the language orders them; the last of real files."""
    assert values(text, {"a": 3.0, "X": 1.0, "T": 60.0}) == [pytest.approx(expected, rel=1e-15)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 +2", [1, 2]),
        ("1 -2", [1, -2]),
        ("1+ 2", [3]),
        ("1-\t2", [-1]),
        ("( 1 )", [1]),
        ("pow( 2 , 3 )", [8]),
        ("  1\t 2  3 \t", [1, 2, 3]),
        ("1 (2)", [1, 2]),
        ("", []),
        (" \t", []),
    ],
)
def test_blanks(text, expected):
    """A blank ends an expression where an operator could stand, and only there."""
    assert values(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1.", 1),
        (".5", 0.5),
        ("0.5", 0.5),
        ("1e3", 1000),
        ("1E-3", 0.001),
        ("2.5e+2", 250),
        ("0x1F", 31),
        ("0Xff", 255),
        ("0t12", 12),
        ("0b2:101", 5),
        ("0b16:ff", 255),
        ("9007199254740993", 9007199254740992),  # to the nearest double
        ("0.1", 0.1),
        ("5e-324", 5e-324),
    ],
)
def test_literals(text, expected):
    """Decimal, hexadecimal and the digits of any base."""
    assert values(text) == [expected]


def test_leading_zero_is_decimal_with_a_note():
    """The program read `010` as octal 8; here it is ten, and the reader is told."""
    found, notes = evaluate("010 08")
    assert [value for value, _ in found] == [10, 8]
    assert len(notes) == 2 and "octal" in notes[0].text
    assert evaluate("0 0.5 00.5")[1] == []


def test_constants_and_functions_come_before_variables():
    """The order in which names are looked up."""
    assert values("pi", {"pi": 3.0}) == [CONSTANTS["pi"]]
    assert error("sin", {"sin": 3.0}).column == 3


def test_columns_of_values():
    """Each value knows where it starts, whichever way it is read."""
    assert [column for _, column in evaluate("1  22 3")[0]] == [0, 3, 6]
    assert [column for _, column in evaluate("1+1  22 x", {"x": 1.0})[0]] == [0, 5, 8]


@pytest.mark.parametrize(
    ("text", "column", "words", "kind"),
    [
        ("1 2 x", 4, "unknown name 'x'", "syntax"),
        ("1 # x", 2, "'# x'", "syntax"),
        ("1..2", 2, "unexpected '.2' after '1.'", "syntax"),
        ("1,2", 1, "unexpected ',2'", "syntax"),
        ("(1", 2, "expected ')'", "syntax"),
        ("(1 +2)", 3, "expected ')'", "syntax"),
        ("1)", 1, "unexpected ')'", "syntax"),
        ("2*", 2, "end of the line", "syntax"),
        ("*2", 0, "'*2'", "syntax"),
        ("sin 1", 3, "expected '('", "syntax"),
        ("sin()", 4, "found ')'", "syntax"),
        ("sin(1,2)", 0, "takes 1 argument(s), found 2", "syntax"),
        ("pow(1)", 0, "takes 2 argument(s), found 1", "syntax"),
        ("Sin(1)", 0, "unknown name 'Sin'", "syntax"),
        ("2_b", 1, "unexpected '_b'", "syntax"),
        ("0b99:1", 0, "not a number", "syntax"),
        ("0b2:7", 0, "not a number", "syntax"),
        ("1.5.2", 3, "unexpected '.2'", "syntax"),
        ("１", 0, "found '１'", "syntax"),
        ("1　2", 1, "unexpected", "syntax"),
        ("nan", 0, "unknown name", "syntax"),
        ("inf", 0, "unknown name", "syntax"),
        ("3 1/0", 2, "'1/0' has no finite value", "value"),
        ("1%0", 0, "no finite value", "value"),
        ("sqrt(-1)", 0, "no finite value", "value"),
        ("log(0)", 0, "no finite value", "value"),
        ("asin(2)", 0, "no finite value", "value"),
        ("(-8)^0.5", 0, "no finite value", "value"),
        ("0^-1", 0, "no finite value", "value"),
        ("9^9^9^9", 2, "no finite value", "value"),
        ("exp(1000)", 0, "no finite value", "value"),
        ("1e400", 0, "no finite value", "value"),
        ("1e400-1e400", 0, "no finite value", "value"),
        ("1e308*10", 0, "no finite value", "value"),
        ("floor(1e400)", 0, "no finite value", "value"),
        ("0x" + "f" * 300, 0, "not a number", "syntax"),
        ("9" * 401, 0, "number of 401 characters", "syntax"),
    ],
)
def test_errors(text, column, words, kind):
    """What is no expression, or has no finite value, is named with its column (from 0)."""
    found = error(text)
    assert (found.column, found.kind) == (column, kind)
    assert words in str(found)


def test_infinity_on_the_way_is_allowed():
    """Only the value that a keyword gets must be finite."""
    assert values("1/1e400") == [0]


@pytest.mark.parametrize("opening", ["(", "sqrt(", "1+(", "1^", "-(", "pow(1,"])
def test_deep_nesting_is_an_error(opening):
    """Nesting ends in a message, never in a crash, and a good part of it is allowed."""
    assert "nested deeper" in str(error(opening * (MAX_DEPTH + 1) + "1"))
    assert "nested deeper" in str(error(opening * 100_000))
    depth = MAX_DEPTH // 2
    assert len(values(opening * depth + "1" + ")" * depth * ("(" in opening))) == 1


@pytest.mark.parametrize(
    "text",
    ["1+" * 500_000 + "1", "-" * 1_000_000 + "1", "1 " * 500_000, "x" * 1_000_000, "9" * 1_000_000,
     "0b2:" + "1" * 1_000_000, " " * 1_000_000, "1 " * 499_999 + "?", "1e" * 500_000,
     "1*(" + "2," * 500_000, "." * 1_000_000],
    ids=lambda text: text[:6],
)
def test_a_megabyte_takes_bounded_time(text):
    """Time is linear in the length of a line: eight times as long, less than 16 times as much.

    That is processor time, of which a busy machine takes more for both; were it quadratic, it would
    be 64 times as much.
    """

    def seconds(text):
        start = time.process_time()
        try:
            evaluate(text)
        except ExpressionError as found:
            assert len(str(found)) < 200
        return time.process_time() - start

    shorter = text[: len(text) // 8] + text[-1]
    assert seconds(text) < 0.2 + 16 * min(seconds(shorter) for _ in range(2))


def test_clip_shows_one_printable_line():
    """Messages stay short and free of control characters, whatever the file holds."""
    assert clip("a\x1b[31m\n\u202eb") == "a�[31m��b"
    assert clip("x" * 100) == "x" * 39 + "…"
    assert clip("x" * 40) == "x" * 40
