"""The response of a plant within a loop, by what excites the loop from outside (joint input-output method).

Noise that the controller feeds back goes with the input of the plant, and biases H1 from there. It does not go with the
reference: Y = G U of what the reference alone explains of both (Söderström and Stoica 1989; Abdalmoaty and Smith 2024).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexura.errors import OptionError
from flexura.tables import in_hz
from flexura.testing.measurement.measurement import MeasuredFRF, Recording

FEW = 1 / 3
"""Relative standard deviation of the response of an input to the references from which a plant is not known."""


def by_reference(records: Sequence[Recording], references: Sequence[str]) -> tuple[list[Recording], list[str]]:
    """Records whose inputs are the references, and the names of the inputs of the plant, which become outputs.

    Raises OptionError for references that a record does not have, and where nothing is left to be an input.
    """
    found: list[Recording] = []
    inputs: list[str] = []
    for record in records:
        names = [c.name for c in record.channels]
        missing = [name for name in references if name not in names]
        if missing:
            raise OptionError(f"{record.name or 'record'} has no channel {missing[0]!r}; it has {', '.join(names)}")
        own = [names[k] for k in record.inputs if names[k] not in references]
        if len(own) > len(references) or not own:
            raise OptionError(
                f"{record.name or 'record'}: the plant has {len(own)} inputs ({', '.join(own) or 'none'}), and there"
                f" are {len(references)} references: as many are needed; a file of channels says what is an input"
            )
        inputs = inputs or own
        if own != inputs:
            raise OptionError(f"inputs of the plant differ between records: {', '.join(inputs)} and {', '.join(own)}")
        found.append(replace(record, inputs=tuple(names.index(name) for name in references)))
    return found, inputs


def plant(joint: MeasuredFRF, inputs: Sequence[str]) -> MeasuredFRF:
    """Responses of outputs to inputs of a plant, from those of both to the references: G = T_yr T_ur^-1.

    `coherence` is that of the outputs with the references. Raises OptionError where inputs do not follow them.
    """
    names = [c.name for c in joint.outputs]
    lost = [name for name in inputs if name not in names]
    if lost:
        raise OptionError(f"{lost[0]} is not coherent with the references: they do not excite the loop")
    at = [names.index(name) for name in inputs]
    rest = [k for k in range(len(names)) if k not in at]
    if not rest:
        raise OptionError("no output is left beside the inputs of the plant")
    T = joint.response
    G = T[:, rest] @ np.linalg.pinv(T[:, at])
    notes = [*joint.notes, f"plant within its loop, by {', '.join(c.name for c in joint.inputs)}"]
    gamma = joint.coherence
    if gamma is not None and joint.averages:
        follows = gamma[:, at].min(axis=(1, 2))
        unsure = 1 - follows > FEW**2 * joint.averages * follows
        if unsure.any():
            hz = joint.frequency_hz[unsure]
            notes.append(
                f"{', '.join(inputs)} hardly follow the references at {unsure.mean():.0%} of the lines, from"
                f" {in_hz(hz[0], 4)} to {in_hz(hz[-1], 4)}: the plant is not known there"
            )
    return replace(
        joint,
        response=np.asarray(G, dtype=np.complex128),
        inputs=tuple(joint.outputs[k] for k in at),
        outputs=tuple(joint.outputs[k] for k in rest),
        coherence=None if gamma is None else np.repeat(gamma[:, rest, :1], len(at), axis=2),
        partial_coherence=None,
        notes=tuple(notes),
    )
