"""The shapes of a test that are compared with those of a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.testing.identification import frfs_of, identify
from flexura.testing.measurement import IdentifiedModes, MeasuredChannel, MeasuredFRF, Measurement


def identified_modes(test: IdentifiedModes | Measurement, **how: Any) -> IdentifiedModes:
    """The modes of a test: as they are, identified from its data, or those that a file without data came with.

    `how` are options of `identify`. Raises OptionError for anything else, and as `identify` does.
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
    return identify(test, **how)


def measured_frfs(measurement: Measurement | None) -> Sequence[MeasuredFRF]:
    """Frequency responses of a measurement, estimated where it has records alone."""
    if measurement is None or not (measurement.frfs or measurement.recordings):
        return ()
    return frfs_of(measurement)[1]


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
    kept, lost = (np.flatnonzero(own).tolist() for own in (whole, ~whole))
    if lost:
        names = ", ".join(channels[k].name for k in lost)
        notes.append(f"left out, for want of a shape in every mode: {names}")
    return ShapesOfTest(tuple(channels[k] for k in kept), shapes[kept], real[kept], tuple(notes))
