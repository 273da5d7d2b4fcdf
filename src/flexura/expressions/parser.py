"""Reading expressions from text, without `eval`.

Grammar (a number may be followed by a unit, in square brackets or not):

    sum     = product {("+" | "-") product}
    product = sign {("*" | "/") sign}
    sign    = ["+" | "-"] power
    power   = atom [("^" | "**") sign]
    atom    = number [unit {("*" | "/") unit} | "[" unit "]"] | name | function "(" sum {"," sum} ")" | "(" sum ")"

A power right behind a unit is the unit's: `9 mm^2` are nine square millimetres, the square of 9 mm is `(9 mm)^2`. A
name that follows a unit, as in `200 N/mm`, belongs to it where it is a unit and nothing else.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from flexura.errors import ExpressionError
from flexura.expressions.dimension import NUMBER, Dimension
from flexura.expressions.tree import FUNCTIONS, NAME, Binary, Call, Name, Negative, Number, Tree

UnitReader = Callable[[str, str], tuple[float, Dimension]]
"""Turns the text of a number and of its unit into (value in SI, dimension)."""

MAX_LENGTH = 20_000
MAX_OPERANDS = 300
MAX_DEPTH = 60
MAX_EXPONENT = 16

_POWER = ("^", "**")
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[^\W\d]\w*)|(?P<unit>\[[^\[\]]*\])"
    r"|(?P<op>\*\*|[-+*/^(),]))"
)


def parsed(text: str, unit: UnitReader | None, is_unit: Callable[[str], bool]) -> Tree:
    """The tree of a text, as `Expression.parse`. Raises ExpressionError with the rule that was broken."""
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"an expression has at most {MAX_LENGTH} characters")
    return _Parser(text, unit, is_unit).parse()


class _Parser:
    """Recursive descent over the tokens of one expression."""

    def __init__(self, text: str, unit: UnitReader | None, is_unit: Callable[[str], bool]) -> None:
        self.tokens = _tokens(text)
        self.at = 0
        self.depth = 0
        self.unit, self.is_unit = unit, is_unit

    def parse(self) -> Tree:
        tree = self.sum()
        kind, token = self.peek()
        if kind != "end":
            raise ExpressionError(f"{token!r} was not expected here", "operators are + - * / ^ and parentheses")
        return tree

    def peek(self) -> tuple[str, str]:
        return self.tokens[self.at]

    def take(self, *ops: str) -> str | None:
        kind, token = self.peek()
        if kind == "op" and token in ops:
            self.at += 1
            return token
        return None

    def sum(self) -> Tree:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise ExpressionError(f"an expression nests at most {MAX_DEPTH} deep")
        tree = self.product()
        while op := self.take("+", "-"):
            tree = Binary(op, tree, self.product())
        self.depth -= 1
        return tree

    def product(self) -> Tree:
        tree = self.sign()
        while op := self.take("*", "/"):
            tree = Binary(op, tree, self.sign())
        return tree

    def sign(self) -> Tree:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise ExpressionError(f"an expression nests at most {MAX_DEPTH} deep")
        op = self.take("+", "-")
        tree = self.sign() if op else self.power()
        self.depth -= 1
        return Negative(tree) if op == "-" else tree

    def power(self) -> Tree:
        base = self.atom()
        if not self.take(*_POWER):
            return base
        exponent = self.sign()
        literal = exponent.operand if isinstance(exponent, Negative) else exponent
        if isinstance(literal, Number) and literal.value > MAX_EXPONENT:
            raise ExpressionError(f"an exponent is at most {MAX_EXPONENT}")
        return Binary("^", base, exponent)

    def atom(self) -> Tree:
        kind, token = self.peek()
        self.at += 1
        if kind == "number":
            return self.quantity(token)
        if kind == "name":
            return self.call(token) if self.take("(") else self.reference(token)
        if token == "(":
            tree = self.sum()
            if not self.take(")"):
                raise ExpressionError("a ( is not closed")
            return tree
        raise ExpressionError("the expression ends too early" if kind == "end" else f"{token!r} was not expected here")

    def reference(self, token: str) -> Tree:
        if token in FUNCTIONS:
            raise ExpressionError(f"{token} is a function", f"write {token}(…)")
        return Name(token)

    def call(self, function: str) -> Tree:
        if function not in FUNCTIONS:
            raise ExpressionError(f"{function!r} is not a function", "known: " + ", ".join(sorted(FUNCTIONS)))
        arguments = [self.sum()]
        while self.take(","):
            arguments.append(self.sum())
        if not self.take(")"):
            raise ExpressionError("a ( is not closed")
        if len(arguments) != FUNCTIONS[function][1]:
            raise ExpressionError(f"{function} takes {FUNCTIONS[function][1]} argument(s), not {len(arguments)}")
        return Call(function, tuple(arguments))

    def quantity(self, number: str) -> Tree:
        kind, token = self.peek()
        if kind not in ("name", "unit"):
            return Number(float(number), NUMBER if self.unit else None)
        if self.unit is None:
            raise ExpressionError("numbers are in SI here and carry no unit", "units belong in a model file")
        self.at += 1
        text = self.powered(token.strip("[]"))
        while kind == "name" and self.is_unit_next():
            (_, operator), (_, name) = self.tokens[self.at : self.at + 2]
            self.at += 2
            text += operator + self.powered(name)
        return Number(*self.unit(number, text))

    def is_unit_next(self) -> bool:
        """Whether * or / and a name follow that belong to the unit before them."""
        operator, *name = self.tokens[self.at : self.at + 3]
        if operator not in (("op", "*"), ("op", "/")) or len(name) < 2 or name[1] == ("op", "("):
            return False
        return name[0][0] == "name" and self.is_unit(name[0][1])

    def powered(self, unit: str) -> str:
        """The unit with the power that follows it."""
        if not self.take(*_POWER):
            return unit
        sign = "-" if self.take("+", "-") == "-" else ""
        (kind, power), after = self.peek(), self.tokens[min(self.at + 1, len(self.tokens) - 1)]
        self.at += 1
        is_whole = kind == "number" and power.isdigit() and after[0] not in ("name", "unit") and after[1] not in _POWER
        if not is_whole or not NAME.fullmatch(unit):
            raise ExpressionError(
                f"it is not clear whether a power belongs to {unit} or to the quantity",
                f"write 9 mm^2 for square millimetres, (9 {unit})^n for a power of a quantity",
            )
        return f"{unit}^{sign}{power}"


def _tokens(text: str) -> list[tuple[str, str]]:
    tokens: list[tuple[str, str]] = []
    position = 0
    text = text.rstrip()
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            raise ExpressionError(f"{text[position:].strip()[0]!r} cannot stand in an expression")
        tokens.append((str(match.lastgroup), match.group(str(match.lastgroup))))
        position = match.end()
    if sum(kind in ("name", "number") for kind, _ in tokens) > MAX_OPERANDS:
        raise ExpressionError(
            f"an expression has at most {MAX_OPERANDS} numbers and names", "split it over several parameters"
        )
    tokens.append(("end", ""))
    return tokens
