"""The part itself as one solid beside the described model, and what each assumption of the description makes."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array
from flexura.deadline import Say
from flexura.errors import OptionError
from flexura.mechanism import Mechanism, with_rigid_roots
from flexura.methods import Solution, mac_matrix
from flexura.modal import pair_by_mac
from flexura.results import Tabular
from flexura.solid.fem import as_beams
from flexura.solid.verification.beam_models import full_order
from flexura.solid.whole import ORDER, WholeModes, WholePart
from flexura.structure import FullOrderModel, assemble, one_design
from flexura.tables import Facts, Table, percent

STIFFER = 1e4
"""How many times as stiff bodies and ground are made to see what their giving does."""
FALL = 10.0
"""How far the lower order is from the higher one, over how far this is from the limit: measured 9 to 17."""
MORE = 6
"""Modes of every model beyond those asked for, among which counterparts are looked for."""


@dataclass(frozen=True)
class WholeMode:
    """A mode of the part as one solid: `frequency_hz`, known to a relative `uncertainty`, an estimate.

    `described_hz` is its counterpart in the described model, with the modal assurance criterion `mac` over the nodes,
    and `difference` how far that is off, relative to the solid. The rest are what single assumptions make of it,
    relative: `beams` beam theory in place of solid members, with rigid roots against solids between rigid bodies and a
    rigid ground; `roots` elastic ones in place of rigid ones in the described model; `bodies` and `ground` the part
    with these rigid against the part. None where there is no counterpart, or nothing of the kind.
    """

    frequency_hz: float
    uncertainty: float
    described_hz: float | None = None
    mac: float | None = None
    difference: float | None = None
    beams: float | None = None
    roots: float | None = None
    bodies: float | None = None
    ground: float | None = None


@dataclass(frozen=True, repr=False)
class WholeVerification(Tabular):
    """The described model against the part itself: one solid, nothing rigid but what is held.

    `modes` are those of the solid, `cells` of its mesh, `dofs` of order `order`; `mass`, kg, of the solids. `notes` say
    what is held how, and what is lumped.
    """

    name: str
    parameters: dict[str, float]
    modes: tuple[WholeMode, ...]
    order: int
    size: float
    cells: int
    dofs: int
    mass: float
    seconds: float
    notes: tuple[str, ...] = ()

    def _view(self) -> Iterator[Facts | Table]:
        yield Table(self.columns(), "modes")
        yield Facts({"cells": self.cells, "DOFs": self.dofs, **{f"note {k + 1}": t for k, t in enumerate(self.notes)}})

    def columns(self) -> dict[str, list[Any]]:
        """The columns of the table of modes, as they are shown."""

        def signed(name: str) -> list[str]:
            values = [getattr(mode, name) for mode in self.modes]
            return ["" if value is None else f"{100 * value:+.2f} %" for value in values]

        return {
            "mode": list(range(1, len(self.modes) + 1)),
            "whole [Hz]": [mode.frequency_hz for mode in self.modes],
            "known to": [percent(mode.uncertainty, 2) for mode in self.modes],
            "described [Hz]": [mode.described_hz for mode in self.modes],
            "difference": signed("difference"),
            **{name: signed(name) for name in ("beams", "roots", "bodies", "ground")},
        }

    def _columns(self) -> dict[str, Any]:
        """A row for each mode."""
        names = tuple(WholeMode.__dataclass_fields__)
        rows = {name: [getattr(mode, name) for mode in self.modes] for name in names}
        headings = {"frequency_hz": "frequency [Hz]", "described_hz": "described [Hz]"}
        return {
            "mode": list(range(1, len(self.modes) + 1)),
            **{headings.get(name, name): own for name, own in rows.items()},
        }

    def __repr__(self) -> str:
        worst = max((m.difference for m in self.modes if m.difference is not None), key=abs, default=None)
        return f"WholeVerification({self.name!r}, worst difference {percent(worst) or 'unknown'})"


def whole(
    model: Mechanism, parameters: Mapping[str, ArrayLike] | None, n: int, size: float, say: Say
) -> WholeVerification:
    """The `n` lowest modes of the part as one solid beside the described model. Raises as `WholePart`."""
    began, single = time.perf_counter(), one_design(parameters)
    beams = as_beams(model)
    described, rigid = assemble(beams, single), assemble(with_rigid_roots(beams), single)
    if described.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    part, more = WholePart(described, ORDER, size, say), n + MORE
    say(f"the part with elements of order {ORDER}")
    fine = part.modes(more, ORDER)
    say("the same with a lower order, for the uncertainty")
    coarse = part.modes(more, ORDER - 1)
    variants: dict[str, WholeModes | None] = {}
    for label, stiffer in (("bodies", part.bodies), ("ground", part.held), ("both", part.bodies | part.held)):
        variants[label] = None
        if stiffer and (label != "both" or (part.bodies and part.held)):
            say(f"the same with {'bodies and ground' if label == 'both' else label} {STIFFER:g} times as stiff")
            variants[label] = part.modes(more, ORDER - 1, stiffer, factor=STIFFER)
    variants["both"] = variants["both"] or variants["bodies"] or variants["ground"] or coarse
    say("the described model")
    solutions = {
        "described": full_order(described, min(more, described.order)),
        "rigid": full_order(rigid, min(more, rigid.order)),
    }
    lookup = _Counterparts(described, fine, n)
    lower = lookup.of_solid(coarse)
    uncertain = [abs(c - f) / FALL if c else f for c, f in zip(lower, fine.frequency_hz, strict=False)]
    limits = [f - u if c else f for c, f, u in zip(lower, fine.frequency_hz, uncertain, strict=False)]
    own, macs = lookup.of_beams(solutions["described"])
    stiff_roots, _ = lookup.of_beams(solutions["rigid"])
    fine_over_coarse = [f / c if c else 1.0 for c, f in zip(lower, limits, strict=False)]  # errors of the same mesh
    found = {label: lookup.of_solid(modes) if modes else [None] * n for label, modes in variants.items()}
    modes = tuple(
        WholeMode(
            limits[k],
            uncertain[k] / limits[k] if limits[k] else 0.0,
            own[k],
            macs[k],
            _over(own[k], limits[k]),
            _over(stiff_roots[k], None if (hz := found["both"][k]) is None else hz * fine_over_coarse[k]),
            _over(own[k], stiff_roots[k]),
            _over(found["bodies"][k], lower[k]),
            _over(found["ground"][k], lower[k]),
        )
        for k in range(min(n, len(limits)))
    )
    seconds = time.perf_counter() - began
    values = (modes, ORDER, size, fine.cells, fine.dofs, fine.mass, seconds, fine.notes)
    return WholeVerification(model.name, single, *values)


def _over(value: float | None, base: float | None) -> float | None:
    return None if value is None or not base else value / base - 1


class _Counterparts:
    """Counterparts of the first `n` modes of the whole part, by shape at the nodes that lie in it."""

    def __init__(self, model: FullOrderModel, fine: WholeModes, n: int) -> None:
        self._model, self._n = model, n
        self._inside: NDArray[np.bool_] = np.asarray(np.isfinite(fine.shapes).all(axis=(1, 2)))
        self._reference = self._of(fine.frequency_hz, fine.shapes)

    def _of(self, hz: Array, shapes: Array) -> Solution:
        return Solution("", None, hz, np.where(self._inside[:, None, None], shapes, 0.0))

    def of_beams(self, solution: Solution) -> tuple[list[float | None], list[float | None]]:
        """Frequencies and MAC of the counterparts, None where there is none."""
        assert solution.shapes is not None
        own = self._of(solution.frequency_hz, solution.shapes)
        mac = mac_matrix(self._model, self._reference, own)
        partner = pair_by_mac(mac, self._reference.frequency_hz, own.frequency_hz).tolist()
        at = [partner.index(k) if k in partner else None for k in range(self._n)]
        hz = [None if j is None else float(own.frequency_hz[j]) for j in at]
        return hz, [None if j is None else float(mac[k, j]) for k, j in enumerate(at)]

    def of_solid(self, modes: WholeModes) -> list[float | None]:
        """Frequencies of the counterparts among modes of the same part with other elements or stiffnesses."""
        return self.of_beams(Solution("", None, modes.frequency_hz, modes.shapes))[0]
