"""Expressions over named parameters: read from text without `eval`, evaluated over a design axis.

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

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from flexura.arguments import verb
from flexura.errors import ExpressionError
from flexura.expressions.dimension import NUMBER, Dimension

UnitReader = Callable[[str, str], tuple[float, Dimension]]
"""Turns the text of a number and of its unit into (value in SI, dimension)."""

Value = Any
"""A float, or an array whose leading axis counts designs."""

MAX_LENGTH = 20_000
MAX_OPERANDS = 300
MAX_DEPTH = 60
MAX_TREE_DEPTH = 200
MAX_EXPONENT = 16

FUNCTIONS: dict[str, tuple[Callable[..., Value], int]] = {
    "sqrt": (np.sqrt, 1),
    "abs": (np.abs, 1),
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "tan": (np.tan, 1),
    "asin": (np.arcsin, 1),
    "acos": (np.arccos, 1),
    "atan": (np.arctan, 1),
    "atan2": (np.arctan2, 2),
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
}
CONSTANTS = {"pi": math.pi}


class _Node:
    """Arithmetic that builds trees; shared by every kind of node."""

    def __add__(self, other: Any) -> Expression:
        return Expression(Binary("+", _tree(self), _tree(other)))

    def __radd__(self, other: Any) -> Expression:
        return Expression(Binary("+", _tree(other), _tree(self)))

    def __sub__(self, other: Any) -> Expression:
        return Expression(Binary("-", _tree(self), _tree(other)))

    def __rsub__(self, other: Any) -> Expression:
        return Expression(Binary("-", _tree(other), _tree(self)))

    def __mul__(self, other: Any) -> Expression:
        return Expression(Binary("*", _tree(self), _tree(other)))

    def __rmul__(self, other: Any) -> Expression:
        return Expression(Binary("*", _tree(other), _tree(self)))

    def __truediv__(self, other: Any) -> Expression:
        return Expression(Binary("/", _tree(self), _tree(other)))

    def __rtruediv__(self, other: Any) -> Expression:
        return Expression(Binary("/", _tree(other), _tree(self)))

    def __pow__(self, other: Any) -> Expression:
        return Expression(Binary("^", _tree(self), _tree(other)))

    def __neg__(self) -> Expression:
        return Expression(Negative(_tree(self)))


@dataclass(frozen=True)
class Number:
    """A literal in SI, not negative; `dimension` is None when it was written in Python, where SI is understood.

    Raises ExpressionError when it is negative (that is a Negative of a Number) or not finite.
    """

    value: float
    dimension: Dimension | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if not math.isfinite(self.value) or math.copysign(1.0, self.value) < 0:
            raise ExpressionError("a number in an expression must be finite and not negative")


@dataclass(frozen=True)
class Name:
    """A reference to a parameter or to a constant such as `pi`."""

    id: str


@dataclass(frozen=True)
class Negative:
    """Unary minus."""

    operand: Tree


@dataclass(frozen=True)
class Binary:
    """A sum, difference, product, quotient or power."""

    op: str
    left: Tree
    right: Tree


@dataclass(frozen=True)
class Call:
    """A function of `FUNCTIONS` applied to its arguments."""

    function: str
    arguments: tuple[Tree, ...]


Tree = Number | Name | Negative | Binary | Call


@dataclass(frozen=True)
class Expression(_Node):
    """A number that depends on parameters. Build it with `parameter("t") / 2` or `Expression.parse("t/2")`."""

    tree: Tree

    def __post_init__(self) -> None:
        if not isinstance(self.tree, Tree):
            raise ExpressionError(
                "this is no expression", hint=f"Expression.parse({str(self.tree)!r}) reads one from text"
            )

    @staticmethod
    def parse(
        text: str, unit: UnitReader | None = None, is_unit: Callable[[str], bool] = lambda _: False
    ) -> Expression:
        """Read an expression; `unit` reads the units of its literals (None: units are refused, numbers are SI), and
        `is_unit` says of a name whether it is a unit and nothing else.

        Raises ExpressionError with the rule that was broken.
        """
        if len(text) > MAX_LENGTH:
            raise ExpressionError(f"an expression has at most {MAX_LENGTH} characters")
        return Expression(checked(_Parser(text, unit, is_unit).parse()))

    @property
    def names(self) -> frozenset[str]:
        """Names of the parameters it depends on."""
        return frozenset(_names(self.tree)) - CONSTANTS.keys()

    def evaluate(self, values: Mapping[str, Value]) -> Value:
        """Value in SI for parameter values that are floats or arrays sharing a design axis.

        Raises ExpressionError when a parameter is missing.
        """
        return self.compiled()(values)

    def compiled(self) -> Callable[[Mapping[str, Value]], Value]:
        """The expression as a function of the parameter values, for repeated evaluation."""
        return _compile(self.tree)

    def dimension(self, of: Mapping[str, Dimension | None]) -> Dimension | None:
        """Physical dimension, given those of the parameters; None where a bare Python number leaves it open.

        Raises ExpressionError where dimensions clash.
        """
        return _dimension(self.tree, of)

    def renamed(self, names: Mapping[str, str]) -> Expression:
        """The same expression with other names for some parameters."""
        return self.substituted({name: Expression(Name(own)) for name, own in names.items()})

    def substituted(self, values: Mapping[str, float | Expression]) -> Expression:
        """The same expression with numbers in SI and expressions in the place of some parameters."""
        if self.names.isdisjoint(values):
            return self
        return Expression(_substituted(self.tree, {name: _tree(value) for name, value in values.items()}))

    def __str__(self) -> str:
        return format_tree(self.tree)


class Folded(float):
    """The number that an expression without parameters comes to, which remembers the expression."""

    tree: Tree

    def __new__(cls, value: float, tree: Tree = Number(0.0)) -> Folded:
        """The value with its tree."""
        self = super().__new__(cls, value)
        self.tree = tree
        return self


@verb
def parameter(name: str) -> Expression:
    """Refer to a parameter by name, to be joined with + - * / ** into expressions; ExpressionError for no text."""
    if not isinstance(name, str):
        raise ExpressionError(f"the name of a parameter is text, not {type(name).__name__}")
    return Expression(Name(name))


def _tree(value: Any) -> Tree:
    if isinstance(value, Expression):
        return value.tree
    if isinstance(value, int | float | np.floating | np.integer) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        return Negative(Number(-number)) if math.copysign(1.0, number) < 0 else Number(number)
    raise ExpressionError(f"{value!r} cannot stand in an expression", "use numbers and parameters")


def checked(tree: Tree) -> Tree:
    """The tree itself; ExpressionError when it nests too deep, or uses a name that cannot be written."""
    pending = [(tree, 1)]
    while pending:
        node, depth = pending.pop()
        if depth > MAX_TREE_DEPTH:
            raise ExpressionError(
                f"an expression joins at most {MAX_TREE_DEPTH} operations in a row",
                "split it over several parameters",
            )
        match node:
            case Name(id):
                if not _NAME.fullmatch(id) or id in FUNCTIONS:
                    raise ExpressionError(f"{id!r} cannot be the name of a parameter")
            case Negative(operand):
                pending.append((operand, depth + 1))
            case Binary(_, left, right):
                pending += [(left, depth + 1), (right, depth + 1)]
            case Call(_, arguments):
                pending += [(argument, depth + 1) for argument in arguments]
    return tree


def _names(tree: Tree) -> set[str]:
    match tree:
        case Name(id):
            return {id}
        case Negative(operand):
            return _names(operand)
        case Binary(_, left, right):
            return _names(left) | _names(right)
        case Call(_, arguments):
            return set().union(*(_names(a) for a in arguments))
    return set()


def _substituted(tree: Tree, values: Mapping[str, Tree]) -> Tree:
    match tree:
        case Name(id):
            return values.get(id, tree)
        case Negative(operand):
            return Negative(_substituted(operand, values))
        case Binary(op, left, right):
            return Binary(op, _substituted(left, values), _substituted(right, values))
        case Call(function, arguments):
            return Call(function, tuple(_substituted(a, values) for a in arguments))
    return tree


def _compile(tree: Tree) -> Callable[[Mapping[str, Value]], Value]:
    match tree:
        case Number(value):
            return lambda _: value
        case Name(id):
            if id in CONSTANTS:
                constant = CONSTANTS[id]
                return lambda _: constant

            def look_up(values: Mapping[str, Value]) -> Value:
                try:
                    return values[id]
                except KeyError:
                    raise ExpressionError(f"parameter {id!r} is not defined") from None

            return look_up
        case Negative(operand):
            inner = _compile(operand)
            return lambda values: -inner(values)
        case Binary(op, left, right):
            return _compile_binary(op, _compile(left), _compile(right))
        case Call(function, arguments):
            call = FUNCTIONS[function][0]
            compiled = [_compile(a) for a in arguments]
            return lambda values: call(*(c(values) for c in compiled))
    raise ExpressionError(f"{tree!r} is not an expression")


def _compile_binary(op: str, a: Callable[..., Value], b: Callable[..., Value]) -> Callable[..., Value]:
    if op == "+":
        return lambda values: a(values) + b(values)
    if op == "-":
        return lambda values: a(values) - b(values)
    if op == "*":
        return lambda values: a(values) * b(values)
    if op == "/":
        return lambda values: np.divide(a(values), b(values))
    return lambda values: np.power(a(values), b(values))


def _dimension(tree: Tree, of: Mapping[str, Dimension | None]) -> Dimension | None:
    result: Dimension | None = None
    match tree:
        case Number(value, dimension):
            result = None if value == 0 and dimension == NUMBER else dimension
        case Name(id):
            result = NUMBER if id in CONSTANTS else of.get(id)
        case Negative(operand):
            result = _dimension(operand, of)
        case Call(function, arguments):
            result = _call_dimension(function, [_dimension(a, of) for a in arguments])
        case Binary(op, left, right):
            a, b = _dimension(left, of), _dimension(right, of)
            if op in "+-":
                result = _same_dimension(a, b, "+ and - join quantities of one dimension")
            elif op == "^":
                result = _power_dimension(a, b, right)
            elif a is not None and b is not None:
                result = a.times(b, 1 if op == "*" else -1)
    return result


def _same_dimension(a: Dimension | None, b: Dimension | None, rule: str) -> Dimension | None:
    if a is not None and b is not None and a != b:
        left, right = a.unit() or "a pure number", b.unit() or "a pure number"
        raise ExpressionError(f"{rule}; these are {left} and {right}", "give every number in the sum its unit")
    return b if a is None else a


def _power_dimension(base: Dimension | None, exponent: Dimension | None, tree: Tree) -> Dimension | None:
    if exponent not in (None, NUMBER):
        raise ExpressionError("an exponent is a pure number")
    if base in (None, NUMBER):
        return base
    number = tree.operand if isinstance(tree, Negative) else tree
    if not isinstance(number, Number):
        raise ExpressionError("a quantity with a unit is raised to a literal power only")
    power = Fraction(number.value).limit_denominator(12)
    return base.power(-power if isinstance(tree, Negative) else power)


def _call_dimension(function: str, arguments: list[Dimension | None]) -> Dimension | None:
    first = arguments[0]
    if function == "sqrt":
        return None if first is None else first.power(Fraction(1, 2))
    if function == "abs":
        return first
    if function in ("min", "max", "atan2"):
        same = _same_dimension(first, arguments[1], f"{function} compares quantities of one dimension")
        return NUMBER if function == "atan2" else same
    if first not in (None, NUMBER):
        raise ExpressionError(f"{function} takes a pure number or an angle")
    return NUMBER


_PRECEDENCE = {"+": 1, "-": 1, "*": 2, "/": 2, "^": 4}


def _si_literal(number: Number) -> str:
    return repr(number.value).removesuffix(".0")


def format_tree(tree: Tree, number: Callable[[Number], str] = _si_literal, above: int = 0) -> str:
    """Text of a tree with the fewest parentheses; `number` writes its literals."""
    match tree:
        case Number(value):
            text, own = number(tree), 5 if value >= 0 else 3
        case Name(id):
            text, own = id, 5
        case Negative(operand):
            text, own = f"-{format_tree(operand, number, 3)}", 3
        case Call(function, arguments):
            text, own = f"{function}({', '.join(format_tree(a, number) for a in arguments)})", 5
        case Binary(op, left, right):
            own = _PRECEDENCE[op]
            lhs = format_tree(left, number, own + (op == "^"))
            if op == "^" and isinstance(left, Number) and lhs[-1:].isalpha() | lhs.endswith("]"):
                lhs = f"({lhs})"
            text = f"{lhs} {op} {format_tree(right, number, own + 1)}"
    return f"({text})" if own < above else text


_POWER = ("^", "**")
_NAME = re.compile(r"[^\W\d]\w*")
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[^\W\d]\w*)|(?P<unit>\[[^\[\]]*\])"
    r"|(?P<op>\*\*|[-+*/^(),]))"
)


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
        if not is_whole or not _NAME.fullmatch(unit):
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
