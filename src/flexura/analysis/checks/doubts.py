"""Corrections in use, and doubts: what the description takes for granted, by how much it moves a frequency."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from flexura.analysis.model_error import ModelError, drawn_solids, interval_text, node_of, place_of
from flexura.arrays import Array
from flexura.errors import Diagnostic
from flexura.mechanism import CORRECTIONS, Link
from flexura.structure import FullOrderModel
from flexura.tables import in_hz, quantity

SLENDER = 500.0
"""Length over depth above which a member buckles or vibrates by itself long before it guides anything."""

OUTSIDE = 0.25
"""Distance of a carried node from the solid, relative to the size of the solid, from which it is a doubt."""

WORTH = 0.01
"""Relative change of a frequency from which what makes it is a doubt."""

MOST_MODES = 3
"""Modes that a warning names."""


def corrected(full: FullOrderModel) -> tuple[dict[str, tuple[str, ...]], dict[str, tuple[str, str]]]:
    """Corrections of every member that has any, and how its ends are held, by `SUBSTRUCTURE.MEMBER`."""
    applied: dict[str, tuple[str, ...]] = {}
    ends: dict[str, tuple[str, str]] = {}
    for name, part in full.plan.parts.items():
        own = part.table.corrections
        for key, active, clamped in zip(part.members, own.active, own.clamped, strict=True):
            if active.any():
                place = place_of(name, key)
                applied[place] = tuple(c for c in CORRECTIONS if c in _names(active))
                first, second = (_held(float(end)) for end in clamped)
                ends[place] = (first, second)
    return applied, ends


def _held(share: float) -> str:
    """How far an end is held flat, in words, to a percent."""
    percent = round(100 * share)
    return {0: "free", 100: "clamped"}.get(percent, f"{percent} % clamped")


def _names(flags: Any) -> set[str]:
    return {name for name, flag in zip(CORRECTIONS, flags, strict=True) if flag}


def member_doubts(full: FullOrderModel) -> list[Diagnostic]:
    """Members so slender that they buckle or vibrate by themselves."""
    doubts = []
    for name, part in full.plan.parts.items():
        geometry = full.geometry.parts[name]
        _, _, nu, _ = part.table.moduli(full.values)
        sections = part.table.section_properties(full.values, nu, geometry.length)
        # the larger side of the rectangle with the same area and second moments
        most = np.sqrt(12 * np.maximum(sections.Iy, sections.Iz) / sections.A)
        for k, (key, member) in enumerate(part.members.items()):
            own = most[part.first[k] : part.first[k + 1]].mean()
            if (isinstance(member, Link) or member.profile.type == "leaf") and geometry.length[k] > SLENDER * own:
                text = f"slender: {geometry.length[k] / own:.0f} times as long as wide"
                doubts.append(Diagnostic.about("slender", text, place_of(name, key)))
    return doubts


def assumed(errors: ModelError, hz: Array) -> tuple[list[Diagnostic], list[Diagnostic]]:
    """What the description takes for granted that moves one of the frequencies (n,), Hz, by 1 % or more, or that no
    evidence covers, worst first, and what moves them by less."""
    doubts: tuple[list[Diagnostic], list[Diagnostic]] = [], []
    for own in errors.effects:
        most = np.nan_to_num(np.maximum(np.abs(own.low), np.abs(own.high)))
        order = [k for k in np.argsort(-most, kind="stable")[:MOST_MODES] if most[k] >= WORTH] or [int(most.argmax())]
        moved = [
            f"mode {k + 1} ({in_hz(hz[k], 4)}) by {interval_text((float(own.low[k]), float(own.high[k])))}"
            for k in order
        ]
        doubt = Diagnostic.about(own.kind, f"{own.text}; moves {', '.join(moved)}", *own.places)
        doubts[int(most.max() < WORTH)].append(doubt)
    for own in errors.unknown:
        most = int(own.share.argmax())
        held = f"{own.share[most]:.0%} of the energy of mode {most + 1} ({in_hz(hz[most], 4)})"
        text = f"no evidence of how far beams are off: {own.reason}; holds {held}"
        doubts[int(own.share[most] < WORTH)].append(Diagnostic.about("evidence", text, *own.places))
    return doubts


def as_one(doubts: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Doubts that say the same of several places as one."""
    places: dict[tuple[str, str], list[str]] = {}
    for own in doubts:
        places.setdefault((own.kind, own.text), []).extend(own.places)
    return tuple(Diagnostic.about(kind, text, *own) for (kind, text), own in places.items())


def outside_doubts(full: FullOrderModel, values: Mapping[str, Any], told: Collection[int] = ()) -> list[Diagnostic]:
    """Bodies that carry nodes well outside their solids, for parameter values in SI; nodes `told` are in doubt already
    for where they are."""
    doubts: dict[str, Diagnostic] = {}
    names, root = full.plan.topology.node_names, full.plan.topology.root
    bodies = drawn_solids(full, values)
    clusters = [int(root[node_of(full, body.name)]) for body in bodies]
    for body, own in zip(bodies, clusters, strict=True):
        if clusters.count(own) > 1:
            continue
        nodes = [int(n) for n in np.flatnonzero((root == own) & full.plan.topology.has_position) if int(n) not in told]
        if not nodes:
            continue
        far = max(nodes, key=lambda n: body.distance(full.geometry.positions[n]))
        reach, size = body.distance(full.geometry.positions[far]), max(body.solid.size)
        if reach > OUTSIDE * size:
            text = (
                f"{names[far]} lies {quantity(reach, 'm', 3)} outside the solid of {quantity(size, 'm', 3)}: "
                "what leads there is taken as rigid and without mass; add links or bodies for it"
            )
            doubts.setdefault(body.kind, Diagnostic.about("reach", text, body.kind))
    return list(doubts.values())
