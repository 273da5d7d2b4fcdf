"""Elements that are warmer: what expands takes its ends along, and what it does not may take it is under force.

Temperatures are linear in place in every thing by itself, so that free expansion of a homogeneous thing has no stress;
its displacement from a point is that of eq. W13 of the theory (Boley and Weiner 1960, sections 3.2 and 9.1).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.duals import plain
from flexura.errors import OptionError
from flexura.mechanism import GROUND
from flexura.motion.diaphragms import BentRings
from flexura.motion.elements import Group, PoseElements
from flexura.motion.layout import Laid
from flexura.motion.se3 import rotation
from flexura.motion.superelements import Superelements
from flexura.structure import Warmth

ALIKE = 1e-9
"""Difference of free strains, relative, up to which two are one."""


def expansion(reach: Array, strain: Array, gradient: Array) -> tuple[Array, Array]:
    """Displacement and rotation (..., 3) of points at `reach` (..., 3) from where the free strain is `strain` (...),
    which has a gradient (..., 3), 1/m, in a body that nothing holds, as seen from there (theory eq. W13)."""
    along = (gradient * reach).sum(axis=-1)
    square = (reach * reach).sum(axis=-1)
    moved = (strain + along)[..., None] * reach - (square / 2)[..., None] * gradient
    return moved, np.cross(gradient, reach)


class Warmed(NamedTuple):
    """Elements in states of temperature, and the displacements and rotations (n + 1, 6) of nodes as seen from the
    frames that they follow."""

    elements: tuple[Group, ...]
    growth: Array

    @staticmethod
    def of(model: Laid, shares: Mapping[str, Any]) -> Warmed:
        """Those of a model in states of temperature, of each a share.

        Raises ModelError and OptionError as `Temperatures.of`, and OptionError for what is not known: bodies in one
        with others that expand otherwise, diaphragms that expand otherwise than what holds them, gradients in layers.
        """
        states = _States(model, shares)
        root = np.append(model.design.plan.topology.root, len(model.dof) - 1)
        moved, turned = states.growth(root, model.arm)
        elements = tuple(states.group(group, names) for group, names in zip(model.elements, model.names, strict=True))
        return Warmed(elements, np.concatenate([moved, turned], axis=1))


class _States:
    """What is warmer in some states of temperature, of each a share."""

    def __init__(self, model: Laid, shares: Mapping[str, Any]) -> None:
        plan = model.design.plan
        self.model = model
        states = [plan.temperatures.of(name, model.design) for name in shares]
        self.warm: dict[str, list[tuple[Any, Warmth]]] = {}
        for share, state in zip(shares.values(), states, strict=True):
            for name, own in state.items():
                self.warm.setdefault(name, []).append((share, own))
        n = len(model.dof)
        self.strain: Array = np.zeros(n, like=model.design.values)
        self.gradient: Array = np.zeros((n, 3), like=model.design.values)
        self.moved: Array = np.zeros((n, 2, 3), like=model.design.values)
        """Free strain at frames of what they carry, its gradient, 1/m, and displacement and rotation of held frames."""
        self._ground()
        self._bodies()

    def _free(self, name: str, points: Array, middle: Array) -> tuple[Any, Any]:
        """Free strain of a thing at points (..., 3), and its gradient (3,)."""
        rates = [(share * own.expansion, own) for share, own in self.warm[name]]
        return sum(r * own.at(points, middle) for r, own in rates), sum(r * own.gradient for r, own in rates)

    def _ground(self) -> None:
        """The ground takes along what it holds, as seen from the global origin."""
        if GROUND not in self.warm:
            return
        model, origin = self.model, np.zeros(3)
        held = np.flatnonzero((model.dof < 0).all(axis=1))
        x = model.rest.x[held]
        strain, gradient = self._free(GROUND, x, origin)
        start, _ = self._free(GROUND, origin, origin)
        self.strain[held], self.gradient[held] = strain, gradient
        self.moved[held] = np.stack(expansion(x, start, gradient), axis=1)

    def _bodies(self) -> None:
        """Rigid bodies take along what they carry."""
        model, topology = self.model, self.model.design.plan.topology
        bodies = {name: k for k, name in enumerate(topology.node_names) if self._is_rigid_body(name, k)}
        owner: dict[int, str] = {}
        for name, number in bodies.items():
            root = int(topology.root[number])
            centre = model.rest.x[number]
            cold = np.zeros(()), np.zeros(3)
            free = self._free(name, model.rest.x[root], centre) if name in self.warm else cold
            if root in owner and not all(
                np.allclose(plain(a), plain(b), rtol=ALIKE, atol=0)
                for a, b in zip(free, (self.strain[root], self.gradient[root]), strict=True)
            ):
                raise OptionError(
                    f"{name} and {owner[root]} are one rigid body and expand differently: how they bend each other is"
                    " not known; give them one temperature and material, or join them by members"
                )
            owner[root] = name
            self.strain[root], self.gradient[root] = free

    def _is_rigid_body(self, name: str, number: int) -> bool:
        topology = self.model.design.plan.topology
        return name in self._body_names and bool(topology.is_rigid[number])

    @cached_property
    def _body_names(self) -> set[str]:
        return set(self.model.design.plan.body_names)

    def growth(self, frames: Index, reach: Array) -> tuple[Array, Array]:
        """Displacement and rotation (..., 3) of points at `reach` (..., 3) from frames, as seen from these at rest."""
        moved, turned = expansion(reach, self.strain[frames], self.gradient[frames])
        start, turn = self.moved[frames, 0], self.moved[frames, 1]
        return start + np.cross(turn, reach) + moved, turn + turned

    def group(self, group: Any, names: tuple[str, ...]) -> Group:
        """One kind of elements."""
        if not hasattr(group, "arm"):
            return group
        count = group.arm.shape[1]
        moved, turned = self.growth(group.node[:, :count], group.arm)
        grown = replace(group, arm=group.arm + moved)
        if isinstance(group, PoseElements):
            grown = replace(grown, axes=rotation(turned) @ group.axes)
            return self._members(grown, group, names)
        if isinstance(group, Superelements):
            return self._parts(grown, turned, group, names)
        return grown

    def _members(self, grown: PoseElements, group: PoseElements, names: tuple[str, ...]) -> PoseElements:
        """Beams of one name after another, or springs, which do not expand."""
        at: dict[str, list[int]] = {}
        for e, name in enumerate(names):
            if name in self.warm:
                at.setdefault(name, []).append(e)
        if not at or not group.are_beams:
            return grown
        ends = group.ends(self.model.rest)
        middle = ends.position.mean(axis=1)
        length = np.linalg.norm(ends.position[:, 1] - ends.position[:, 0], axis=1)
        rest = group.rest + np.zeros(group.rest.shape, like=self.model.design.values)
        moduli, size = (np.ones(len(names), like=self.model.design.values) for _ in range(2))
        for name, rows in at.items():
            own = middle[rows]
            centre = ends.position[rows].reshape(-1, 3).mean(axis=0)
            if any(warm.kind == "layered" for _, warm in self.warm[name]):
                rest[rows] = rest[rows] + self._layers(name, group, rows, own, centre)
            else:
                strain, gradient = self._free(name, own, centre)
                axes = ends.axes[rows, 0]
                bent = (np.swapaxes(axes, -1, -2) @ np.cross(gradient, axes[..., 0])[..., None])[..., 0]
                free = np.concatenate([strain[:, None], 0 * bent[:, :2], bent], axis=1)
                rest[rows] = rest[rows] + length[rows, None] * free
                size[rows] = 1 + strain
            moduli[rows] = 1 + self._softening(name, own, centre)
        return replace(grown, rest=rest, strain=group.strain.scaled(moduli, size))

    def _softening(self, name: str, points: Array, middle: Array) -> Any:
        """Relative change of moduli at points (..., 3); none where it is not known."""
        change: Any = 0.0
        for share, own in self.warm[name]:
            if not np.isnan(plain(own.softening)):
                change = change + share * own.softening * own.at(points, middle)
        return change

    def _layers(self, name: str, group: PoseElements, rows: list[int], points: Array, middle: Array) -> Array:
        """Free strains (e, 6) of the elements of a layered member, of a temperature that is the same in all layers."""
        *steps, key = name.split(".")
        path = tuple(steps)
        topology, values = self.model.design.plan.topology, self.model.design.values
        copies = next(own for own in topology.copies.values() if key in own.part.members and path in own.paths)
        member = list(copies.part.members).index(key)
        N, M = copies.part.table.blocking(member, "temperature", values)
        number = copies.number[copies.paths.index(path)]
        sign = -1 if np.linalg.det(plain(self.model.design.geometry.Q[number])) < 0 else 1
        along = group.axes[rows, 0][:, :, 0]
        wrench = np.zeros((len(rows), 6), like=self.model.design.values)
        for share, own in self.warm[name]:
            if np.abs(np.cross(along, own.gradient)).max() > ALIKE * max(np.abs(plain(own.gradient)).max(), 1e-300):
                raise OptionError(f"{name}: layers are warmer all through; a gradient across them is not known")
            warmer = share * own.at(points, middle)
            wrench[:, 0] = wrench[:, 0] + N * warmer
            wrench[:, 4] = wrench[:, 4] + sign * M * warmer
        free: Any = np.linalg.solve(group.strain.stiffness[rows, :6, :6], wrench[..., None])
        return free[..., 0]

    def _parts(
        self, grown: Superelements, turned: Array, group: Superelements, names: tuple[str, ...]
    ) -> Superelements:
        """Superelements, bodies that bend and diaphragms, one each, of nodes that these take along."""
        [name] = names
        x = (self.model.rest.x[group.node[:, : group.count]] + group.arm)[0]
        if name in self.warm:
            first, gradient = self._free(name, x[0], x.mean(axis=0))
            moved, twist = expansion(x - x[0], first, gradient)
        else:
            first, moved, twist = 0.0, np.zeros_like(x), np.zeros_like(x)
        if isinstance(group, BentRings):
            rims = self.strain[group.node[0, :2]]
            if not np.allclose(plain(rims), plain(first), rtol=ALIKE, atol=0):
                raise OptionError(
                    f"{name}: a diaphragm that expands otherwise than its rim and its hub is under stress in its plane,"
                    " which is not known; warm all three alike, or give it fidelity: solid"
                )
        twist = twist - turned[0]
        relative = np.concatenate([moved[1:], twist[1:] - twist[:1]], axis=1)
        # the first frame is turned against the part by what it takes along
        relative[:, :3] = relative[:, :3] - np.cross(twist[0], x[1:] - x[0])
        local = (group.axes[0].T @ relative.reshape(-1, 2, 3, 1))[..., 0].reshape(-1, 6)
        after = group.logs_at(self.model.rest).after[0]
        rest = group.rest + (after @ local[..., None])[..., 0][None]
        if name not in self.warm:
            return replace(grown, rest=rest)
        turns = np.arange(group.energy.stiffness.shape[-1]) % 6 >= 3
        turns[6 * (group.count - 1) :] = False
        middle = x.mean(axis=0)
        moduli, length = (np.reshape(1 + own, 1) for own in (self._softening(name, middle, middle), first))
        energy = group.energy.scaled(moduli, length, turns)
        return replace(grown, rest=rest, energy=energy)
