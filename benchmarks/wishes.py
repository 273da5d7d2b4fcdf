"""What `design` finds for wishes that are read off the mechanisms of the gallery: is it as good as these?

A wish has what moves and how it is to be free, the box around the mechanism, its material, its thinnest web, its
process, its stroke and, as requirements, what the mechanism reaches itself by the same questions: its first frequency,
its stiffness in all directions that are no freedoms, and its margin to yield over the stroke, 2 at most. What is not in
a mechanism, which of its bodies is moved and how it is made, stands in a table here. A design is as good where all its
numbers are, whose model errors are those of the mechanism's, where none of its solids meet, and where its freedoms are
as far from its constraints as they have to be, or as the mechanism's are. Once one is found the search ends.

    .venv/bin/python benchmarks/wishes.py                    all, half an hour and more
    .venv/bin/python benchmarks/wishes.py --only z_stage     one anew; rows of others stay in wishes.csv
    .venv/bin/python benchmarks/wishes.py --wishes DIR       wish files alone

Rows go to wishes.csv one by one, designs to a folder (`--out`). The table at the end is in Markdown; `--page FILE` puts
it between the marks of a page.
"""

from __future__ import annotations

import argparse
import csv
import io
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

import flexura as fx
from flexura.deadline import time_limit
from flexura.errors import FlexuraError
from flexura.full_order import FullOrderModel, plan_of
from flexura.gallery import entries, entry
from flexura.mechanism import CATALOGUE, Mechanism, Motion, Moved, evaluated
from flexura.modelfile import read_as
from flexura.structure import Plan, solids_of
from flexura.study.questions import questions
from flexura.study.requirements import requirements
from flexura.synthesis import Candidates, Room, WishFile, design, room_of
from flexura.synthesis.drafts import ends_of
from flexura.synthesis.screening import COMPLIANCES, gap_of
from flexura.synthesis.wish import LEAST_GAP, TURNS

TABLE = Path(__file__).parent / "wishes.csv"
MARKS = ("<!-- against the gallery -->", "<!-- end of against the gallery -->")
HEAD = ("name", "freedoms", "topologies", "held_by", "met", "asked", "as_good", "gap", "own_gap", "missed", "seconds")
DOFS = ("x", "y", "z", "rx", "ry", "rz")

SOFT = 1.0
"""Stiffness, N/m, of stacks that hold nothing: they are what moves the freedoms, and gaps are asked without them."""

EDGE = 5e-3
"""Of a stack of which the mechanism does not say it, m: as in the name of its catalogue, SA050520."""

MOST_MARGIN = 2.0
"""Margin to yield that is enough."""

SECONDS, SAMPLES, MOST = 120.0, 32, 300
"""Time for each, designs of each topology at rest, and topologies."""


@dataclass(frozen=True)
class Wished:
    """What is wished of a mechanism: freedoms of a `body` about a point (3,), m, the middle of its platform by default.

    The platform is the solid of the body, or of another one that moves with it; what else moves with it is a mass
    in the middle of this, as large as gives no smaller inertia about wished axes. It is held at the `base`, and by
    a `frame` where its ground is around it. `values` are of parameters, such as a modulus of the catalogue, `more`,
    kg, what moves and is no body. `soft` are freedoms that are to be no stiffer than its own; `cannot` says what no
    wish can. `stacks` push `along` an axis; where they are several the strokes that they give are so much along each
    freedom, over each other, by `shares`.
    """

    body: str
    freedoms: tuple[str, ...]
    base: str = "z-"
    frame: bool = False
    process: str = "assembled"
    material: str = "Al-7075-T6"
    about: tuple[float, float, float] | None = None
    platform: str | None = None
    own_material: str | None = None
    size: tuple[float, ...] | None = None
    values: dict[str, float] = field(default_factory=dict)
    middle: tuple[float, float, float] | None = None
    more: float = 0.0
    more_at: tuple[float, float, float] | None = None
    soft: tuple[str, ...] = ()
    cannot: str = ""
    stacks: tuple[str, ...] = ()
    along: str = "z"
    shares: tuple[float, ...] = (1.0,)


