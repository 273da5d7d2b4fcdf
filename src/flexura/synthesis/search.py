"""From all topologies of a wish to a few mechanisms: sizes sampled at rest, the best led through their strokes, and
the best of these optimised."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from flexura._version import __version__
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener, Progress, no_listener, time_limit
from flexura.errors import FlexuraError, OptionError
from flexura.files import write_file
from flexura.full_order import plan_of
from flexura.mechanism import CATALOGUE, Mechanism, Parameter, with_rigid_bodies
from flexura.modelfile import read_as, save, text_of
from flexura.study.engine import blocks_of
from flexura.study.optimum import Optimum, optimize
from flexura.study.questions import questions, relation
from flexura.study.requirements import described_relations, requirements
from flexura.synthesis.bending import strain_over_stroke
from flexura.synthesis.drafts import draft
from flexura.synthesis.result import LEAST_GAP, Candidate, Candidates, freedoms_in_short
from flexura.synthesis.topologies import Topology, topologies
from flexura.synthesis.wish import DOFS, Room, Wish, WishFile, room_of, si
from flexura.thresholds import ROUND_OFF, STILL

SAMPLES = 64
"""Designs of each topology at rest."""

FINALISTS = 24
"""Topologies that are led through their strokes."""

OPTIMISED = 6
"""Of these that are optimised, the best of each set of kinds and numbers of limbs."""

SPARE = 2.2
"""Yield strain over that of the limbs, roughly, where a margin of stress is required."""

SLACK = 0.1
"""What optima are to have to spare, over the limits."""

OPTIMUM_SECONDS = 60.0
"""Seconds for each of these."""


@dataclass(frozen=True)
class Screening:
    """Designs of topologies at rest, one topology after another: what a worker is sent.

    A block has the values of the best design of a topology, `value`, in the order of its parameters, the margins of
    the requirements that are asked at rest, nan where there is none, the `gap`, and the `score` by which it is best.
    """

    file: WishFile
    room: Room
    listed: tuple[Topology, ...]
    samples: int

    @property
    def blocks(self) -> int:
        """How many topologies there are."""
        return len(self.listed)

    def designs(self, *numbers: int) -> str:
        """Topologies in words."""
        return f"topology {', '.join(str(n + 1) for n in numbers)}"

    @cached_property
    def at_rest(self) -> dict[str, str]:
        """Requirements that ask nothing at poses, of strokes or stresses."""
        return {name: text for name, text in self.file.requirements.items() if _is_at_rest(text)}

    @cached_property
    def allowed(self) -> float:
        """The strain that limbs are to have at most at the end of the stroke, by the material and what is required."""
        material = CATALOGUE[self.file.wish.make.material]
        required = any("margin" in text or "stress" in text for text in self.file.requirements.values())
        return si(material.yield_stress or np.inf) / si(material.E) / (SPARE if required else 1.0)

    def __call__(self, number: int) -> dict[str, Array]:
        """The best design of a topology."""
        own = self.listed[number]
        plan = plan_of(with_rigid_bodies(draft(own, self.file, self.room, "draft")))
        parameters = plan.mechanism.parameters
        low, high = (np.array([float(getattr(p, end)) for p in parameters.values()]) for end in ("minimum", "maximum"))
        unit = qmc.Halton(len(low), seed=np.random.default_rng(number)).random(self.samples)
        drawn = [float(p.value) for p in parameters.values()]  # type: ignore[arg-type]
        values = np.concatenate([[drawn], low + unit * (high - low)])
        designs = dict(zip(parameters, values.T, strict=True))
        relations = [relation(plan, text) for text in self.at_rest.values()]
        margins = np.array([own.margin(designs) for own in relations]).reshape(len(relations), len(values))
        gaps = gap_of(questions(plan, ", ".join(_COMPLIANCES)).values(designs).value, self.room)
        spare = self.allowed / np.maximum(strain_over_stroke(own, designs, self.file.wish, self.room), ROUND_OFF)
        with np.errstate(divide="ignore"):
            apart = np.minimum(np.log(gaps / LEAST_GAP), np.log(spare)) / 3
        score = np.minimum(apart, margins.min(axis=0, initial=1.0))
        best = int(np.nanargmax(np.where(np.isfinite(score), score, -np.inf)))
        return {
            "value": values[best],
            "margins": margins[:, best],
            "gap": np.asarray(gaps[best]),
            "score": np.asarray(score[best]),
        }


_COMPLIANCES = [f"compliance(about.{a}, about.{b})" for i, a in enumerate(DOFS) for b in DOFS[i:]]
_AT = [(i, j) for i in range(6) for j in range(i, 6)]


def gap_of(compliances: Array, room: Room) -> Array:
    """How many times as compliant the stiffest wished freedom is as the softest of what is not wished (n,), of
    designs with compliances (n, 21) of the point of the wish, rotations counted at half the length of the room;
    infinite where nothing is wished."""
    C = np.zeros((len(compliances), 6, 6))
    for (i, j), own in zip(_AT, compliances.T, strict=True):
        C[:, i, j] = C[:, j, i] = own
    scale = np.repeat([1.0, room.freedoms.length / 2], 3)
    C = C * scale[:, None] * scale
    F = _twists_about(room) / scale[:, None]
    U, s, _ = np.linalg.svd(F)
    k = int((s > 1e-9).sum())
    free, rest = U[:, :k], U[:, k:]
    bad = ~np.isfinite(C).all(axis=(1, 2))
    C[bad] = 0.0
    softest = np.linalg.eigvalsh(rest.T @ C @ rest)[:, -1] if k < 6 else np.zeros(len(C))
    stiffest = np.linalg.eigvalsh(free.T @ C @ free)[:, 0] if k else np.full(len(C), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(bad, np.nan, stiffest / np.maximum(softest, 1e-300))


def _twists_about(room: Room) -> Array:
    """The wished freedoms (6, f) as twists of the point of the wish, global frame."""
    units = np.repeat([room.freedoms.length, 1.0], 3)[:, None]
    F = room.freedoms.basis * units
    v = F[:3] + np.cross(F[3:], room.about, axisa=0, axisc=0)
    return np.concatenate([room.turn @ v, room.turn @ F[3:]])


def _is_at_rest(text: str) -> bool:
    return not any(word in text for word in (" at ", " over ", "margin", "stress", "reach", "buckling", " under "))


@verb
def design(
    wish: str | Path,
    *,
    folder: str | Path,
    most: int = 300,
    samples: int = SAMPLES,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Listener | None = None,
    found: Callable[[Candidates], object] | None = None,
) -> Candidates:
    """Mechanisms that do what a wish file asks for, best first, written into a folder as mechanism files.

    All topologies of the grammar are listed, and of the plainest, `most` of them, `samples` designs each worked out at
    rest; the best are led through their strokes, and the best of these optimised. What is done of a wish is kept in the
    folder, and the same call goes on there; `found` is told of the candidates as soon as there are some, and whenever
    one is better. Raises ModelError for what is wrong with the wish, and OptionError where nothing is found.
    """
    text = text_of(Path(wish))
    file = read_as(WishFile, text, str(wish))
    report = progress or no_listener
    room = room_of(file.wish)
    _sane(room)
    report(Progress("topologies"))
    listed = topologies(room, file.wish.make.process, si(file.wish.make.thinnest))
    if not listed:
        raise OptionError(_nothing(file, room))
    described_relations(plan_of(draft(listed[0], file, room, file.name)))  # what cannot be asked is told before
    work = Screening(file, room, tuple(listed[:most]), samples)
    store = Store(Path(folder), text, most, samples)
    left, remarks = (n for n in range(work.blocks) if n not in store.known), list[str]()
    with closing(blocks_of(work, left, workers, scheduler, remarks.append)) as blocks:
        for number, columns in blocks:
            store.add(number, {name: value.tolist() for name, value in columns.items()})
            report(Progress("topologies at rest", len(store.known), work.blocks))
    scores = {n: known["score"] for n, known in store.known.items() if np.isfinite(known["score"])}
    finalists = sorted(scores, key=lambda n: -scores[n])[:FINALISTS]
    if not finalists:
        raise OptionError(f"none of the {work.blocks} topologies has a design that can be worked out at rest")
    judged = []
    for k, n in enumerate(finalists):
        report(Progress("strokes of the best", k, len(finalists)))
        judged.append(_judged(work, n, store.known[n]))

    def written() -> Candidates:
        judged.sort(key=lambda own: own.rank)
        told = (*_notes(len(listed), most), *remarks)
        candidates = tuple(_written(own, k, Path(folder)) for k, own in enumerate(judged))
        counts = {"n_topologies": len(listed), "n_at_rest": work.blocks, "n_designs": work.blocks * (samples + 1)}
        short = freedoms_in_short(room.freedoms)
        ruled_out = _ruled_out(work, store)
        result = Candidates(file.name, short, **counts, candidates=candidates, ruled_out=ruled_out, notes=told)
        text = json.dumps(result.to_dict(), indent=1) + "\n"
        write_file(Path(folder) / "design.json", lambda to: to.write_text(text, encoding="utf-8"))
        if found is not None:
            found(result)
        return result

    result = written()
    best = list(
        {tuple((p.kind.name, p.count) for p in own.topology.patterns): own for own in reversed(judged)}.values()
    )
    best = sorted(best, key=lambda own: own.rank)[:OPTIMISED]
    for k, own in enumerate(best):
        report(Progress("optima of the best", k, len(best)))
        better = _bettered(own, work)
        if better is not own:
            judged[judged.index(own)] = better
            result = written()
    return result


def _notes(found: int, most: int) -> tuple[str, ...]:
    told = [
        "posts and ground are not drawn and rigid here; limbs are clear of each other as first drawn, check each file"
    ]
    if found > most:
        told.append(f"{found - most} topologies, those with the most limbs, were listed and not worked out")
    return tuple(told)


class Store:
    """What is known of the topologies of a wish, by number, in a file that grows line by line."""

    def __init__(self, folder: Path, text: str, most: int, samples: int) -> None:
        mark = hashlib.sha256(f"{__version__}\n{samples}\n{text}".encode()).hexdigest()
        self.path: Path = folder / "at_rest.jsonl"
        self.known: dict[int, dict[str, Any]] = {}
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lines = self.path.read_text(encoding="utf-8").splitlines() if self.path.exists() else []
        except OSError as error:
            raise OptionError(f"{folder} cannot be written to: {error.strerror}") from None
        if lines and lines[0] != json.dumps({"wish": mark}):
            raise OptionError(f"{folder} has the designs of another wish; name another folder")
        for line in lines[1:]:
            with suppress(ValueError):  # of a line that was cut off
                own = json.loads(line)
                if own["number"] < most:
                    self.known[own.pop("number")] = own
        if not lines:
            self.path.write_text(json.dumps({"wish": mark}) + "\n", encoding="utf-8")

    def add(self, number: int, columns: dict[str, Any]) -> None:
        """Keep what a topology came to."""
        self.known[number] = columns
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"number": number, **columns}) + "\n")


def _sane(room: Room) -> None:
    """Refuse what contradicts itself."""
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    if (room.outside(room.middle + signs * room.platform) > STILL * room.size).any():
        rule = "wish.platform: it is not within the envelope, which stands on the base"
        raise OptionError(f"{rule}; make it smaller or move it")
    if room.freedoms.dimension == 6:
        raise OptionError("wish.freedoms: all six are free, so that nothing is to be held")


def _nothing(file: WishFile, room: Room) -> str:
    """Why there is no topology, in words."""
    lines = room.wrenches.lines().dimension
    text = f"no topology of the grammar holds this by {file.wish.make.process} limbs"
    if lines < room.wrenches.dimension:
        return (
            f"{text}: lines span {lines} of the {room.wrenches.dimension} constraints, so that wires and leaves alone"
            " cannot, and no guide that fits the envelope can; give it more room, or wish other freedoms"
        )
    return (
        f"{text} in this envelope: give it more room around the platform, or move the platform so that the lines that"
        " are borne meet it; rotations pass through `about`"
    )


@dataclass(frozen=True, eq=False)
class _Judged:
    """A mechanism with its requirements."""

    mechanism: Mechanism
    topology: Topology
    candidate: Candidate

    @property
    def rank(self) -> tuple[float, float]:
        """First those that meet the most, of these those that meet them by the most."""
        return -self.candidate.n_met, -self.candidate.least_margin


def _judged(work: Screening, number: int, known: dict[str, Any]) -> _Judged:
    own = work.listed[number]
    mechanism = draft(own, work.file, work.room, f"{work.file.name}, {own.name}")
    values = dict(zip(mechanism.parameters, known["value"], strict=True))
    return _looked_at(_with_values(mechanism, values), own, work)


def _with_values(mechanism: Mechanism, values: dict[str, float]) -> Mechanism:
    parameters = {
        name: own.model_copy(update={"value": _rounded(values[name], own)}) if name in values else own
        for name, own in mechanism.parameters.items()
    }
    return mechanism.replaced({"parameters": parameters})


def _rounded(value: float, own: Parameter) -> float:
    """A size to be read, within its limits."""
    low, high = float(own.minimum or -np.inf), float(own.maximum or np.inf)  # type: ignore[arg-type]
    return float(np.clip(float(f"{value:.4g}"), low, high))


def _looked_at(mechanism: Mechanism, own: Topology, work: Screening) -> _Judged:
    """A mechanism with its requirements worked out, strokes included."""
    plan = plan_of(mechanism)
    found = requirements(plan).requirements if mechanism.requirements else ()
    asked = questions(plan, ", ".join(["f1", "mass", *_COMPLIANCES])).values({}).value[0]
    gap = float(gap_of(asked[None, 2:], work.room)[0])
    return _Judged(
        mechanism,
        own,
        Candidate(
            file="",
            topology=own.name,
            freedoms=freedoms_in_short(work.room.freedoms),
            limbs=own.n_limbs,
            over=own.over,
            gap=gap,
            first_hz=float(asked[0]),
            mass=float(asked[1]),
            requirements=found,
        ),
    )


def _bettered(own: _Judged, work: Screening) -> _Judged:
    """The same topology at its highest first frequency within what is required, where that is better."""
    try:
        stiff = with_rigid_bodies(own.mechanism)
        with time_limit(OPTIMUM_SECONDS):
            best = optimize(
                stiff,
                vary=list(stiff.parameters),
                maximise="f1",
                subject_to=[*map(_with_slack, work.file.requirements.values()), *_apart(work.file.wish, work.room)],
                requirements=False,
                starts=1,
            )
        assert isinstance(best, Optimum)
        values = {variable.name: variable.value for variable in best.variables}
        bettered = _looked_at(_with_values(own.mechanism, values), own.topology, work)
    except FlexuraError:
        return own
    return min(own, bettered, key=lambda one: one.rank)


def _with_slack(text: str) -> str:
    """A requirement with something to spare."""
    left, sign, right = text.partition(">=") if ">=" in text else text.partition("<=")
    limit, *where = re.split(r"(?= (?:over|at|under) )", right, maxsplit=1)
    return f"{left.strip()} {sign} {1 + SLACK if sign == '>=' else 1 - SLACK}*({limit.strip()}){''.join(where)}"


def _apart(wish: Wish, room: Room) -> list[str]:
    """That freedoms along and about global axes are so many times as compliant as all else."""
    free = wish.freedoms.platform
    if not free or len(free) == 6:
        return []
    length = f"({1e3 * room.freedoms.length / 2:.6g} mm)^2"
    scaled = {name: f"compliance(about.{name})" + (f"*{length}" if name[0] == "r" else "") for name in DOFS}
    return [f"{scaled[a]} >= {LEAST_GAP * (1 + SLACK):g}*{scaled[b]}" for a in free for b in DOFS if b not in free]


def _ruled_out(work: Screening, store: Store) -> dict[str, int]:
    """How many topologies miss each requirement that is asked at rest, in the best design that was found."""
    counts = dict.fromkeys(["freedoms", *work.at_rest], 0)
    for known in store.known.values():
        counts["freedoms"] += not known["gap"] >= LEAST_GAP
        for name, margin in zip(work.at_rest, known["margins"], strict=True):
            counts[name] += not margin >= 0
    return counts


def _written(own: _Judged, number: int, folder: Path) -> Candidate:
    """The candidate with its file written."""
    name = f"candidate-{number + 1:02d}.yaml"
    save(own.mechanism, folder / name)
    return replace(own.candidate, file=name)
