"""What the meshes of solid parts leave uncertain of responses."""

from __future__ import annotations

import numpy as np

from flexura.analysis.strain import frequency_errors, mesh_warning, motion_meshes, part_meshes
from flexura.analysis.strokes import pose_limits
from flexura.errors import Diagnostic
from flexura.structure import FullOrderModel
from flexura.systems import ModalSystem, SecondOrder, input_loads
from flexura.tables import in_hz


def response_meshes(
    system: SecondOrder, modes: ModalSystem | None = None, up_to_hz: float = np.inf
) -> tuple[Diagnostic, ...]:
    """Warnings of what meshes leave uncertain of the static deflection by inputs, and of the `modes` up to a frequency:
    the worst of each; and of the pose, where one is described."""
    full = system.full_order
    posed = pose_limits(full)
    if not part_meshes(full):
        return posed
    static = np.zeros((full.order, 0))
    if system.inputs:
        static = system.full_flexibility(input_loads(system))
    said = (*posed, *motion_meshes(full, static, [f"by {c.name}" for c in system.inputs]))
    own = np.flatnonzero(modes.frequency_hz <= up_to_hz) if modes is not None else np.empty(0, dtype=np.intp)
    if modes is None or not len(own):
        return said
    shapes, hz = modes.shapes[:, own], modes.frequency_hz[own]
    shapes = shapes if isinstance(system.model, FullOrderModel) else system.model.recover(shapes)
    errors = frequency_errors(full, full.node_displacements(shapes), hz)
    assert errors is not None
    k = int(errors.share.argmax())
    warning = mesh_warning("", f"the resonance at {in_hz(hz[k], 4)}", float(errors.share[k] / 2), errors.part[k])
    return said if warning is None else (*said, warning)
