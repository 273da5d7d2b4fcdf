"""What benchmarks/bench.py sets beside each other: ours and the best that a user has, for the same question.

Every group yields pairs. Models, other programs and their fastest settings are those of the scripts beside this one.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from statistics import median
from typing import Any

import control_step
import designs
import gradients
import numpy as np
import optimize
import scipy.linalg as la
import scipy.signal
from numpy.typing import NDArray
from scipy.sparse.linalg import eigsh, splu
from speed import ROOT, RPR

import flexura as fx
import response
import solid
from flexura.linalg import lowest
from flexura.structure import Design, stiffness_and_mass
from flexura.systems import ModalSystem

Array = NDArray[np.float64]
MODES = 6
HERTZ = 2 * np.pi
SCIPY = "SciPy"


@dataclass(frozen=True)
class Pair:
    """Processor time of ours and of the other, s, on a model of so many coordinates; the largest relative difference of
    their answers where both give numbers that can be compared."""

    row: str
    order: int
    against: str
    own: float
    other: float
    apart: float | None

    @property
    def ratio(self) -> float:
        """How many times as long the other takes."""
        return self.other / self.own


def costs(own: Callable[[], object], other: Callable[[], object], repeat: int = 9) -> tuple[float, float]:
    """Median processor times of two calls, s, in turns, so that both have the machine as it is; after one of each that
    is not counted, quick ones counted together."""
    own()
    other()
    found: list[list[float]] = [[], []]
    together = [max(1, round(5e-3 / max(_seconds(call, 1), 1e-6))) for call in (own, other)]
    for _ in range(repeat):
        for call, times, n in zip((own, other), found, together, strict=True):
            times.append(_seconds(call, n) / n)
    return median(found[0]), median(found[1])


def _seconds(call: Callable[[], object], n: int) -> float:
    start = time.process_time()
    for _ in range(n):
        call()
    return time.process_time() - start


def apart(own: Any, other: Any) -> float:
    """Largest difference beside the largest value."""
    own, other = np.asarray(own), np.asarray(other)
    return float(np.abs(own - other).max() / np.abs(own).max())


def full() -> Iterator[Pair]:
    """From changed sizes to six frequencies at full order."""
    plan = fx.Plan(fx.load(RPR))
    webs = (3e-4 * (1 + 1e-4 * k) for k in count())

    def built() -> tuple[Any, Any]:
        return stiffness_and_mass(Design.of(plan, {"r_web": next(webs)}))

    K, M = built()
    order, ours = K.shape[0], np.sqrt(lowest(K, M, MODES).values)
    theirs = np.sqrt(np.sort(eigsh(K, MODES, M, sigma=0.0, return_eigenvectors=False)))
    own, other = costs(
        lambda: lowest(*built(), MODES), lambda: eigsh(*_first_two(built()), sigma=0.0, return_eigenvectors=False)
    )
    yield Pair("full.scipy", order, f"{SCIPY} eigsh, matrices of flexura", own, other, apart(ours, theirs))

    sys.path.insert(0, str(ROOT / "tests"))
    from helpers.opensees_mesh import OpenSeesMesh  # type: ignore[import-not-found]

    beams = plan.mechanism.model_copy(update={"theory": "euler_bernoulli"})
    mesh, model = OpenSeesMesh(fx.assemble(beams)), fx.assemble(beams)
    found = np.sqrt(lowest(model.K, model.M, MODES).values) / HERTZ
    own, other = costs(lambda: lowest(*built(), MODES), lambda: mesh.frequencies(MODES), 5)
    yield Pair("full.opensees", order, "OpenSeesPy, same mesh", own, other, apart(found, mesh.frequencies(MODES)))


def _first_two(matrices: tuple[Any, Any]) -> tuple[Any, int, Any]:
    K, M = matrices
    return K, MODES, M


def low() -> Iterator[Pair]:
    """From changed sizes to six frequencies at order 54, constraint modes alone on both sides."""
    plan = fx.Plan(fx.load(RPR))
    webs = (3e-4 * (1 + 1e-4 * k) for k in count())
    reduced, whole = fx.reduce(plan), fx.assemble(plan)
    numbers = {name: k for k, name in enumerate(whole.dof_names)}
    kept = np.array([numbers[name] for name in reduced.coordinate_names])
    inner = np.setdiff1d(np.arange(whole.order), kept)

    def condensed(web: float) -> Array:
        K, M = stiffness_and_mass(Design.of(plan, {"r_web": web}))
        K, M = K.tocsc(), M.tocsc()
        T = np.zeros((K.shape[0], len(kept)))
        T[kept] = np.eye(len(kept))
        T[inner] = -splu(K[inner][:, inner].tocsc()).solve(K[inner][:, kept].toarray())
        values = la.eigh(T.T @ (K @ T), T.T @ (M @ T), eigvals_only=True, subset_by_index=[0, MODES - 1])
        return np.sqrt(values) / HERTZ

    own, other = costs(
        lambda: fx.unproven_frequencies(plan, {"r_web": next(webs)}, n=MODES), lambda: condensed(next(webs))
    )
    off = apart(fx.unproven_frequencies(plan, {"r_web": 3e-4}, n=MODES), condensed(3e-4))
    yield Pair("low.scipy", reduced.order, f"{SCIPY} splu and eigh, matrices of flexura", own, other, off)


def batch() -> Iterator[Pair]:
    """Six frequencies of each of many designs, a design; full order on the other side."""
    case = designs.CASES[0]
    plan, n = designs.prepared(case)[0], 2048
    order, drawn = fx.assemble(plan).order, designs.designs(case, 1, 1)
    one = {name: float(values[0]) for name, values in drawn.items()}
    theirs = np.sqrt(np.sort(designs.by_scipy(plan, one))) / HERTZ
    other = designs.one_by_one(designs.by_scipy, case, 20)
    for verb, call in designs.VERBS.items():
        found = call(plan, drawn)
        ours = getattr(found, "frequency_hz", found)
        own = median(designs.worked((verb, case, n, seed))[1] for seed in range(3)) / n
        text = f"{SCIPY} eigsh, matrices of flexura, one by one"
        yield Pair(f"batch.{verb}.scipy", order, text, own, other, apart(np.ravel(ours)[:MODES], theirs))


def _platform(outputs: list[str], inputs: list[str], damping: Any) -> ModalSystem:
    return fx.system(fx.reduce(fx.load(RPR)), inputs=inputs, outputs=outputs, damping=damping).modal()


def frf() -> Iterator[Pair]:
    """6 x 6 frequency responses at 10 000 frequencies from the same 54 modes."""
    modes, hz = _platform(response.PLATFORM, response.PLATFORM, 0.01), np.geomspace(1, 1000, 10_000)
    found, s = fx.frequency_response(modes, frequency_hz=hz).response, 2j * np.pi * hz[:, None]
    C, B = np.asarray(modes.C)[:, : modes.order], np.asarray(modes.B)

    def three_lines() -> NDArray[np.complex128]:
        gain = 1 / (s**2 + 0.02 * modes.omega * s + modes.omega**2)
        return ((gain[:, None, :] * C).reshape(-1, modes.order) @ B).reshape(len(hz), len(C), -1)

    def run() -> object:
        return fx.frequency_response(modes, frequency_hz=hz)

    yield Pair("frf.numpy", modes.order, "NumPy, three lines", *costs(run, three_lines), apart(found, three_lines()))

    import control

    model = fx.to_control(fx.state_space(modes))
    theirs = np.moveaxis(np.asarray(model(s[:, 0])), 2, 0)
    own, other = costs(run, lambda: model.frequency_response(HERTZ * hz), 3)
    has_slycot = control.slycot_check()  # type: ignore[attr-defined]
    row, text = ("frf.control_slycot", "with") if has_slycot else ("frf.control", "without")
    text = f"python-control {control.__version__} {text} slycot, same modes as a state space"
    yield Pair(row, modes.order, text, own, other, apart(found, theirs))


def steps() -> Iterator[Pair]:
    """10 000 time steps of the same 54 modes, one force that goes straight between samples, three displacements."""
    modes = _platform(response.DISPLACEMENTS, ["platform.tz"], response.RAYLEIGH)
    u = np.random.default_rng(1).standard_normal(response.STEPS + 1)
    t = response.DT * np.arange(len(u))

    def run() -> Array:
        return np.asarray(fx.time_response(modes, inputs={"platform.tz": u}, dt=response.DT).response)

    found, model = run(), fx.state_space(modes)
    spaced = scipy.signal.StateSpace(model.A, model.B, model.C, model.D)
    theirs = scipy.signal.lsim(spaced, u, t)[1].T
    own, other = costs(run, lambda: scipy.signal.lsim(spaced, u, t), 5)
    yield Pair(
        "steps.scipy", modes.order, f"{SCIPY} lsim, same modes as a state space", own, other, apart(found, theirs)
    )

    import control

    linear: Any = fx.to_control(model)
    forced: Any = control.forced_response
    theirs = forced(linear, t, u).outputs
    own, other = costs(run, lambda: forced(linear, t, u), 5)
    text = f"python-control {control.__version__} forced_response, same state space"
    yield Pair("steps.control", modes.order, text, own, other, apart(found, theirs))


def newmark() -> Iterator[Pair]:
    """One step by average acceleration, factorised once: full order, and order 54 beside exact steps."""
    beams = fx.load(RPR).model_copy(update={"theory": "euler_bernoulli"})
    ports: dict[str, Any] = {"inputs": ["platform.tz"], "outputs": ["platform.tz"], "damping": response.RAYLEIGH}
    whole, small = fx.system(beams, order="full", **ports), fx.system(fx.reduce(beams), **ports)

    def ramp(system: Any, **how: Any) -> Callable[[int], float]:
        def run(steps: int) -> float:
            u = response.DT * np.arange(steps + 1)
            return float(fx.time_response(system, inputs={"platform.tz": u}, dt=response.DT, **how).response[0, -1])

        return run

    run_whole = ramp(whole, method="generalised_alpha", rho_infinity=1.0)
    own, _ = response.per_step_us(run_whole, 1000)
    exact, end = response.per_step_us(ramp(small.modal()), 20_000)
    for name, build, number, text in (
        ("exudyn", response.exudyn, 1000, "exudyn, same matrices"),
        ("opensees", response.opensees, 100, "OpenSeesPy, same mesh"),
    ):
        us, other = response.per_step_us(build(whole), number)
        last = run_whole(number)
        yield Pair(f"newmark.{name}", whole.order, text, 1e-6 * own, 1e-6 * us, abs(other / last - 1))
    us, other = response.per_step_us(response.exudyn(small), 20_000)
    yield Pair("steps.exudyn", small.order, "exudyn, same matrices", 1e-6 * exact, 1e-6 * us, abs(other / end - 1))


def controller() -> Iterator[Pair]:
    """One control step of twelve states: the C code of an FMU and NumPy."""
    model, number = control_step.platform(6), 20_000
    own, total = control_step.in_c(model, number)
    other, same = control_step.in_numpy(model, number)
    yield Pair("controller.numpy", model.order, "NumPy, matrices of the same step", own, other, abs(total / same - 1))


def stroke() -> Iterator[Pair]:
    """41 poses of a guide with six frequencies each, at no larger an error than exudyn's with 40 elements a leaf."""
    import stroke_exudyn as guide

    other, error = guide.timed(guide.Exudyn(40).stroke)
    runs = ((n, *guide.timed(guide.Flexura(n).stroke)) for n in (2, 3, 4, 6, 10))
    _, own, least = next(run for run in runs if run[2] <= error)
    text = f"exudyn, geometrically exact beams; errors {least:.0e} and {error:.0e}"
    yield Pair("stroke.exudyn", 0, text, own, other, None)


