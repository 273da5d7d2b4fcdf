"""What periodic motions of a mechanism with large displacements have in common: the order that turns, damping,
readings, errors and stability."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.responses.time_response import moving_system
from flexura.analysis.strokes import LowOrderMotion, low_order_motion
from flexura.arrays import Array, Complex
from flexura.deadline import checkpoint
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.linalg import Balance, Orbit, along
from flexura.mechanism import DOF_NAMES
from flexura.motion import (
    Damping,
    Equations,
    Equilibrium,
    Frames,
    MovingModel,
    Oscillation,
    Path,
    Point,
    commanded,
    described_loads,
    rotation_vector,
)
from flexura.structure import FullOrderModel, OutputPort
from flexura.systems import System
from flexura.tables import in_hz, quantity

HARMONICS = 5
"""Harmonics of which motions consist."""

MOST_HARMONICS = 40

HARMONIC_TOLERANCE = 1e-3
"""Relative change by twice as many harmonics from which more are asked for."""

JUDGED = 3
"""Motions of which that is estimated."""

COMPARED = 8
"""Instants that are compared with the full order."""

LOSSY = 24
"""Modes whose structural damping is told apart; those beyond have the ratio of the last."""

MOST_MOTIONS = 400
"""Motions along one curve."""

FURTHEST = 0.1
"""Displacement, over the size or in rad, of states that are like the largest motion at most."""

FINER = 8
"""Instants between samples at which the largest value of an output is looked for."""

FOLDED = 1e-6
"""Frequency in the unit tangent below which a curve folds."""

SAME_PERIOD = 0.02
"""Imaginary part of an exponent over the frequency up to which it counts as that of motions of the same period."""

ALIKE = 0.05
"""Relative difference of a harmonic from the frequency of a mode at rest up to which both are named."""

GROWS = 1e-6
"""Rate of growth over the frequency from which a motion counts as unstable; free ones, whose exponents are imaginary
but for errors, from a thousandth on."""


class Reading(NamedTuple):
    """What an output reads, beside what it reads in equilibrium: a node, or a second one seen from the first, along a
    direction or, where it `turns`, about it, so often differentiated."""

    nodes: tuple[int, ...]
    direction: Array
    turns: bool
    derivative: int

    @staticmethod
    def of(model: MovingModel, port: OutputPort) -> Reading:
        """The reading of a port. Raises OptionError for forces and for accelerations in axes that turn."""
        channel = port.channel
        if channel.quantity in ("force", "moment") or channel.node is None:
            raise OptionError(f"{channel.name} reads a {channel.quantity}: in large motion outputs are those of nodes")
        if port.derivative == 2 and channel.name.rpartition(".")[2].partition(":")[0] not in DOF_NAMES:
            raise OptionError(f"{channel.name} reads along axes that turn: name a DOF, such as {channel.node}.tx")
        names = [channel.node] if channel.against is None else [channel.against, channel.node]
        nodes = tuple(model.design.plan.topology.numbers(names).tolist())
        turns = channel.quantity.split("_")[0] in ("rotation", "angular")
        return Reading(nodes, np.array(channel.direction, dtype=float), turns, port.derivative)

    def at(self, model: MovingModel, frames: Frames, count: int) -> Array:
        """Displacements or rotations (count,) at instants, frames (count (n + 1),) one after another."""
        x, R = frames.x.reshape(count, -1, 3), frames.R.reshape(count, -1, 3, 3)
        roots = model.root[list(self.nodes)]
        turned = [R[:, root] for root in roots]
        if self.turns:
            turn = turned[0] if len(turned) == 1 else np.swapaxes(turned[0], 1, 2) @ turned[1]
            return rotation_vector(turn) @ self.direction
        places = [x[:, root] + own @ model.arm[node] for root, own, node in zip(roots, turned, self.nodes, strict=True)]
        if len(places) == 1:
            return places[0] @ self.direction
        return np.einsum("sji,sj->si", turned[0], places[1] - places[0]) @ self.direction


class Curve(NamedTuple):
    """Motions along a curve: frequencies, Hz, and amplitudes (c, H + 1, p) of the harmonics of outputs, constant part
    first, their largest values (c, p), the exponent (c,), 1/s, of the small motion beside each that grows most, whether
    each is stable (c,), and the orbits with their oscillation and the `displacements` (s, n) of all its coordinates at
    instants."""

    balance: Balance
    oscillation: Oscillation
    orbits: list[Orbit]
    displacements: list[Array]
    frequency_hz: Array
    amplitudes: Complex
    largest: Array
    growing: Complex
    stable: NDArray[np.bool_]


class Studied(NamedTuple):
    """The curve on the order that was chosen, how far this may be off in frequency, relative, by the energy that the
    full order has in the same state (theory eq. G48), and what is said of it."""

    curve: Curve
    error: float
    notes: tuple[str, ...]
    warnings: tuple[Diagnostic, ...]


def checked_harmonics(harmonics: int) -> int:
    """The number of harmonics. Raises OptionError for none and for too many."""
    if isinstance(harmonics, bool) or int(harmonics) != harmonics or not 1 <= harmonics <= MOST_HARMONICS:
        raise OptionError(f"harmonics are between 1 and {MOST_HARMONICS}, not {harmonics}")
    return int(harmonics)


def built_system(model: Any, parameters: Mapping[str, Any] | None, order: str, **channels: Any) -> System:
    """The system of full order whose motions are followed. Raises OptionError for what cannot move far."""
    if order not in ("low", "full"):
        raise OptionError(f"order is low or full, not {order!r}")
    return moving_system(model, parameters, **channels)


def studied(
    built: System,
    order: str,
    nodes: Sequence[int],
    n: int,
    follow: Callable[[Equations, Equilibrium], Curve],
    like: Callable[[Equations, Equilibrium], Equilibrium],
) -> Studied:
    """What `follow` finds about the state under described loads, on the full order or the one that turns, which is made
    good in this state and one of equilibrium that is `like` the largest motion, if there is, judged by n modes, first.

    Raises SolverError where nothing is found.
    """
    full = built.model
    assert isinstance(full, FullOrderModel)
    equations = Equations(MovingModel.of(full.design))
    runs: list[tuple[Curve, Array]] = []
    bends = False
    loads = described_loads(full.design)

    def run(equations: Equations) -> list[Equilibrium]:
        rest = Path.resting(equations, Point(np.empty(0), loads))
        curve = follow(equations, rest)
        largest = curve.displacements[int(curve.largest[:, 0].argmax())]
        instants = np.linspace(0, len(largest), COMPARED, endpoint=False).astype(int)
        x, R, z, placed = curve.oscillation.frames(largest[instants])
        parts = (np.split(each, COMPARED) for each in (x, R, z))
        none, own = np.empty(0), placed[: len(equations.model.dof)]
        frames = [Frames(x, R, z, own) for x, R, z in zip(*parts, strict=True)]
        tangents = [equations.tangent(state, loads, none)[0] for state in frames]
        energies = [rest.tangent.forces.energy, *(tangent.forces.energy for tangent in tangents)]
        runs.append((curve, np.array(energies)))
        return [Equilibrium(state, none, loads, own, 0) for state, own in zip(frames, tangents, strict=True)]

    if order == "full":
        run(equations)
        return Studied(runs[0][0], 0.0, (f"full-order model, order {equations.model.n_dof}",), ())
    with suppress(SolverError):
        like(equations, Path.resting(equations, Point(np.empty(0), loads)))
        bends = True

    def probe(equations: Equations) -> list[Equilibrium]:
        rest = Path.resting(equations, Point(np.empty(0), loads))
        return [rest, like(equations, rest)] if bends else [rest]

    found = low_order_motion(equations, [*loads.dead, *nodes], run, n, probe)
    curve, (rest, *energies) = runs[found.run]
    k = int(np.argmax(np.abs(np.array(energies) - rest)))
    off = abs(found.states[k].tangent.forces.energy - energies[k]) / abs(energies[k] - rest)
    note = f"the low order may be off by {off:.1g} in frequency, by its energy in the largest motion"
    motion: LowOrderMotion = found.motion
    return Studied(curve, float(off), (motion.note, note), motion.warnings)


def damped(built: System, equations: Equations, state: Equilibrium) -> tuple[Damping, Array | None, tuple[str, ...]]:
    """Rayleigh damping as described, ratios (n,) of all modes about a state where such are, and notes.

    Structural damping of a mode is taken as the viscous one that dissipates as much at its own frequency.
    """
    law = built.law
    rayleigh = Damping(float(law.alpha), float(law.beta))
    if not law.is_modal and built.H is None:
        return rayleigh, None, ()
    omega = Oscillation(equations, state).frequencies
    ratios = np.where(np.isfinite(omega), law.modal_ratios(omega / (2 * np.pi)), 0.0)
    if built.H is None:
        return rayleigh, ratios, ()
    modes = built.modal(n=min(LOSSY, len(omega)))
    assert modes.loss is not None
    lossy = np.diag(modes.loss) / (2 * modes.omega**2)
    ratios = ratios + np.append(lossy, np.full(len(omega), lossy[-1]))[: len(omega)]
    note = "structural damping is viscous damping that dissipates as much at the frequency of each mode at rest"
    return rayleigh, ratios, (note,)


def undamped(equations: Equations) -> Equations:
    """Without dashpots."""
    return Equations(replace(equations.model, dashpots=()), equations.drives)


def oscillating(
    built: System, equations: Equations, state: Equilibrium, amounts: Sequence[float]
) -> tuple[Oscillation, tuple[str, ...]]:
    """A damped model with the inputs of a system as levers, and notes on damping."""
    damping, ratios, notes = damped(built, equations, state)
    levers = [commanded(equations.model, port) for port in built.input_ports]
    return Oscillation(equations, state, levers, amounts, damping, ratios), notes


def bent(oscillation: Oscillation, q: Array) -> Equilibrium:
    """The state under the forces that would make a small motion (n,) of a model, as that of masses which it
    accelerates, no larger than flexures go. Raises SolverError where there is none."""
    model, state, loads = oscillation.equations.model, oscillation.state, oscillation.state.loads
    omega = np.where(np.isfinite(oscillation.frequencies), oscillation.frequencies, 0.0)
    reach = oscillation.equations.scale * (oscillation.shapes @ q)
    q = q * min(1.0, FURTHEST / float(np.abs(reach).max()))
    force = model.mass(state.frames) @ (oscillation.shapes @ (omega**2 * q))
    spread = np.where(model.dof >= 0, force[model.dof], 0.0)
    dead = dict(loads.dead)
    for node in np.flatnonzero(model.rest.placed & spread.any(axis=1)).tolist():
        dead[node] = dead.get(node, 0.0) + spread[node]
    return Path.resting(oscillation.equations, Point(np.empty(0), replace(loads, dead=dead)))


def followed(balance: Balance, first: Orbit, step: float, longest: Callable[[Orbit], float]) -> Iterator[Orbit]:
    """Motions along a curve as `along`, within the limits of time and number."""
    for orbit in islice(along(balance, first, step, longest), MOST_MOTIONS):
        checkpoint()
        yield orbit


def read(balance: Balance, oscillation: Oscillation, readings: Sequence[Reading], motions: Iterable[Orbit]) -> Curve:
    """Motions along a curve as outputs have them, with stability. Raises SolverError where there is none but one."""
    model, least = oscillation.equations.model, GROWS if balance.driven else 1e3 * GROWS
    count, H = len(balance.series.values), balance.series.harmonics
    still = oscillation.frames(np.zeros((1, model.n_dof)))
    orbits, amplitudes, largest, stable = list[Orbit](), list[Complex](), list[Array](), list[bool]()
    displacements, growing = list[Array](), list[complex]()
    for orbit in motions:
        displacements.append(balance.instants(orbit.motion)[0])
        frames = oscillation.frames(displacements[-1])
        y = np.stack([own.at(model, frames, count) - own.at(model, still, 1) for own in readings], axis=1)
        rate = 1j * orbit.omega * np.arange(count // 2 + 1)[:, None]
        spectrum = np.fft.rfft(y, axis=0) * rate ** [own.derivative for own in readings] / count
        spectrum[1:] *= 2
        amplitudes.append(spectrum[: H + 1])
        both = np.concatenate([2 * spectrum[:1].real, spectrum[1:-1]])
        largest.append(np.abs(np.fft.irfft(both, FINER * count, axis=0)).max(axis=0) * FINER * count / 2)
        exponents = balance.exponents(orbit)
        if not balance.driven:  # two are zero: the phase, and the energy
            exponents = exponents[np.argsort(np.abs(exponents))][2:]
        growing.append(complex(exponents[exponents.real.argmax()]) if len(exponents) else -np.inf)
        stable.append(growing[-1].real < least * orbit.omega)
        orbits.append(orbit._replace(slopes=None))
    if len(orbits) < 2:
        raise SolverError("no periodic motion is found near the linear one: start with less, or take order full")
    hz = np.array([orbit.omega for orbit in orbits]) / (2 * np.pi)
    found = (np.array(each) for each in (amplitudes, largest, growing, stable))
    return Curve(balance, oscillation, orbits, displacements, hz, *found)


def branches(curve: Curve, name: str, unit: str) -> tuple[tuple[str, ...], tuple[Diagnostic, ...]]:
    """Notes where other motions branch off, and warnings where stability goes over to these: of the same period where
    the determinant of the equations changes its sign, of others where stability changes and this does not, nor is
    there a fold (theory eqs. G45-G46)."""
    notes, warnings = list[str](), list[Diagnostic]()
    side = np.array([orbit.side for orbit in curve.orbits])
    turning = np.array([orbit.turning for orbit in curve.orbits])
    steps = side[1:] != side[:-1]
    explained = steps | (turning[1:] * turning[:-1] <= 0) | (np.minimum(abs(turning[1:]), abs(turning[:-1])) < FOLDED)
    explained |= np.append(explained[1:], False) | np.append(False, explained[:-1])
    for k in np.flatnonzero(steps | (~explained & (curve.stable[1:] != curve.stable[:-1]))).tolist():
        before, after = (curve.orbits[i].determinant[1] for i in (k, k + 1))
        share = 1 / (1 + np.exp(np.clip(after - before, -50.0, 50.0))) if steps[k] else 0.5
        hz, value = (float(own[k] + share * (own[k + 1] - own[k])) for own in (curve.frequency_hz, curve.largest[:, 0]))
        unstable = k if curve.stable[k + 1] else k + 1
        turns = abs(curve.growing[unstable].imag) / curve.orbits[unstable].omega
        if steps[k] or turns < SAME_PERIOD:
            other = "other motions of the same period"
        elif abs(turns - 0.5) < SAME_PERIOD:
            other = "motions of twice the period"
        else:
            other = "motions of two frequencies, which are not periodic,"
        place = f"near {in_hz(hz, 4)}, {name} {quantity(value, unit, 3)}{_commensurate(curve, hz)}"
        text = f"{place}, {other} branch off or pass by, which are not followed"
        if curve.stable[k] == curve.stable[k + 1]:
            notes.append(text)
        else:
            warnings.append(Diagnostic("equilibrium", name, hz, np.nan, "Hz", f"{text}: stability changes"))
    return tuple(notes), tuple(warnings)


def _commensurate(curve: Curve, hz: float) -> str:
    """Which harmonic of a frequency is nearest to that of a mode at rest, if one is near."""
    modes = curve.oscillation.frequencies[: curve.balance.slow] / (2 * np.pi)
    order = np.round(modes / hz)
    known = (order > 1) & (order <= curve.balance.series.harmonics)
    off = np.where(known, np.abs(modes / np.where(known, order * hz, 1.0) - 1), np.inf)
    j = int(off.argmin())
    if off[j] > ALIKE:
        return ""
    return f", where harmonic {int(order[j])} is that of mode {j + 1}, {in_hz(float(modes[j]), 4)} at rest"


def harmonic_errors(curve: Curve) -> tuple[float, float]:
    """What twice as many harmonics would change at most, of motions and of frequencies, relative, by the motions with
    the largest outputs and some others."""
    chosen = {int(curve.largest[:, 0].argmax()), *np.linspace(0, len(curve.orbits) - 1, JUDGED).astype(int).tolist()}
    errors = np.array([curve.balance.error(curve.orbits[k]) for k in chosen])
    return float(errors[:, 0].max()), float(errors[:, 1].max())


def harmonic_remarks(errors: tuple[float, float], harmonics: int) -> tuple[str, tuple[Diagnostic, ...]]:
    """A note on errors for want of harmonics, and a warning where they are large."""
    note = (
        f"{harmonics} harmonics: twice as many would change motions by {errors[0]:.1g} and frequencies by"
        f" {errors[1]:.1g} at most, to first order"
    )
    worst = max(errors)
    if worst <= HARMONIC_TOLERANCE:
        return note, ()
    text = f"{harmonics} harmonics are too few: twice as many would change motions by {worst:.2g}; take more harmonics"
    return note, (Diagnostic("convergence", "", worst, HARMONIC_TOLERANCE, "1", text),)


def lost(name: str, unit: str, value: float, hz: float, aim: str) -> Diagnostic:
    """A warning that a curve ends before it is where it is to go."""
    text = f"no motion is found beyond {quantity(hz, 'Hz', 5)}, {name} {quantity(value, unit, 4)}, on the way to {aim}"
    return Diagnostic("equilibrium", name, value, np.nan, unit, text)


def node_numbers(built: System) -> list[int]:
    """Nodes that are driven and read."""
    topology = built.model.plan.topology
    channels = (*built.inputs, *built.outputs)
    names = dict.fromkeys(name for c in channels for name in (c.node, c.against) if name is not None)
    return [int(k) for k in topology.numbers(list(names))]
