"""What a time response lacks: a bound from the shock spectrum of its signals, for whatever modes are left out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.responses.recurrences import Hold, motion
from flexura.arrays import Array
from flexura.errors import Diagnostic
from flexura.linalg import leading
from flexura.reduction import stored_flexibility
from flexura.results import Result
from flexura.structure import FullOrderModel
from flexura.systems import FAINT, WORTH, Channel, ModalSystem, input_loads, rounded_up
from flexura.tables import Facts, Table, in_hz, percent

FREQUENCIES = 48
"""Frequencies of a shock spectrum, from the first mode left out on."""

SPAN = 30.0
"""The highest of these over the lowest; beyond, the spectrum is bounded."""

LINES = 4
"""Strongest frequencies of a signal that are looked at beside these."""

VALUES = 20_000_000
"""Values of a shock spectrum that are worked out at most; longer signals get fewer frequencies."""

OVERDAMPED = 0.7
"""Damping ratio from which decay is not counted on."""

ROUNDING = 1e-9
"""Relative round-off of sums over all modes."""

EXACT = 1e-12
"""Relative size of a jump at time zero that is none."""

MOST = 4
"""Outputs that a sentence names."""

APART = 1e-7
"""Size of three moments of a channel beside what they could be, up to which symmetry keeps input from output."""

KNOWN = 2e-4
"""Relative error of what kept modes of a low-order model carry."""


@dataclass(frozen=True, repr=False)
class LeftOut(Result):
    """Bound (p,) on what outputs lack at any time, from modes above `above_hz`, beside their size `scale` (p,)."""

    bound: Array
    scale: Array
    outputs: tuple[Channel, ...]
    above_hz: float

    @property
    def shares(self) -> Array:
        """The bound over the size of each output (p,)."""
        return np.asarray(self.bound / self.scale)

    @property
    def share(self) -> float:
        """The largest of them."""
        return float(self.shares.max(initial=0.0))

    @property
    def text(self) -> str:
        """One sentence."""
        head = f"modes above {in_hz(self.above_hz)} are left out but for their static part"
        listed = [
            f"{rounded_up(share, 2)} of {channel.name}"
            if np.isfinite(share)
            else f"{channel.name} by an unknown amount"
            for channel, share in zip(self.outputs, self.shares, strict=True)
            if share > WORTH
        ]
        if not listed:
            return f"{head}, which changes outputs by at most {rounded_up(self.share, 2)} of their largest values"
        more = ", ..." if len(listed) > MOST else ""
        return f"{head}, which may change, of its largest value, {', '.join(listed[:MOST])}{more}"

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """One, when an output may be off by more than 1 %."""
        if self.share <= WORTH:
            return ()
        name = self.outputs[int(leading(self.shares))].name
        text = f"{self.text}: take a shorter step or keep more modes, or apply the signal less abruptly"
        return (Diagnostic("tolerance", name, self.share, WORTH, "1", text),)

    def _view(self) -> Iterator[Facts | Table]:
        yield Facts({"at most": self.text})
        shares = [percent(float(share)) for share in self.shares]
        yield Table({"output": [c.name for c in self.outputs], "left out, at most": shares}, "outputs")

    def _data(self) -> dict[str, Any]:
        outputs = {str(c): pair for c, *pair in zip(self.outputs, self.bound, self.shares, strict=True)}
        return {"above_hz": self.above_hz, "bound_and_share": outputs, "text": self.text}


def left_out(
    modes: ModalSystem, dynamic: Array, peak: Array, u: Array, dt: float, hold: Hold, impulses: Array, start: Array
) -> LeftOut | None:
    """What outputs lack of modes beyond those of a viscously damped system (theory eq. T30); None where none is.

    `dynamic` (p,) is the largest of what residual modes in their place add beyond static parts, `peak` (p,) the largest
    output. Inputs u (m, N) in steps of dt, s, after `impulses` (m,) on the static state under `start` (m,).
    """
    if not np.isfinite(modes.next_omega) or not modes.outputs:
        return None
    own, turn = _patterns(np.column_stack([u, start, impulses]))
    u, start, impulses = own[:, :-2], own[:, -2], own[:, -1]
    rows, loads, coupled = _sizes(modes, turn)
    spectra = [_spectrum(modes, own, dt, hold, first) for own, first in zip(u, start, strict=True)]
    bound = dynamic.copy()
    for i, k in enumerate(modes.derivative):
        for j in np.flatnonzero(coupled[i]):
            worst = spectra[j]
            bound[i] += min(_times(worst[k, s], _summed(rows[:, i], loads[:, j], 2 - k + s)) for s in (0, 1))
            bound[i] += _times(abs(impulses[j]), _summed(rows[:, i], loads[:, j], 1 - k))
    lowest = float(modes.omega[modes.omega > 0].min(initial=modes.next_omega))
    drive = np.abs(u).max(axis=1, initial=0.0) + np.abs(start) + np.abs(impulses) * lowest
    scale = np.maximum(peak, FAINT * (np.sqrt(np.outer(rows[3], loads[3])) @ drive) * lowest**modes.derivative)
    return LeftOut(bound, np.where(scale > 0, scale, np.inf), modes.outputs, modes.next_omega / (2 * np.pi))


def _patterns(signals: Array) -> tuple[Array, Array]:
    """Table (g, N) that those of signals (m, N) are multiples of, and the factors (m, g): inputs that are driven alike
    act as one, in which symmetric ones cancel."""
    found: list[Array] = []
    turn = np.zeros((len(signals), len(signals)))
    for k, own in enumerate(signals):
        if not own.any():
            continue
        for g, other in enumerate(found):
            ratio = float(own @ other) / float(other @ other)
            if np.abs(own - ratio * other).max() <= EXACT * np.abs(own).max():
                turn[k, g] = ratio
                break
        else:
            turn[k, len(found)] = 1.0
            found.append(own)
    return np.array(found).reshape(len(found), signals.shape[1]), turn[:, : len(found)]


def _times(one: float, other: float) -> float:
    """A product that is zero where one factor is, whatever the other."""
    return float(one * other) if one and other else 0.0


def _summed(row: Array, load: Array, power: int) -> float:
    """Bound on the sum of |c b| / omega^power over modes left out, by the inequality of Cauchy and Schwarz."""
    if power < 0:
        return np.inf
    ways = [(power // 2, power - power // 2), (power - power // 2, power // 2)]
    return min(_times(float(np.sqrt(row[i])), float(np.sqrt(load[j]))) for i, j in ways)


def _sizes(modes: ModalSystem, turn: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Sums over modes left out of squares of what outputs (4, p) and inputs (4, m) have in them, over omega^0, omega^2
    and omega^4, and over omega^2 with the kept modes; and which outputs inputs reach (p, m). Of the full order, the
    inputs in combinations `turn` (., m)."""
    system, full = modes.system, modes.system.full_order
    rows = np.array([o.row for o in system.output_ports]).reshape(-1, full.order)
    flexible = system.full_flexibility
    shift = flexible.shift
    known = 0.0 if isinstance(system.model, FullOrderModel) else KNOWN
    found, solved = [], []
    for W, kept in ((rows.T, modes.C.T), (input_loads(system) @ turn, modes.B @ turn)):
        X, agile = flexible(W), np.full(W.shape, np.inf)
        if (full.M.diagonal() > 0).all():
            agile = stored_flexibility(full.M, full.M, 0.0)(W)
        with np.errstate(invalid="ignore"):
            free = np.where(W.any(axis=0), np.einsum("ij,ij->j", np.where(W, W, 0.0), np.where(W, agile, 0.0)), 0.0)
        whole = np.stack([free, np.einsum("ij,ij->j", W, X), np.einsum("ij,ij->j", X, full.M @ X)])
        own = np.stack([(kept**2 / (modes.omega**2 + shift)[:, None] ** k).sum(axis=0) for k in range(3)])
        found.append(np.vstack([np.maximum(whole - own, 0.0) + ROUNDING * whole + known * own, whole]))
        solved.append((W, X, agile))
    (W, X, agile), (loads, Y, _) = solved
    moments = (agile.T @ loads if np.isfinite(agile).all() else None, X.T @ loads, X.T @ (full.M @ Y))
    coupled = np.zeros((len(rows), loads.shape[1]), dtype=bool)
    for k, moment in enumerate(moments):
        if moment is not None:
            coupled |= np.abs(moment) > APART * np.sqrt(np.outer(found[0][3 + k], found[1][3 + k]))
    return found[0][[0, 1, 2, 4]], found[1][[0, 1, 2, 4]], coupled