CENTRE = (0.0, 0.0, 0.0)
STEEL, TITANIUM, ALUMINIUM = "spring-steel", "Ti-6Al-4V", "Al-6061-T6"
SILICON = {"modulus": 169e9}

WISHED = {
    "bridge": Wished("output", ("z",), process="wire-cut", stacks=("piezo",)),
    "bridge_lever": Wished("output", ("z",), process="wire-cut", stacks=("piezo",)),
    # a disc in front of its leaves: what is behind it is the base
    "butterfly": Wished("holder", ("ry",), "y+", frame=True, material=TITANIUM, about=CENTRE),
    "cartwheel": Wished("block", ("ry",), process="wire-cut", material=STEEL, about=CENTRE),
    "comb_drive": Wished(
        "shuttle", ("x",), process="printed", material="silicon", values=SILICON, more=18 * 40 * 2 * 2 * 2.33e-15
    ),
    "cross_spring": Wished("block", ("ry",), material=STEEL, own_material="17-4PH", about=CENTRE),
    # drives are on three sides of the table, of which one is the base
    "delta": Wished("table", ("x", "y", "z"), "z+", material="17-4PH", own_material="Al-7075-T6"),
    # the stage hangs below the ground
    "double_parallelogram": Wished("stage", ("x",), "z+", process="wire-cut"),
    "folded_mems": Wished("shuttle", ("x",), process="printed", material="silicon", values=SILICON),
    "folded_parallelogram": Wished("shuttle", ("x",), "y-", True, "wire-cut", TITANIUM),
    "four_bar": Wished("stage", ("ry",), process="wire-cut", about=CENTRE),
    "infinity_hinge": Wished("arm", ("ry",), "x-", material=STEEL, own_material=ALUMINIUM, about=CENTRE),
    "inverted_pendulum": Wished(
        "leg",
        ("x", "ry", "rz"),
        material=STEEL,
        platform="mass",
        soft=("x",),
        cannot="gravity, that takes away stiffness",
    ),
    # heel and lever as one; the lever and what it carries are where they have as large a moment of inertia
    "lever": Wished(
        "heel",
        ("ry",),
        process="wire-cut",
        about=(0.0, 0.0, 0.043),
        size=(0.0636, 0.008, 0.012),
        middle=(0.0282, 0.0, 0.052),
        more=0.0225,
        more_at=(0.05, 0.0, 0.052),
        stacks=("piezo",),
    ),
    "parallelogram": Wished("stage", ("x",), material=STEEL, own_material=ALUMINIUM),
    "rcm_pivot": Wished("stage", ("ry",), process="wire-cut", about=CENTRE),
    "rhombic": Wished("output", ("z",), process="wire-cut", material=STEEL, more=0.05, stacks=("piezo",)),
    # where sideways forces do not tilt it
    "rpr": Wished("platform", ("rx", "ry", "z"), process="milled", about=(0.0, 0.0, 0.0231)),
    "serpentine": Wished("plate", ("x", "y", "rz"), process="printed", material="silicon", values=SILICON),
    # plate and mirror as one disc
    "tip_tilt": Wished(
        "plate",
        ("rx", "ry"),
        frame=True,
        material=STEEL,
        own_material="fused-silica",
        about=CENTRE,
        size=(0.032, 0.009),
    ),
    # plate and mirror as one disc of the plate's steel, as heavy and with as large a moment of inertia
    "tip_tilt_piston": Wished(
        "plate",
        ("rx", "ry", "z"),
        frame=True,
        material="17-4PH",
        about=CENTRE,
        size=(0.044, 0.0086),
        stacks=("leg1.stack", "leg2.stack", "leg3.stack"),
        shares=(1 / 0.015, 1 / 0.015, 1.0),
    ),
    "wire_hexapod": Wished("plate", (), material=STEEL, own_material="Al-7075-T6", about=CENTRE),
    "xy_parallel": Wished("table", ("x", "y"), frame=True, process="wire-cut"),
    "xy_serial": Wished("table", ("x", "y"), frame=True, process="wire-cut"),
    # stacks as those of its legs, two along x and one along y
    "xy_theta": Wished(
        "table",
        ("x", "y", "rz"),
        frame=True,
        process="wire-cut",
        about=CENTRE,
        stacks=("leg1.stack", "leg2.stack", "leg3.stack"),
        along="x and y",
        shares=(1.0, 1.0, 1 / 0.02),
    ),
    "z_stage": Wished("column", ("z",), frame=True, material=STEEL, own_material=ALUMINIUM),
    "zero_stiffness": Wished(
        "beam",
        ("ry",),
        material=STEEL,
        own_material=ALUMINIUM,
        about=CENTRE,
        soft=("ry",),
        cannot="gravity, that takes away stiffness",
    ),
}

