"""What the model tells of its description: motions that nothing holds, assumptions that move frequencies, coarse
meshes, slender members, leaves turned the wrong way, nodes outside their solids or at one place without a joint."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.model_error import (
    drawn_solids,
    interval_text,
    model_errors_of_modes,
    node_of,
    place_of,
)
from flexura.analysis.strain import frequency_errors, mesh_warning, part_meshes
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.full_order import assemble
from flexura.linalg import Eigenpairs, bracket, leading, lowest
from flexura.mechanism import TOP, Link, Mechanism, origin_of
from flexura.reduction import Certificate, ChainedModel, certificate, chained, lowest_pairs
from flexura.structure import Bars, FullOrderModel, Part
from flexura.tables import in_hz, quantity
from flexura.thresholds import SAME_PLACE

LOOSE = 3e-5
"""Part of the highest frequency looked at below which a motion counts as all but free."""

FREE_MODES = 8
"""Lowest modes that are looked at, rigid motions of unconnected parts beyond six not counted."""

HINT = "a joint, a support or a stiffness may be missing"


class FreeMotions(NamedTuple):
    """How many independent rigid motions strain nothing, and an interval that is proven to hold the lowest other
    frequency, Hz; None where it is not known, and where there is none."""

    rigid_body_modes: int | None
    lowest_hz: tuple[float, float] | None
    warnings: list[Diagnostic]


def free_motions(full: FullOrderModel) -> FreeMotions:
    """The rigid motions of a mechanism, and warnings of motions that are free or all but free, by the DOF that moves
    most, and of what round-off hides."""
    if not full.order:
        return FreeMotions(0, None, [_of_whole("held", "every node is held: nothing can move")])
    model = chained(full)
    n = min(max(FREE_MODES, model.free_motions + 2), model.pencil.order)
    try:
        pairs = lowest_pairs(model, n)
        return _judged(model, pairs, certificate(model, pairs, n))
    except OptionError:  # no mass, no frequency: the stiffness is all that can be judged
        warnings = [_of_whole("mass", "nothing that moves has any mass: there are no modes")]
        held = bool((model.pencil.K.diagonal() > 0).all()) and bracket(model.pencil, 0.0).most == 0
        if not held:
            warnings.append(_of_whole("mechanism", f"it is not proven that nothing moves freely; {HINT}"))
        return FreeMotions(0 if held else None, None, warnings)
    except SolverError as error:
        return FreeMotions(None, None, [_of_whole("proof", f"whether anything moves freely is not known: {error}")])


def _of_whole(kind: str, text: str) -> Diagnostic:
    return Diagnostic.about(kind, text, "mechanism")


def _judged(model: ChainedModel, pairs: Eigenpairs, proof: Certificate) -> FreeMotions:
    """Rigid motions, the first frequency beyond them, and the warnings."""
    hz, lower, upper = proof.frequency_hz, proof.lower_hz, proof.upper_hz
    rigid = int(((hz == 0) & (lower == 0) & (np.arange(len(hz)) < model.free_motions)).sum())

    def of_mode(k: int, text: str) -> Diagnostic:
        """A warning about the DOF that moves most in a mode, by its mass."""
        shape = np.abs(model.recover(pairs.vectors[:, [k]])[:, 0] * np.sqrt(np.abs(model.model.M.diagonal())))
        return Diagnostic.about("mechanism", f"{text}; {HINT}", model.model.dof_names[int(leading(shape))])

    if rigid == 6 and not model.model.plan.topology.held.any():
        warnings = [_of_whole("ungrounded", "not held anywhere: six rigid-body modes at zero frequency")]
    else:
        warnings = [of_mode(k, "free to move") for k in range(rigid)]
    for k in range(rigid, len(hz)):
        if not (lower[k] > 0 and proof.is_indexed[k]):
            held = f"held by less than round-off hides (below {in_hz(upper[k], 2)})"
            warnings.append(of_mode(k, f"free to move, or {held}"))
        elif upper[k] < LOOSE * hz[-1]:
            warnings.append(of_mode(k, f"all but free to move ({in_hz(hz[k], 2)})"))
        else:
            break
    if not proof.is_counted:
        text = f"round-off hides how many modes lie below {in_hz(proof.below_hz)}: {proof.count} at most"
        warnings.append(_of_whole("proof", text))
    elif not proof.is_complete:
        text = f"{proof.missing} of the {proof.count} modes below {in_hz(proof.below_hz)} were not found"
        warnings.append(_of_whole("proof", text))
    is_known = rigid < len(hz) and proof.is_indexed[rigid] and np.isfinite(upper[rigid])
    return FreeMotions(rigid, (float(lower[rigid]), float(upper[rigid])) if is_known else None, warnings)


WORTH_A_WARNING = 0.01
"""Relative change of a frequency from which what makes it is a warning."""

ELASTIC_MODES = 6
"""Lowest modes beyond rigid motions, one of which what is taken for granted must move to be a warning."""

MOST_MODES = 3
"""Modes that a warning names."""


def assumed(full: FullOrderModel, rigid: int) -> tuple[list[Diagnostic], list[Diagnostic]]:
    """What the description takes for granted that moves one of the lowest frequencies beyond those of `rigid` motions
    by 1 % or more, or that no evidence covers, worst first, and what moves them by less."""
    warnings, minor = list[Diagnostic](), list[Diagnostic]()
    if not full.order:
        return warnings, minor
    try:
        errors, hz = model_errors_of_modes(full, min(rigid + ELASTIC_MODES, full.order))
    except SolverError as error:
        return [_of_whole("proof", f"how far the part may be from the model is not known: {error}")], minor
    for effect in errors.effects:
        if effect.kind == "mesh":  # `coarse_meshes` says it
            continue
        change = np.nan_to_num(np.maximum(np.abs(effect.low), np.abs(effect.high)))
        moved = [k for k in np.argsort(-change, kind="stable")[:MOST_MODES] if change[k] >= WORTH_A_WARNING]
        texts = [
            f"mode {k + 1} ({in_hz(hz[k], 4)}) by {interval_text((float(effect.low[k]), float(effect.high[k])))}"
            for k in moved or [int(change.argmax())]
        ]
        warning = Diagnostic.about(effect.kind, f"{effect.text}; moves {', '.join(texts)}", *effect.places)
        (warnings if moved else minor).append(warning)
    for unknown in errors.unknown:
        k = int(unknown.share.argmax())
        text = (
            f"no evidence of how far beams are off: {unknown.reason}; holds {unknown.share[k]:.0%} of the energy of"
            f" mode {k + 1} ({in_hz(hz[k], 4)})"
        )
        warning = Diagnostic.about("evidence", text, *unknown.places)
        (warnings if unknown.share[k] >= WORTH_A_WARNING else minor).append(warning)
    return warnings, minor


COARSE_MODES = 6
"""Lowest modes that meshes are looked at for."""


def coarse_meshes(full: FullOrderModel) -> list[Diagnostic]:
    """Meshes of solid parts that leave one of the lowest frequencies uncertain."""
    if not full.order or not part_meshes(full):
        return []
    pairs = lowest(full.K, full.M, min(COARSE_MODES, full.order))
    finite = np.flatnonzero(np.isfinite(pairs.values) & (pairs.values > 0))
    hz, u = np.sqrt(pairs.values[finite]) / (2 * np.pi), full.node_displacements(pairs.vectors[:, finite])
    errors = frequency_errors(full, u, hz)
    warnings: dict[str, Diagnostic] = {}
    for f, error, part in zip(hz, errors.share / 2, errors.part, strict=True) if errors else ():
        warning = mesh_warning("", f"a mode at {in_hz(f, 4)}", error, part)
        if warning is not None:
            warnings.setdefault(part, Diagnostic.about("mesh", warning.text, part))
    return list(warnings.values())


SLENDER = 500.0
"""Length over depth above which a member buckles or vibrates by itself long before it guides anything."""


def slender_members(full: FullOrderModel) -> Iterator[Diagnostic]:
    """Members so slender that they buckle or vibrate by themselves."""
    for name, part in full.plan.parts.items():
        lengths = full.geometry.parts[name].length
        _, _, nu, _ = part.table.moduli(full.values)
        sections = part.table.section_properties(full.values, nu, lengths)
        # the larger side of the rectangle with the same area and second moments
        sides = np.sqrt(12 * np.maximum(sections.Iy, sections.Iz) / sections.A)
        for k, (key, member) in enumerate(part.members.items()):
            depth = sides[part.first[k] : part.first[k + 1]].mean()
            if (isinstance(member, Link) or member.profile.type == "leaf") and lengths[k] > SLENDER * depth:
                text = f"slender: {lengths[k] / depth:.0f} times as long as wide"
                yield Diagnostic.about("slender", text, place_of(name, key))


OUTSIDE = 0.25
"""Distance of a carried node from the solid, relative to the size of the solid, from which it is a warning."""


def nodes_outside(full: FullOrderModel, reported: Collection[int]) -> list[Diagnostic]:
    """Bodies that carry nodes well outside their solids; nodes `reported` have a warning
    already for where they are."""
    warnings: dict[str, Diagnostic] = {}
    topology, positions = full.plan.topology, full.geometry.positions
    bodies = drawn_solids(full)
    clusters = [int(topology.piece[node_of(full, body.name)]) for body in bodies]
    for body, cluster in zip(bodies, clusters, strict=True):
        carried = np.flatnonzero((topology.piece == cluster) & topology.has_position).tolist()
        nodes = [node for node in carried if node not in reported]
        if clusters.count(cluster) > 1 or not nodes:
            continue
        farthest = max(nodes, key=lambda node: body.distance(positions[node]))
        distance, size = body.distance(positions[farthest]), float(max(body.size))
        if distance > OUTSIDE * size:
            text = (
                f"{topology.node_names[farthest]} lies {quantity(distance, 'm', 3)} outside the solid of"
                f" {quantity(size, 'm', 3)}: what leads there is taken as rigid and without mass; add links or bodies"
                " for it"
            )
            warnings.setdefault(body.kind, Diagnostic.about("reach", text, body.kind))
    return list(warnings.values())


def _joined_at_one_place(part: Part) -> Iterator[list[int]]:
    """Pairs of nodes of diaphragms and superelements."""
    yield from (ring.nodes for ring in part.diaphragms.values())
    for nodes in (own.nodes for own in part.superelements.values()):
        yield from (list(pair) for pair in combinations([n for n in nodes if n < part.n_positioned], 2))


def overlapping_nodes(full: FullOrderModel) -> Iterator[Diagnostic]:
    """Named nodes of different rigid clusters at one place, which no diaphragm nor superelement joins: perhaps a joint
    was forgotten."""
    topology, positions = full.plan.topology, full.geometry.positions
    copies = topology.copies.values()
    named = np.array([k + node for own in copies for k in own.offset for node in range(own.part.n_named)], np.intp)
    held = {frozenset(topology.root[k + np.array(nodes)].tolist()) for own in copies for k in own.offset
            for nodes in _joined_at_one_place(own.part)}  # fmt: skip
    size = float(np.ptp(positions, axis=0).max()) or 1.0
    cell = np.round(positions[named] / (SAME_PLACE * size)).astype(np.int64)
    order = np.lexsort(cell.T)
    same = (cell[order][1:] == cell[order][:-1]).all(axis=1)
    for a, b in zip(named[order][:-1][same], named[order][1:][same], strict=True):
        roots = frozenset(topology.root[[a, b]].tolist())
        if topology.piece[a] != topology.piece[b] and roots not in held:
            text = f"at the same place as {topology.node_names[b]}, but not joined to it"
            yield Diagnostic.about("overlap", text, topology.node_names[a])


FLAT = 3.0
"""Width over least thickness from which a member is a leaf, with a thin and a wide direction."""

LIKE = 0.2
"""Members are alike when lengths, widths and thicknesses differ by less than this share."""

ACROSS = 0.1
"""Cosine of the angle between thin directions up to which they stand across each other."""

CROSSING = 1.5
"""Two leaves whose planes meet within so many half widths of both are an angle or a cross, and meant so."""

SOFTER = 4.0
"""The least eigenvalue falls by more than this when a member is turned whose reference gets a warning."""

MOST_TURNED, MOST_ORDER = 8, 20_000
"""Members that are turned one after the other, and the order of models in which this is done."""


def turned_references(full: FullOrderModel, bars: Bars) -> list[Diagnostic]:
    """Leaves across those like them between the same two bodies, such that turned by 90 degrees they let these move.

    Two leaves of a guide have one thin direction, or thin directions that both stand across the axis of a pivot. Where
    the thin direction of one stands across that of another, the mechanism is solved with its reference turned by 90
    degrees; it gets a warning when the least eigenvalue of the elastic motions falls by more than SOFTER.
    """
    suspects = _across(bars)
    if not suspects or full.order > MOST_ORDER:
        return []
    eigenvalue = _least_eigenvalue(full)
    softest: dict[tuple[int, int], float] = {}
    warnings: dict[tuple[int, int], Diagnostic] = {}
    for i, j in suspects[:MOST_TURNED]:
        ratio = eigenvalue / _least_eigenvalue(_turned(full, bars, i))
        pair = (min(i, j), max(i, j))
        if ratio > softest.get(pair, SOFTER):
            softest[pair] = ratio
            text = (
                f"its wide side stands in the motion that {bars.names[j]}, beside it, leaves free: turned by 90"
                f" degrees it would make the mechanism {ratio:.2g} times softer in its lowest mode; is its `reference`"
                " meant so?"
            )
            warnings[pair] = Diagnostic.about("reference", text, bars.names[i])
    return list(warnings.values())


class _Leaves(NamedTuple):
    """Thin directions (n, 3), widths and least thicknesses (n, 2), m, of members, and which are leaves (n,)."""

    thin: Array
    sizes: Array
    is_leaf: NDArray[np.bool_]

    @classmethod
    def of(cls, bars: Bars) -> _Leaves:
        """Of all members, those of round sections never leaves."""
        lofts = [(bars.lofts[group], int(row)) for group, row in zip(bars.group, bars.row, strict=True)]
        least = np.array([[loft.y[row].min(), loft.z[row].min()] for loft, row in lofts]).reshape(-1, 2)
        axis, every = np.argmin(least, axis=1), np.arange(len(least))
        sizes = 2 * np.column_stack([least[every, 1 - axis], least[every, axis]])
        is_round = np.array([loft.is_round for loft, _ in lofts], dtype=bool)
        return cls(bars.axes[every, 1 + axis], sizes, ~is_round & (sizes[:, 0] > FLAT * sizes[:, 1]))


def _across(bars: Bars) -> list[tuple[int, int]]:
    """Pairs of members, both ways round, whose thin directions stand across each other, the first to be turned."""
    if not bars.names:
        return []
    leaves = _Leaves.of(bars)
    between: dict[tuple[int, ...], list[int]] = {}
    for k in np.flatnonzero(leaves.is_leaf).tolist():
        first, second = sorted(bars.clusters[k].tolist())
        if first != second:
            between.setdefault((first, second), []).append(k)
    measures = np.column_stack([bars.length, leaves.sizes])
    pairs: list[tuple[int, int]] = []
    seen: set[tuple[str, str]] = set()
    for group in between.values():
        for a, i in enumerate(group):
            for j in group[a + 1 :]:
                labels = (bars.labels[i], bars.labels[j])
                if labels[0] == labels[1] or labels in seen or abs(leaves.thin[i] @ leaves.thin[j]) > ACROSS:
                    continue
                seen.add(labels)
                alike = (abs(measures[i] - measures[j]) <= LIKE * np.maximum(measures[i], measures[j])).all()
                if alike and not _cross(bars, leaves, i, j):
                    pairs += [(i, j), (j, i)]
    return pairs


def _cross(bars: Bars, leaves: _Leaves, i: int, j: int) -> bool:
    """Whether the line in which the planes of two leaves meet passes within both of them."""
    middle = {k: bars.origin[k] + bars.axes[k, 0] * bars.length[k] / 2 for k in (i, j)}
    planes = leaves.thin[[i, j]]
    line = np.cross(*planes)
    offsets = [planes[0] @ middle[i], planes[1] @ middle[j], line @ (middle[i] + middle[j]) / 2]
    point = np.linalg.solve(np.stack([*planes, line]), offsets)
    for k in (i, j):
        wide = np.cross(leaves.thin[k], bars.axes[k, 0])
        # where the line is nearest to the leaf's middle, along its width
        slope = line @ wide
        nearest = point + (0.0 if abs(slope) < 0.5 else ((middle[k] - point) @ wide) / slope) * line
        if abs((nearest - middle[k]) @ wide) > CROSSING * leaves.sizes[k, 0] / 2:
            return False
    return True


def _least_eigenvalue(full: FullOrderModel) -> float:
    """The least eigenvalue, (rad/s)^2, above those of rigid motions."""
    values = lowest(full.K, full.M, min(8, full.order)).values
    finite = values[np.isfinite(values) & (values > 0)]
    return float(finite[0]) if len(finite) else np.inf


def _turned(full: FullOrderModel, bars: Bars, k: int) -> FullOrderModel:
    """The same mechanism with the reference of a member, in all copies of its part, turned by 90 degrees."""
    name, _, key = bars.labels[k].rpartition(".")
    mechanism = full.plan.mechanism
    prototype = mechanism if name == TOP else mechanism.substructures[origin_of(name)]
    row = list(full.plan.parts[name].members).index(key)
    side = full.geometry.parts[name].R[row, 1]
    kind = "flexures" if key in prototype.flexures else "links"
    members = getattr(prototype, kind)
    member = members[key].model_copy(update={"reference": tuple(map(float, side))})
    turned = prototype.model_copy(update={kind: {**members, key: member}})
    if name != TOP:
        turned = mechanism.replaced({"substructures": {**mechanism.substructures, name: turned}})
    assert isinstance(turned, Mechanism)
    return assemble(turned, full.parameters)
