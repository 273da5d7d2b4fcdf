"""Heat that flows through members and contacts: temperatures that last, and how soon they are reached.

Bodies and parts have one temperature each, members one in each element, with half of what they store at each end
(Incropera and DeWitt 2007, sections 3.1 and 5.1).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from flexura.arrays import Array, Bools, Index
from flexura.duals import Dual, plain, slope_of, with_slopes_of
from flexura.errors import ModelError, OptionError, Problem
from flexura.mechanism import AIR, GROUND, Layout
from flexura.structure.elements import Elements
from flexura.structure.values import ValueTable

DENSE_PLACES = 2000
"""Places of a network up to which all its time constants are worked out."""

SHOWN_CONSTANTS = 6
"""Time constants that are told, the slowest first."""


class Evaluated(Protocol):
    """One design of a plan: its values (s,), and where everything is."""

    @property
    def plan(self) -> Any:
        """The plan."""
        ...

    @property
    def values(self) -> Array:
        """The values."""
        ...

    @property
    def geometry(self) -> Any:
        """The geometry."""
        ...


class _Path(NamedTuple):
    """Conductances (b,), W/K, between pairs of places (b, 2)."""

    places: Index
    conductance: Any


class HeatNetwork:
    """The places of a mechanism that have a temperature each, and what leads heat between them."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        mechanism = layout.mechanism

        def entry(value: object) -> int:
            return table.add(np.nan if value is None else value)  # type: ignore[arg-type]

        self._members: dict[str, list[tuple[int, int]]] = {}
        self._bodies: dict[str, dict[str, int]] = {}
        for name, prototype in layout.prototypes.items():
            metals = [mechanism.material(member.material) for _, _, member in prototype.members()]
            self._members[name] = [(entry(m.conductivity), entry(m.heat_capacity)) for m in metals]
            self._bodies[name] = {
                key: entry(None if body.solid is None else mechanism.material(body.solid.material).heat_capacity)
                for key, body in prototype.bodies.items()
            }
        self._contacts = {
            key: (own.between, [table.add(x) for x in (own.conductance, own.coefficient, own.area) if x is not None])
            for key, own in mechanism.thermal_contacts.items()
        }

    def steady(self, design: Evaluated, heat: Mapping[str, Any], held: Mapping[str, Any]) -> dict[str, Any]:
        """Lasting temperatures, K, of bodies, parts and the ground by name, and of members those of their elements
        (e,), with `heat`, W, into some and others `held` at temperatures.

        Raises ModelError for contacts of nothing, OptionError for members whose conductivity is not known, and where
        nothing leads heat away.
        """
        where = _Places(design)
        paths = self._paths(design, where)
        fixed: dict[int, Any] = {where.of(GROUND): 0.0, where.of(AIR): 0.0}
        fixed |= {place: t for name, t in held.items() for place in where.all_of(name)}
        power = np.zeros(where.count, like=design.values)
        for name, watts in heat.items():
            places = where.all_of(name)
            shares = np.bincount(places, minlength=where.count) / len(places)
            power = power + shares * watts
        at = np.array(list(fixed), dtype=np.intp)
        temperature = np.zeros(where.count, like=design.values)
        for place, held_at in fixed.items():
            temperature[place] = held_at
        free = np.setdiff1d(np.unique(where.used), at)
        _refuse_isolated(where, paths, free, at, power)
        free = free[_reached(where.count, paths.places, at)[free]]
        temperature = _solved(paths, temperature, power, free)
        means = (temperature[where.element_ends].mean(axis=1)) if len(where.element_ends) else np.zeros(0)
        found: dict[str, Any] = {name: temperature[where.of(name)] for name in where.single}
        return found | {name: means[rows] for name, rows in where.element_rows.items()}

    def time_constants(self, design: Evaluated) -> tuple[Array, list[str]]:
        """The slowest time constants, s, with which temperatures settle while the ground and the air keep theirs, and
        what has no heat capacity, which is then left out."""
        where = _Places(design)
        paths = self._paths(design, where)
        at = np.array([where.of(GROUND), where.of(AIR)])
        free = np.setdiff1d(np.unique(where.used), at)
        free = free[_reached(where.count, paths.places, at)[free]]
        stored, unknown = self._stored(design, where)
        if not len(free) or len(free) > DENSE_PLACES or not stored[free].any():
            return np.zeros(0), unknown
        G = _matrix(paths, where.count)[free][:, free].toarray()
        values: Any = la.eigh(np.diag(stored[free]), G, eigvals_only=True)[::-1]
        return values[:SHOWN_CONSTANTS][values[:SHOWN_CONSTANTS] > 0], unknown

    def _paths(self, design: Evaluated, where: _Places) -> _Path:
        """What leads heat. Raises ModelError and OptionError."""
        values, plan = design.values, design.plan
        places = [where.element_ends]
        start, resistance = 0, _elements(design).resistance
        by_part = dict[str, Any]()
        for name, part in plan.parts.items():
            stop = start + len(part.connectivity)
            k = values[..., [own for own, _ in self._members[name]]] if part.members else np.zeros(0)
            by_part[name] = k[part.table.element_member] / resistance[start:stop] if stop > start else np.zeros(0)
            start = stop
        conductances: list[Any] = [by_part[name] for name, _ in where.order]
        known = np.concatenate([np.zeros(0), *map(plain, conductances)])
        if np.isnan(known).any():
            names = sorted({name for name, rows in where.element_rows.items() if np.isnan(known[rows]).any()})
            raise OptionError(f"{', '.join(names[:5])}: no conductivity is known; give it in the material")
        for key, (between, entries) in self._contacts.items():
            ends = [where.all_of(name) for name in between]
            for name, found in zip(between, ends, strict=True):
                if not len(found):
                    path = ("thermal_contacts", key, "between")
                    raise ModelError(
                        [Problem(path, name, "there is no such node, body or part", f"or {GROUND}, {AIR}")]
                    )
            size = values[entries[0]] if len(entries) == 1 else values[entries[0]] * values[entries[1]]
            pairs = np.array([[a, b] for a in np.unique(ends[0]) for b in np.unique(ends[1])])
            places.append(pairs)
            conductances.append(np.ones(len(pairs)) / len(pairs) * size)
        return _Path(
            np.concatenate([np.zeros((0, 2), dtype=np.intp), *places]), np.concatenate(conductances or [np.zeros(0)])
        )

    def _stored(self, design: Evaluated, where: _Places) -> tuple[Array, list[str]]:
        """Heat capacities (n,) of places, J/K, and the names of what has none that is known."""
        values, plan = plain(design.values), design.plan
        stored, unknown = np.zeros(where.count), list[str]()
        rho = plain(plan.members.moduli(values)[1])[plan.members.element_member]
        mass = rho * plain(_elements(design).volume)
        start, by_part = 0, dict[str, Array]()
        for name, part in plan.parts.items():
            stop = start + len(part.connectivity)
            c = values[[own for _, own in self._members[name]]] if part.members else np.zeros(0)
            by_part[name] = c[part.table.element_member] * mass[start:stop] if stop > start else np.zeros(0)
            start = stop
        each = np.concatenate([np.zeros(0), *(by_part[name] for name, _ in where.order)])
        unknown += [name for name, rows in where.element_rows.items() if np.isnan(each[rows]).any()]
        np.add.at(stored, where.element_ends.ravel(), np.repeat(np.nan_to_num(each) / 2, 2))
        for copies in plan.topology.copies.values():
            for path in copies.paths:
                for key, capacity in self._bodies[copies.part.name].items():
                    name = ".".join((*path, key))
                    _, body = copies.part.bodies[key]
                    own = float(values[capacity] * plain(body.mass_and_inertia(values)[0]))
                    if np.isnan(own):
                        unknown.append(name)
                    else:
                        stored[where.of(name)] += own
        return stored, unknown


