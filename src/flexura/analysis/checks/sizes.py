"""Doubts about sizes: leaves thicker than long, and sizes that are a unit away from those of the parts beside them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from flexura.errors import Diagnostic
from flexura.mechanism import TOP
from flexura.structure import FullOrderModel

SLIP = 0.3
"""A size is a unit off when it is within this share of 10^3 or 10^6 times, or 10^-3 or 10^-6 times, that of others."""

ROUNDS = (1e3, 1e6, 1e-3, 1e-6)
"""From one unit to the next: um, mm, m."""


class _Size(NamedTuple):
    """A length, m, of a part, by its name in the description; `sort` is what it is compared within."""

    sort: str
    place: str
    name: str
    value: float


def size_doubts(full: FullOrderModel) -> list[Diagnostic]:
    """Leaves thicker than long, and lengths that differ from the median of others like them by a change of unit."""
    return [*_thick(full), *_slips(list(_sizes(full)))]


def _thick(full: FullOrderModel) -> Iterator[Diagnostic]:
    for name, part in full.plan.parts.items():
        keys, own = list(part.members), full.geometry.parts[name]
        for group, _, _ in part.table.groups:
            if group.kind != ("leaf",):
                continue
            length = own.length[group.index]
            width, thickness = (
                np.broadcast_to(s[:, 0], length.shape) for s in group.sizes(full.values, length, np.array([0.5]))
            )
            for k, t, w, L in zip(group.index, thickness, width, length, strict=True):
                if t > L:
                    is_slip, swapped = 5 * L < t < 100 * L, w < L
                    meant = f"; {_text(1e-3 * t)} meant?" if is_slip else ""
                    meant = meant or ("; width and thickness exchanged?" if swapped else "")
                    text = f"{_text(t)} thick but {_text(L)} long: no leaf, and no beam{meant}"
                    yield Diagnostic.about("thick", text, _place(name, keys[k]))


def _sizes(full: FullOrderModel) -> Iterator[_Size]:
    """Lengths, sizes of sections and bodies, everywhere they are described."""
    for name, part in full.plan.parts.items():
        keys, members = list(part.members), list(part.members.values())
        kinds = ["flexure" if hasattr(member, "profile") else "link" for member in members]
        for key, kind, length in zip(keys, kinds, full.geometry.parts[name].length if keys else (), strict=True):
            yield _Size(f"{kind} length", _place(name, key), "length", float(length))
        for group, _, _ in part.table.groups:
            if group.family == "constants":
                continue
            for size, entries in group.entries.items():
                if size.endswith(("angle", "positions", "thicknesses", "shift")):
                    continue
                for k, entry in zip(group.index, entries, strict=True):
                    yield _Size(f"{kinds[k]} {size}", _place(name, keys[k]), size, float(full.values[entry]))
        for key, (_, body) in part.bodies.items():
            form = body.form(full.values)
            if form is not None:
                yield _Size("body", _place(name, key), "largest size", 2 * float(form.half.max()))


def _slips(sizes: list[_Size]) -> Iterator[Diagnostic]:
    sorts: dict[str, list[_Size]] = {}
    for size in sizes:
        if size.value > 0:
            sorts.setdefault(size.sort, []).append(size)
    for own in sorts.values():
        values = np.array([size.value for size in own])
        if len(own) == 2:
            large = int(np.argmax(values))
            candidates, typical = [large], float(values[1 - large])
        else:
            candidates, typical = range(len(own)), float(np.median(values))
        ratios = values / typical
        for k in candidates:
            size, ratio = own[k], float(ratios[k])
            if any(abs(ratio / p - 1) <= SLIP for p in ROUNDS):
                times = f"{ratio:.4g} times" if ratio > 1 else f"1/{1 / ratio:.4g} of"
                others = {"body": "bodies"}.get(size.sort, f"{size.sort.split()[0]}s")
                text = (
                    f"{size.name} {_text(size.value)}, {times} the {_text(typical)} of other {others}: a slip of unit?"
                )
                yield Diagnostic.about("unit", text, size.place)


def _text(length: float) -> str:
    """A length in the unit that suits it."""
    unit, scale = next(((u, s) for u, s in (("m", 1.0), ("mm", 1e3), ("um", 1e6)) if length * s >= 0.1), ("nm", 1e9))
    return f"{length * scale:.4g} {unit}"


def _place(name: str, key: str) -> str:
    return f"{name}.{key}" if name != TOP else key
