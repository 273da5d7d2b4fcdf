"""Where to put sensors so that a test tells the modes apart: effective independence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.full_order import assemble
from flexura.linalg import ranked
from flexura.mechanism import DOF_NAMES, Mechanism, is_pattern
from flexura.modal import DEPENDENT_SHAPES, largest_motion, mac
from flexura.reduction import full_order_modes
from flexura.results import Tabular
from flexura.structure import FullOrderModel, Plan
from flexura.tables import Facts, Item, Table, counted, number, percent, quantity
from flexura.testing.correlation import UNSEEN
from flexura.testing.measurement import MeasuredChannel
from flexura.testing.rig import TURNS, pair_channels
from flexura.thresholds import EQUAL_BY_SYMMETRY, SAME_PLACE

ADD_MORE = "add other directions, or nodes such as those of the mesh within members (candidates '*.t*')"

STILL = 1e-12
"""A place moves that has more than this share of the largest motion in some mode."""

MOST_EXCHANGES = 100
"""Most exchanges of sensors."""


@dataclass(frozen=True, repr=False)
class SensorPlacement(Tabular):
    """The chosen sensors and how well they tell the modes apart.

    `sensors` name DOFs or described sensors, the most important one first; `positions` and `directions` (k, 3), m;
    `turns` (k,) tells those that read rotations. `independence` (k,) is what of the modes each sensor alone
    contributes, from 0 to 1: at 1 the modes are lost without it. `information` is the geometric mean, over the modes,
    of the share of the information of all candidates that the chosen ones have; `mac` (n, n) the AutoMAC of the modes,
    and `condition` the condition number of their shapes, at the chosen sensors.
    """

    _shown = ("name", "sensors", "information", "condition")

    name: str
    frequency_hz: Array
    sensors: tuple[str, ...]
    positions: Array
    directions: Array
    turns: NDArray[np.bool_]
    independence: Array
    information: float
    mac: Array
    condition: float
    candidates: tuple[str, ...]
    exchanges: int
    model: FullOrderModel
    notes: tuple[str, ...] = ()

    @property
    def worst_mac(self) -> float:
        """Largest MAC of two different modes at the chosen sensors."""
        return float((self.mac - np.eye(len(self.mac))).max(initial=0.0))

    def _data(self) -> dict[str, Any]:
        """Everything but the model."""
        chosen = zip(self.sensors, self.positions, self.directions, self.turns, self.independence, strict=True)
        return {
            "name": self.name,
            "frequency_hz": self.frequency_hz,
            "sensors": [
                {"name": name, "position": x, "direction": d, "rotation": turn, "independence": share}
                for name, x, d, turn, share in chosen
            ],
            "information": self.information,
            "mac": self.mac,
            "worst_mac": self.worst_mac,
            "condition": self.condition,
            "candidates": len(self.candidates),
            "exchanges": self.exchanges,
        }

    def _title(self) -> str:
        return f"{len(self.sensors)} of {len(self.candidates)} candidates for {counted(len(self.frequency_hz), 'mode')}"

    def presentation(self) -> Iterator[Item]:
        """The chosen sensors and how well they tell the modes apart."""

        def vector_text(values: Array, factor: float = 1.0) -> str:
            return (
                ", ".join(number(round(factor * x, 6), 4) for x in values.tolist()) if np.isfinite(values).all() else ""
            )

        turned = ["about " if turns else "" for turns in self.turns]
        columns = {
            "sensor": self.sensors,
            "at, mm": [vector_text(position, 1e3) for position in self.positions],
            "direction": [turn + vector_text(axis) for turn, axis in zip(turned, self.directions, strict=True)],
            "independence": [f"{value:.3f}" for value in self.independence],
        }
        yield Table(columns, "sensors")
        yield Facts(
            {
                "largest MAC of two modes": f"{self.worst_mac:.3f}",
                "condition number": f"{self.condition:.3g}",
                "of the information of all candidates": percent(self.information),
                "exchanges": self.exchanges,
            }
        )

    def _columns(self) -> dict[str, Any]:
        """The sensors, the most important one first."""
        places = {f"{axis} [m]": self.positions[:, k] for k, axis in enumerate("xyz")}
        return {"sensor": self.sensors, **places, "rotation": self.turns, "independence": self.independence}


@verb
def place_sensors(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    sensors: int,
    n: int = 6,
    candidates: Sequence[str] | None = None,
    exchange: bool = True,
) -> SensorPlacement:
    """The best places for so many `sensors` among the candidates, to tell the first `n` modes apart.

    The way is effective independence. `candidates` are described sensors and DOFs by name, wildcards allowed
    (`platform.t*`); by default all described sensors, or without any the displacements of all nodes that the
    description names. The sensor that contributes least to the determinant of the Fisher information of the modal
    coordinates is left out until so many remain (Kammer 1991; theory eqs. Q14-Q15); with `exchange`, sensors are then
    swapped for left-out ones while the determinant grows (Fedorov 1972). All sensors are equally accurate, a rotation
    counting as the displacement at half of the longest side of the mechanism; their mass is not part of this.

    Raises ModelError, and OptionError for unknown candidates, fewer sensors than modes, and candidates that do not tell
    the modes apart.
    """
    full = assemble(model, parameters)
    full.plan.refuse_pose("places of sensors")
    if not 1 <= n <= sensors:
        raise OptionError(
            f"{n} modes need at least {n} sensors, and at least one mode is asked for; found {sensors} sensors"
        )
    pairs = full_order_modes(full, n)
    if len(pairs.values) < n:
        raise OptionError(f"the model has only {counted(len(pairs.values), 'mode')}, not {n}")
    reach = 0.5 * float(np.ptp(full.geometry.positions, axis=0).max())
    u = full.node_displacements(pairs.vectors)
    places = _candidates(full, candidates, pairs.vectors, u, reach)
    if len(places.names) < sensors:
        raise OptionError(
            f"{sensors} sensors are asked for, but only {len(places.names)} candidates move in the modes: {ADD_MORE}"
        )
    size = np.linalg.norm(places.shapes, axis=0)
    shapes = places.shapes / np.maximum(size, 1e-300)
    _refuse_dependent(shapes, size < UNSEEN * largest_motion(u, reach))
    chosen = effective_independence(shapes, sensors)
    chosen, exchanges = exchanged(shapes, chosen) if exchange else (chosen, 0)
    order = ranked(_contribution(shapes[chosen]))
    independence, chosen = _contribution(shapes[chosen])[order], chosen[order]
    at_sensors = shapes[chosen]
    return SensorPlacement(
        full.plan.mechanism.name,
        np.sqrt(np.maximum(pairs.values, 0.0)) / (2 * np.pi),
        tuple(places.names[i] for i in chosen),
        places.positions[chosen],
        places.directions[chosen],
        places.turns[chosen],
        independence,
        float(np.exp((log_determinant(at_sensors) - log_determinant(shapes)) / n)),
        mac(at_sensors, at_sensors),
        float(np.linalg.cond(at_sensors)),
        places.names,
        exchanges,
        full,
        (f"rotations count as displacements {quantity(reach, 'm', 4)} away",) if places.turns.any() else (),
    )


@dataclass(frozen=True)
class _Candidates:
    """Places for sensors: names (c), shapes (c, n), rotations times reach, positions and directions (c, 3)."""

    names: tuple[str, ...]
    shapes: Array
    positions: Array
    directions: Array
    turns: NDArray[np.bool_]


def _candidates(
    model: FullOrderModel, wanted: Sequence[str] | None, vectors: Array, u: Array, reach: float
) -> _Candidates:
    """Candidates that move in modes with `vectors` (n, k) and displacements `u` (n_nodes, 6, k), one for every place
    and direction."""
    topology, x = model.plan.topology, model.geometry.positions
    names, types = candidate_names(model, wanted), _sensor_types(model)
    described = [k for k, name in enumerate(names) if name in types]
    dofs = [k for k, name in enumerate(names) if name not in types]
    parts = [names[k].rpartition(".") for k in dofs]
    for k, (node, _, dof) in zip(dofs, parts, strict=True):
        if dof not in DOF_NAMES or not node:
            raise OptionError(f"{names[k]!r} is neither a described sensor nor a DOF such as NODE.tx")
    number = topology.numbers([node for node, _, _ in parts])
    dof = np.array([DOF_NAMES.index(dof) for _, _, dof in parts], dtype=int)
    shapes, turns = np.zeros((len(names), vectors.shape[1])), np.zeros(len(names), dtype=bool)
    positions, directions = np.full((len(names), 3), np.nan), np.full((len(names), 3), np.nan)
    shapes[dofs], positions[dofs], turns[dofs] = u[number, dof], x[number], dof >= 3
    directions[dofs] = np.eye(3)[dof % 3]
    kinds = ["rotation" if types[names[k]] in TURNS else "displacement" for k in described]
    placed = pair_channels(model, [MeasuredChannel(names[k], q) for k, q in zip(described, kinds, strict=True)])
    at = np.array(described, dtype=np.intp)[placed.at]
    shapes[at], turns[at] = placed.rows @ vectors, placed.turns
    positions[at], directions[at] = placed.positions, placed.directions
    shapes[turns] *= reach
    keys = np.zeros((len(names), 5))
    keys[:, 0] = -1.0 - np.arange(len(names))
    keys[dofs] = np.column_stack([topology.root[number], dof, np.round(x[number] / (SAME_PLACE * (reach or 1.0)))])
    first = np.sort(np.unique(keys, axis=0, return_index=True)[1])
    first = first[(np.abs(shapes[first]) > STILL * largest_motion(u, reach)).any(axis=1)]
    chosen = tuple(names[k] for k in first)
    return _Candidates(chosen, shapes[first], positions[first], directions[first], turns[first])


def candidate_names(model: FullOrderModel, wanted: Sequence[str] | None = None) -> tuple[str, ...]:
    """Names of candidate sensors, wildcards written out. Raises OptionError for names that mean nothing."""
    described = [name for name, kind in _sensor_types(model).items() if kind != "force"]
    if wanted is None:
        return tuple(described or [f"{node}.{dof}" for node in _nodes(model, True) for dof in DOF_NAMES[:3]])
    every = [*described, *(f"{node}.{dof}" for node in _nodes(model) for dof in DOF_NAMES)]
    names: list[str] = []
    for name in [wanted] if isinstance(wanted, str) else wanted:
        matching = [e for e in every if _matches(e, name)] if is_pattern(name) else [name]
        if not matching:
            raise OptionError(f"no sensor or DOF matches {name!r}; DOFs are written NODE.tx, e.g. {every[0]}")
        names += matching
    return tuple(dict.fromkeys(names))


def _sensor_types(model: FullOrderModel) -> dict[str, str]:
    """Types of the described sensors by name."""
    return {
        ".".join((*path, key)): str(sensor.type)
        for placed in model.plan.topology.copies.values()
        for path in placed.paths
        for key, sensor in placed.part.channels.sensors.items()
    }


def _matches(name: str, pattern: str) -> bool:
    """Whether a name matches as a whole, or its node and DOF match those of the pattern."""
    node, _, dof = pattern.rpartition(".")
    own_node, _, own_dof = name.rpartition(".")
    if own_dof in DOF_NAMES and node:
        return fnmatchcase(own_node, node) and fnmatchcase(own_dof, dof)
    return fnmatchcase(name, pattern)


def effective_independence(shapes: Array, k: int) -> Index:
    """Positions (k,) of the rows of shapes (c, n) that are left when the least independent is left out one by one.

    The contribution of row i is E_i = phi_i (Phi^T Phi)^-1 phi_i^T; leaving it out multiplies det(Phi^T Phi) by 1 - E_i
    (Kammer 1991; theory eqs. Q14-Q15). Among equals the last is left out. n <= k <= c, and the columns are independent.
    """
    left = np.arange(len(shapes))
    while len(left) > k:
        contribution = _contribution(shapes[left])
        left = np.delete(left, np.flatnonzero(contribution <= contribution.min() + EQUAL_BY_SYMMETRY)[-1])
    return left


def exchanged(shapes: Array, chosen: Index) -> tuple[Index, int]:
    """Exchange chosen rows for others while det(Phi^T Phi) grows, the best exchange first; the rows and the number.

    Row j in place of i multiplies the determinant by (1 + E_jj)(1 - E_ii) + E_ij^2 (Fedorov 1972; theory eq. Q16).
    """
    chosen = chosen.copy()
    for count in range(MOST_EXCHANGES):
        rest = np.setdiff1d(np.arange(len(shapes)), chosen)
        Q, R = np.linalg.qr(shapes[chosen])
        P = np.linalg.solve(R.T, shapes[rest].T).T
        growth = (1 + (P**2).sum(axis=1)) * (1 - (Q**2).sum(axis=1))[:, None] + (Q @ P.T) ** 2
        if not growth.size or growth.max() <= 1 + EQUAL_BY_SYMMETRY:
            return chosen, count
        i, j = np.unravel_index(int(np.flatnonzero(growth >= (1 - EQUAL_BY_SYMMETRY) * growth.max())[0]), growth.shape)
        chosen[i] = rest[j]
    return chosen, MOST_EXCHANGES


def log_determinant(shapes: Array) -> float:
    """ln det(Phi^T Phi) of shapes (k, n); minus infinity where they are dependent."""
    s = np.linalg.svd(shapes, compute_uv=False)
    if len(s) < shapes.shape[1] or s[-1] <= DEPENDENT_SHAPES * s[0]:
        return -np.inf
    return float(2 * np.log(s).sum())


def _contribution(shapes: Array) -> Array:
    """Diagonal (k,) of Phi (Phi^T Phi)^-1 Phi^T."""
    Q, _ = np.linalg.qr(shapes)
    return (Q**2).sum(axis=1)


def _refuse_dependent(shapes: Array, unseen: NDArray[np.bool_]) -> None:
    """Raise OptionError where the candidates do not tell the modes apart, naming the modes."""
    if unseen.any():
        modes = ", ".join(str(i + 1) for i in np.flatnonzero(unseen))
        raise OptionError(f"none of the candidates moves in mode {modes}: {ADD_MORE}")
    _, s, Vt = np.linalg.svd(shapes, full_matrices=False)
    if s[-1] <= DEPENDENT_SHAPES * s[0]:
        share = np.abs(Vt[-1])
        modes = ", ".join(str(i + 1) for i in np.flatnonzero(share > 0.1 * share.max()))
        raise OptionError(f"the candidates do not distinguish modes {modes}: {ADD_MORE}")


def _nodes(model: FullOrderModel, described: bool = False) -> list[str]:
    """Names of all nodes that can move, or of those that the description names."""
    topology = model.plan.topology
    moves = topology.has_position & (topology.dof[topology.root] >= 0).any(axis=1)
    return [
        ".".join((*path, node))
        for placed in topology.copies.values()
        for path, offset in zip(placed.paths, placed.offset, strict=True)
        for k, node in enumerate(placed.part.node_names[: placed.part.n_own if described else None])
        if moves[offset + k]
    ]
