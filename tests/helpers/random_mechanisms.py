"""Random mechanisms: spatial chains, branches and closed loops, bodies, springs and masses, placed and nested.

Hypothesis decides the topology and the kinds of parts; sizes come from a generator that it seeds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from flexura.mechanism import (
    Box,
    Circle,
    CircularContour,
    CircularPattern,
    CornerFilletedContour,
    DiagonalStiffness,
    Flexure,
    Instance,
    Leaf,
    LinearPattern,
    Link,
    Material,
    Mechanism,
    MirrorPattern,
    Notch,
    PointMass,
    Rectangle,
    RigidBody,
    Rotation,
    RoundNotch,
    SectionConstants,
    Spring,
    Substructure,
    Tube,
)

MM = 1e-3
METALS = {"aluminium": Material(E=70e9, nu=0.33, rho=2800.0), "steel": Material(E=205e9, G=79e9, rho=7850.0)}
THEORIES = ("euler_bernoulli", "rayleigh", "timoshenko")
FEW = settings(
    deadline=None,
    max_examples=20,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
"""Settings of every property test."""


def vector(rng: np.random.Generator, size: float) -> tuple[float, float, float]:
    """Return a random vector with components up to `size`."""
    x, y, z = rng.uniform(-size, size, 3).tolist()
    return x, y, z


def across(rng: np.random.Generator, axis: np.ndarray) -> tuple[float, float, float]:
    """Return a direction at 60 to 90 degrees to an axis."""
    axis = axis / np.linalg.norm(axis)
    while True:
        v = rng.normal(size=3)
        v /= np.linalg.norm(v)
        if abs(v @ axis) < 0.5:
            return float(v[0]), float(v[1]), float(v[2])


def section(rng: np.random.Generator, kind: str) -> Any:
    """Return a section of a few millimetres."""
    a, b = rng.uniform(1.5, 4.0, 2) * MM
    match kind:
        case "rectangle":
            return Rectangle(width=a, thickness=b)
        case "circle":
            return Circle(diameter=a)
        case "tube":
            return Tube(outer_diameter=a + b, inner_diameter=b)
    Iy, Iz = a * b**3 / 12, b * a**3 / 12
    return SectionConstants(A=a * b, Iy=Iy, Iz=Iz, J=0.4 * min(Iy, Iz), ky=0.8, kz=0.9)


def profile(rng: np.random.Generator, kind: str, length: float) -> Any:
    """Return a flexure profile that fits a member of the given length."""
    width, web = rng.uniform(3.0, 6.0) * MM, rng.uniform(0.6, 1.2) * MM
    match kind:
        case "leaf":
            tapers = width > 4.5 * MM
            return Leaf(width=(width, 0.6 * width) if tapers else width, thickness=(web, 1.5 * web) if tapers else web)
        case "filleted":
            return Notch(width=width, contour=CornerFilletedContour(fillet_radius=0.2 * length, web=web))
        case "round":
            return RoundNotch(contour=CircularContour(radius=length, web=1.5 * web))
    return Notch(width=width, contour=CircularContour(radius=0.8 * length, web=web))


@st.composite
def parts(draw: st.DrawFn, nodes: int, carried: tuple[str, ...]) -> dict[str, Any]:
    """Parts over nodes n0, n1, ...: a tree of members, some loops, now and then a mass, a spring, and a body.

    The body carries one of the nodes in `carried`.
    """
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    grid = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 0, 1]])
    x = 20 * MM * grid[rng.permutation(6)[:nodes]] + rng.uniform(-3, 3, (nodes, 3)) * MM
    edges = [(draw(st.integers(0, k - 1)), k) for k in range(1, nodes)]
    spare = [(i, j) for i in range(nodes) for j in range(i + 1, nodes) if (i, j) not in edges]
    if spare:
        edges += draw(st.lists(st.sampled_from(spare), max_size=2, unique=True))
    kinds = ("rectangle", "circle", "tube", "constants", "leaf", "filleted", "round", "notch")
    links, flexures = {}, {}
    for number, (i, j) in enumerate(edges):
        kind = draw(st.sampled_from(kinds))
        offsets = [vector(rng, 2 * MM) if draw(st.booleans()) else (0.0, 0.0, 0.0) for _ in range(2)]
        axis = x[j] + offsets[1] - x[i] - offsets[0]
        common = {
            "nodes": (f"n{i}", f"n{j}"),
            "material": draw(st.sampled_from(tuple(METALS))),
            "reference": across(rng, axis),
            "start_offset": offsets[0],
            "end_offset": offsets[1],
            "theory": draw(st.sampled_from((None, *THEORIES))),
            "elements": draw(st.integers(1, 4)),
        }
        if kind in ("leaf", "filleted", "round", "notch"):
            integration = draw(st.sampled_from(("stepped", "tapered")))
            shape = profile(rng, kind, float(np.linalg.norm(axis)))
            flexures[f"f{number}"] = Flexure(profile=shape, integration=integration, **common)
        else:
            links[f"m{number}"] = Link(section=section(rng, kind), **common)
    found: dict[str, Any] = {
        "nodes": {f"n{k}": tuple(p) for k, p in enumerate(x.tolist())},
        "links": links,
        "flexures": flexures,
        "masses": {},
        "springs": {},
        "bodies": {},
    }
    any_node = st.sampled_from(sorted(found["nodes"]))
    if draw(st.booleans()):
        inertia = tuple(rng.uniform(2e-8, 3e-8, 3).tolist()) if draw(st.booleans()) else None
        mass = {"mass": rng.uniform(1e-3, 1e-2), "inertia": inertia, "offset": vector(rng, 3 * MM)}
        found["masses"]["weight"] = PointMass(node=draw(any_node), **mass)
    if draw(st.booleans()):
        stiffness = dict(zip(("tx", "ty", "tz"), (1e5 * rng.uniform(0.1, 1, 3)).tolist(), strict=True))
        stiffness |= dict(zip(("rx", "ry", "rz"), (10 * rng.uniform(0.1, 1, 3)).tolist(), strict=True))
        ends = (f"n{nodes - 1}", "n0")
        turn = Rotation(axis=vector(rng, 1.0), angle=rng.uniform(0.1, 3))
        found["springs"]["spring"] = Spring(nodes=ends, stiffness=DiagonalStiffness(**stiffness), rotate=turn)
    if carried and draw(st.booleans()):
        turn = Rotation(axis=vector(rng, 1.0), angle=rng.uniform(0.1, 3))
        size = tuple((rng.uniform(4, 9, 3) * MM).tolist())
        carries = (draw(st.sampled_from(carried)),)
        at = tuple((x[int(carries[0][1:])] + rng.uniform(3, 6, 3) * MM).tolist())
        found["bodies"]["block"] = RigidBody(
            centre=at, carries=carries, solid=Box(size=size, material="steel"), rotate=turn
        )
    return found


def patterns(rng: np.random.Generator, kind: str) -> tuple[Any, ...]:
    """Return the patterns of an instance."""
    match kind:
        case "circular":
            return (CircularPattern(count=3, axis=vector(rng, 1.0), centre=vector(rng, 10 * MM)),)
        case "mirror":
            return (MirrorPattern(normal=vector(rng, 1.0), point=vector(rng, 10 * MM)),)
        case "both":
            mirror = MirrorPattern(normal=vector(rng, 1.0), point=vector(rng, 10 * MM))
            return (mirror, LinearPattern(count=2, step=vector(rng, 60 * MM)))
    return ()


@st.composite
def mechanisms(draw: st.DrawFn, grounded: bool = True, nested: bool | None = None) -> Mechanism:
    """Mechanisms that hang together; when grounded, own nodes of the mechanism are clamped.

    Nested ones carry copies of a branch on a hub; a branch may contain a smaller one, and another body may tie the far
    ends of the branches together.
    """
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    nested = draw(st.booleans()) if nested is None else nested
    count = draw(st.integers(2, 5))
    names = tuple(f"n{k}" for k in range(count))
    own = draw(parts(count, () if nested else names[1:]))
    ground = {"n0": "clamped"} if grounded else {}
    if grounded and count > 2 and not own["bodies"] and draw(st.booleans()):
        ground[names[-1]] = "clamped"
    more: dict[str, Any] = {}
    if nested:
        size = draw(st.integers(2, 3))
        branch = draw(parts(size, ("n1",) if size == 3 else ()))
        substructures = {}
        if draw(st.booleans()):
            tip = draw(parts(2, ("n1",)))
            substructures["tip"] = Substructure(**tip, interface=("n0",))
            branch["instances"] = {"end": Instance(of="tip", at=vector(rng, 20 * MM), rotate=_turns(rng))}
            bridge = {"material": "steel", "section": Circle(diameter=2 * MM), "elements": 2}
            branch["links"]["bridge"] = Link(nodes=("n0", "end.n0"), start_offset=(0, 0, 4 * MM), **bridge)
        substructures["branch"] = Substructure(**branch, interface=("n0", f"n{size - 1}"))
        kind = draw(st.sampled_from(("single", "circular", "mirror", "both")))
        instance = Instance(of="branch", at=vector(rng, 20 * MM), rotate=_turns(rng), pattern=patterns(rng, kind))
        bodies = {"hub": _body(rng, ("n1", "branch*.n0"))}
        if draw(st.booleans()):
            bodies["rim"] = _body(rng, (f"branch*.n{size - 1}",))
        more = {"substructures": substructures, "instances": {"branch": instance}}
        own["bodies"] |= bodies
    return Mechanism(**own, **more, materials=METALS, theory=draw(st.sampled_from(THEORIES)), ground=ground)


def _turns(rng: np.random.Generator) -> tuple[Rotation, ...]:
    return tuple(Rotation(axis=vector(rng, 1.0), angle=rng.uniform(-3, 3)) for _ in range(2))


def _body(rng: np.random.Generator, carries: tuple[str, ...]) -> RigidBody:
    spread = rng.uniform(1.2, 1.8, 3) * 1e-6
    inertia = (*spread.tolist(), *(rng.uniform(-0.1, 0.1, 3) * 1e-6).tolist())
    turn = Rotation(axis=vector(rng, 1.0), angle=rng.uniform(0.1, 3))
    return RigidBody(
        centre=vector(rng, 20 * MM), carries=carries, mass=rng.uniform(0.02, 0.1), inertia=inertia, rotate=turn
    )
