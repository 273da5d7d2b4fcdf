"""Random mechanisms that are hard on arithmetic.

Stages of leaves and notches, bodies and springs whose stiffness and mass differ by up to twelve decades, webs of
micrometres, nearly equal parts, parts that float, and very soft supports.
"""

from __future__ import annotations

import numpy as np

import flexura as fx

MM = 1e-3


def _flexure(rng: np.random.Generator, ends: tuple[str, str], thickness: float, elements: int) -> fx.describe.Flexure:
    width = float(rng.choice([5, 20])) * MM
    corrections = "none" if rng.random() < 0.5 else "auto"
    profile = fx.describe.Leaf(width=width, thickness=thickness)
    if rng.random() < 0.3:
        contour = fx.describe.CircularContour(radius=25 * MM, web=thickness)
        profile = fx.describe.Notch(width=width, contour=contour)
        elements = max(elements, 2)
    integration = "tapered" if rng.random() < 0.3 and profile.type == "notch" else "stepped"
    return fx.describe.Flexure(
        nodes=ends,
        material="spring-steel",
        reference="x",
        profile=profile,
        elements=elements,
        corrections=corrections,
        integration=integration,
    )


def nasty(seed: int) -> fx.Mechanism:
    """A mechanism of up to a hundred degrees of freedom or so; the same for the same seed."""
    rng = np.random.default_rng(seed)
    stages = int(rng.integers(1, 4))
    elements = int(rng.choice([1, 1, 2, 3, 6]))
    spread = float(rng.choice([0.0, 1e-12, 1.0, 3.0]))
    base = 10.0 ** rng.uniform(-2, 0) * MM
    nodes: dict[str, tuple[float, float, float]] = {}
    flexures, bodies, springs, ground = {}, {}, {}, {}
    away = float(rng.choice([0.0, 0.0, 1.2, 30.0]))
    floats = rng.random() < 0.2
    height = 0.0
    for stage in range(stages):
        heads = []
        beside = 0.1 * stage if rng.random() < 0.5 else 0.0
        foot = "ground" if stage == 0 or beside else f"c{stage - 1}"
        for k in range(int(rng.integers(1, 4))):
            x = away + beside + 0.02 * k
            a, b = f"b{stage}_{k}", f"h{stage}_{k}"
            bottom = height if foot != "ground" else 0.0
            nodes[a], nodes[b] = (x, away, bottom), (x, away, bottom + 0.05)
            if spread < 1:
                thickness = base * (1 + spread * k)
            else:
                thickness = min(base * 10.0 ** rng.uniform(-spread, spread / 3), 20 * MM)
            flexures[f"f{stage}_{k}"] = _flexure(rng, (a, b), max(thickness, 1e-7), elements)
            heads.append(b)
            if foot == "ground":
                if not floats:
                    ground[a] = "clamped"
            else:
                bodies[foot] = bodies[foot].model_copy(update={"carries": (*bodies[foot].carries, a)})
        mass = 10.0 ** rng.uniform(-4, 2)
        z = nodes[heads[0]][2] + 0.005
        inertia = tuple(float(v) for v in mass * 1e-4 * rng.uniform(0.8, 1.2, 3))
        bodies[f"c{stage}"] = fx.describe.RigidBody(
            centre=(away + beside, away, z), mass=mass, inertia=inertia, carries=tuple(heads)
        )
        height = z + 0.01
    for stage in range(1, stages):
        values = {name: 10.0 ** rng.uniform(-3, 9) for name in ("tx", "ty", "tz")}
        values |= {name: 10.0 ** rng.uniform(-5, 6) for name in ("rx", "ry", "rz")}
        ends = (f"c{stage - 1}", f"c{stage}")
        springs[f"between{stage}"] = fx.describe.Spring(nodes=ends, stiffness=fx.describe.DiagonalStiffness(**values))
    for k in range(int(rng.integers(0, 3))):
        pair = rng.choice(sorted(bodies), size=min(2, len(bodies)), replace=False).tolist()
        own = [pair[0]] if len(pair) < 2 or (not floats and rng.random() < 0.3) else pair
        values = {name: 10.0 ** rng.uniform(-6, 9) for name in rng.choice(["tx", "ty", "tz"], 2, replace=False)}
        springs[f"k{k}"] = fx.describe.Spring(nodes=tuple(own), stiffness=fx.describe.DiagonalStiffness(**values))
    return fx.Mechanism(nodes=nodes, flexures=flexures, bodies=bodies, springs=springs, ground=ground)


def slender(elements: int, support: float) -> fx.Mechanism:
    """Two bodies joined by one leaf of so many elements, held by a very soft spring along it alone."""
    leaf = fx.describe.Leaf(width=20 * MM, thickness=0.5 * MM)
    flexure = fx.describe.Flexure(
        nodes=("a", "b"), material="spring-steel", reference="x", profile=leaf, elements=elements, corrections="none"
    )
    return fx.Mechanism(
        nodes={"a": (0, 0, 0), "b": (0, 0, 50 * MM)},
        flexures={"leaf": flexure},
        bodies={
            "base": fx.describe.RigidBody(
                centre=(0, 0, -5 * MM), mass=10.0, inertia=(0.01, 0.01, 0.01), carries=("a",)
            ),
            "head": fx.describe.RigidBody(centre=(0, 0, 55 * MM), mass=1.0, inertia=(1e-3, 1e-3, 1e-3), carries=("b",)),
        },
        springs={"bungee": fx.describe.Spring(nodes=("base",), stiffness=fx.describe.DiagonalStiffness(tz=support))},
    )
