"""Corrections in use, and doubts about members that no theory in use covers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.beam import phi
from flexura.mechanism import CORRECTIONS, TOP, Flexure
from flexura.structure import FullOrderModel, Part, PartGeometry

SHEAR = 0.03
"""Share of shear in the deflection between parallel ends from which leaving it out is doubtful."""

SOLID = 2.0
"""Length over depth below which a member is a solid rather than a beam, whatever the theory."""

SLENDER = 500.0
"""Length over depth above which a member buckles or vibrates by itself long before it guides anything."""

WIDE = 5.0
"""Width over thickness above which a leaf bends as a plate."""

STEEP = 0.08
"""Web over length from which a right-circular notch is softer by more than 6 % than the beam integral says:
plane-stress elements give 6.5 % at 0.083, 7.7 % at 0.1 and 18 % at 0.25."""

STEEPEST = 0.5
"""Web over length from which even wedge theory is off: 5 % in rotation and 10 % in stretch against plane-stress
elements for a right-circular notch."""

SHORT = 0.4
"""Length over width below which a wide member held flat is so stiff in torsion that what holds it is not rigid: notches
on blocks of their own full height are twice as soft at 0.2 and 3 to 7 % softer at 1 in solid elements."""


@dataclass(frozen=True)
class Doubt:
    """Something that is allowed but may not be meant, or that the beam theory does not cover."""

    kind: str
    place: str
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


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


def place_of(name: str, key: str) -> str:
    """How a member of a prototype is called."""
    return f"{name}.{key}" if name != TOP else key


def _names(flags: Any) -> set[str]:
    return {name for name, flag in zip(CORRECTIONS, flags, strict=True) if flag}


def member_doubts(full: FullOrderModel) -> list[Doubt]:
    """Every doubt about a member's theory."""
    doubts = []
    for name, part in full.plan.parts.items():
        if part.members:
            doubts += _part_doubts(full, name, part, full.geometry.parts[name])
    return doubts


def _part_doubts(full: FullOrderModel, name: str, part: Part, geometry: PartGeometry) -> list[Doubt]:
    E, _, nu, G = part.table.moduli(full.values)
    sections = part.table.section_properties(full.values, nu, geometry.length)
    # the sizes of the rectangle with the same area and second moments
    thickness, width = np.sqrt(12 * sections.Iy / sections.A), np.sqrt(12 * sections.Iz / sections.A)
    m = part.table.element_member
    shear = np.minimum(*phi(E[m], G[m], sections, geometry.length[m], 1.0))
    doubts = []
    for k, ((key, member), n) in enumerate(zip(part.members.items(), part.counts, strict=True)):
        own = slice(part.first[k], part.first[k] + n)
        place, applied = place_of(name, key), _names(part.table.corrections.active[k])
        length, is_notch = float(geometry.length[k]), isinstance(member, Flexure) and member.profile.type != "leaf"
        if is_notch:
            web = min(float(thickness[own].min()), float(width[own].min()))
            doubts += _steepness(place, length, web, "notch" in applied)
        else:
            doubts += _slenderness(place, length, thickness[own].mean(), width[own].mean())
            doubts += [] if part.table.shear[k] else _shear(place, float(shear[own].mean()))
        small, large = sorted((float(thickness[own].min()), float(width[own].min())))
        if large > WIDE * small and "warping" in applied and length < SHORT * large:
            text = f"{length / large:.2g} times as long as wide: its torsion depends on how the parts next to it warp"
            doubts.append(Doubt("short", place, text))
        if large > WIDE * small and not {"plate", "warping"} <= _names(part.table.corrections.wanted[k]):
            ratio = f"{large / small:.0f} times as wide as thick"
            text = f"{ratio}: a plate rather than a beam; bending is stiffer by up to 1/(1 - nu^2), torsion by more"
            doubts.append(Doubt("wide", place, text))
    return doubts


def _steepness(place: str, length: float, web: float, is_corrected: bool) -> list[Doubt]:
    """A doubt about a notch whose web is thick for its length: the flanks are too steep for the theory in use."""
    share = f"steep notch: web {web / length:.2g} of the length"
    if is_corrected and web >= STEEPEST * length:
        return [Doubt("steep", place, f"{share}; wedge theory is too soft by 5 % or more")]
    if not is_corrected and web >= STEEP * length:
        return [Doubt("steep", place, f"{share}; the beam integral is too stiff by 6 % or more")]
    return []


def _slenderness(place: str, length: float, thickness: float, width: float) -> list[Doubt]:
    """Doubts about a member's length over its depth."""
    least, most = min(thickness, width), max(thickness, width)
    if length < SOLID * least:
        return [Doubt("stubby", place, f"{length / least:.1f} times as long as thick: a solid rather than a beam")]
    if length > SLENDER * most:
        return [Doubt("slender", place, f"slender: {length / most:.0f} times as long as wide")]
    return []


def _shear(place: str, phi: float) -> list[Doubt]:
    """A doubt about a member without shear, by its shear parameter across the smaller depth."""
    if phi < SHEAR:
        return []
    text = f"shear, left out, would add {phi:.0%} to its deflection between parallel ends; consider theory: timoshenko"
    return [Doubt("shear", place, text)]