UNTOLD = {
    "bistable": "a wish has no word for a second position",
    "gripper": "a wish has one platform, and it has two fingers that move against each other",
    "scott_russell": "what it leads straight is a point of a link that turns, and a wish is of bodies",
}
"""Mechanisms of which no wish is read, and why."""


@dataclass(frozen=True)
class Reading:
    """A wish file as data, the gap of the mechanism itself, and the inertia that the wish moves over its own, by axis
    that is free to turn."""

    data: dict[str, Any]
    own_gap: float
    inertia: dict[str, float]


def read_off(name: str) -> Reading:
    """The wish of a mechanism of the gallery."""
    wished = WISHED[name]
    mechanism = _varied(fx.load(entry(name).path), wished)
    plan = plan_of(mechanism)
    model = fx.assemble(plan)
    bars, bodies = solids_of(model)
    stacks = [_stack(model, own) for own in wished.stacks]
    k = bodies.names.index(wished.platform or wished.body)
    corners = [own.pieces(n).reshape(-1, 3) for own in (bodies, bars) for n in range(len(own.names))]
    corners += [own.ends + side for own in stacks for side in own.sides]
    low, high = np.concatenate(corners).min(axis=0), np.concatenate(corners).max(axis=0)
    normal = TURNS[wished.base][:, 2]
    foot = np.where(normal > 0.5, low, np.where(normal < -0.5, high, (low + high) / 2))
    middle, half = bodies.origin[k], bodies.half[k]
    is_round = bool(bodies.is_round[k]) and abs(bodies.axes[k][0] @ normal) > 0.99
    size = wished.size or ((2 * half[1], 2 * half[0]) if is_round else tuple(np.abs(bodies.axes[k].T @ (2 * half))))
    if wished.middle is not None:
        middle = np.array(wished.middle)
    elif wished.size is not None:  # as one from the face that is nearest the base
        middle = middle + normal * (wished.size[-1] / 2 - float(half[0]))
    about = np.array(wished.about) if wished.about is not None else middle
    material = wished.own_material or wished.material
    moved = [n for n in range(len(bodies.names)) if bodies.clusters[n] == bodies.clusters[k]]
    whole = _masses(plan, bodies)
    solid = (
        CATALOGUE[material].rho * float(np.prod(size))
        if not is_round
        else CATALOGUE[material].rho * np.pi / 4 * size[0] ** 2 * size[1]
    )
    rest = sum(whole[n] for n in moved) + wished.more - float(solid)
    axes = [own for own in wished.freedoms if own[0] == "r"]
    own_inertia = {own: sum(_inertia(bodies, n, whole[n], about, own) for n in moved) for own in axes}
    if wished.more_at is not None:
        own_inertia = {own: x + wished.more * _arm(wished.more_at - about, own) for own, x in own_inertia.items()}
    alone = {own: _solid_inertia(size, is_round, normal, float(solid), middle - about, own) for own in axes}
    arms = {own: _arm(middle - about, own) for own in axes}
    for own in axes:
        if arms[own] > (0.1 * float(half.max())) ** 2:
            rest = max(rest, (own_inertia[own] - alone[own]) / arms[own])
    rest = max(rest, 0.0)
    inertia = {own: (alone[own] + rest * arms[own]) / own_inertia[own] for own in axes}
    wish: dict[str, Any] = {
        "freedoms": {"platform": list(wished.freedoms)},
        "about": _lengths(about - foot),
        "stroke": {},
        "envelope": _lengths(np.ceil((high - low) * 1e9 - 1e-3) * 1e-9),
        "base": {"plane": wished.base} | ({"frame": True} if wished.frame else {}),
        "platform": {
            "shape": "cylinder" if is_round else "box",
            "size": _lengths(size),
            "at": _lengths(middle - foot),
            "material": material,
            "mass": f"{rest:.6g} kg",
        },
        "make": {"material": wished.material, "thinnest": _mm(_thinnest(bars)), "process": wished.process},
    }
    if rest < 1e-6 * float(solid):
        del wish["platform"]["mass"]
    if stacks:
        mechanism, wish["stroke"] = _driven(mechanism, wished, about, stacks[0].free_stroke)
        wish["drives"] = {"kind": "piezo stack", "count": len(stacks), "along": wished.along, **stacks[0].data}
    else:
        wish["stroke"] = _stroke(mechanism, wished)
    if not wish["stroke"]:
        del wish["stroke"]
    read = read_as(WishFile, text_of_wish({"wish": wish}), name).wish
    asked, gap = _reached(mechanism, wished, about, room_of(read), ends_of(read, room_of(read)))
    if gap < LEAST_GAP:
        wish["gap"] = float(_down(gap))
    return Reading({"name": name, "wish": wish, "requirements": asked}, gap, inertia)