def slopes() -> Iterator[Pair]:
    """Six frequencies with derivatives by fifteen sizes: exact, and by finite differences of SciPy's eigsh."""
    _, _, own, other = gradients.times()
    yield Pair("slopes.eigsh", 1062, f"{SCIPY} approx_fprime on eigsh, matrices of flexura", own, other, None)


def optimum() -> Iterator[Pair]:
    """The greatest first frequency of the guide under limits of stress and mass, from one start to within 0.1 %."""
    problem = optimize.PROBLEMS["guide"]
    plan = problem.plan
    asked: dict[str, Any] = {"vary": problem.box(plan), "maximise": "f1", "subject_to": problem.limits(), "starts": 1}
    fx.optimize(plan, **asked)
    start = time.process_time()
    found = fx.optimize(problem.plan, **asked)
    own = time.process_time() - start
    assert isinstance(found, fx.Optimum)
    check = optimize.Model(problem, 1.0, 1)
    at = [(found.design[name] - check.low[k]) / check.range[k] for k, name in enumerate(check.box)]
    best = -float(check(np.array(at))[0])
    model = optimize.Model(problem, best, 2000)
    optimize.slsqp(model)
    if model.first is not None:
        yield Pair("optimum.scipy", 0, f"{SCIPY} SLSQP on finite steps", own, model.first[1], None)


def cells() -> Iterator[Pair]:
    """Stiffness and mass of solid elements."""
    for kind, shape, order, own, other, off in solid.assembled():
        yield Pair(f"cells.{kind}.{shape}", order, "scikit-fem, same mesh", own, other, off)


GROUPS = (full, low, batch, frf, steps, newmark, controller, stroke, slopes, optimum, cells)
