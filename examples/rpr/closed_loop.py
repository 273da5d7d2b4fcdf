"""Position control of the RPR platform through its four piezo stacks: designed on twelve states, checked on full order.

    python examples/rpr/closed_loop.py [FOLDER]

prints margins and saves the picture `closed_loop.png` in FOLDER. Integral force feedback in every stack damps the
platform (Preumont, Dufour and Malekian 1992, J. Guidance Control Dyn. 15, 390); integral control of lift, roll and
pitch, decoupled by the static gain, goes around it. Both are sampled, outputs held, with one step for computing. It
needs python-control.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import control
import numpy as np

import flexura as fx

FILE = Path(__file__).with_name("rpr_piezo.yaml")
AXES = ("lift", "roll", "pitch")
DT = 1e-4
FORCE_CROSSOVER, FORCE_LEAK, FORCE_LOW_PASS = 30.0, 1.0, 400.0  # Hz
INTEGRAL, STIFFER = (7.0, 2.0, 2.0), 10.0  # Hz, in the order of AXES; Hz
STEP = (50e-6, 1e-3, 1e-3)  # m, rad, rad
LONGEST = 1.0  # s
REDUCED, FULL = 6, 60  # modes
LEAST = 0.5  # distance of a loop from -1


@dataclass(frozen=True)
class Controller:
    """u = force (-F) + position (r - y) for forces F in the stacks and motions y: state spaces of python-control."""

    force: Any
    position: Any

    @property
    def whole(self) -> Any:
        """From (-F, r - y) to the voltages."""
        both, add = control.append(self.force, self.position), np.hstack([np.eye(4), np.eye(4)])
        return control.ss(both.A, both.B, add @ both.C, add @ both.D, DT)


@dataclass(frozen=True)
class Loops:
    """Loop responses at `hz` (f,): `force` (f, 4, 4) at the stacks, `position` (f, 3, 3) at the sensors with force
    feedback closed, and `actuators` (f, 4, 4), all feedback cut at the stacks."""

    hz: np.ndarray
    force: np.ndarray
    position: np.ndarray
    actuators: np.ndarray


@dataclass(frozen=True)
class Margins:
    """Gain margin, phase margin in degrees, distance from -1, and the last frequency at which the loop is above one."""

    gain: float
    phase: float
    distance: float
    crossover_hz: float


def platform(modes: int) -> fx.StateSpace:
    """The platform with so many modes of the full-order model, static gain kept."""
    return fx.state_space(fx.system(fx.load(FILE), order="full"), n=modes)


def sampled(model: fx.StateSpace) -> fx.StateSpace:
    """The model in steps of DT, its inputs held and one step late."""
    return model.discretised(DT, delay=DT)


def without_parasitic_modes(model: fx.StateSpace) -> fx.StateSpace:
    """The model less its first three modes, in which the platform moves sideways and turns about z."""
    own = slice(6, None)
    return replace(model, A=model.A[own, own], B=model.B[own], C=model.C[:, own], state_names=model.state_names[own])


def design(model: fx.StateSpace, integral: tuple[float, ...] = INTEGRAL) -> Controller:
    """The controller for a model; a gain is the frequency, Hz, at which an integrator with that gain crosses one.

    Force feedback softens the platform between its leak and STIFFER; position control makes up for that.
    """
    s: Any = control.tf("s")
    w = 2 * np.pi * FORCE_LOW_PASS
    gain = 2 * np.pi * FORCE_CROSSOVER / model.D[:4].diagonal().mean()
    damper = gain / (s + 2 * np.pi * FORCE_LEAK) * w**2 / (s**2 + 1.4 * w * s + w**2)
    force = control.sample_system(control.ss(damper), DT, "tustin")
    lag = (s + 2 * np.pi * STIFFER) / (s + 2 * np.pi * FORCE_LEAK)
    integrators = [control.sample_system(control.ss(2 * np.pi * hz / s * lag), DT, "tustin") for hz in integral]
    loops, decoupling = control.append(*integrators), np.linalg.pinv(model.static_gain()[4:])
    position = control.ss(loops.A, loops.B, decoupling @ loops.C, decoupling @ loops.D, DT)
    return Controller(control.append(*[force] * 4), position)


def grid(model: fx.StateSpace) -> np.ndarray:
    """Frequencies from 0.1 Hz to half the sampling rate, close together about the lower modes."""
    modes = np.unique(np.round(np.abs(model.poles()) / (2 * np.pi), 6))
    near = np.concatenate([f * (1 + 0.03 * np.linspace(-1, 1, 61) ** 3) for f in modes[modes < 500]])
    return np.unique(np.concatenate([np.geomspace(0.1, 0.5 / DT, 700), near]))


def responses(controller: Controller, hz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Responses of the controller to forces (f, 4, 4) and motions (f, 4, 3)."""
    z = np.exp(2j * np.pi * hz * DT)
    force, position = (np.moveaxis(np.asarray(part(z)), 2, 0) for part in (controller.force, controller.position))
    return force, position


