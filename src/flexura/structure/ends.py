"""Which ends of members are held flat, worked out from what they meet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexura.mechanism.layout import TOP, Layout, matching
from flexura.structure.corrections import BULKY, STUBBY, Bools

if TYPE_CHECKING:
    from flexura.structure.part import Part, PartGeometry

Array = NDArray[np.float64]

COLLINEAR = 1e-3
"""Sine of the angle below which two members go on in one line."""


def settle_ends(layout: Layout, part: Part, values: Array, geometry: PartGeometry) -> tuple[Bools, Bools]:
    """Return which ends of a part's members are clamped (m, 2), and which members are long for their thickness (m,).

    An end is clamped at a node that is held, carried, an interface or a joint to other parts, on a rigid arm, or where
    it meets a bulkier member; free where it meets nothing, goes on in line into a member that is no bulkier, or meets
    only slimmer ones across. A notch that is bulkier at its end than at its web holds itself. What a member says of
    its `ends` goes before. One design: values (s,).
    """
    table = part.table
    J, least, thickness = table.bulk(values, geometry.length)
    clamped = BULKY * least[:, None] < J
    shared = _clamping_nodes(layout, part)
    axis = geometry.R[:, 0]
    at: dict[int, list[tuple[int, int]]] = {}
    for member, ends in enumerate(part.ends.tolist()):
        for end, node in enumerate(ends):
            at.setdefault(node, []).append((member, end))
    has_arm: Bools = np.asarray(geometry.offsets.any(axis=-1))
    for node, meeting in at.items():
        for member, end in meeting:
            others = [other for other in meeting if other[0] != member]
            clamped[member, end] |= (
                node in shared
                or bool(has_arm[member, end])
                or any(_holds(J[o], J[member, end], axis[member], axis[o[0]], bool(has_arm[o])) for o in others)
            )
    for k, member in enumerate(part.members.values()):
        if member.ends is not None:
            clamped[k] = [end == "clamped" for end in member.ends]
    return clamped, geometry.length > STUBBY * thickness


def _holds(other: float, own: float, axis: Array, its_axis: Array, has_arm: bool) -> bool:
    """True when a member of torsion constant `other` holds the end of one of constant `own` flat."""
    in_line = not has_arm and bool(np.linalg.norm(np.cross(axis, its_axis)) < COLLINEAR)
    return other > BULKY * own if in_line else other > own / BULKY


def _clamping_nodes(layout: Layout, part: Part) -> set[int]:
    """Nodes that anything but this part's own members holds."""
    prototype = layout.prototypes[part.name]
    names = set(layout.interface(part.name)) | set(prototype.bodies)
    names |= {name for joint in prototype.joints for name in joint}
    names |= {name for superelement in prototype.superelements.values() for name in superelement.nodes}
    if part.name == TOP:
        names |= {name for text in prototype.ground for name in matching(text, list(part.node_number))}  # type: ignore[attr-defined]
    nodes = {part.node_number[name] for name in names if name in part.node_number}
    nodes |= {node for carried in part.carried.values() for node in carried}
    return nodes | set(range(part.n_own, part.n_named))