def _varied(mechanism: Mechanism, wished: Wished) -> Mechanism:
    """The mechanism by the theory of designs, and with values of parameters."""
    parameters = {
        key: own.model_copy(update={"value": wished.values[key]}) if key in wished.values else own
        for key, own in mechanism.parameters.items()
    }
    return mechanism.replaced({"corrections": "auto", "theory": "rayleigh", "parameters": parameters})


@dataclass(frozen=True)
class _Stack:
    """A piezo stack: its ends (2, 3), m, half its edge, and what its data sheet says."""

    ends: np.ndarray
    half: float
    free_stroke: float
    stiffness: float
    mass: float

    @property
    def sides(self) -> np.ndarray:
        """From its axis to its corners (8, 3), m, those along it too, which are no corners."""
        across = (self.ends[1] - self.ends[0]) / np.linalg.norm(self.ends[1] - self.ends[0])
        signs = np.array(list(product((-1.0, 1.0), repeat=3))) * self.half
        return signs - (signs @ across)[:, None] * across

    @property
    def data(self) -> dict[str, str]:
        """Its keys of a wish."""
        length = float(np.linalg.norm(self.ends[1] - self.ends[0]))
        return {
            "free_stroke": f"{1e6 * self.free_stroke:.6g} um",
            "stiffness": f"{1e-6 * self.stiffness:.6g} N/um",
            "length": _mm(length),
            "edge": _mm(2 * self.half),
            "mass": f"{1e3 * self.mass:.6g} g",
        }


def _stack(model: FullOrderModel, name: str) -> _Stack:
    """A piezo stack by its name."""
    mechanism, values = model.plan.mechanism, model.plan.parameter_values()
    *path, key = name.split(".")
    part: Any = mechanism
    if path:
        (kind,) = (own for own, copies in model.plan.topology.copies.items() if tuple(path) in copies.paths)
        part = mechanism.substructures[kind]
    stack = evaluated(part.actuators[key], values)
    half = stack.section.width / 2 if stack.section is not None else EDGE / 2
    names = list(model.plan.topology.node_names)
    ends = np.array([model.positions[names.index(".".join((*path, own)))] for own in stack.nodes])
    return _Stack(ends, half, stack.free_stroke, stack.stiffness, stack.mass)


def _with_stacks(mechanism: Mechanism, **values: Any) -> Mechanism:
    """The mechanism with other values of its stacks."""

    def other(part: Any) -> dict[str, Any]:
        return {"actuators": {key: own.model_copy(update=values) for key, own in part.actuators.items()}}

    parts = {key: own.replaced(other(own)) for key, own in mechanism.substructures.items()}
    return mechanism.replaced({**other(mechanism), "substructures": parts})