def loops(H: np.ndarray, controller: Controller, hz: np.ndarray) -> Loops:
    """All loops around a sampled model with responses H (f, 7, 4)."""
    F, Y = H[:, :4], H[:, 4:]
    force, position = responses(controller, hz)
    damped = Y @ np.linalg.inv(np.eye(4) + force @ F)
    return Loops(hz, force @ F, damped @ position, force @ F + position @ Y)


def margins(loop: np.ndarray, hz: np.ndarray) -> Margins:
    """Margins of a single loop (f,): the smallest ones of all crossings."""
    found = control.stability_margins((np.abs(loop), np.degrees(np.unwrap(np.angle(loop))), 2 * np.pi * hz), True)
    gain, phase = (np.asarray(part, dtype=float) for part in found[:2])
    above = hz[np.abs(loop) >= 1]
    return Margins(
        float(np.exp(np.abs(np.log(gain)).min(initial=np.inf))),
        float(np.abs(phase).min(initial=np.inf)),
        float(np.abs(1 + loop).min()),
        float(above[-1]) if len(above) else 0.0,
    )


def distance(loop: np.ndarray) -> float:
    """Smallest singular value of I + L over all frequencies: 1/distance is the peak of the sensitivity."""
    return float(np.linalg.svd(np.eye(loop.shape[1]) + loop, compute_uv=False).min())


def closed(model: fx.StateSpace, controller: Controller) -> Any:
    """From (0, r) to (F, y) with everything closed, of python-control."""
    every: Any = np.eye(7)
    return control.feedback(fx.to_control(model) * controller.whole, every)


def neglected(controller: Controller, modes: fx.ModalSystem, sure: Loops, up_to: float) -> float:
    """Largest share of the distance from instability at the stacks that modes beyond those of a model can take.

    The controller's gain times the proven bound on those modes, over the smallest singular value of I + L.
    """
    own = sure.hz < up_to
    bound = fx.models.neglected_bound(modes, sure.hz[own])
    force, position = (np.abs(part) for part in responses(controller, sure.hz[own]))
    most = np.linalg.norm(force @ bound[:, :4] + position @ bound[:, 4:], ord=2, axis=(1, 2))
    least = np.linalg.svd(np.eye(4) + sure.actuators[own], compute_uv=False)[:, -1]
    return float((most / least).max())


def integral_limits(model: fx.StateSpace, hz: np.ndarray, damped: bool) -> np.ndarray:
    """Largest integral gain (3,), Hz, of every axis that keeps the loop LEAST from -1."""
    controller = design(model, (1.0,) * 3)
    if not damped:
        controller = replace(controller, force=0 * controller.force)
    unit = np.einsum("fii->if", loops(sampled(model).frequency_response(hz), controller, hz).position)
    found = []
    for axis in unit:
        low, high = 1e-3, 1e3
        while high / low > 1.001:
            middle = np.sqrt(low * high)
            crossings = np.flatnonzero(np.diff(np.sign(axis.imag)))
            stable = (axis[crossings].real * middle > -1).all()
            low, high = (middle, high) if stable and np.abs(1 + middle * axis).min() > LEAST else (low, middle)
        found.append(low)
    return np.array(found)


