"""What large motion must be whatever the mechanism: its limit at rest, its derivatives, and what leaves it alone."""

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import scipy.linalg as la
from numpy.typing import NDArray

import flexura as fx
from flexura.mechanism import with_rigid_roots
from flexura.motion.elements import Frames
from flexura.motion.equilibrium import NO_LOADS, Drive, Equations, Equilibrium, Loads
from flexura.motion.model import MovingModel
from flexura.motion.path import Path as Way
from flexura.motion.path import Point, Stopped
from flexura.motion.se3 import Logarithm, rotation, rotation_vector
from helpers.large_motion import Moved, condensed, inside_strips, straight_beams
from helpers.oscillators import dense

Array = NDArray[np.float64]

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(str(path.relative_to(EXAMPLES)) for path in EXAMPLES.rglob("*.yaml"))
NO_GRAVITY = np.zeros(3)
GRAVITY = np.array([1.0, -3.0, -9.0])


class Case(NamedTuple):
    """An example, its drives with how far they move, and a node with loads in N and N m."""

    file: str
    move: dict[str, float]
    loaded: str
    load: float


CASES = {
    "guide": Case("guide/guide.yaml", {"carriage.x": 0.02, "carriage.rz": 0.03}, "carriage", 2.0),
    "pivot": Case("pivot/pivot.yaml", {"arm.ry": 1.2}, "arm", 0.2),
    "amplifier": Case("amplifier/amplifier.yaml", {"output.z": -3e-4}, "right", 2.0),
    "imported": Case("imported/guide.yaml", {"carriage.x": 0.01, "tip.z": -2e-3}, "tip", 1.0),
    "piezo": Case("rpr/rpr_piezo.yaml", {"platform.z": 5e-4, "platform.rx": 5e-3}, "platform", 1.0),
}


class State(NamedTuple):
    """Equilibrium of a case with everything on at once."""

    equations: Equations
    loads: Loads
    state: Equilibrium


def equations_of(case: Case, is_rigid: bool = False) -> Equations:
    mechanism = fx.load(EXAMPLES / case.file)
    design = fx.assemble(with_rigid_roots(mechanism) if is_rigid else mechanism).design
    model = MovingModel.of(design)
    drives = []
    for name in case.move:
        node, axis = name.rsplit(".", 1)
        number = int(design.plan.topology.numbers([node])[0])
        component = ("x", "y", "z", "rx", "ry", "rz").index(axis)
        drives.append(Drive(name, number, int(model.root[number]), component))
    return Equations(model, drives)


def reached(equations: Equations, targets: Array, loads: Loads) -> Equilibrium:
    zero = np.zeros(len(targets))
    start = equations.solve(equations.model.rest, NO_LOADS, zero)
    for state in Way(equations, start, Point(zero, NO_LOADS)).through([Point(targets, loads)]):
        assert not isinstance(state, Stopped)
        return state
    raise AssertionError


@cache
def moved(name: str, follower: bool = True, weight: bool = True, is_rigid: bool = False) -> State:
    case = CASES[name]
    equations = equations_of(case, is_rigid)
    node = int(equations.model.design.plan.topology.numbers([case.loaded])[0])
    wrench = case.load * np.array([0.3, -1.0, 0.7, 0.02, 0.01, -0.03])
    loads = Loads(
        {node: wrench * [1, 1, 1, 0, 0, 0]},
        {node: -0.5 * wrench} if follower else {},
        GRAVITY if weight else NO_GRAVITY,
    )
    return State(equations, loads, reached(equations, np.array(list(case.move.values())), loads))


def smooth(state: State, seed: int) -> Array:
    """A direction (n,) as a random load would move the mechanism, at most 1 rad or the size of the mechanism."""
    K, scale = state.state.tangent.K, state.equations.scale
    load = np.random.default_rng(seed).standard_normal(K.shape[0]) * scale
    step = np.linalg.solve(K.toarray(), load)
    return step / np.abs(step * scale).max()