class _Places:
    """Which nodes have one temperature: those of one body or part, and all that the ground holds."""

    def __init__(self, design: Evaluated) -> None:
        topology = design.plan.topology
        n = topology.n_nodes
        ground, air = n, n + 1
        pairs = [(k, int(root)) for k, root in enumerate(topology.root)]
        pairs += [(int(k), ground) for k in np.flatnonzero(topology.held[topology.root].all(axis=1))]
        self.single: list[str] = [GROUND]
        nodes: dict[str, list[int]] = {GROUND: [ground], AIR: [air]}
        ends, self.element_rows, first = [], dict[str, Index](), 0
        self.order: list[tuple[str, int]] = []
        for name, copies in topology.copies.items():
            part = copies.part
            for copy, path in enumerate(copies.paths):
                prefix = ".".join(path) + "." if path else ""
                offset = copies.offset[copy]
                meshed = {**part.elastic, **part.superelements}
                several = {key: [k for k in own.nodes if k < part.n_positioned] for key, own in meshed.items()}
                several |= {key: [number] for key, (number, _) in part.bodies.items() if key not in several}
                for key, own in several.items():
                    at = [offset + k for k in own]
                    pairs += [(at[0], k) for k in at[1:]]
                    nodes[prefix + key] = at
                    self.single.append(prefix + key)
                if len(part.connectivity):
                    self.order.append((name, copy))
                    ends.append(offset + part.connectivity)
                    for key, start, stop in zip(part.members, part.first[:-1], part.first[1:], strict=True):
                        self.element_rows[prefix + key] = np.arange(first + start, first + stop)
                    first += len(part.connectivity)
        joined = sp.coo_matrix((np.ones(len(pairs)), np.array(pairs).T), shape=(n + 2, n + 2))
        count, place = connected_components(joined, directed=False)
        self.count: int = int(count)
        self._place: Index = place.astype(np.intp)
        self._nodes = nodes
        self._names = {name: k for k, name in enumerate(topology.node_names)}
        self.element_ends: Index = self._place[np.concatenate([np.zeros((0, 2), dtype=np.intp), *ends])]
        used = [self.element_ends.ravel(), *(self._place[at] for at in nodes.values())]
        self.used: Index = np.concatenate(used)

    def of(self, name: str) -> int:
        """The place of a body, a part, the ground or the air."""
        return int(self._place[self._nodes[name][0]])

    def all_of(self, name: str) -> Index:
        """The places of what has a name, of a member those at both ends of each of its elements; none of nothing."""
        if name in self.element_rows:
            return self.element_ends[self.element_rows[name]].ravel()
        known = self._nodes.get(name) or ([self._names[name]] if name in self._names else [])
        return self._place[known]


