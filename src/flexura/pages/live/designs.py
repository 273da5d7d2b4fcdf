"""What a page asks of one design and is told: proven frequencies first, then a picture, then all that takes longer."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from flexura.analysis import (
    States,
    compliance,
    frequency_response,
    member_stresses,
    model_errors_of_modes,
    motion_limits,
    motions,
    statics,
)
from flexura.arrays import Array
from flexura.errors import Diagnostic, FlexuraError, OptionError, SolverError, foremost
from flexura.mechanism import DOF_NAMES, UNITS
from flexura.motion import at_pose
from flexura.pages.live.described import Described, FollowedModes, Identified, lowest_shapes, scene_message
from flexura.pages.live.sliders import blamed, moved_bounds, parameters_of
from flexura.pages.viewer import Buffer, Drawing, facts_of, quick, scene_and_drawing, to_message
from flexura.reduction import HERTZ, certificate, chained, lowest_pairs, natural_frequencies, proven_text
from flexura.results import plain
from flexura.structure import Design, FullOrderModel, Plan, Ports, full_order_model
from flexura.study.requirements import requirements
from flexura.tables import ends, quantity

LARGEST = 1 << 17
"""Bytes of the largest message that is read."""

MOST_MODES = 30

Finite = Annotated[float, Field(allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=200)]
Numbers = Annotated[dict[Name, Finite], Field(max_length=2000)]


class Message(BaseModel):
    """What the page sends: nothing but the keys that are known, of exactly their types."""

    model_config: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)


class Response(Message):
    """The frequency response that is asked for; a damping ratio in place of the described damping."""

    input: Name
    output: Name
    low: Annotated[Finite, Field(gt=0)]
    high: Annotated[Finite, Field(gt=0)]
    damping: Annotated[Finite, Field(ge=0, lt=1)] | None = None


class Load(Message):
    """What the stresses are of: the loads that are described, actuators at their limits, or a DOF that is moved by an
    `amplitude`, m or rad."""

    kind: Literal["described", "actuators", "move"]
    dof: Name = ""
    amplitude: Finite = 0.0


class Ask(Message):
    """A design: the numbers of the sliders that differ from the file, in their units."""

    type: Literal["design"]
    serial: Annotated[int, Field(ge=0)]
    values: Numbers
    modes: Annotated[int, Field(ge=1, le=MOST_MODES)] = 6
    shown: int | None = None
    response: Response | None = None
    load: Load | None = None


class Save(Message):
    """A file to be written beside the one that is open."""

    type: Literal["save"]
    file: Name
    values: Numbers
    overwrite: bool = False


T = TypeVar("T")
_READER: TypeAdapter[Ask | Save] = TypeAdapter(Annotated[Ask | Save, Field(discriminator="type")])


def read_message(text: str) -> Ask | Save:
    """A message of the page. Raises OptionError for anything else."""
    return understood(_READER, text)


def understood(reader: TypeAdapter[T], text: str) -> T:
    """What a reader makes of a message. Raises OptionError where it is none that it knows."""
    try:
        return reader.validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise OptionError(f"a message that is not understood: {where}: {first['msg']}") from None


def told(kind: str, **data: Any) -> str:
    """A message in JSON; numbers that are not finite are null."""
    return json.dumps({"type": kind, **plain(data)}, allow_nan=False, separators=(",", ":"))


TOLERANCE = 1e-5
"""Relative width of intervals that is aimed at: the five digits shown hold."""

WIDE = 1e-3
"""Width from which an interval is said to be wide."""

ASSUMED_DAMPING = 0.01
"""Of responses of mechanisms without any damping, whose resonances are infinite."""

FACTOR = 0.08
"""Largest motion of a picture, as a part of the size of what is drawn."""

ROWS = 6
"""Members whose stress is shown."""

Steps = list[tuple[str, Callable[[], str | bytes]]]
"""Work to be done one after another, each giving a message of a kind."""


@dataclass
class Shown:
    """A design that was worked out: what it was asked for with, its parameters in SI, its model and modes, which of
    these is `at` the picture, from 0, with what is said of it, and milliseconds of each piece of work."""

    ask: Ask
    parameters: dict[str, float]
    model: FullOrderModel
    modes: Identified
    at: int
    row: dict[str, Any]
    timing: dict[str, float]


class Designs:
    """The designs of one description that one page looks at, one after another."""

    def __init__(self, described: Described, followed: FollowedModes) -> None:
        self.described = described
        self._followed, self._undamped = followed, False
        model, found = described.reference
        modes = followed.follow(model, found)
        self._near: Array | None = modes.shapes
        self._told: dict[int, Sequence[tuple[str, str]]] = {}
        hz = np.sqrt(np.maximum(found.values, 0)) / HERTZ
        self._drawing = described.drawn[1]
        self._file = {str(mode): float(f) for mode, f in zip(modes.number, hz, strict=True)}

    def numbers(self, ask: Ask) -> tuple[str, Shown]:
        """What follows the hand first: frequencies with their intervals, and what moves with the sliders.

        Raises FlexuraError for a design that cannot be.
        """
        timing: dict[str, float] = {}
        plan, parameters = self.described.plan, parameters_of(self.described.sliders, ask.values)
        with _timed(timing, "frequencies"):
            f, lower, upper, indexed, rigid = _proven(plan, parameters, self._count(ask))
        with _timed(timing, "shapes"):
            model = full_order_model(at_pose(Design.of(plan, parameters)))
            found = lowest_shapes(model, self._count(ask), self._near)
            modes = self._followed.follow(model, found)
        self._near = modes.shapes
        number = modes.number[: len(f)]
        rows = [
            {"mode": number[k], "like": modes.like[k]}
            | _frequency(f[k], lower[k], upper[k], bool(indexed[k]), k < rigid)
            for k in range(len(f))
        ]
        elastic = next((k for k, row in enumerate(rows) if not row["rigid"]), 0)
        at = number.index(ask.shown) if ask.shown in number else elastic
        own = {"serial": ask.serial, "revision": self.described.revision, "shown": number[at], "rows": rows}
        own |= {"file": self._file, "timing": timing, **moved_bounds(plan, self.described.sliders, parameters)}
        return told("numbers", **own), Shown(ask, parameters, model, modes, at, rows[at], timing)

    def picture(self, shown: Shown) -> tuple[bytes, ...]:
        """What follows the hand next: points of a design, and the shape of its mode; before it the whole scene where
        the page has none that these fit."""
        scenes: tuple[bytes, ...] = ()
        model, at = shown.model, shown.at
        with _timed(shown.timing, "points"):
            u = model.node_displacements(shown.modes.shapes[:, at : at + 1])[:, :, 0]
            drawn = quick(self._drawing, model, u)
            if drawn is None:  # other parts than those that the page has
                scene, self._drawing = scene_and_drawing(model)
                scenes, drawn = (scene_message(scene),), quick(self._drawing, model, u)
                self._told = {}
            assert drawn is not None
            self._drawing, buffers = drawn
        own = {"serial": shown.ask.serial, "row": shown.row, "factor": _factor(self._drawing, buffers)}
        return (*scenes, to_message({"type": "picture", **own, "timing": shown.timing, "buffers": buffers}))

    def details(self, shown: Shown) -> Steps:
        """Steps to what takes longer, each named and giving a message: whether the description holds, facts of the
        parts, stresses, what moves, responses, how far the part may be from the model, and what is required."""
        load, response = shown.ask.load, shown.ask.response
        steps: Steps = [("holds", lambda: self._verified(shown)), ("facts", lambda: self._facts(shown))]
        if load is not None:
            steps.append(("stress", lambda: self._stress(shown, load)))
        steps.append(("motions", lambda: self._motions(shown)))
        if response is not None:
            steps.append(("response", lambda: self._response(shown, response)))
        steps.append(("model errors", lambda: self._model_errors(shown)))
        if self.described.plan.mechanism.requirements:
            steps.append(("requirements", lambda: self._requirements(shown)))
        return steps

    def _count(self, ask: Ask) -> int:
        """Modes of a design, rigid ones beside those that are asked for."""
        return ask.modes + self.described.rigid

    def problems(self, ask: Ask, error: Exception, held: Mapping[str, float]) -> list[dict[str, Any]]:
        """What is wrong with a design that failed, each with the sliders that it is said at, of those that were moved
        from the values `held`."""
        own = self.described
        if not isinstance(error, FlexuraError):
            detail = " ".join(f"{type(error).__name__}: {error}".split())[:300]
            error = SolverError(f"the numbers of this design cannot be worked with ({detail})")
        parameters: dict[str, float] = {}
        try:
            parameters = parameters_of(own.sliders, ask.values)
            own.plan.verify(parameters)
        except FlexuraError as found:
            error = found
        moved = {name for name in ask.values.keys() | held.keys() if ask.values.get(name) != held.get(name)}
        return blamed(own.plan, own.sliders, parameters, error, moved or set(ask.values))

    def _verified(self, shown: Shown) -> str:
        self.described.plan.verify(shown.parameters)
        return told("holds", serial=shown.ask.serial)

    def _facts(self, shown: Shown) -> str:
        """What changed of the facts of parts, by number, since they were last told."""
        own = facts_of(replace(self._drawing, model=shown.model))
        changed = {str(k): facts for k, facts in enumerate(own) if facts != self._told.get(k)}
        self._told = dict(enumerate(own))
        return told("facts", serial=shown.ask.serial, facts=changed)

    def _motions(self, shown: Shown) -> str:
        n = self._count(shown.ask)
        u = shown.model.node_displacements(shown.modes.shapes[:, :n])
        own = motions(shown.model, u)
        texts = {str(number): motion.summary for number, motion in zip(shown.modes.number, own, strict=False)}
        return told("motions", serial=shown.ask.serial, texts=texts)

    def _model_errors(self, shown: Shown) -> str:
        """By number of a mode how far the part may be from its frequency, in words, and why."""
        n = self._count(shown.ask)
        try:
            errors, _ = model_errors_of_modes(shown.model, min(n, shown.model.order))
            own = [{"text": text, "why": why} for text, why in zip(errors.texts, errors.causes, strict=True)]
        except FlexuraError as error:
            own = [{"text": "not known", "why": str(error)}] * n
        errors_of = {str(number): error for number, error in zip(shown.modes.number, own, strict=False)}
        return told("model errors", serial=shown.ask.serial, errors=errors_of)

    def _requirements(self, shown: Shown) -> str:
        """What is required of the design, each with its number, its verdict, and why."""
        try:
            found = requirements(self.described.plan, shown.parameters)
        except FlexuraError as error:
            return told("requirements", serial=shown.ask.serial, rows=[], limits=[], error=str(error))
        rows = [
            {"name": r.name, "text": r.text, "is": r.state, "verdict": r.verdict, "why": r.why}
            for r in found.requirements
        ]
        return told("requirements", serial=shown.ask.serial, rows=rows, limits=[str(own) for own in found.limits])

    def _stress(self, shown: Shown, load: Load) -> str:
        """Factors to yield, the least first, and the warnings of what is linear here."""
        try:
            data = _stresses(shown.model, load)
        except FlexuraError as error:
            data = {"error": str(error)}
        return told("stress", serial=shown.ask.serial, **data)

    def _response(self, shown: Shown, asked: Response) -> str | bytes:
        try:
            damping = asked.damping
            if damping is None and self._undamped:
                damping = ASSUMED_DAMPING
            found = self._responses(shown, asked, damping)
            if damping is None and not found.ratios.any():
                self._undamped, damping = True, ASSUMED_DAMPING
                found = self._responses(shown, asked, damping)
        except FlexuraError as error:
            return told("no response", serial=shown.ask.serial, error=str(error))
        notes = list(found.notes)
        if self._undamped and asked.damping is None:
            notes.insert(0, f"no damping is described: a ratio of {ASSUMED_DAMPING:g} is assumed for all modes")
        H = found.response[:, 0, 0]
        curves = Buffer.floats([found.frequency_hz, np.abs(H), np.degrees(np.unwrap(np.angle(H)))])
        own = {
            "unit": found.unit(asked.output, asked.input).replace("*", "·"),
            "notes": notes,
            "warnings": foremost(found.known, 1),
        }
        own |= {"input": asked.input, "output": asked.output, "resonances": found.resonances_hz}
        return to_message({"type": "response", "serial": shown.ask.serial, "buffers": {"curves": curves}, **own})

    @staticmethod
    def _responses(shown: Shown, asked: Response, damping: float | None) -> Any:
        if asked.high <= asked.low:
            raise OptionError("a band goes from a lower frequency to a higher one")
        ends = {"inputs": [asked.input], "outputs": [asked.output], "band": (asked.low, asked.high)}
        return frequency_response(shown.model, order="full", damping=damping, points=300, **ends)


def _factor(drawing: Drawing, buffers: dict[str, Buffer]) -> float:
    """The factor on a displacement with which its largest motion is seen well."""
    field = buffers["displacement"]
    largest = float(np.sqrt((field.stored.astype(float) ** 2).sum(axis=1).max(initial=0.0))) * (field.scale or 1.0)
    return FACTOR * drawing.solids.size() / (largest or 1.0)


def _proven(plan: Plan, parameters: dict[str, float], n: int) -> tuple[Array, Array, Array, NDArray[np.bool_], int]:
    """Frequencies and their lower and upper bounds (n,), Hz, which bound the frequency of the same number, and how many
    are those of rigid motions."""
    if not (plan.is_loaded or plan.is_posed):
        found = natural_frequencies(plan, parameters, n=n, tolerance=TOLERANCE)
        if not found.is_proven and found.frequency_hz.all() and float(found.error_bound.max()) > WIDE:
            found = found.resolved()
        if found.lower_hz.all():
            return found.frequency_hz, found.lower_hz, found.upper_hz, found.upper_hz > 0, 0
    model = chained(full_order_model(at_pose(Design.of(plan, parameters))))
    proof = certificate(model, lowest_pairs(model, n), n)
    n = min(n, len(proof.frequency_hz))
    f, lower, upper, indexed = proof.frequency_hz[:n], proof.lower_hz[:n], proof.upper_hz[:n], proof.is_indexed[:n]
    zero = np.flatnonzero((f == 0) & (lower == 0))
    return f, lower, upper, indexed, int((zero < model.rigid_motions.shape[1]).sum())


def _frequency(hz: float, lower: float, upper: float, indexed: bool, rigid: bool) -> dict[str, Any]:
    """A frequency in numbers and words, with what is wrong with it."""
    hz, lower, upper = float(hz), float(lower), float(upper)
    known = (lower if np.isfinite(lower) else None, upper if np.isfinite(upper) else None)
    proof, flag = proven_text(hz, known, indexed, rigid), ""
    if not rigid and not (indexed and lower > 0 and max(upper - hz, hz - lower) <= WIDE * lower):
        flag = f"proven only {proof}" if proof.startswith("within") else "not proven"
        flag = flag if hz else "is indistinguishable from zero"
    own = {"hz": hz, "text": f"{hz:.5g}", "proof": proof, "flag": flag, "rigid": rigid}
    return own | {"interval": ends((lower, upper), "Hz", 9) if indexed and not rigid else ""}


def _stresses(model: FullOrderModel, load: Load) -> dict[str, Any]:
    """The members nearest to yield, what the loads are in words, and warnings."""
    said: tuple[Diagnostic, ...] = ()
    if load.kind == "actuators":
        limits = [
            (i.channel.name, max(i.limits, key=abs))
            for i in Ports(model.design).inputs()
            if np.isfinite(i.limits).all()
        ]
        if not limits:
            raise OptionError("no actuator has a limit")
        states = [statics(model, actuators={name: limit}) for name, limit in limits]
        words = [f"with {name} at its limit" for name, _ in limits]
    elif load.kind == "move":
        state, text = _moved(model, load)
        states, words = [state], [text]
        said = motion_limits(States(model, state.displacement_vector[:, None]))
    else:
        states, words = [statics(model)], ["under the loads and gravity that are described"]
    u = np.column_stack([state.displacement_vector for state in states])
    weight = next((state.gravity for state in states if any(state.gravity)), None)
    stresses = member_stresses(model, u, gravity=weight)
    known = [m for m in stresses.members if m.factor_to_yield is not None]
    known.sort(key=lambda m: m.factor_to_yield or 0.0)
    rows = [
        {"member": m.name, "stress": m.von_mises, "yield": m.yield_stress, "factor": m.factor_to_yield}
        | {"when": words[m.state] if len(words) > 1 else ""}
        for m in known[:ROWS]
    ]
    unknown = len(stresses.members) - len(known)
    notes = [f"{unknown} members without a yield stress or with a section by constants"] if unknown else []
    notes += stresses.notes
    when = words[0] if len(words) == 1 else "each actuator at its limit, one at a time"
    return {"rows": rows, "when": when, "notes": notes, "warnings": foremost(said, 1)}


def _moved(model: FullOrderModel, load: Load) -> tuple[Any, str]:
    """The state in which a force or moment at a DOF moves it by an amplitude, and that in words."""
    node, _, dof = load.dof.rpartition(".")
    if dof not in DOF_NAMES:
        raise OptionError(f"{load.dof!r} is no DOF such as platform.tz")
    k = DOF_NAMES.index(dof)
    own = float(compliance(model, nodes=[node])[k, k])
    if not own > 0:
        raise OptionError(f"{load.dof} cannot move")
    wrench = np.zeros(6)
    wrench[k] = load.amplitude / own
    moved = quantity(load.amplitude, UNITS[k > 2], 4)
    text = f"with {load.dof} moved by {moved} by a {'force' if k < 3 else 'moment'} there, linear"
    return statics(model, loads={node: wrench}), text


@contextmanager
def _timed(timing: dict[str, float], name: str) -> Iterator[None]:
    """Milliseconds that something takes, under a name."""
    begun = time.perf_counter()
    yield
    timing[name] = round(1e3 * (time.perf_counter() - begun), 2)
