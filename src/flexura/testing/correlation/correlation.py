"""Test and model side by side: which modes are which, how alike they are, and where they differ.

A channel that contradicts all others in sign or scale is found out, and modes are paired without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.full_order import assemble
from flexura.linalg import count_below, lowest
from flexura.mechanism import Mechanism
from flexura.modal import (
    CLOSE,
    ModePairing,
    channel_gain,
    comac,
    in_space,
    largest_motion,
    mac,
    orthogonality,
    pair_modes,
    space_mac,
    trusted_channels,
)
from flexura.reduction import LowOrderModel, full_order_modes, low_order_modes
from flexura.structure import FullOrderModel, Plan, full_order_model
from flexura.tables import in_hz, quantity
from flexura.testing.correlation.correlated import (
    Correlation,
    Expansion,
    ModePair,
    ReducedMass,
    overlay,
    sensor_mass,
    serep,
)
from flexura.testing.identification import frfs_of, identify
from flexura.testing.measurement import IdentifiedModes, MeasuredChannel, Measurement, setups_of
from flexura.testing.rig import (
    ChannelMatch,
    ChannelPairing,
    added_mass,
    frequency_ratios,
    nothing_matched,
    pair_channels,
    placement_frequencies,
    placements_of,
    sensors_note,
    with_sensors,
)


def identified_modes(test: IdentifiedModes | Measurement, **options: Any) -> IdentifiedModes:
    """The modes of a test: as they are, identified from its data, or those that a file without data came with.

    `options` are those of `identify`. Raises OptionError for anything else, and as `identify` does.
    """
    if isinstance(test, IdentifiedModes):
        return test
    if not isinstance(test, Measurement):
        raise OptionError(
            f"identified modes or a measurement are expected, not a {type(test).__name__}; flexura.read_measurement"
            " reads a file"
        )
    if test.modes is not None and not test.frfs and not test.recordings:
        return test.modes
    return identify(test, **options)


@dataclass(frozen=True)
class ShapesOfTest:
    """Shapes (p, n) of a test, complex and real, at channels."""

    channels: tuple[MeasuredChannel, ...]
    shapes: Complex
    real_shapes: Array
    notes: tuple[str, ...]


def shapes_of(test: IdentifiedModes) -> ShapesOfTest:
    """Shapes at the outputs; at the inputs, by reciprocity, where these are more: the hammer has moved about.

    Channels without a shape in some mode are left out.
    """
    channels, shapes, real, notes = test.outputs, test.shapes, test.real_shapes, []
    if len(test.inputs) > len(test.outputs):
        channels, shapes = test.inputs, test.participation
        turn = np.exp(-0.5j * np.angle((shapes**2).sum(axis=0)))
        real = (shapes * turn).real
        notes.append(f"shapes are those at the {len(channels)} inputs, by reciprocity")
    whole = (np.isfinite(shapes) & np.isfinite(real)).all(axis=1)
    if not whole.all():
        names = ", ".join(channels[k].name for k in np.flatnonzero(~whole))
        notes.append(f"left out, for want of a shape in every mode: {names}")
    kept = np.flatnonzero(whole)
    return ShapesOfTest(tuple(channels[k] for k in kept), shapes[kept], real[kept], tuple(notes))


Shapes = NDArray[np.inexact[Any]]
"""Shapes of modes, real or complex."""

RELIABLE_COMAC = 0.8
"""CoMAC of a channel from which its gain says something."""

FAULTLESS_GAINS = (0.4, 2.5)
"""A channel with a gain outside is faulty."""

FEWEST_SENSORS = 3
"""Sensors that have to be left when faulty ones are left out."""


@dataclass(frozen=True)
class CheckedPairing:
    """Pairs of modes over the channels that are `used` (q,), and CoMAC and gain (q,) of all channels over the pairs."""

    pairing: ModePairing
    comac: Array
    gain: Array
    used: NDArray[np.bool_]

    def notes(self, matched: tuple[ChannelMatch, ...]) -> list[str]:
        """What is wrong with the channels that are left out."""
        notes = []
        for k in np.flatnonzero(~self.used):
            wrong = "is mounted the wrong way round" if self.gain[k] < 0 else "has another unit or sensitivity"
            reads = f"{matched[k].channel.name} reads {self.gain[k]:.3g} times what the model has there, in all modes"
            notes.append(f"{reads}: maybe it {wrong}; it takes no part in MAC, pairs and expansion")
        return notes


def checked_pairing(test_hz: Array, x: Shapes, model_hz: Array, y: Array, close: float) -> CheckedPairing:
    """Pair modes with shapes x (q, n) and y (q, k); where a channel turns out to be faulty, again without it.

    A channel is faulty when it reads the same multiple of the model's shapes in all pairs (CoMAC above 0.8), and that
    is far from one (theory eqs. Q5, Q6): an error of the data, not of the model.
    """
    used: NDArray[np.bool_] = np.ones(len(x), dtype=np.bool_)
    pairing = pair_modes(test_hz, x, model_hz=model_hz, model_shapes=y, close=close)
    alike, gain = _agreement(x, y, pairing, used)
    faulty = (alike > RELIABLE_COMAC) & ~((gain > FAULTLESS_GAINS[0]) & (gain < FAULTLESS_GAINS[1])) & np.isfinite(gain)
    if (pairing.partner >= 0).sum() < 2 or not faulty.any() or len(x) - faulty.sum() < FEWEST_SENSORS:
        return CheckedPairing(pairing, alike, gain, used)
    used = np.asarray(~faulty, dtype=np.bool_)
    pairing = pair_modes(test_hz, x[used], model_hz=model_hz, model_shapes=y[used], close=close)
    return CheckedPairing(pairing, *_agreement(x, y, pairing, used), used)


def _agreement(x: Shapes, y: Array, pairing: ModePairing, used: NDArray[np.bool_]) -> tuple[Array, Array]:
    """CoMAC and gain (q,) over the pairs, mixed modes unmixed, every mode of length one at trusted channels."""
    paired = np.flatnonzero(pairing.partner >= 0)
    if not len(paired):
        return np.full(len(x), np.nan), np.full(len(x), np.nan)
    a, b = x[:, paired].astype(complex), y[:, pairing.partner[paired]].astype(complex)
    for c, k in enumerate(paired):
        tests, models = pairing.space_of(int(k))
        if 1 < len(models) < used.sum():
            b[:, [c]] = in_space(a[:, [c]], y[:, models], used)
        elif 1 < len(tests) < used.sum():
            a[:, [c]] = in_space(b[:, [c]], x[:, tests], used)
    trusted = (used & trusted_channels(a, b))[:, None]
    a, b = (s / np.maximum(np.linalg.norm(np.where(trusted, s, 0), axis=0), 1e-300) for s in (a, b))
    return comac(a, b), channel_gain(a, b)


COMPARED_UP_TO = 1.5
"""Modes of the model up to so many times the highest test frequency are compared."""

MOST_MODES = 200
"""At most so many modes of the model are compared."""

OVERLAID_UP_TO = 1.25
"""Responses are compared up to so many times the highest identified frequency."""

ALIASED_MAC = 0.5
"""MAC of two modes of the model from which the sensors hardly tell them apart."""

UNSEEN = 1e-6
"""Readings of a mode below this, relative to its largest displacement, are round-off of a symmetry."""


@verb
def correlate(
    model: Mechanism | Plan | FullOrderModel | LowOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    test: IdentifiedModes | Measurement,
    measurement: Measurement | None = None,
    n: int | None = None,
    within: float | None = None,
    close: float = CLOSE,
    reduced_mass: ReducedMass = "serep",
) -> Correlation:
    """Hold a test against the model of a mechanism: channels paired with DOFs, modes with modes, and compared.

    A measurement is identified first; its frequency responses, or those of `measurement`, are laid over the model's.
    `n` modes of the model are compared, by default all up to 1.5 times the highest test frequency. Sensors are looked
    for `within` that distance, m (see `pair_channels`), `close` is the relative difference of frequencies below which
    modes may have mixed (see `pair_modes`), and `reduced_mass` serep or guyan (see `sensor_mass`).

    Where the mechanism describes a test, the model carries the mass of the accelerometers of the test's setups: shapes
    are those with their mean mass, frequencies means over the placements, responses each of its own placement.
    Raises ModelError, and OptionError when no channel of the test is found in the model and for impossible arguments.
    """
    identified = identified_modes(test)
    if not len(identified.poles):
        raise OptionError(f"{identified.name}: the test has no modes to correlate")
    read = shapes_of(identified)
    bare = _full(model, parameters)
    placements = placements_of(bare.plan, setups_of(identified))
    full = with_sensors(bare, placements)
    sensors = pair_channels(full, read.channels, within=within)
    if not sensors.matched:
        raise OptionError(nothing_matched(identified.name, sensors))
    hz, vectors = _model_modes(model, full, identified.frequency_hz, n, placements)
    each = placement_frequencies(full, placements, hz, vectors)
    hz = each.mean(axis=0) if placements else hz
    # shapes at the sensors, rotations as displacements at half of the longest side
    modes = full.node_displacements(vectors)
    reach = 0.5 * float(np.ptp(full.geometry.positions, axis=0).max())
    scale = np.where(sensors.turns, reach, 1.0)[:, None]
    test_shapes, model_shapes = scale * read.shapes[sensors.at], scale * (sensors.rows @ vectors)
    model_shapes[:, np.linalg.norm(model_shapes, axis=0) < UNSEEN * largest_motion(modes, reach)] = 0.0
    checked = checked_pairing(identified.frequency_hz, test_shapes, hz, model_shapes, close)
    pairing, used = checked.pairing, checked.used
    real, rows = (s[used] for s in (scale * read.real_shapes[sensors.at], scale * sensors.rows))
    x, y = test_shapes[used], model_shapes[used]
    # the whole mechanism from the sensors
    basis = _basis(pairing, len(x))
    expansion = serep(real, y[:, basis])
    paired = np.flatnonzero(pairing.partner >= 0)
    turn = _turn(pairing, basis, expansion, len(hz))
    mass = sensor_mass(full, rows, vectors[:, basis], reduced_mass)
    sizes = np.ones(len(identified.poles))
    sizes[paired] = _to_size_of(y @ turn, real[:, paired])
    expanded = full.node_displacements(vectors[:, basis] @ expansion.coefficients) * sizes
    pairs = tuple(_pair(int(k), identified, hz, pairing, (x, y), expansion) for k in paired)
    notes = _notes(sensors, pairing, hz, y, expansion, reach)
    pairs = _by_setup(pairs, identified, placements, each)
    ratios = _ratios(identified, pairing, len(hz))
    overlays = []
    measurement = test if isinstance(test, Measurement) else measurement
    if measurement is not None and (measurement.frfs or measurement.recordings):
        for frf in frfs_of(measurement)[1]:
            loaded = with_sensors(bare, placements_of(bare.plan, [(frf.setup, frf.outputs)]))
            top = OVERLAID_UP_TO * float(identified.frequency_hz.max())
            overlays.append(overlay(loaded, frf, ratios, top, within=within))
    return Correlation(
        name=full.plan.mechanism.name,
        test_name=identified.name,
        pairs=pairs,
        matched=sensors.matched,
        unmatched=sensors.unmatched,
        test_hz=identified.frequency_hz,
        test_damping=identified.damping_ratio,
        model_hz=hz,
        test_shapes=np.asarray(test_shapes, dtype=complex),
        model_shapes=model_shapes,
        used=used,
        reach=reach,
        mac=pairing.mac,
        auto_mac_test=mac(x, x),
        auto_mac_model=mac(y, y),
        comac=checked.comac,
        gain=checked.gain,
        reduced_mass=reduced_mass,
        self_orthogonality=orthogonality(real[:, paired], real[:, paired], mass),
        cross_orthogonality=orthogonality(real[:, paired], y @ turn, mass),
        expanded=expanded,
        counterparts=modes @ turn,
        modes=modes,
        expansion=expansion,
        frfs=tuple(o for o in overlays if o is not None),
        model=full,
        sensors=sensors,
        measured=read.real_shapes[sensors.at] * sizes,
        traces=identified.traces,
        notes=(
            *(*read.notes, *notes, *checked.notes(sensors.matched), *identified.notes),
            *sensors_note(bare, placements, each[:, [p.model - 1 for p in pairs]]),
        ),
    )


def _full(model: Any, parameters: Mapping[str, ArrayLike] | None) -> FullOrderModel:
    if isinstance(model, LowOrderModel) and parameters:
        raise OptionError("parameters belong to a mechanism, not to a finished model")
    full = full_order_model(model.design) if isinstance(model, LowOrderModel) else assemble(model, parameters)
    full.plan.refuse_pose("correlation")
    return full


def _by_setup(
    pairs: Sequence[ModePair], test: IdentifiedModes, placements: Sequence[str], each: Array
) -> tuple[ModePair, ...]:
    """Pairs with errors that are means over setups, where each of these is known by the name of its placement."""
    if tuple(setup.setup for setup in test.setups) != tuple(placements) or not placements:
        return tuple(pairs)
    hz = [setup.frequency_hz for setup in test.setups]
    ratios = ((p, frequency_ratios(each, hz, p.test_hz, p.model - 1)) for p in pairs)
    return tuple(replace(p, model_hz=p.test_hz * r, error=r - 1) for p, r in ratios)


def _model_modes(
    model: Any, full: FullOrderModel, test_hz: Array, n: int | None, placements: Sequence[str]
) -> tuple[Array, Array]:
    """Frequencies (k,), Hz, and M-orthonormal full-order vectors (n, k) of the modes compared."""
    low = model if isinstance(model, LowOrderModel) else None
    K, M = (full.K, full.M) if low is None else (low.K, low.M)
    if low is not None and (added := added_mass(full, placements)) is not None:
        M = M + added.on(added.motion @ low.recover(np.eye(low.order)))
    if n is not None and n < 1:
        raise OptionError(f"the number of modes is at least 1, not {n}")
    count = count_below(K, M, (2 * np.pi * COMPARED_UP_TO * float(test_hz.max())) ** 2) if n is None else n
    count = min(max(count, len(test_hz) if n is None else n), MOST_MODES, K.shape[0])
    if not placements:  # nothing but what is described
        modes = full_order_modes(full, count) if low is None else low_order_modes(low, full, count)
        return np.sqrt(modes.values) / (2 * np.pi), modes.vectors
    pairs = lowest(K, M, count)
    finite = np.isfinite(pairs.values)
    vectors = pairs.vectors[:, finite]
    hz = np.sqrt(np.maximum(pairs.values[finite], 0.0)) / (2 * np.pi)
    return hz, vectors if low is None else np.asarray(low.recover(vectors))


def _basis(pairing: ModePairing, sensors: int) -> NDArray[np.intp]:
    """Model modes in which test shapes are expanded: those paired and their close ones, as far as sensors go."""
    paired = pairing.partner[pairing.partner >= 0]
    spaces = [g for g in pairing.model_spaces if np.isin(g, paired).any()]
    wide = np.sort(np.concatenate(spaces)) if spaces else paired
    return wide if len(wide) <= sensors else np.sort(paired)


def _turn(pairing: ModePairing, basis: NDArray[np.intp], expansion: Expansion, count: int) -> Array:
    """Coefficients (k, r) of the r counterparts in the k modes of the model: close modes turned among themselves to be
    nearest to the test's, the orthogonal Procrustes problem (Schoenemann 1966; theory eq. Q13).
    """
    paired = np.flatnonzero(pairing.partner >= 0)
    turn = np.zeros((count, len(paired)))
    turn[pairing.partner[paired], np.arange(len(paired))] = 1.0
    for group in pairing.model_spaces:
        columns = np.flatnonzero(np.isin(pairing.partner[paired], group))
        at = np.flatnonzero(np.isin(basis, group))
        if len(at) < 2 or not len(columns):
            continue
        C = expansion.coefficients[np.ix_(at, paired[columns])]
        C = C / np.maximum(np.linalg.norm(C, axis=0), 1e-300)
        U, _, Vt = np.linalg.svd(C, full_matrices=False)
        turn[np.ix_(basis[at], columns)] = U @ Vt
    return turn


def _to_size_of(target: Array, shapes: Array) -> Array:
    """Factors (r,) that bring shapes (p, r) to the size and sign of others, by least squares."""
    size, product = (shapes**2).sum(axis=0), (shapes * target).sum(axis=0)
    return np.where(product != 0, product / np.where(size > 0, size, 1.0), 1.0)


def _pair(
    k: int, test: IdentifiedModes, hz: Array, pairing: ModePairing, at: tuple[NDArray, Array], expansion: Expansion
) -> ModePair:
    x, y = at
    j = int(pairing.partner[k])
    tests, models = pairing.space_of(k)
    alone = float(pairing.mac[k, j])
    in_model = float(space_mac(x[:, [k]], y[:, models])[0]) if 1 < len(models) < len(x) else alone
    in_test = float(space_mac(y[:, [j]], x[:, tests])[0]) if 1 < len(tests) < len(x) else alone
    test_hz, model_hz = float(test.frequency_hz[k]), float(hz[j])
    test_space, model_space = (tuple(int(i) + 1 for i in np.sort(s)) for s in (tests, models))
    return ModePair(
        k + 1,
        j + 1,
        test_hz,
        model_hz,
        model_hz / test_hz - 1,
        float(test.damping_ratio[k]),
        alone,
        max(alone, in_model, in_test),
        test_space,
        model_space,
        float(expansion.error[k]),
    )


def _notes(
    sensors: ChannelPairing, pairing: ModePairing, hz: Array, y: Array, expansion: Expansion, reach: float
) -> list[str]:
    """What to beware of."""
    notes = list(sensors.notes)
    if sensors.turns.any() and not sensors.turns.all():
        notes.append(f"rotations are compared with displacements as those {quantity(reach, 'm', 4)} away")
    if len(y) == 1:
        notes.append("a single channel has no shapes: modes are paired in order of frequency")
    top = int(pairing.partner.max(initial=-1)) + 1
    if not top:
        return [*notes, "no mode of the test has a counterpart in the model"]
    alike = mac(y, y)
    for i, j in np.argwhere(np.triu(alike[:top, :top] > ALIASED_MAC, 1)):
        if not any(i in g and j in g for g in pairing.model_spaces):
            notes.append(
                f"the sensors hardly tell modes {i + 1} and {j + 1} of the model apart ({in_hz(hz[i], 4)} and"
                f" {in_hz(hz[j], 4)}, MAC {alike[i, j]:.2f}): place_sensors finds better places"
            )
    if not expansion.is_determined:
        notes.append(f"{len(y)} sensors do not determine the paired shapes: expanded shapes are the smallest that fit")
    return notes


def _ratios(test: IdentifiedModes, pairing: ModePairing, count: int) -> tuple[float, ...]:
    """Damping ratios of the model's modes from their counterparts in the test, of others the median."""
    ratios = np.full(count, float(np.median(test.damping_ratio)))
    paired = np.flatnonzero(pairing.partner >= 0)
    ratios[pairing.partner[paired]] = test.damping_ratio[paired]
    return tuple(np.clip(ratios, 0.0, 0.99).tolist())