def _driven(
    mechanism: Mechanism, wished: Wished, about: np.ndarray, free_stroke: float
) -> tuple[Mechanism, dict[str, str]]:
    """The mechanism led by its stacks through the strokes that these surely give, and these, to either side."""
    mechanism = _with_stacks(mechanism, gain=None).replaced({"motion": None})
    asked = _asked_about(mechanism, wished, about)
    names = [f"coupling({stack}, about.{dof})" for dof in wished.freedoms for stack in wished.stacks]
    C = questions(plan_of(asked), ", ".join(names)).values({}).value.reshape(len(wished.freedoms), -1)
    shares = np.linalg.solve(C, np.diag(wished.shares))
    shares *= free_stroke / 2 / np.abs(shares).sum(axis=1).max()
    units = ["rad" if dof[0] == "r" else "m" for dof in wished.freedoms]
    given = [
        float(
            _sure(
                asked,
                " + ".join(f"({b:.9g} um)*{name}" for b, name in zip(1e6 * own, row, strict=True)) + f" >= 0 {unit}",
            )
        )
        for own, row, unit in zip(shares.T, np.reshape(names, C.shape), units, strict=True)
    ]
    ways = np.abs(shares).sum(axis=1) if len(shares) == 1 else shares.sum(axis=1)
    moved = {
        stack: Moved(expansion=(free_stroke / 2 - way, free_stroke / 2 + way))
        for stack, way in zip(wished.stacks, ways, strict=True)
    }
    strokes = {
        dof: f"{1e3 * own:.9g} {'mrad' if dof[0] == 'r' else 'mm'}"
        for dof, own in zip(wished.freedoms, given, strict=True)
    }
    return mechanism.replaced({"motion": Motion(move=moved)}), strokes


def _masses(plan: Plan, bodies: Any) -> list[float]:
    """Mass of each body, kg."""
    found, mechanism, values = [], plan.mechanism, plan.parameter_values()
    for n, label in enumerate(bodies.labels):
        part = mechanism
        *inner, body = label.split(".")
        for key in inner:
            part = mechanism.substructures[key]
        name = part.bodies[body].solid.material
        own = mechanism.materials.get(name) or CATALOGUE[name]
        found.append(float(evaluated(own, values).rho) * bodies.volume(n))
    return found


def _arm(away: np.ndarray, dof: str) -> float:
    """Square of the distance of a point from an axis, m^2."""
    return float(away @ away - away[DOFS.index(dof) - 3] ** 2)


def _inertia(bodies: Any, n: int, mass: float, about: np.ndarray, dof: str) -> float:
    """Moment of inertia of a body about an axis, kg m^2."""
    square = (2 * bodies.half[n]) ** 2
    own = np.array([square[1] + square[2], square[2] + square[0], square[0] + square[1]]) / 12
    if bodies.is_round[n]:
        r, length = bodies.half[n][1], 2 * bodies.half[n][0]
        own = np.array([r**2 / 2, r**2 / 4 + length**2 / 12, r**2 / 4 + length**2 / 12])
    tensor = bodies.axes[n].T @ np.diag(own) @ bodies.axes[n]
    k = DOFS.index(dof) - 3
    return mass * float(tensor[k, k] + _arm(bodies.origin[n] - about, dof))


def _solid_inertia(size: Any, is_round: bool, normal: np.ndarray, mass: float, away: np.ndarray, dof: str) -> float:
    """Moment of inertia of the platform of a wish about an axis, kg m^2."""
    k = DOFS.index(dof) - 3
    if is_round:
        r, length = size[0] / 2, size[1]
        own = r**2 / 2 if abs(normal[k]) > 0.5 else r**2 / 4 + length**2 / 12
    else:
        own = (sum(x**2 for x in size) - size[k] ** 2) / 12
    return mass * float(own + _arm(away, dof))


def _thinnest(bars: Any) -> float:
    """The thinnest place of all members, m."""
    return min(2 * min(float(own.y.min()), float(own.z.min())) for own in bars.lofts)


def _stroke(mechanism: Mechanism, wished: Wished) -> dict[str, str]:
    """What is moved, to either side, by the freedoms of the wish."""
    found = {}
    for moved in (mechanism.motion.move if mechanism.motion else {}).values():
        for dof in wished.freedoms:
            if (ends := getattr(moved, dof)) is not None:
                amount = max(abs(float(x)) for x in np.atleast_1d(ends))
                found[dof] = f"{1e3 * amount:.9g} {'mrad' if dof[0] == 'r' else 'mm'}"
    return found