def _elements(design: Evaluated) -> Elements:
    return design.plan.elements(design.values, design.geometry)


def _matrix(paths: _Path, count: int) -> sp.csc_matrix:
    a, b = paths.places.T
    g = plain(paths.conductance)
    rows, columns = np.concatenate([a, b, a, b]), np.concatenate([a, b, b, a])
    return sp.csc_matrix((np.concatenate([g, g, -g, -g]), (rows, columns)), shape=(count, count))


def _reached(count: int, places: Index, at: Index) -> Bools:
    """Places (n,) from which heat can go to some."""
    graph = sp.coo_matrix((np.ones(len(places)), places.T), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    return np.isin(label, label[at])


def _refuse_isolated(where: _Places, paths: _Path, free: Index, at: Index, power: Any) -> None:
    """Raise OptionError where heat goes into what nothing leads it away from."""
    lost = free[~_reached(where.count, paths.places, at)[free] & (plain(power)[free] != 0)]
    if len(lost):
        name = next((name for name in where.single if where.of(name) in lost), "a member")
        raise OptionError(f"nothing leads away the heat that goes into {name}: join it by members or a thermal contact")


def _solved(paths: _Path, temperature: Any, power: Any, free: Index) -> Any:
    """Temperatures (n,) with those that are free worked out; with slopes where anything has some."""
    if not len(free):
        return temperature
    solve = splu(_matrix(paths, len(plain(power)))[free][:, free].tocsc()).solve

    def missing(t: Any) -> Any:
        a, b = paths.places.T
        flow = paths.conductance * (t[b] - t[a])
        out = power + np.zeros_like(power)
        np.add.at(out, a, flow)
        np.add.at(out, b, -flow)
        return out[free]

    start = plain(temperature).copy()
    start[free] += solve(plain(missing(start)))
    like = with_slopes_of(paths.conductance, temperature, power)
    if like is None:
        return start
    known: Any = Dual(start, np.zeros((len(slope_of(like)), *start.shape)))
    known = known + (temperature - plain(temperature))
    known[free] = known[free] + Dual(np.zeros(len(free)), solve(slope_of(missing(known)).T).T)
    return known