def differences(of, h: float):
    """The derivative by a step at zero: central differences, extrapolated by Richardson's rule to sixth order."""
    coarse, middle, fine = ((of(s) - of(-s)) / (2 * s) for s in (h, h / 2, h / 4))
    first, second = (4 * middle - coarse) / 3, (4 * fine - middle) / 3
    return (16 * second - first) / 15


def moves(state: State, force: Array) -> float:
    """How far forces (n,) move the mechanism, over its size or in rad: what an error of them matters."""
    step = np.linalg.solve(state.state.tangent.K.toarray(), force)
    return float(np.abs(step * state.equations.scale).max())


def scaled(A: Array, B: Array) -> float:
    """The largest difference of symmetric matrices, by the diagonal of the second."""
    d = np.sqrt(np.abs(np.diag(B)))
    d[d == 0] = 1.0
    return float(np.abs((A - B) / np.outer(d, d)).max())


@pytest.mark.parametrize("file", FILES)
def test_at_rest_it_is_the_linear_model(file):
    """But for what strips resist where their torque is uneven: loads at their ends move them alike."""
    full = fx.assemble(fx.load(EXAMPLES / file))
    model = MovingModel.of(full.design)
    forces = model.forces(model.rest, NO_GRAVITY)
    assert np.abs(forces.force).max() == 0
    K, expected, close = model.pattern.dense(forces.blocks), full.K.toarray(), 1e-12
    if inner := inside_strips(model):
        K, expected, close = condensed(K, inner), condensed(expected, inner), 1e-9
    assert scaled(K, expected) < close
    assert scaled(dense(model.mass(model.rest)), full.M.toarray()) < 1e-12
    weight = Equations(model).free(-model.forces(model.rest, GRAVITY).force)
    expected = full.base_inertia_forces[:, :3] @ GRAVITY
    assert np.abs(weight - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("name", CASES)
def test_tangent_is_the_derivative_of_forces(name):
    """With weight, dead and follower loads and drives on, in a state far from rest."""
    state = moved(name)
    equations, (frames, multipliers, _, tangent, _) = state.equations, state.state

    def held(frames: Frames) -> Array:
        at, missing = equations.tangent(frames, state.loads, multipliers)
        return -missing - at.rows.T @ multipliers

    for seed in range(2):
        v = smooth(state, seed)
        got = differences(lambda s, v=v: held(frames.moved(equations.displacements(s * v))), 2e-3)
        assert moves(state, got - tangent.K @ v) < 1e-7, "against 1 of the direction"


@pytest.mark.parametrize("name", CASES)
def test_force_is_the_gradient_of_energy(name):
    state = moved(name)
    model, frames = state.equations.model, state.state.frames
    force = state.equations.free(model.forces(frames, NO_GRAVITY).force)
    for seed in range(2):
        v = smooth(state, seed)
        steps = state.equations.displacements(v)
        got = differences(lambda s, steps=steps: model.forces(frames.moved(s * steps), NO_GRAVITY).energy, 2e-3)
        assert got == pytest.approx(float(force @ v), rel=1e-8)


@pytest.mark.parametrize("name", CASES)
def test_drives_know_their_derivatives(name):
    state = moved(name)
    equations, frames = state.equations, state.state.frames
    v = smooth(state, 5)
    steps = equations.displacements(v)
    got = differences(lambda s: equations.travelled(frames.moved(s * steps)), 1e-2)
    assert got == pytest.approx(state.state.tangent.rows @ v, rel=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_tangent_is_reciprocal(name):
    """In equilibrium under forces that derive from an energy: the weight of members with elastic roots, which divides
    otherwise along and across them, does so to some 1e-8 (docs/theory/large-motion.md)."""
    for how in ({"weight": False}, {"is_rigid": True}):
        K = moved(name, follower=False, **how).state.tangent.K.toarray()
        assert scaled(K, K.T) < 1e-9


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("turn", [(0.3, -0.2, 0.5), (-2.0, 1.0, 1.9)])
def test_turning_everything_changes_nothing(name, turn):
    """Not the energy, and forces, weights, mass and tangent turn along."""
    state = moved(name)
    model, frames = state.equations.model, state.state.frames
    Q, shift = rotation(np.array(turn)), state.equations.size * np.array([0.3, -1.2, 0.7])
    there = Frames(frames.x @ Q.T + shift, Q @ frames.R, frames.z, frames.placed)
    T = np.kron(np.eye(2), Q)
    equations = state.equations
    own, other = model.forces(frames, GRAVITY), model.forces(there, Q @ GRAVITY)
    assert other.energy == pytest.approx(own.energy, rel=1e-9)
    back = np.where(frames.placed[:, None], other.force @ T, other.force)
    assert moves(state, equations.free(back - own.force)) < 1e-10
    for elements in model.elements:
        turns = np.where(frames.placed[elements.node][:, :, None, None], T, np.eye(6))
        e, k = elements.node.shape
        for matrix in (lambda at, e=elements: e.response(at).tangent, lambda at, e=elements: e.masses(at)):
            before, after = (matrix(at).reshape(e, k, 6, k, 6) for at in (frames, there))
            before = np.einsum("eaij,eajbk,eblk->eaibl", turns, before, turns)
            assert np.abs(after - before).max() <= 1e-9 * np.abs(before).max()


def bent(mechanism: fx.Mechanism, node: str = "p1") -> tuple[Array, float]:
    """Displacement of a node under loads in all directions, and the energy."""
    beam = Moved(mechanism)
    *_, pose = beam.loaded(
        [{node: (share * np.array([-3.0, 4.0, 2.0, 0.1, 0.2, 0.3])).tolist()} for share in (0.3, 1.0)]
    )
    return pose.displacement(beam.number(node)), pose.state.tangent.forces.energy


BEAM = """
flexura: 1
name: beam
corrections: none
nodes: {{p0: [0, 0, 0], p1: [{x} mm, 20 mm, {z} mm]}}
flexures:
  leaf:
    {{nodes: {ends}, material: spring-steel, reference: z, elements: {elements},
     profile: {{type: leaf, width: 5 mm, thickness: 0.6 mm}}}}
ground: {{p0: clamped}}
"""


def test_the_order_of_nodes_does_not_matter():
    there, back = (bent(fx.loads(BEAM.format(ends=e, elements=6, x=80, z=30))) for e in ("[p0, p1]", "[p1, p0]"))
    assert np.abs(there[0]).max() > 0.1
    assert back[0] == pytest.approx(there[0], rel=1e-8, abs=1e-10)
    assert back[1] == pytest.approx(there[1], rel=1e-8)


def test_refining_converges_with_the_fourth_power():
    coarse, middle, fine = (
        bent(fx.loads(BEAM.format(ends="[p0, p1]", elements=n, x=80, z=30)))[0] for n in (6, 12, 24)
    )
    first, second = np.abs(middle - coarse).max(), np.abs(fine - middle).max()
    assert np.abs(fine[3:]).max() > 1
    assert second < 2e-4 * np.abs(fine).max()
    assert first / second > 2**3.5


MIRRORED = """
flexura: 1
name: mirrored
substructures:
  arm:
    nodes: {foot: [10 mm, 0, 0], bend: [50 mm, 20 mm, 5 mm], head: [90 mm, 5 mm, 30 mm]}
    flexures:
      leaf:
        {nodes: [foot, bend], material: spring-steel, reference: z, elements: 6,
         profile: {type: leaf, width: 5 mm, thickness: 0.6 mm}}
      hinge:
        {nodes: [bend, head], material: spring-steel, reference: z, elements: 8,
         profile: {type: leaf, width: 3 mm, thickness: 0.5 mm}}
    springs:
      spring: {nodes: [foot, head], stiffness: {tx: 10 N/m, ty: 30 N/m, tz: 20 N/m}}
    interface: [foot, head]
instances:
  arm:
    of: arm
    pattern: {type: mirror, normal: x}
springs:
  between: {nodes: [arm1.foot, arm2.foot], stiffness: {tx: 1 N/m}}
ground: {"arm*.foot": clamped}
"""


def test_a_mirrored_copy_moves_as_the_image():
    image = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
    load = np.array([-1.0, 1.5, 0.7, 0.01, 0.02, 0.03])
    arms = Moved(fx.loads(MIRRORED))
    *_, pose = arms.loaded(
        [{"arm1.head": (s * load).tolist(), "arm2.head": (s * image * load).tolist()} for s in (0.3, 1.0)]
    )
    own, other = (pose.displacement(arms.number(f"arm{k}.head")) for k in (1, 2))
    assert np.abs(own[3:]).max() > 0.2
    assert other == pytest.approx(image * own, rel=1e-8, abs=1e-10)
    M = dense(pose.M)
    n, sign = len(M) // 2, np.tile(image, len(M) // 12)
    assert scaled(sign[:, None] * M[n:, n:] * sign, M[:n, :n]) < 1e-9


@pytest.mark.parametrize("name", ["guide", "pivot"])
def test_a_closed_way_gives_its_energy_back(name):
    """Round a circle of a drive and a force the state is where it began, and no work is left."""
    case = CASES[name]
    equations = equations_of(Case(case.file, dict(list(case.move.items())[:1]), case.loaded, case.load))
    radius = next(iter(case.move.values()))
    node = int(equations.model.design.plan.topology.numbers([case.loaded])[0])
    zero = np.zeros(1)
    start = equations.solve(equations.model.rest, NO_LOADS, zero)
    points = []
    for angle in np.linspace(0, 2 * np.pi, 33):
        push = Loads(
            {node: case.load * np.array([0, 5 * (1 - np.cos(angle)), 2 * np.sin(angle), 0, 0, 0])}, {}, NO_GRAVITY
        )
        points.append(Point(np.array([radius * np.sin(angle)]), push))
    states = [s for s in Way(equations, start, Point(zero, NO_LOADS)).through(points) if not isinstance(s, Stopped)]
    assert len(states) == len(points)
    assert np.abs(states[-1].frames.R - states[0].frames.R).max() < 1e-8
    assert np.abs(states[-1].frames.x - states[0].frames.x).max() < 1e-8 * equations.size
    energies = [s.tangent.forces.energy for s in states]
    assert energies[-1] < 1e-12 * max(energies)
    # of a smooth periodic function the trapezoidal rule is exact up to its 32nd harmonic
    angle = np.linspace(0, 2 * np.pi, 33)[:-1]
    at = np.array([equations.model.positions(s.frames)[node] for s in states[:-1]])
    waves = 1j * np.fft.fftfreq(32, 1 / 32)
    speed = np.fft.ifft(waves[:, None] * np.fft.fft(at, axis=0), axis=0).real
    push = case.load * np.stack([0 * angle, 5 * (1 - np.cos(angle)), 2 * np.sin(angle)], axis=1)
    drive = np.array([s.drive[0] for s in states[:-1]]) * radius * np.cos(angle)
    work = (np.einsum("ij,ij->i", push, speed) + drive) * 2 * np.pi / 32
    assert abs(work.sum()) < 1e-6 * np.abs(work).sum()


def test_energy_is_the_work_of_the_drive():
    """Gauss and Legendre's points along the stroke."""
    equations = equations_of(Case("pivot/pivot.yaml", {"arm.ry": 1.0}, "arm", 0.0))
    points, weights = np.polynomial.legendre.leggauss(8)
    targets = [*((1 + points) / 2), 1.0]
    start = equations.solve(equations.model.rest, NO_LOADS, [0.0])
    way = Way(equations, start, Point(np.zeros(1), NO_LOADS))
    states = [s for s in way.through([Point(np.array([t]), NO_LOADS) for t in targets]) if not isinstance(s, Stopped)]
    work = sum(w / 2 * s.drive[0] for w, s in zip(weights, states[:-1], strict=True))
    assert work == pytest.approx(states[-1].tangent.forces.energy, rel=1e-8)


def twist_matrix(e: Array) -> Array:
    return np.block([[np.cross(np.eye(3), e[3:]), e[:3, None]], [np.zeros((1, 4))]])


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.1, 1.0, 2.0, 2.8])
def test_exponential_and_logarithm_against_those_of_matrices(angle):
    rng = np.random.default_rng(3)
    for _ in range(5):
        w = rng.standard_normal(3)
        w *= angle / np.linalg.norm(w)
        v = rng.standard_normal(3)
        whole = la.expm(twist_matrix(np.append(v, w)))
        assert rotation(w) == pytest.approx(whole[:3, :3], abs=1e-14)
        assert rotation_vector(whole[:3, :3]) == pytest.approx(w, abs=1e-14, rel=1e-12)
        log = Logarithm(whole[None, :3, :3], whole[None, :3, 3])
        assert log.e[0] == pytest.approx(np.append(v, w), abs=1e-12)
        assert twist_matrix(log.e[0]) == pytest.approx(la.logm(whole).real, abs=1e-7)