def _reached(
    mechanism: Mechanism, wished: Wished, about: np.ndarray, room: Room, ends: list[str]
) -> tuple[dict[str, str], float]:
    """Requirements, what the mechanism reaches itself, and its gap, the least at rest and at the ends of its stroke, as
    that of designs."""
    mechanism = _asked_about(mechanism, wished, about)
    wanted = {"first mode": ("f1", ">=", "Hz")}
    for dof in DOFS:
        unit = "N*m/rad" if dof[0] == "r" else "N/m"
        if dof not in wished.freedoms:
            wanted[f"stiff {dof}"] = (f"stiffness(about.{dof})", ">=", unit)
        elif dof in wished.soft:
            wanted[f"soft {dof}"] = (f"stiffness(about.{dof})", "<=", unit)
    asked = {}
    for name, (question, sign, unit) in wanted.items():
        asked[name] = f"{question} {sign} {_sure(mechanism, f'{question} {sign} 1 {unit}')} {unit}"
    if CATALOGUE[wished.material].yield_stress is not None and mechanism.motion is not None:
        with suppress(FlexuraError):  # where no pose is found
            margin = _sure(mechanism, "margin >= 1 over stroke")
            asked["strong"] = f"margin >= {min(float(margin), MOST_MARGIN):g} over stroke"
    plan = plan_of(_with_stacks(mechanism, stiffness=SOFT) if wished.stacks else mechanism)
    states = [[name + at for name in COMPLIANCES] for at in ("", *(f" at {pose}" for pose in ends))]
    gaps = [float(gap_of(questions(plan, each).values({}).value, room)[0]) for each in states]
    return asked, min(own for own in gaps if own > 0)  # of those that are known


def _asked_about(mechanism: Mechanism, wished: Wished, about: np.ndarray) -> Mechanism:
    """The mechanism with the point of the wish as a node of what is moved."""
    body = mechanism.bodies[wished.body]
    bodies = mechanism.bodies | {wished.body: body.replaced({"carries": (*(body.carries or ()), "about")})}
    nodes = (mechanism.nodes or {}) | {"about": tuple(float(x) for x in about)}
    return mechanism.replaced({"bodies": bodies, "nodes": nodes})


def _sure(mechanism: Mechanism, text: str) -> str:
    """What a mechanism reaches of a requirement wherever in its model error the part is, in three digits."""
    (own,) = requirements(mechanism.replaced({"requirements": {"own": text}})).requirements
    low, high = own.model_error or (0.0, 0.0)
    return _down(own.value * (1 + low)) if ">=" in text else _up(own.value * (1 + high))


def _down(value: float) -> str:
    """A limit in three digits, no more than the number."""
    digits = 10.0 ** (np.floor(np.log10(value)) - 2)
    return f"{np.floor(value / digits * (1 + 1e-12)) * digits:.3g}"


def _up(value: float) -> str:
    """A limit in three digits, no less than the number."""
    digits = 10.0 ** (np.floor(np.log10(value)) - 2)
    return f"{np.ceil(value / digits * (1 - 1e-12)) * digits:.3g}"


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.7g} mm"


def _lengths(metres: Any) -> list[str]:
    return [_mm(float(x) if abs(float(x)) > 1e-12 else 0.0) for x in metres]


def text_of_wish(data: dict[str, Any]) -> str:
    """A wish as the text of a file."""
    yaml, to = YAML(), io.StringIO()
    yaml.width = 200
    yaml.dump(data, to)
    return to.getvalue()


class _AsGoodError(Exception):
    """A design is as good, and no better one is looked for."""


