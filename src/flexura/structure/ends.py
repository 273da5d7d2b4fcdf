"""Which ends of members are held flat, worked out from what they meet."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.mechanism import TOP, Layout, matching
from flexura.structure.part import Part, PartGeometry

ARM = 0.5
"""Length of a rigid arm over the member's least thickness from which it holds the end flat altogether."""


def settle_ends(layout: Layout, part: Part, values: Array, geometry: PartGeometry) -> Array:
    """Return how far the ends of a part's members are clamped (m, 2), from 0, free, to 1, held flat.

    An end is clamped at a node that is held, carried, an interface or a joint to other parts, and on a rigid arm; free
    where it meets nothing. Other members hold it the more the bulkier they are (theory eq. F20), and so does a notch
    that is bulkier at its end than at its web; what holds most counts. What a member says of its `ends` goes before.
    One design: values (s,).
    """
    table = part.table
    J, least, thickness = table.bulk(values, geometry.length)
    arm = np.linalg.norm(geometry.offsets, axis=-1) / (ARM * thickness[:, None])
    clamped = np.maximum(np.minimum(arm, 1.0), _hold(J / least[:, None], 0.0))
    shared = _clamping_nodes(layout, part)
    axis = geometry.R[:, 0]
    at: dict[int, list[tuple[int, int]]] = {}
    for member, ends in enumerate(part.ends.tolist()):
        for end, node in enumerate(ends):
            at.setdefault(node, []).append((member, end))
    for node, meeting in at.items():
        if node in shared:
            for own in meeting:
                clamped[own] = 1.0
            continue
        members, ends = np.array(meeting).T
        sine = np.linalg.norm(np.cross(axis[members][:, None], axis[members]), axis=-1)
        across = np.maximum(sine**2, np.minimum(arm[members, ends], 1.0))
        held = _hold(J[members, ends] / J[members, ends][:, None], across)
        held[members[:, None] == members] = 0.0
        clamped[members, ends] = np.maximum(clamped[members, ends], held.max(axis=1))
    for k, member in enumerate(part.members.values()):
        if member.ends is not None:
            clamped[k] = [end == "clamped" for end in member.ends]
    return clamped


def _hold(ratio: Array, across: Array | float) -> Array:
    """How far an end is held by what has `ratio` times its torsion constant (theory eq. F20).

    `across` is the square of the sine of the angle between the two.
    """
    return np.clip((ratio * (1 + across) - (1 - across)) / (1 + ratio), 0.0, 1.0)


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