@pytest.mark.parametrize("angle", [0.0, 1e-4, 0.5, 1.5, 2.8])
def test_derivatives_of_the_logarithm(angle):
    rng = np.random.default_rng(7)
    w, v, n = (rng.standard_normal(k) for k in (3, 3, 6))
    w *= angle / np.linalg.norm(w)
    whole = la.expm(twist_matrix(np.append(v, w)))

    def log(h1: Array, h2: Array) -> Logarithm:
        there = la.expm(-twist_matrix(h1)) @ whole @ la.expm(twist_matrix(h2))
        return Logarithm(there[None, :3, :3], there[None, :3, 3])

    at, zero = log(np.zeros(6), np.zeros(6)), np.zeros(6)
    before, after = at.second(n[None])
    for h in np.eye(6):
        assert differences(lambda s, h=h: log(zero, s * h).e[0], 0.02) == pytest.approx(at.after[0] @ h, abs=1e-8)
        assert differences(lambda s, h=h: log(s * h, zero).e[0], 0.02) == pytest.approx(-at.before[0] @ h, abs=1e-8)
        slope = differences(lambda s, h=h: log(zero, s * h).after[0].T @ n, 0.02)
        assert slope == pytest.approx(after[0] @ at.after[0] @ h, abs=1e-7)
        slope = differences(lambda s, h=h: log(zero, s * h).before[0].T @ n, 0.02)
        assert slope == pytest.approx(before[0] @ at.after[0] @ h, abs=1e-7)


def test_loads_that_follow_stay_in_the_axes_of_what_they_turn_with():
    """A cantilever under a moment that follows is an arc with a force of no use: the same as under a dead moment."""
    beam = straight_beams(
        [(0, 0, 0), (1, 0, 0)], "A: 1e3 m^2, Iy: 1 m^4, Iz: 1 m^4, J: 1 m^4", 6, E=2.0, G=1.0, ground={"p0": "clamped"}
    )
    case = Moved(beam)
    node, M = case.number("p1"), np.array([0, 0, 0, 0, 0, 2.5])
    zero = np.empty(0)
    dead, follower = (
        next(iter(case.along([Point(zero, loads)])))
        for loads in (Loads({node: M}, {}, NO_GRAVITY), Loads({}, {node: M}, NO_GRAVITY))
    )
    assert follower.displacement(node) == pytest.approx(dead.displacement(node), abs=1e-9)
    assert follower.displacement(node)[5] == pytest.approx(1.25, abs=1e-9)
