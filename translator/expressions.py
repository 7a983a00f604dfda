"""The scene language's expressions (spec section 2): a small evaluator over a whitelist.

::

    expr   := term  (('+'|'-') term)*
    term   := factor (('*'|'/'|'%') factor)*       a % b = a - floor(a/b) b
    factor := signed ['^' factor]                  right associative
    signed := ('-'|'+') signed | number            so -2^2 = 4
    number := literal | '(' expr ')' | name | func '(' expr [',' expr] ')'

A blank ends an expression where an operator could stand, and is skipped where an operand must
follow, so ``1 +2`` is two values and ``1+ 2`` is one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping

from relume.translator.outcome_rows import Note
from relume.translator.outcomes import make_note

MAX_DEPTH = 64
"""Deepest nesting of brackets, signs and powers; deeper text is an error, not a crash."""

CONSTANTS = {"pi": math.pi, "e": math.e}

FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sqrt": math.sqrt,
    "exp": math.exp,
    "log": math.log,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "floor": math.floor,
    "ceil": math.ceil,
    "sind": lambda x: math.sin(math.radians(x)),
    "cosd": lambda x: math.cos(math.radians(x)),
    "tand": lambda x: math.tan(math.radians(x)),
    "dasin": lambda x: math.degrees(math.asin(x)),
    "dacos": lambda x: math.degrees(math.acos(x)),
    "datan": lambda x: math.degrees(math.atan(x)),
}

BINARY_FUNCTIONS: dict[str, Callable[[float, float], float]] = {
    "pow": math.pow,
    "atan2": math.atan2,
    "datan2": lambda y, x: math.degrees(math.atan2(y, x)),
}

_LITERAL = re.compile(
    r"0[xX][0-9a-fA-F]+|0t[0-9]+|0b[0-9]+:[0-9a-zA-Z]+|"
    r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
)
_PLAIN_NUMBER = re.compile(r"(?<![^ \t])[+-]?(?:0|[1-9][0-9]{0,14})(?:\.[0-9]{0,15})?(?=[ \t]|$)")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*")
_MAX_DIGITS = 400


class ExpressionError(ValueError):
    """A malformed or undefined expression.

    Attributes:
        column: offset of the offending text in the line, from 0.
        kind: `syntax` (the text is malformed) or `value` (it has no finite value).
    """

    def __init__(self, column: int, message: str, kind: str = "syntax") -> None:
        super().__init__(message)
        self.column = column
        self.kind = kind


def evaluate(
    text: str, variables: Mapping[str, float] | None = None
) -> tuple[list[tuple[float, int]], list[Note]]:
    """Evaluate the expressions of one line.

    Args:
        text: one line of text.
        variables: names defined by `VAR` with their values.

    Returns:
        (values, notes): a list of pairs (value, column from 0), and a list of remarks on literals
        that the original program would have read otherwise.

    Raises:
        ExpressionError: with the column, for text that is no expression or has no finite value.
    """
    plain = [(float(m.group()), m.start()) for m in _PLAIN_NUMBER.finditer(text)]
    if plain and len(plain) == len(text.split()):
        return plain, []
    parser = _Parser(text, variables or {})
    values = []
    parser.skip_blanks()
    while parser.position < len(text):
        start = parser.position
        value = parser.expression(0)
        if not math.isfinite(value):
            shown = text[start : parser.position]
            raise ExpressionError(start, f"'{clip(shown)}' has no finite value", "value")
        if parser.position < len(text) and text[parser.position] not in " \t":
            found, read = clip(text[parser.position :]), clip(text[start : parser.position])
            raise ExpressionError(parser.position, f"unexpected '{found}' after '{read}'")
        values.append((value, start))
        parser.skip_blanks()
    return values, parser.notes


FULL_WIDTH_BLANK = "\u3000"


def clip(text: str, width: int = 40) -> str:
    """`text` shortened to `width` characters and freed of control characters, for messages.

    A full-width blank, which looks like one and separates nothing, is named.
    """
    text = text.replace(FULL_WIDTH_BLANK, "<full-width blank U+3000>")
    text = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text[: width + 1])
    return text if len(text) <= width else text[: width - 1] + "…"


class _Parser:
    def __init__(self, text: str, variables: Mapping[str, float]) -> None:
        self.text = text
        self.variables = variables
        self.position = 0
        self.notes: list[Note] = []

    def skip_blanks(self) -> None:
        while self.position < len(self.text) and self.text[self.position] in " \t":
            self.position += 1

    def peek(self) -> str:
        return self.text[self.position] if self.position < len(self.text) else ""

    def found(self) -> str:
        """What stands here, for messages."""
        return f"'{clip(self.text[self.position :])}'" if self.peek() else "the end of the line"

    def calculate(
        self, start: int, function: Callable[..., float], *arguments: float
    ) -> float:
        try:
            return float(function(*arguments))
        except (ArithmeticError, ValueError):
            shown = clip(self.text[start : self.position])
            raise ExpressionError(start, f"'{shown}' has no finite value", "value") from None

    def operand(self, rule: Callable[[int], float], depth: int) -> float:
        self.position += 1
        self.skip_blanks()
        return rule(depth)

    def expression(self, depth: int) -> float:
        start, value = self.position, self.term(depth)
        while (operator := self.peek()) and operator in "+-":
            right = self.operand(self.term, depth)
            value = self.calculate(
                start, float.__add__ if operator == "+" else float.__sub__, value, right
            )
        return value

    def term(self, depth: int) -> float:
        start, value = self.position, self.factor(depth)
        while (operator := self.peek()) and operator in "*/%":
            right = self.operand(self.factor, depth)
            function = {"*": float.__mul__, "/": float.__truediv__, "%": _modulo}[operator]
            value = self.calculate(start, function, value, right)
        return value

    def factor(self, depth: int) -> float:
        if depth > MAX_DEPTH:
            message = f"expression nested deeper than {MAX_DEPTH} levels"
            raise ExpressionError(self.position, message)
        start, base = self.position, self.signed(depth)
        if self.peek() == "^":
            exponent = self.operand(self.factor, depth + 1)
            return self.calculate(start, math.pow, base, exponent)
        return base

    def signed(self, depth: int) -> float:
        sign = 1.0
        while (operator := self.peek()) and operator in "+-":
            sign = -sign if operator == "-" else sign
            self.position += 1
        return sign * self.number(depth)

    def number(self, depth: int) -> float:
        start = self.position
        if self.peek() == "(":
            value = self.operand(self.expression, depth + 1)
            self.close(start)
            return value
        if match := _LITERAL.match(self.text, start):
            self.position = match.end()
            return self.literal(match.group(), start)
        if match := _NAME.match(self.text, start):
            self.position = match.end()
            return self.named(match.group(), start, depth)
        raise ExpressionError(start, f"expected a number, a name or '(', found {self.found()}")

    def literal(self, digits: str, start: int) -> float:
        if len(digits) > _MAX_DIGITS:
            raise ExpressionError(start, f"number of {len(digits)} characters")
        try:
            if digits[:2] in ("0x", "0X"):
                return float(int(digits[2:], 16))
            if digits.startswith("0t"):
                return float(digits[2:])
            if digits.startswith("0b"):
                base, _, figures = digits[2:].partition(":")
                return float(int(figures, int(base)))
        except (ValueError, OverflowError):
            raise ExpressionError(start, f"'{clip(digits)}' is not a number") from None
        if len(digits) > 1 and digits[0] == "0" and digits.isdigit():
            self.notes.append(make_note("leading-zero", digits=digits))
        return float(digits)

    def named(self, name: str, start: int, depth: int) -> float:
        if name in CONSTANTS:
            return CONSTANTS[name]
        if name in FUNCTIONS or name in BINARY_FUNCTIONS:
            arity = 1 if name in FUNCTIONS else 2
            arguments = self.arguments(name, start, arity, depth)
            function = FUNCTIONS.get(name) or BINARY_FUNCTIONS[name]
            return self.calculate(start, function, *arguments)
        if name in self.variables:
            return self.variables[name]
        raise ExpressionError(
            start, f"unknown name '{clip(name)}' (no function, no VAR before here)"
        )

    def arguments(self, name: str, start: int, arity: int, depth: int) -> list[float]:
        if self.peek() != "(":
            raise ExpressionError(self.position, f"expected '(' after the function '{name}'")
        found = [self.operand(self.expression, depth + 1)]
        self.skip_blanks()
        while self.peek() == ",":
            found.append(self.operand(self.expression, depth + 1))
            self.skip_blanks()
        self.close(start)
        if len(found) != arity:
            raise ExpressionError(start, f"'{name}' takes {arity} argument(s), found {len(found)}")
        return found

    def close(self, start: int) -> None:
        self.skip_blanks()
        if self.peek() != ")":
            opened = clip(self.text[start : self.position])
            message = f"expected ')' to close '{opened}', found {self.found()}"
            raise ExpressionError(self.position, message)
        self.position += 1


def _modulo(a: float, b: float) -> float:
    return a - math.floor(a / b) * b