def compared(name: str, folder: Path, seconds: float, samples: int) -> dict[str, Any]:
    """The row of a mechanism: what is asked, the best design, what it misses."""
    row: dict[str, Any] = dict.fromkeys(HEAD, "") | {"name": name, "as_good": "not asked"}
    if name in UNTOLD:
        return row | {"missed": UNTOLD[name]}
    reading = read_off(name)
    row |= {"own_gap": f"{reading.own_gap:.3g}", "freedoms": " ".join(WISHED[name].freedoms) or "none"}
    row["asked"] = len(reading.data["requirements"]) + 2 + len(WISHED[name].shares) * bool(WISHED[name].stacks)
    folder.mkdir(parents=True, exist_ok=True)
    wish = folder / "wish.yaml"
    wish.write_text(text_of_wish(reading.data), encoding="utf-8")
    last: list[Candidates] = []

    def found(own: Candidates) -> None:
        last.append(own)
        if own.candidates[0].meets_all:
            raise _AsGoodError

    start = time.monotonic()
    error = ""
    try:
        with time_limit(seconds):
            design(
                wish,
                folder=folder / "designs",
                samples=samples,
                most=MOST,
                verify=False,
                workers=1,
                found=found,
            )
    except _AsGoodError:
        pass
    except FlexuraError as own:
        error = str(own)
    row["seconds"] = f"{time.monotonic() - start:.0f}"
    if not last:
        return row | {"as_good": "no", "missed": error}
    best = last[-1].candidates[0]
    row |= {"topologies": last[-1].n_topologies, "held_by": best.topology, "met": best.n_met, "gap": f"{best.gap:.3g}"}
    missed = [f"{own.name} {own.value / own.limit - 1:+.0%}" for own in best.requirements if own.verdict == "missed"]
    missed += [f"{own.name} not known" for own in best.requirements if own.verdict == "not known"]
    missed += [f"gap {best.gap:.2g}"] * (best.gap < best.least_gap) + ["clashes"] * bool(best.clashes)
    return row | {"as_good": "yes" if best.meets_all else "no", "missed": ", ".join(missed)}


def _rows() -> dict[str, dict[str, Any]]:
    if not TABLE.exists():
        return {}
    with TABLE.open(encoding="utf-8", newline="") as file:
        return {row["name"]: dict(row) for row in csv.DictReader(file)}


def _keep(row: dict[str, Any]) -> None:
    rows = _rows() | {row["name"]: row}
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        to = csv.DictWriter(file, HEAD, lineterminator="\n")
        to.writeheader()
        to.writerows(rows[name] for name in sorted(rows))


def table() -> str:
    """All rows in Markdown."""
    rows = sorted(_rows().values(), key=lambda row: row["name"])
    good = sum(row["as_good"] == "yes" for row in rows)
    lines = [
        f"A design at least as good is found for {good} of the {len(rows)} mechanisms.",
        "",
        "| mechanism | freedoms | as good | best design is held by | met | missed | seconds |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        met = f"{row['met']} of {row['asked']}" if row["met"] else ""
        cells = (row["name"], row["freedoms"], row["as_good"], row["held_by"], met, row["missed"], row["seconds"])
        lines.append("| " + " | ".join(str(own).replace("|", "/").replace("\n", " ") for own in cells) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=None, metavar="NAME")
    parser.add_argument("--wishes", type=Path, metavar="DIR")
    parser.add_argument("--out", type=Path, metavar="DIR")
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--page", type=Path, metavar="FILE")
    own = parser.parse_args()
    names = [each.name for each in entries()] if own.only is None else own.only
    if own.wishes:
        own.wishes.mkdir(parents=True, exist_ok=True)
        for name in names:
            if name in WISHED:
                (own.wishes / f"{name}.yaml").write_text(text_of_wish(read_off(name).data), encoding="utf-8")
        return
    with tempfile.TemporaryDirectory() as scratch:
        for name in names:
            row = compared(name, (own.out or Path(scratch)) / name, own.seconds, own.samples)
            _keep(row)
            print(
                *(row[key] for key in ("name", "as_good", "held_by", "met", "asked", "missed", "seconds")),
                sep=" | ",
                flush=True,
            )
    print(table())
    if own.page:
        before, rest = own.page.read_text(encoding="utf-8").split(MARKS[0])
        after = rest.split(MARKS[1])[1]
        own.page.write_text(f"{before}{MARKS[0]}\n\n{table()}\n\n{MARKS[1]}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
