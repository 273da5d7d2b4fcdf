"""A modal test of a mechanism before there is one: simulated hits, what is identified from them, and the truth.

The force of a hammer pulse, and what a modal system does after it, in closed form without time steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Complex, Index
from flexura.deadline import Listener, announcer
from flexura.errors import OptionError, SolverError
from flexura.mechanism import Damping, Mechanism, ModalTest
from flexura.modal import assignment, best_pairs, mac, pair_modes, space_mac
from flexura.results import Tabular
from flexura.structure import Plan
from flexura.systems import ModalSystem
from flexura.tables import Facts, Item, Line, Table, counted, ends, in_hz, percent, quantity
from flexura.testing.identification import identify
from flexura.testing.measurement import IdentifiedModes, Measurement, Recording, estimate_frf
from flexura.testing.rig import ModalTestRig, TrueModes

PULSE_TERMS = ((0.5, 0.0), (-0.25, 1.0), (-0.25, -1.0))
"""Coefficients and exponents, in 2 pi i over the length, of the exponentials that make up a pulse (theory eq. H13)."""

POLES_TOGETHER = 32
"""Poles that are summed at a time."""

EQUAL_EXPONENTS = 1e-6
"""Difference of two exponents over the time elapsed below which they are taken as equal."""


def hammer_pulse(time: Array, start: float, length: float, derivative: int = 0) -> Array:
    """Force (N,) of unit peak, (1 - cos(2 pi t / length)) / 2 after `start`, s, or its first or second derivative
    (theory eq. H13)."""
    share = (time - start) / length
    if derivative == 0:
        force = 0.5 - 0.5 * np.cos(2 * np.pi * share)
    elif derivative == 1:
        force = np.pi / length * np.sin(2 * np.pi * share)
    else:
        force = 2 * (np.pi / length) ** 2 * np.cos(2 * np.pi * share)
    return np.where((share > 0) & (share < 1), force, 0.0)


def response_to_pulse(modes: ModalSystem, time: Array, start: float, length: float) -> Array:
    """Outputs (p, m, N) at `time` (N,), s, of a system at rest after a pulse of unit peak at each input.

    The convolution of the modes with the pulse in closed form (theory eq. H14); modes that are left out follow the
    force at once. Raises SolverError where there are no complex modes, as of something that floats.
    """
    every = modes.complex_modes
    r, (p, m) = modes.order, (len(modes.outputs), len(modes.inputs))
    order = np.asarray(modes.derivative)
    y = np.zeros((p, m, len(time)))
    for first in range(0, len(every.poles), POLES_TOGETHER):
        some = slice(first, first + POLES_TOGETHER)
        poles = every.poles[some]
        q = convolved(poles, time - start, length)
        left = modes.C @ every.right[:r, some] * poles ** order[:, None]
        residues = left[:, None, :] * (every.left[some] @ modes.B).T[None]
        y += (residues.reshape(p * m, -1) @ q).real.reshape(p, m, -1)
    force = [hammer_pulse(time, start, length, derivative) for derivative in range(3)]
    direct = modes.C @ modes.B
    for k, d in enumerate(order):
        y[k] += modes.residual[k][:, None] * force[d] + modes.D[k][:, None] * force[0]
        if d == 2:
            y[k] += direct[k][:, None] * force[0]
    return y


def convolved(poles: Complex, time: Array, length: float) -> Complex:
    """The integral of e^(pole (t - tau)) over a pulse of unit peak from time zero (poles, N) (theory eq. H14)."""
    t = np.maximum(time, 0.0)
    inside = np.minimum(t, length)
    p = poles[:, None]
    within = np.zeros((len(poles), len(t)), dtype=complex)
    decayed = np.exp(p * inside)
    for coefficient, multiple in PULSE_TERMS:
        s = 2j * np.pi * multiple / length
        gap = s - p
        near = np.abs(gap) * length < EQUAL_EXPONENTS
        quotient = (np.exp(s * inside) - decayed) / np.where(near, 1.0, gap)
        within += coefficient * np.where(near, inside * decayed, quotient)
    return within * np.exp(p * (t - inside))


QUIET_SAMPLES = 40
"""Samples before a pulse, beside as many as it has itself, from which offset and noise are told."""

SECOND_PULSE = 0.4
"""Peak of the second pulse of a double hit, relative."""

SAME_AS_TRUE = 0.05
"""An identified mode is the true one whose frequency, in the same placement, differs by less than this, relative."""


@dataclass(frozen=True)
class FoundMode:
    """One true mode and what the test has made of it.

    `bare_hz` without sensors; `mass_loaded_hz` and `damping_ratio` with them, means over the placements. `mass_effect`
    is `mass_loaded_hz` over `bare_hz` less one. `identified_hz`, `identified_damping` and `confidence` are of all
    placements merged; `mac` compares their shape at all accelerometers with the one without sensors, where modes are
    close with the space of these; None where the mode was missed. `placement_hz` has the true and the identified
    frequency of every placement.
    """

    number: int
    bare_hz: float
    mass_loaded_hz: float
    mass_effect: float
    damping_ratio: float
    identified_hz: float | None
    identified_damping: float | None
    mac: float | None
    confidence: float | None
    placement_hz: dict[str, tuple[float, float | None]]

    @property
    def error(self) -> float | None:
        """Identified over true frequency less one, with the sensors of those placements in which it was identified."""
        if self.identified_hz is None:
            return None
        true = [hz for hz, identified in self.placement_hz.values() if identified is not None]
        return self.identified_hz / (float(np.mean(true)) if true else self.mass_loaded_hz) - 1

    @property
    def damping_error(self) -> float | None:
        """Identified over true damping ratio less one; None without damping."""
        if self.identified_damping is None or not self.damping_ratio:
            return None
        return self.identified_damping / self.damping_ratio - 1


@dataclass(frozen=True, repr=False)
class VirtualTest(Tabular):
    """A simulated modal test: the `measurement` with records and frequency responses, what was `identified` from it,
    and the truth, without sensors (`bare`) and in every placement (`mass_loaded`), up to half the sample rate.

    `modes` compares them within the `band` of the frequency responses, Hz. `false_hz` are frequencies identified where
    there is no mode.
    """

    name: str
    test: ModalTest
    measurement: Measurement
    identified: IdentifiedModes | None
    bare: TrueModes
    mass_loaded: tuple[TrueModes, ...]
    modes: tuple[FoundMode, ...]
    false_hz: tuple[float, ...]
    band: tuple[float, float]
    seed: int
    notes: tuple[str, ...] = ()

    def _data(self) -> dict[str, Any]:
        """Everything but records and responses."""
        return {
            "name": self.name,
            "band": self.band,
            "seed": self.seed,
            "placements": self.test.placed(),
            "records": len(self.measurement.recordings),
            "modes": [{**vars(m), "error": m.error, "damping_error": m.damping_error} for m in self.modes],
            "false_hz": self.false_hz,
            "identified": self.identified,
        }

    def _title(self) -> str:
        hits, placements = len(self.measurement.recordings), counted(len(self.test.placed()), "placement")
        return f"{counted(hits, 'hit')}, {placements}, {ends(self.band, 'Hz')}, seed {self.seed}"

    def presentation(self, measured: Mapping[int, float] | None = None) -> Iterator[Item]:
        """True and identified modes, beside `measured` frequencies by number, Hz, and what the sensors do in every
        placement. Damping that nothing was identified for is the true one, in brackets."""
        modes, placements = self.modes, list(self.test.placed())
        if self.identified is None:  # what says why is said first
            yield from map(Line, dict.fromkeys(self.notes))
        missed = "" if self.identified is None else "missed"
        columns: dict[str, list[Any]] = {
            "mode": [mode.number for mode in modes],
            "no sensors [Hz]": [mode.bare_hz for mode in modes],
            "sensors on [Hz]": [mode.mass_loaded_hz for mode in modes],
            "mass effect": [f"{100 * mode.mass_effect:+.2f} %" for mode in modes],
            "identified [Hz]": [mode.identified_hz for mode in modes],
            "off": [missed if mode.error is None else f"{100 * mode.error:+.3f} %" for mode in modes],
            "damping": [
                f"({percent(mode.damping_ratio)})"
                if mode.identified_damping is None
                else f"{100 * mode.identified_damping:.3f} %"
                for mode in modes
            ],
            "its error": ["" if mode.damping_error is None else f"{100 * mode.damping_error:+.1f} %" for mode in modes],
            "MAC": ["" if mode.mac is None else f"{mode.mac:.3f}" for mode in modes],
            "confidence": ["" if mode.confidence is None else f"{mode.confidence:.2f}" for mode in modes],
        }
        if measured is not None:
            columns["measured [Hz]"] = [measured.get(k + 1) for k in range(len(modes))]
        yield Table(columns, "modes")
        if len(placements) > 1 and self.identified is not None:
            columns = {"mode": [mode.number for mode in modes]}
            pairs = {p: [mode.placement_hz[p] for mode in modes] for p in placements}
            columns |= {f"{p} [Hz]": [true for true, _ in pair] for p, pair in pairs.items()}
            for p, pair in pairs.items():
                columns[f"{p} off"] = ["missed" if f is None else f"{100 * (f / t - 1):+.3f} %" for t, f in pair]
            yield Table(columns, "modes")
        yield Facts({"identified where there is no mode": ", ".join(in_hz(hz) for hz in self.false_hz)})

    def _columns(self) -> dict[str, Any]:
        """What was found of each mode, beside the truth."""
        modes = self.modes
        return {
            "mode": [m.number for m in modes],
            "bare frequency [Hz]": [m.bare_hz for m in modes],
            "mass-loaded frequency [Hz]": [m.mass_loaded_hz for m in modes],
            "identified frequency [Hz]": [m.identified_hz for m in modes],
            "relative error": [m.error for m in modes],
            "damping ratio": [m.damping_ratio for m in modes],
            "identified damping ratio": [m.identified_damping for m in modes],
            "mac": [m.mac for m in modes],
            "confidence": [m.confidence for m in modes],
        }


@verb
def virtual_test(
    model: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    test: ModalTest | None = None,
    band: tuple[float, float] | None = None,
    damping: Damping | float | Mapping[str, Any] | None = None,
    seed: int = 0,
    double_hits: int = 0,
    progress: Listener | None = None,
) -> VirtualTest:
    """Simulate the modal test that a mechanism describes, or `test`, identify its modes, and compare with the truth.

    Every placement of accelerometers is a full-order model with their mass where they are; hits are closed-form
    responses of all its modes up to half the sample rate (theory eqs. H13-H15), with white noise. `damping` replaces
    that of the description. `band` (from, to), Hz, replaces that of the test. `double_hits`: so many more hits at every
    point bounce, to be rejected. `seed` is that of the noise and of the peaks. `progress` is told of each step.

    Raises OptionError for a mechanism without a test and for impossible numbers, ModelError for a description that
    cannot be used, SolverError for one that floats. When nothing can be estimated or identified, notes say why.
    """
    if isinstance(double_hits, bool) or not isinstance(double_hits, int | np.integer) or double_hits < 0:
        raise OptionError(f"double_hits is a number of hits, not {double_hits!r}")
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise OptionError(f"a seed is a whole number that is not negative, not {seed!r}")
    say = announcer(progress)
    rig = ModalTestRig(model, parameters, test, damping)
    bare = true_modes(None, rig.modes(None))
    rng = np.random.default_rng(int(seed))
    recordings: list[Recording] = []
    mass_loaded: list[TrueModes] = []
    for placement in rig.placements:
        say(f"hitting, {placement or 'all accelerometers'}")
        modes = rig.modes(placement)
        mass_loaded.append(true_modes(placement, modes))
        recordings += _hits(rig, placement, modes, int(double_hits), rng)
    t = rig.test
    say("estimating frequency responses")
    notes: list[str] = []
    identified, frfs = None, ()
    try:
        frfs = estimate_frf(
            recordings,
            exponential=t.exponential,  # type: ignore[arg-type]
            force_window=t.force_window,  # type: ignore[arg-type]
            band=t.band if band is None else band,  # type: ignore[arg-type]
        )
    except OptionError as error:
        notes.append(f"no frequency responses: {error}")
    measurement = Measurement(f"virtual test of {rig.name}", tuple(recordings), frfs)
    lines = frfs[0].frequency_hz if frfs else np.array([0.0, float(t.sample_rate) / 2])  # type: ignore[arg-type]
    band = (float(lines[0]), float(lines[-1]))
    if frfs:
        say("identifying")
        try:
            identified = identify(measurement)
            notes += identified.notes
        except (OptionError, SolverError) as error:
            notes.append(f"no modes identified: {error}")
    rows, false_hz = compared(rig, bare, mass_loaded, identified, band)
    truth = (bare, tuple(mass_loaded))
    return VirtualTest(rig.name, t, measurement, identified, *truth, rows, false_hz, band, int(seed), tuple(notes))


def true_modes(placement: str | None, modes: ModalSystem) -> TrueModes:
    """Frequencies |pole| / 2 pi, damping ratios and shapes of a placement of sensors, or without any."""
    if modes.is_proportional:
        hz, ratios = modes.frequency_hz, modes.total_ratios
    else:
        every = modes.complex_modes
        upper = np.flatnonzero(every.poles.imag > 0)[: modes.order]
        hz, ratios = every.frequency_hz[upper], every.ratios[upper]
        if len(hz) < modes.order:
            raise SolverError("a mode is damped more than critically: a test has no resonance of it")
    return TrueModes(placement, np.asarray(hz), np.asarray(ratios), modes.C)


def _hits(
    rig: ModalTestRig, placement: str, modes: ModalSystem, double_hits: int, rng: np.random.Generator
) -> list[Recording]:
    """Records of all hits in one placement, hammer point by hammer point."""
    t = rig.test
    rate, length = float(t.sample_rate), float(t.pulse)  # type: ignore[arg-type]
    N = round(rate * float(t.duration))  # type: ignore[arg-type]
    time = np.arange(N) / rate
    start = 2 * length + QUIET_SAMPLES / rate
    if start > time[-1] / 4:
        raise OptionError(
            f"test: before a pulse {quantity(start, 's', 3)} stay quiet; a record of {t.duration:g} s is too short"
        )
    names = list(t.accelerometers)
    channels = tuple(sensor.channel for sensor in rig.placements[placement])
    y = response_to_pulse(modes, time, start, length)[[names.index(c.name) for c in channels]]
    f = hammer_pulse(time, start, length)
    again = start + max(4 * length, N / rate / 50)
    recordings = []
    for j, point in enumerate(rig.hammer):
        for k in range(int(t.hits) + double_hits):
            peak = float(t.peak) * max(1 + float(t.peak_scatter) * rng.normal(), 0.2)  # type: ignore[arg-type]
            samples = peak * np.concatenate([f[None], y[:, j]])
            if k >= t.hits:
                shift = round((again - start) * rate)
                samples[:, shift:] += SECOND_PULSE * samples[:, : N - shift].copy()
            noise = np.full((len(samples), 1), float(t.acceleration_noise))  # type: ignore[arg-type]
            noise[0] = float(t.force_noise)  # type: ignore[arg-type]
            samples += noise * rng.normal(size=samples.shape)
            label = f"{placement + ' ' if placement else ''}{point.channel.name} hit {k + 1}"
            recordings.append(Recording(rate, samples, (point.channel, *channels), (0,), placement, label))
    return recordings


def compared(
    rig: ModalTestRig,
    bare: TrueModes,
    mass_loaded: Sequence[TrueModes],
    identified: IdentifiedModes | None,
    band: tuple[float, float],
) -> tuple[tuple[FoundMode, ...], tuple[float, ...]]:
    """Table of all modes that lie in the band with sensors on, and frequencies identified where there is none."""
    tracked = np.stack([_tracked(bare, loaded) for loaded in mass_loaded])
    kept = np.flatnonzero((tracked >= 0).all(axis=0))
    hz, ratios = (
        np.stack([getattr(loaded, name)[at[kept]] for loaded, at in zip(mass_loaded, tracked, strict=True)])
        for name in ("frequency_hz", "damping_ratio")
    )
    mean, placements = hz.mean(axis=0), [loaded.placement or "" for loaded in mass_loaded]
    setups: dict[str, IdentifiedModes] = {}
    partner: dict[int, tuple[int, float]] = {}
    if identified is not None:
        setups = {modes.setup: modes for modes in identified.setups or (identified,)}
        names = list(rig.accelerometers)
        shapes = bare.shapes[[names.index(c.name) for c in identified.outputs]]
        partner = _paired(identified, mean, shapes[:, kept])
    seen = [_nearest(true_hz, setups.get(name)) for true_hz, name in zip(hz, placements, strict=True)]
    rows = []
    for k in np.flatnonzero((mean >= band[0]) & (mean <= band[1])).tolist():
        alone, loaded = float(bare.frequency_hz[kept[k]]), float(mean[k])
        merged = (None, None, None, None)
        if identified is not None and k in partner:
            i, likeness = partner[k]
            merged = (
                *(float(identified.frequency_hz[i]), float(identified.damping_ratio[i])),
                *(likeness, float(identified.confidence[i])),
            )
        each = {name: (float(hz[s, k]), seen[s].get(k)) for s, name in enumerate(placements)}
        truth = (alone, loaded, loaded / alone - 1, float(ratios[:, k].mean()))
        rows.append(FoundMode(len(rows) + 1, *truth, *merged, each))
    taken = {i for i, _ in partner.values()}
    every = [] if identified is None else identified.frequency_hz.tolist()
    return tuple(rows), tuple(f for i, f in enumerate(every) if i not in taken)


def _paired(identified: IdentifiedModes, hz: Array, shapes: Array) -> dict[int, tuple[int, float]]:
    """The identified mode of every true one by number, and how alike they are, within the space of close modes."""
    pairing = pair_modes(identified.frequency_hz, identified.shapes, model_hz=hz, model_shapes=shapes)
    partner = {}
    for i, k in enumerate(pairing.partner.tolist()):
        if k >= 0:
            space = pairing.space_of(i)[1]
            likeness = space_mac(identified.shapes[:, [i]], shapes[:, space])[0]
            partner[k] = (i, float(likeness) if len(space) < len(shapes) else float(pairing.mac[i, k]))
    return partner


def _tracked(bare: TrueModes, loaded: TrueModes) -> Index:
    """The mode of a placement that each of the bare modes has become, by frequency and shape; -1 for none."""
    distance = np.abs(np.log(loaded.frequency_hz / bare.frequency_hz[:, None]))
    rows, columns = assignment(distance - mac(bare.shapes, loaded.shapes))
    number = np.full(len(bare.frequency_hz), -1, dtype=np.intp)
    number[rows] = columns
    return number


def _nearest(hz: Array, identified: IdentifiedModes | None) -> dict[int, float]:
    """Identified frequency of the true modes at `hz`, by number, where there is one."""
    if identified is None or not len(identified.poles):
        return {}
    distance = np.abs(np.log(identified.frequency_hz / hz[:, None]))
    partner = best_pairs(np.where(distance < SAME_AS_TRUE, 2 * SAME_AS_TRUE - distance, 0.0)).tolist()
    return {k: float(identified.frequency_hz[i]) for k, i in enumerate(partner) if i >= 0}