def steps(model: fx.StateSpace, controller: Controller, axis: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (N,), motion (N,) of one axis after a step of its reference, and voltages (4, N)."""
    time = DT * np.arange(round(LONGEST / DT))
    reference: Any = np.zeros((7, len(time)))
    reference[4 + axis] = STEP[axis]
    found = control.forced_response(closed(model, controller), time, reference).outputs
    volts = control.forced_response(controller.whole, time, reference - found).outputs
    return time, found[4 + axis], volts


def fed_forward(modes: fx.ModalSystem, axis: int) -> np.ndarray:
    """Motion (N,) of one axis when the stacks get the voltages that hold the step at rest."""
    static = modes.residual + (modes.C / modes.omega**2) @ modes.B
    volts = np.linalg.pinv(static[4:])[:, axis] * STEP[axis]
    held = {c.name: np.full(round(LONGEST / DT), v) for c, v in zip(modes.inputs, volts, strict=True)}
    return fx.time_response(modes, inputs=held, outputs=[AXES[axis]], dt=DT, hold="zoh").response[0]


def settled(time: np.ndarray, motion: np.ndarray, axis: int) -> float:
    """Time, s, after which the motion stays within 2 % of its step."""
    outside = np.flatnonzero(np.abs(motion / STEP[axis] - 1) > 0.02)
    return float(time[min(outside[-1] + 1, len(time) - 1)])


@dataclass(frozen=True)
class Study:
    """The controller with its loops and steps of both models, by number of modes."""

    controller: Controller
    models: dict[int, fx.StateSpace]
    loops: dict[int, Loops]
    undamped: Loops
    steps: dict[int, list[tuple[np.ndarray, np.ndarray, np.ndarray]]]
    fed_forward: list[np.ndarray]
    neglected: float
    limits: dict[str, np.ndarray]


def study() -> Study:
    """Design on the reduced model and look at both."""
    small, modes = platform(REDUCED), fx.system(fx.load(FILE), order="full").modal(n=FULL)
    controller = design(small)
    models = {REDUCED: sampled(small), FULL: sampled(fx.state_space(modes))}
    hz = grid(fx.state_space(modes))
    H = {n: model.frequency_response(hz) for n, model in models.items()}
    bare = replace(controller, force=0 * controller.force)
    free = without_parasitic_modes(small)
    return Study(
        controller,
        models,
        {n: loops(own, controller, hz) for n, own in H.items()},
        loops(H[FULL], bare, hz),
        {n: [steps(model, controller, axis) for axis in range(3)] for n, model in models.items()},
        [fed_forward(modes, axis) for axis in range(3)],
        neglected(controller, modes, loops(H[FULL], controller, hz), 3000.0),
        {
            "force feedback": integral_limits(small, hz, True),
            "force feedback, no parasitic modes": integral_limits(free, hz, True),
            "no force feedback": integral_limits(small, hz, False),
        },
    )


def report(found: Study) -> None:
    """Print what was found."""
    print(f"{'':10}{'states':>8}{'gain margin':>13}{'phase':>9}{'from -1':>9}{'crosses at':>13}{'settles in':>12}")
    for axis, name in enumerate(AXES):
        for n in found.models:
            own = margins(found.loops[n].position[:, axis, axis], found.loops[n].hz)
            time, motion, _ = found.steps[n][axis]
            print(
                f"{name:10}{2 * n:>8}{own.gain:>13.3f}{own.phase:>8.1f}°{own.distance:>9.3f}"
                f"{own.crossover_hz:>10.2f} Hz{1e3 * settled(time, motion, axis):>9.0f} ms"
            )
    for n, model in found.models.items():
        own, radius = found.loops[n], np.abs(closed(model, found.controller).poles()).max()
        print(
            f"{2 * n} states: smallest singular value of I + L {distance(own.position):.4f} at the sensors, "
            f"{distance(own.actuators):.4f} at the stacks; largest pole {radius:.6f}"
        )
    print(f"modes beyond {FULL} take at most {100 * found.neglected:.2g} % of the distance at the stacks below 3 kHz")
    apart = max(
        np.abs(a[1] / b[1][-1] - b[1] / b[1][-1]).max()
        for a, b in zip(found.steps[REDUCED], found.steps[FULL], strict=True)
    )
    print(f"the two models' steps differ by at most {100 * apart:.2g} % of the step")
    largest = max(np.abs(volts).max() for _, _, volts in found.steps[FULL])
    print(f"largest voltage of the steps {largest:.1f} V about the middle of the range")
    for name, hz in found.limits.items():
        listed = ", ".join(f"{axis} {value:.3g} Hz" for axis, value in zip(AXES, hz, strict=True))
        print(f"integral gain at a distance of {LEAST} with {name}: {listed}")


def draw(found: Study, path: Path) -> None:
    """Loop of roll as Bode and Nyquist plots, steps of lift and roll."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 8), layout="constrained")
    FigureCanvasAgg(figure)
    (bode, nyquist), below = figure.subplots(2, 2)
    styles = {FULL: {"color": "#d1732c", "lw": 3}, REDUCED: {"color": "#1f3f77", "lw": 1.2}}
    names = {FULL: f"full order, {2 * FULL} states", REDUCED: f"design model, {2 * REDUCED} states"}
    grey = {"color": "0.6", "lw": 1, "zorder": 0}
    hz = found.undamped.hz
    bare: Any = found.undamped.position[:, 1, 1]
    bode.loglog(hz, np.abs(bare), label="without force feedback", **grey)
    nyquist.plot(bare.real, bare.imag, **grey)
    for n, style in styles.items():
        own: Any = found.loops[n].position[:, 1, 1]
        bode.loglog(hz, np.abs(own), label=names[n], **style)
        nyquist.plot(own.real, own.imag, **style)
    bode.axhline(1, color="k", lw=0.6)
    bode.set(xlim=(0.3, 1000), ylim=(1e-5, 50), xlabel="frequency, Hz", ylabel="|L|", title="loop of roll: magnitude")
    line = {"arrowstyle": "-"}
    bode.annotate("parasitic mode", (13.6, 2), (24, 12), arrowprops=line)
    bode.legend(loc="lower left")
    turn = np.linspace(0, 2 * np.pi, 200)
    x, y = np.cos(turn), np.sin(turn)
    nyquist.plot(-1 + LEAST * x, LEAST * y, "k--", lw=0.8)
    nyquist.plot(x, y, "k:", lw=0.6)
    nyquist.plot(-1, 0, "k+", ms=10)
    nyquist.set(xlim=(-2.5, 1.5), ylim=(-2.5, 1), aspect="equal", xlabel="Re L", ylabel="Im L")
    nyquist.set_title(f"loop of roll; dashed: {LEAST} from -1")
    for axis, panel, unit, scale in ((0, below[0], "µm", 1e6), (1, below[1], "mrad", 1e3)):
        time = found.steps[FULL][axis][0]
        panel.plot(time, scale * found.fed_forward[axis], label="voltages fed forward", **grey)
        for n, style in styles.items():
            panel.plot(time, scale * found.steps[n][axis][1], label=names[n], **style)
        panel.set(xlim=(0, 0.5), xlabel="time, s", ylabel=f"{AXES[axis]}, {unit}", title=f"step of {AXES[axis]}")
        panel.legend(loc="lower right")
    for panel in (bode, nyquist, *below):
        panel.grid(alpha=0.3)
    figure.savefig(path, dpi=100)


def main() -> None:
    found = study()
    report(found)
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        draw(found, folder / "closed_loop.png")


if __name__ == "__main__":
    main()