def _spectrum(modes: ModalSystem, u: Array, dt: float, hold: Hold, start: float) -> Array:
    """Shock spectrum (3, 2) of a signal u (N,): the largest omega^(2 - k + s) |d^k (eta - u / omega^2)/dt^k| of an
    oscillator eta'' + d eta' + omega^2 eta = u at rest under `start`, over time and omega from the first mode left out
    on; rows are k, columns s. Beyond the highest of them a bound on all that follow (theory eq. T30)."""
    if not u.any() and not start:
        return np.zeros((3, 2))
    count = int(np.clip(VALUES // len(u), 8, FREQUENCIES))
    w = np.geomspace(modes.next_omega, SPAN * modes.next_omega, count)
    w = np.unique(np.concatenate([w, _lines(u, dt, w)]))
    damping = _least_damping(modes, w)
    alone = replace(modes, loss=None, B=np.ones((1, 1)))
    slope, bend = references(u, dt)
    worst = np.zeros((3, 2))
    for k in range(len(w)):
        one = replace(alone, omega=w[k : k + 1], damping=damping[k : k + 1, None])
        eta, rate = motion(one, u[None], dt, hold, np.array([start / w[k] ** 2]), np.zeros(1), {0, 1})
        assert eta is not None and rate is not None
        second = u - damping[k] * rate[0] - w[k] ** 2 * eta[0]
        for d, (y, y0) in enumerate(((eta[0], u), (rate[0], slope), (second, bend))):
            size = float(np.abs(y - y0 / w[k] ** 2).max())
            worst[d] = np.maximum(worst[d], size * w[k] ** np.array([2 - d, 3 - d]))
    return np.maximum(worst, _tail(u, dt, hold, start, float(w[-1]), float(damping[0]), float(damping[-1])))


def references(u: Array, dt: float) -> tuple[Array, Array]:
    """First and second derivative of a signal (N,) as what stiff modes follow, by differences around each sample."""
    bend = np.zeros_like(u)
    bend[1:-1] = (u[2:] - 2 * u[1:-1] + u[:-2]) / dt**2
    return np.gradient(u, dt), bend


def _lines(u: Array, dt: float, w: Array) -> Array:
    """Strongest frequencies of a signal in a range w, rad/s, and those that straight lines between samples make."""
    size = np.abs(np.fft.rfft(u - u.mean()))
    found = 2 * np.pi * np.fft.rfftfreq(len(u), dt)
    beyond = np.flatnonzero(found >= w[0])
    own = found[beyond[np.argsort(-size[beyond])[:LINES]]]
    strongest = found[int(leading(size))]
    mirrored = 2 * np.pi / dt + np.array([-strongest, strongest])
    every = np.concatenate([own, mirrored])
    return np.asarray(every[(every > w[0]) & (every < w[-1])], dtype=float)


def _least_damping(modes: ModalSystem, w: Array) -> Array:
    """The least damping, 1/s, that the law gives modes of frequencies w (k,), rad/s, that are left out."""
    law = modes.system.law
    ratios = [
        *(ratio for up_to, ratio in law.bands if 2 * np.pi * up_to >= modes.next_omega),
        *law.ratios[modes.order :],
    ]
    zeta = min([law.ratio, *ratios])
    return np.asarray(2 * zeta * w + law.alpha + law.beta * w**2 + (modes.system.uniform_loss or 0.0) * w)


def _tail(u: Array, dt: float, hold: Hold, start: float, w: float, least: float, damping: float) -> Array:
    """Bound (3, 2) of the shock spectrum from a frequency w, rad/s, on: a sum over kinks or steps that decay."""
    from scipy.signal import lfilter  # slow to import

    zeta = damping / (2 * w)
    gain, rate = (1 / np.sqrt(1 - zeta**2), least / 2) if zeta < OVERDAMPED else (1 + 2 * zeta, 0.0)
    slopes = np.diff(u) / dt
    steep = float(np.abs(slopes).max(initial=0.0))
    jump = abs(float(u[0]) - start)
    jumps = slopes if hold == "foh" else np.diff(u)
    first = slopes[:1] if hold == "foh" else np.zeros(1)
    kinks = np.abs(np.diff(jumps, prepend=0.0)) if hold == "foh" else np.concatenate([first, np.abs(jumps)])
    total = float(lfilter([1.0], [1.0, -np.exp(-rate * dt)], kinks).max(initial=0.0)) * gain
    bend = 4 * float(np.abs(u).max()) / dt**2
    if hold == "zoh":
        level = gain * jump + total
        plain = np.array([level, level + steep / w, level + bend / w**2])
        return np.stack([plain, np.full(3, np.inf)], axis=1)
    level = gain * jump + total / w
    plain = np.array([level + 2 * zeta * steep / w, level + 2 * steep / w, level + bend / w**2])
    smooth = np.array([total + 2 * zeta * steep, total + 2 * steep, total + bend / w])
    return np.stack([plain, np.full(3, np.inf) if jump > EXACT * np.abs(u).max(initial=0.0) else smooth], axis=1)
