"""Checks of what expressions are made of: that their parameters exist, and that their units make sense."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from flexura.errors import ExpressionError, Path, Problem
from flexura.expressions import Dimension, Expression
from flexura.mechanism.checks.survey import suggestion
from flexura.mechanism.evaluation import parameter_at, parameter_dimensions, scalars
from flexura.mechanism.parameters import Parameter
from flexura.mechanism.quantity import Quantity
from flexura.mechanism.substructure import Mechanism

SYMBOLS = frozenset(("m", "mm", "um", "s", "kg", "g", "N", "rad", "deg", "V"))
"""Symbols of units that stand in expressions where no number with a unit is before them."""
COMPOUND = "a unit stands right behind its number, e.g. 2700 kg/m^3"

Dimensions = Mapping[str, Dimension | None]


def undefined(mechanism: Mechanism, ignored: Collection[str]) -> Iterator[Problem]:
    """Parameters that expressions name and nobody defines; `ignored` are known to be missing."""
    for path, _, value in scalars(mechanism):
        if isinstance(value, Expression):
            for name in sorted(value.names - mechanism.parameters.keys()):
                if name not in ignored:
                    hint = COMPOUND if name in SYMBOLS else suggestion(name, mechanism.parameters, "parameters")
                    yield Problem(path, str(value), f"parameter {name!r} is not defined", hint)


@dataclass(frozen=True)
class _Use:
    """An expression in its place; it is in order while `problem` is None."""

    path: Path
    quantity: Quantity
    value: Expression

    def expected(self, parameters: Mapping[str, Parameter], of: Dimensions) -> Dimension | None:
        """The dimension that is due here."""
        if self.quantity.dimension is not None:
            return self.quantity.dimension
        name = parameter_at(self.path)
        is_value = self.path == ("parameters", name, "value")
        return parameters[name].dimension if is_value else of.get(name)

    def problem(self, parameters: Mapping[str, Parameter], of: Dimensions) -> Problem | None:
        """What is wrong with the units of the expression when the parameters have these dimensions."""
        try:
            dimension = self.value.dimension(of)
        except ExpressionError as error:
            return Problem(self.path, str(self.value), error.rule, error.hint)
        expected = self.expected(parameters, of)
        if expected is None or dimension is None or dimension == expected:
            return None
        rule = f"{self.quantity.a_kind} is expected here, in {named(expected)}; this is in {named(dimension)}"
        return Problem(
            self.path, str(self.value), rule, f"e.g. {self.quantity.example}" if self.quantity.dimension else ""
        )


def wrong_dimensions(mechanism: Mechanism) -> list[Problem]:
    """Expressions with units that do not fit: those that one parameter with another unit would mend count as one
    problem, which is that parameter's."""
    parameters = mechanism.parameters
    uses = [
        _Use(path, quantity, value)
        for path, quantity, value in scalars(mechanism)
        if isinstance(value, Expression) and value.names <= parameters.keys()
    ]
    of = parameter_dimensions(parameters)
    found = []
    broken = [(use, problem) for use in uses if (problem := use.problem(parameters, of)) is not None]
    while broken:
        culprit = _culprit(parameters, uses, [use for use, _ in broken])
        if culprit is None:
            return [*found, *(problem for _, problem in broken)]
        name, meant, first = culprit
        others = f" and {len(broken) - 1} other places" if len(broken) > 1 else ""
        place = f"{'.'.join(map(str, first.path))}{others}"
        given = of[name]
        assert given is not None
        rule = f"{first.quantity.a_kind} is expected by {place}, in {named(meant)}; this is in {named(given)}"
        path, value = ("parameters", name, "value"), parameters[name].value
        found.append(Problem(path, str(value), rule, f"e.g. {first.quantity.example}"))
        parameters = _with_unit(parameters, name, meant)
        of = parameter_dimensions(parameters)
        broken = [(use, problem) for use in uses if (problem := use.problem(parameters, of)) is not None]
    return found


def _culprit(
    parameters: Mapping[str, Parameter], uses: list[_Use], broken: list[_Use]
) -> tuple[str, Dimension, _Use] | None:
    """The parameter that mends two broken uses or more, and breaks none, when it has another dimension; which one, and
    the first that it mends. None where there is no such parameter."""
    best: tuple[int, str, Dimension, _Use] | None = None
    of = parameter_dimensions(parameters)
    # only a number with a unit can have the wrong one
    for name in [n for n, p in parameters.items() if of[n] is not None and not isinstance(p.value, Expression)]:
        for meant in dict.fromkeys(u.quantity.dimension for u in broken):
            if meant is None or meant == of[name]:
                continue
            changed = _with_unit(parameters, name, meant)
            then = parameter_dimensions(changed)
            still = {use.path for use in uses if use.problem(changed, then) is not None}
            mended = [use for use in broken if use.path not in still]
            if len(mended) < 2 or still - {use.path for use in broken}:
                continue
            if best is None or len(mended) > best[0]:
                first = next((u for u in mended if u.quantity.dimension == meant), mended[0])
                best = len(mended), name, meant, first
    return None if best is None else best[1:]


def _with_unit(parameters: Mapping[str, Parameter], name: str, dimension: Dimension) -> dict[str, Parameter]:
    """The parameters with another dimension of one, and of those that follow from it."""
    changed = dict(parameters)
    pending = [name]
    while pending:
        own = pending.pop()
        unit = (dimension.unit() or "1") if own == name else ""
        changed[own] = changed[own].replaced({"unit": unit})
        for other, parameter in changed.items():
            if isinstance(parameter.value, Expression) and own in parameter.value.names and other != name:
                pending += [other] if parameter.unit else []
    return changed


def named(dimension: Dimension) -> str:
    """The SI unit of a dimension as it stands in a message."""
    return dimension.unit() or "1 (a pure number)"
