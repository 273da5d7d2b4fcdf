"""Dimensions of parameters and literals that Python code left out, inferred from where they are used."""

from __future__ import annotations

from fractions import Fraction

from flexura.errors import ExpressionError
from flexura.expressions import NUMBER, Binary, Call, Dimension, Expression, Name, Negative, Number, Tree
from flexura.mechanism import Mechanism, parameter_at, parameter_dimensions, scalars

MaybeDimension = Dimension | None


class Inference:
    """Dimensions of the parameters of a mechanism, as far as units and the fields they are used in tell.

    `known` holds them (None: open). Bare literals in a product count as pure numbers unless that cannot be.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.known: dict[str, MaybeDimension] = parameter_dimensions(mechanism.parameters)
        uses: list[tuple[Tree, Dimension | str]] = []
        for path, quantity, value in scalars(mechanism):
            if isinstance(value, Expression):
                uses.append((value.tree, parameter_at(path) if quantity.dimension is None else quantity.dimension))
        before = None
        while before != self.known:
            before = dict(self.known)
            for tree, expected in uses:
                self._learn(tree, expected)

    def _learn(self, tree: Tree, expected: Dimension | str) -> None:
        if isinstance(expected, str):
            if self.known.get(expected) is None:
                self.known[expected] = self._likely(tree)
            self.annotated(tree, self.known[expected])
        else:
            self.annotated(tree, expected)

    def annotated(self, tree: Tree, expected: MaybeDimension) -> Tree:
        """The same tree with dimensions for its literals, given that of the whole; learns those of names."""
        match tree:
            case Number(value, dimension):
                return tree if dimension is not None else Number(value, expected)
            case Name(id):
                if expected is not None and id in self.known and self.known[id] is None:
                    self.known[id] = expected
                return tree
            case Negative(operand):
                return Negative(self.annotated(operand, expected))
            case Call(function, arguments):
                dimension = self._argument(function, arguments, expected)
                return Call(function, tuple(self.annotated(a, dimension) for a in arguments))
            case Binary(op, left, right):
                a, b = self._sides(op, left, right, expected)
                return Binary(op, self.annotated(left, a), self.annotated(right, b))

    def _argument(self, function: str, arguments: tuple[Tree, ...], expected: MaybeDimension) -> MaybeDimension:
        if function == "abs":
            return expected
        if function in ("min", "max"):
            return expected or self._likely(arguments[0]) or self._likely(arguments[1])
        if function == "sqrt":
            return expected.power(Fraction(2)) if expected is not None else None
        if function == "atan2":
            return self._likely(arguments[0]) or self._likely(arguments[1])
        return NUMBER

    def _sides(
        self, op: str, left: Tree, right: Tree, expected: MaybeDimension
    ) -> tuple[MaybeDimension, MaybeDimension]:
        """Dimensions of the two sides of an operation."""
        if op in "+-":
            both = expected or self._likely(left) or self._likely(right)
            return both, both
        if op == "^":
            return self._base(left, right, expected), NUMBER
        sign = 1 if op == "*" else -1
        a, b = self._likely(_pure(left)), self._likely(_pure(right))
        if expected is None:
            return a, b
        clash = a is not None and b is not None and a.times(b, sign) != expected
        if b is not None and (a is None or (clash and not _is_bare(right) and _has_bare_factor(left))):
            return expected.times(b, -sign), b
        if a is not None and (b is None or clash):
            return a, expected.times(a, -1) if sign > 0 else a.times(expected, -1)
        return a, b

    def _base(self, base: Tree, exponent: Tree, expected: MaybeDimension) -> MaybeDimension:
        literal = exponent.operand if isinstance(exponent, Negative) else exponent
        if not isinstance(literal, Number):
            return NUMBER
        power = Fraction(literal.value).limit_denominator(12) * (-1 if isinstance(exponent, Negative) else 1)
        return expected.power(1 / power) if expected is not None and power else self._likely(base)

    def _likely(self, tree: Tree) -> MaybeDimension:
        """Dimension of a tree with bare factors taken for pure numbers; None where it is open."""
        try:
            return Expression(_with_pure_factors(tree)).dimension(self.known)
        except ExpressionError:
            return None


def _with_pure_factors(tree: Tree) -> Tree:
    match tree:
        case Binary(op, left, right) if op in "*/":
            return Binary(op, _pure(left), _pure(right))
        case Binary(op, left, right):
            return Binary(op, _with_pure_factors(left), _with_pure_factors(right))
        case Negative(operand):
            return Negative(_with_pure_factors(operand))
        case Call(function, arguments):
            return Call(function, tuple(_with_pure_factors(a) for a in arguments))
    return tree


def _pure(tree: Tree) -> Tree:
    return Number(1.0, NUMBER) if _is_bare(tree) else _with_pure_factors(tree)


def _is_bare(tree: Tree) -> bool:
    """True for literals without dimension, and what is made of them alone."""
    match tree:
        case Number(_, dimension):
            return dimension is None
        case Negative(operand):
            return _is_bare(operand)
        case Binary(_, left, right):
            return _is_bare(left) and _is_bare(right)
        case Call(_, arguments):
            return all(map(_is_bare, arguments))
    return False


def _has_bare_factor(tree: Tree) -> bool:
    match tree:
        case Negative(operand):
            return _has_bare_factor(operand)
        case Binary(op, left, right) if op in "*/":
            return _has_bare_factor(left) or _has_bare_factor(right)
    return _is_bare(tree)
