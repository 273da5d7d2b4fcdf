"""Matrices of what is no member: rigid bodies, point masses, springs, stops, piezo stacks, sensors that weigh."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array, Index
from flexura.beam import (
    SectionProperties,
    UniformBeam,
    block_rotation,
    combine,
    element_mass,
    element_stiffness,
    geometric_basis,
    member_frame,
    rigid_arm,
)
from flexura.duals import moves, plain, zeros
from flexura.mechanism import (
    Actuator,
    Box,
    Composite,
    Cylinder,
    Dashpot,
    Matrix,
    Mechanism,
    MotionSensor,
    PiezoStack,
    Plate,
    PointMass,
    RigidBody,
    Rotation,
    Sensor,
    Spring,
    Stop,
    StrainActuator,
    Substructure,
    Superelement,
    rotation_matrix,
)
from flexura.structure.composites import MeshedSolid
from flexura.structure.sections import family_properties
from flexura.structure.values import ValueTable

_BOX = (np.eye(3) - np.eye(3)[:, None] * np.eye(3)).reshape(3, 9)
"""The inertia of a box per twelfth of its mass times the square of each side (3, 9)."""


@dataclass
class _Frame:
    """An optional rotation of a discrete element's axes."""

    axis: Index | None
    angle: int = 0

    @staticmethod
    def of(table: ValueTable, rotation: Rotation | None) -> _Frame:
        if rotation is None:
            return _Frame(None)
        return _Frame(table.entries(rotation.axis), table.add(rotation.angle))

    def matrix(self, values: Array) -> Array:
        """Q (..., 3, 3) that carries the discrete element's axes into the part's."""
        if self.axis is None:
            return np.eye(3)
        return rotation_matrix(values[..., self.axis], values[..., self.angle])

    def turned(self, tensor: Array, values: Array) -> Array:
        """A tensor (..., 3, 3) of the discrete element's axes in the part's."""
        if self.axis is None:
            return tensor
        Q = self.matrix(values)
        return Q @ tensor @ np.swapaxes(Q, -1, -2)


def inertia_tensor(entries: Array) -> Array:
    """Symmetric tensor (..., 3, 3) from (..., 3) principal or (..., 6) entries (xx, yy, zz, xy, xz, yz)."""
    tensor = np.zeros((*entries.shape[:-1], 3, 3), like=entries)
    for k, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)][: entries.shape[-1]]):
        tensor[..., i, j] = tensor[..., j, i] = entries[..., k]
    return tensor


def rigid_mass(mass: Array, inertia: Array) -> Array:
    """Mass matrix (..., 6, 6) at the centre of mass from mass (...), kg, and inertia (..., 3, 3), kg m^2."""
    M = zeros((*inertia.shape[:-2], 6, 6), mass, inertia)
    for i in range(3):
        M[..., i, i] = mass
    M[..., 3:, 3:] = inertia
    return M


class Lumped:
    """What a discrete element is made of: stiffness or mass over its nodes at values (..., s) and positions (..., n, 3)
    of these, part's axes."""

    has_stiffness: bool = True
    has_mass: bool = True
    loss: int | None = None
    """Entry of its loss factor."""

    def matrices(self, values: Array, positions: Array) -> tuple[Array | None, Array | None]:
        """K and M (..., 6n, 6n), None where it has none."""
        raise NotImplementedError

    def resisted(self, values: Array, positions: Array) -> tuple[Array, Array] | None:
        """Stiffness k and B (r, 6n) with K = B' k B where it resists displacements B u alone, else None; one design."""
        del values, positions
        return None


class Inertia(Lumped):
    """What has mass alone, at one node."""

    has_stiffness = False

    def matrix(self, values: Array) -> Array:
        """Mass matrix (..., 6, 6) at its node."""
        raise NotImplementedError

    def matrices(self, values: Array, positions: Array) -> tuple[None, Array]:
        """Mass alone."""
        del positions
        return None, self.matrix(values)


class Form(NamedTuple):
    """A box, or a cylinder about its first axis, or the box around a composite: unit axes (3, 3) as rows, half sizes
    (3,), m, and its middle (3,), m, from the body's node."""

    axes: Array
    half: Array
    is_round: bool
    middle: Array


class Hold(NamedTuple):
    """The face at which the ground holds a body, by axis and side, -1 or 1, and the nodes of the part on it that are
    clamped."""

    face: tuple[int, int]
    nodes: tuple[str, ...] = ()


def described_hold(body: RigidBody) -> Hold | None:
    """How a body is held, as described."""
    return None if body.held is None else Hold(("xyz".index(body.held.face[0]), 1 if body.held.face[1] == "+" else -1))


class BodyElement(Inertia):
    """Mass matrix of a rigid body at its own node (theory eqs. 31-32)."""

    def __init__(self, table: ValueTable, body: RigidBody, mechanism: Mechanism) -> None:
        self._frame = _Frame.of(table, body.rotate)
        self._solid = body.solid
        self.hold: Hold | None = described_hold(body)
        """The face at which the ground holds it."""
        self.elastic: bool | str = body.elastic if body.solid is not None else False
        """Whether it bends, as described."""
        self.mesh: MeshedSolid | None = body.solid.meshed if isinstance(body.solid, Composite) else None
        """The solid of a composite."""
        if body.solid is None:
            assert body.mass is not None and body.inertia is not None
            self._mass, self._inertia = table.add(body.mass), table.entries(body.inertia)
            return
        material = mechanism.material(body.solid.material)
        self._rho, self._E = table.add(material.rho), table.add(material.E)
        self._has_nu = material.nu is not None
        self._nu_or_G = table.add(material.nu if material.nu is not None else material.G)  # type: ignore[arg-type]
        match body.solid:
            case Box(size=size):
                self._size = table.entries(size)
            case Plate(length=a, width=b, thickness=c):
                self._size = table.entries((a, b, c))
            case Cylinder(diameter=d, length=length, axis=axis):
                self._size, self._axis = table.entries((d, length)), table.entries(axis)
            case Composite():
                low, high = body.solid.meshed.pieces.box
                self._size = table.entries(tuple((high - low).tolist()))
                self._middle: Array = (low + high) / 2

    def mass_and_inertia(self, values: Array) -> tuple[Array, Array]:
        """Mass (...), kg, and inertia tensor (..., 3, 3) about the centre of mass, kg m^2, in the part's axes."""
        if self._solid is None:
            mass, tensor = values[..., self._mass], inertia_tensor(values[..., self._inertia])
        elif self.mesh is not None:
            m, coupling = self.mesh.rigid[0, 0], self.mesh.rigid[3:, :3]
            mass, tensor = np.array(m), self.mesh.rigid[3:, 3:] - coupling @ coupling.T / m
        elif isinstance(self._solid, Cylinder):
            d, length = values[..., self._size[0]], values[..., self._size[1]]
            mass = values[..., self._rho] * np.pi / 4 * d**2 * length
            axis = values[..., self._axis]
            axis = axis / np.linalg.norm(axis, axis=-1, keepdims=True)
            across, along = mass * (d**2 / 16 + length**2 / 12), mass * d**2 / 8
            outer = axis[..., :, None] * axis[..., None, :]
            tensor = across[..., None, None] * (np.eye(3) - outer) + along[..., None, None] * outer
        else:
            size = values[..., self._size]
            mass = values[..., self._rho] * size[..., 0] * size[..., 1] * size[..., 2]
            tensor = combine(mass[..., None] / 12 * size * size, _BOX, 3)
        return mass, self._frame.turned(tensor, values)

    def matrix(self, values: Array) -> Array:
        """Mass matrix (..., 6, 6) about its node, which is the centre of mass but of composites; part's axes."""
        if self.mesh is None:
            return rigid_mass(*self.mass_and_inertia(values))
        turn = block_rotation(self._frame.matrix(values))
        return turn @ self.mesh.rigid @ np.swapaxes(turn, -1, -2)

    def middle(self, values: Array) -> Array:
        """The middle (..., 3), m, of the box around it, from its node, part's axes."""
        return np.zeros(3) if self.mesh is None else self._frame.matrix(values) @ self._middle

    @property
    def has_form(self) -> bool:
        """Whether the body is described by a solid."""
        return self._solid is not None

    @property
    def is_round(self) -> bool:
        """Whether the body is a cylinder."""
        return isinstance(self._solid, Cylinder)

    def modulus(self, values: Array) -> Array:
        """Young's modulus (...) of a body that has a form, Pa."""
        return values[..., self._E]

    def material(self, values: Array) -> tuple[Array, Array, Array]:
        """Young's modulus (...), Pa, Poisson's ratio (...) and density (...), kg/m^3, of a body that has a form."""
        E, other = values[..., self._E], values[..., self._nu_or_G]
        return E, other if self._has_nu else E / (2 * other) - 1, values[..., self._rho]

    def box(self, values: Array) -> tuple[Array, Array]:
        """The box around a body that has a form: axes (..., 3, 3) as rows, part's axes, and half sizes (..., 3), m."""
        turned, size = np.swapaxes(self._frame.matrix(values), -1, -2), values[..., self._size]
        if not self.is_round:
            return turned, size / 2
        axis = values[..., None, self._axis]
        return member_frame(axis, least_aligned(axis))[..., 0, :, :] @ turned, size[..., [1, 0, 0]] / 2

    def form(self, values: Array) -> Form | None:
        """The solid, part's axes; None where only mass and inertia are known. One design."""
        if self._solid is None:
            return None
        return Form(*self.box(values), self.is_round, self.middle(values))


class PointMassElement(Inertia):
    """Mass matrix of a point mass at its node (theory eq. 33)."""

    def __init__(self, table: ValueTable, point: PointMass) -> None:
        self._mass = table.add(point.mass)
        self._inertia = table.entries(point.inertia or (0.0, 0.0, 0.0))
        self._offset = table.entries(point.offset)

    def matrix(self, values: Array) -> Array:
        """Mass matrix (..., 6, 6) about the node, part's axes."""
        M = rigid_mass(values[..., self._mass], inertia_tensor(values[..., self._inertia]))
        D = rigid_arm(values[..., self._offset])
        return np.swapaxes(D, -1, -2) @ M @ D


class SpringElement(Lumped):
    """Stiffness of a spring, or damping of a dashpot, over its one or two nodes (theory eq. 30)."""

    has_mass = False

    def __init__(self, table: ValueTable, spring: Spring | Dashpot, nodes: list[int]) -> None:
        self.nodes = nodes
        if isinstance(spring, Spring) and spring.loss_factor is not None:
            self.loss: int | None = table.add(spring.loss_factor)
        self._frame = _Frame.of(table, spring.rotate)
        self._at = None if spring.at is None else table.entries(spring.at)
        s = spring.stiffness if isinstance(spring, Spring) else spring.damping
        if s is not None:
            diagonal = table.entries((s.tx, s.ty, s.tz, s.rx, s.ry, s.rz))
            zero = table.add(0.0)
            self._entries = np.full((6, 6), zero, dtype=np.intp)
            np.fill_diagonal(self._entries, diagonal)
        else:
            assert isinstance(spring, Spring) and spring.matrix is not None
            self._entries = np.array([table.entries(row) for row in spring.matrix])

    def relative(self, values: Array, positions: Array) -> tuple[Array, Array]:
        """Its own matrix (..., 6, 6), and B (..., 6, 6n) that gives the displacement which it resists, in its own axes,
        from those of the n nodes at `positions` (..., n, 3), part's axes."""
        at = self.point(values, positions)
        reach = [rigid_arm(at - positions[..., k, :]) for k in range(len(self.nodes))]
        B = reach[0] if len(reach) == 1 else np.concatenate([-reach[0], reach[1]], axis=-1)
        X = block_rotation(self._frame.matrix(values))
        return values[..., self._entries], np.swapaxes(X, -1, -2) @ B

    def matrix(self, values: Array, positions: Array) -> Array:
        """Matrix (..., 6n, 6n) over the n nodes at `positions` (..., n, 3), part's axes."""
        K, B = self.relative(values, positions)
        return np.swapaxes(B, -1, -2) @ K @ B

    def matrices(self, values: Array, positions: Array) -> tuple[Array, None]:
        """Stiffness alone."""
        return self.matrix(values, positions), None

    def resisted(self, values: Array, positions: Array) -> tuple[Array, Array]:
        """The displacement between its nodes, by its own matrix."""
        return self.relative(values, positions)

    def axes(self, values: Array) -> Array:
        """Its axes (..., 3, 3) as columns, part's axes."""
        return self._frame.matrix(values)

    def point(self, values: Array, positions: Array) -> Array:
        """Where it is (..., 3): rigid arms lead there from the nodes at `positions` (..., n, 3), part's axes."""
        return positions.mean(axis=-2) if self._at is None else values[..., self._at]


class StopElement:
    """Numbers of a stop between its one or two nodes, which has no part in any matrix."""

    def __init__(self, table: ValueTable, stop: Stop, nodes: list[int]) -> None:
        self.nodes = nodes
        self._direction = table.entries(stop.direction)
        self._numbers = table.entries((stop.gap, stop.stiffness, stop.damping))

    def direction(self, values: Array) -> Array:
        """The unit direction (3,) in which it is met, part's axes; one design."""
        direction = values[self._direction]
        return direction / np.linalg.norm(direction)

    def numbers(self, values: Array) -> Array:
        """Gap, m, stiffness, N/m, and damping, s/m; one design."""
        return values[self._numbers]


class SuperelementMatrices(Lumped):
    """K and M of a superelement, those of its amplitudes, six to a node, behind those of its `nodes`."""

    def __init__(self, table: ValueTable, described: Superelement, nodes: list[int]) -> None:
        self.nodes = nodes
        self.amplitudes: int = described.amplitudes
        self.loss: int | None = None if described.loss_factor is None else table.add(described.loss_factor)
        self._variation = variation = described.variation
        spare = np.eye(-described.amplitudes % 6)

        def filled(given: Sequence[Matrix], by: Array) -> Array:
            return np.stack([la.block_diag(own.array, by) for own in given])

        terms = (variation.stiffness, variation.mass) if variation else ([described.stiffness], [described.mass])
        self._K, self._M = filled(terms[0], spare), filled(terms[1], 0 * spare)
        if variation is not None:
            self._sizes, self._material = table.entries(variation.sizes), table.entries(variation.material)
            self._places = np.array(variation.places)

    def matrices(self, values: Array, positions: Array) -> tuple[Array, Array]:
        """As they are described; of a part that varies, polynomials, over nodes that may have left their places.

        Raises OptionError for sizes beyond those that the part was reduced for.
        """
        variation = self._variation
        if variation is None:
            return self._K[0], self._M[0]
        sizes, (E, rho) = values[..., self._sizes], np.moveaxis(values[..., self._material], -1, 0)
        variation.refuse_beyond(plain(sizes))
        x = (sizes - variation.centre) / variation.reach
        shares = [np.prod(x**powers, axis=-1) for powers in np.array(variation.powers)]
        K = _combined([own * E / variation.nominal[0] for own in shares], self._K)
        M = _combined([own * rho / variation.nominal[1] for own in shares], self._M)
        return self.over_nodes(K, positions), self.over_nodes(M, positions)

    def over_nodes(self, A: Array, positions: Array) -> Array:
        """A matrix (..., n, n) as described over the nodes at `positions`, which rigid arms join to their places."""
        if self._variation is None:
            return A
        count = len(self._places)
        away = self._places - positions[..., :count, :]
        if not moves(away) and not away.any():
            return A
        T = zeros((*away.shape[:-2], A.shape[-1], A.shape[-1]), away)
        T[..., range(6 * count, A.shape[-1]), range(6 * count, A.shape[-1])] = 1.0
        for k, arm in enumerate(np.moveaxis(rigid_arm(away), -3, 0)):
            T[..., 6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = arm
        return np.swapaxes(T, -1, -2) @ A @ T


def _combined(shares: Sequence[Array], matrices: Array) -> Array:
    """The sum of matrices (k, n, n) times their shares (...)."""
    total = shares[0][..., None, None] * matrices[0]
    for share, own in zip(shares[1:], matrices[1:], strict=True):
        total = total + share[..., None, None] * own
    return total


class PiezoElement(Lumped):
    """Stiffness and mass of a piezo stack over its two nodes: a spring along its line, or a bonded prism.

    The prism has the stack's axial stiffness k = E A / L; its other stiffnesses follow from its section (theory
    eq. T2).
    """

    def __init__(self, table: ValueTable, piezo: PiezoStack, nodes: list[int]) -> None:
        self.nodes = nodes
        self._numbers = table.entries((piezo.stiffness, piezo.mass, piezo.nu))
        self._shape, self._sizes = "", table.entries(())
        if piezo.section is not None:
            self._shape = piezo.section.shape
            names = [name for name in type(piezo.section).model_fields if name != "shape"]
            self._sizes = table.entries(tuple(getattr(piezo.section, name) for name in names))

    def stiffness(self, values: Array) -> Array:
        """Axial stiffness (...), N/m."""
        return values[..., self._numbers[0]]

    def mass(self, values: Array) -> Array:
        """Mass (...), kg."""
        return values[..., self._numbers[1]]

    def section(self, values: Array) -> SectionProperties | None:
        """Section of a bonded stack."""
        if not self._shape:
            return None
        return family_properties(self._shape, [values[..., k] for k in self._sizes], values[..., self._numbers[2]])

    @staticmethod
    def frame(positions: Array) -> Array:
        """Axes (..., 3, 3) of the prism as rows."""
        axis = (positions[..., 1, :] - positions[..., 0, :])[..., None, :]
        return member_frame(axis, least_aligned(axis))[..., 0, :, :]

    @staticmethod
    def elongation(positions: Array) -> Array:
        """Rows (..., 12): elongation from the displacements of both nodes at `positions` (..., 2, 3)."""
        axis = positions[..., 1, :] - positions[..., 0, :]
        axis = axis / np.linalg.norm(axis, axis=-1, keepdims=True)
        rows = np.zeros((*axis.shape[:-1], 12), like=axis)
        rows[..., :3], rows[..., 6:9] = -axis, axis
        return rows

    def geometric(self, values: Array, positions: Array) -> Array:
        """Geometric stiffness (..., 2, 12, 12) per axial force at both ends, part's axes: of a string, or of the prism
        (theory eqs. P3, P8). One design."""
        if self._shape:
            beam, T = self.prism(values, positions)
            return T.T @ geometric_basis(beam) @ T
        axis = positions[1] - positions[0]
        length = np.sqrt(axis @ axis)
        across = (np.eye(3) - axis[:, None] * axis / length**2) / length
        string = np.zeros((12, 12), like=across)
        for i, j, sign in ((0, 0, 1), (6, 6, 1), (0, 6, -1), (6, 0, -1)):
            string[i : i + 3, j : j + 3] = sign * across
        return np.stack([string, string]) / 2

    def matrices(self, values: Array, positions: Array) -> tuple[Array, Array]:
        """K and M (..., 12, 12), part's axes, for nodes at `positions` (..., 2, 3)."""
        if not self._shape:
            k, mass, _ = (values[..., entry] for entry in self._numbers)
            rows = self.elongation(positions)
            K = k[..., None, None] * rows[..., :, None] * rows[..., None, :]
            points = np.diag(np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], 2))
            return K, mass[..., None, None] / 2 * points
        beam, T = self.prism(values, positions)
        Tt = np.swapaxes(T, -1, -2)
        return Tt @ element_stiffness(beam) @ T, Tt @ element_mass(beam) @ T

    def resisted(self, values: Array, positions: Array) -> tuple[Array, Array] | None:
        """The elongation of a pinned stack."""
        return None if self._shape else (self.stiffness(values).reshape(1, 1), self.elongation(positions)[None])

    def prism(self, values: Array, positions: Array) -> tuple[UniformBeam, Array]:
        """A bonded stack as a beam, and its element axes as T (..., 12, 12)."""
        k, mass, nu = (values[..., entry] for entry in self._numbers)
        length = np.linalg.norm(positions[..., 1, :] - positions[..., 0, :], axis=-1)
        s = self.section(values)
        assert s is not None
        E, rho = k * length / s.A, mass / (s.A * length)
        R = self.frame(positions)
        T = np.zeros((*R.shape[:-2], 12, 12), like=R)
        for i in range(4):
            T[..., 3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = R
        fields = (E * s.A, E / (2 * (1 + nu)) * s.J, E * s.Iy, E * s.Iz, 0.0, 0.0, rho * s.A, rho * (s.Iy + s.Iz))
        return UniformBeam(*np.broadcast_arrays(*fields, rho * s.Iy, rho * s.Iz, length)), T


def least_aligned(axis: Array) -> Array:
    """The coordinate direction (..., m, 3) that is least aligned with each axis: a frame for round sections."""
    return np.eye(3)[np.argmin(np.abs(axis), axis=-1)]


class SensorMass(Inertia):
    """A share of the mass of a sensor, entry `mass`, at one of its nodes."""

    def __init__(self, mass: int, share: float) -> None:
        self._mass, self._share = mass, share

    def matrix(self, values: Array) -> Array:
        """Mass matrix (..., 6, 6)."""
        mass = self._share * values[..., self._mass]
        return rigid_mass(mass, np.broadcast_to(np.zeros((3, 3)), (*mass.shape, 3, 3)))


NUMBERS = ("direction", "point", "limit", "stiffness", "free_stroke", "blocked_force", "gain")
"""What an actuator or a sensor may have a number or a vector of."""


class PartChannels:
    """Actuators and sensors of one prototype, laid out once.

    `actuators` and `sensors` are the descriptions, `nodes` the numbers of their nodes in the part, by kind and name.
    """

    def __init__(self, table: ValueTable, prototype: Substructure, number: Callable[[str], int]) -> None:
        self.actuators: dict[str, Actuator] = prototype.actuators
        self.sensors: dict[str, Sensor] = prototype.sensors
        self.nodes: dict[tuple[str, str], list[int]] = {}
        self._entries: dict[tuple[str, str], dict[str, Index]] = {}
        self.piezos: dict[str, PiezoElement] = {}
        self.masses: list[tuple[str, int, SensorMass]] = []
        """Name, node, and mass there of sensors that have one."""
        for kind, entries in (("actuator", self.actuators), ("sensor", self.sensors)):
            for key, part in entries.items():
                own = prototype.flexures[part.member] if isinstance(part, StrainActuator) else part
                at = self.nodes[kind, key] = [number(n) for n in getattr(own, "nodes", ())]
                numbers = ((name, getattr(part, name, None)) for name in NUMBERS)
                self._entries[kind, key] = {n: table.entries(value) for n, value in numbers if value is not None}
                if isinstance(part, PiezoStack):
                    self.piezos[key] = PiezoElement(table, part, at)
                if isinstance(part, MotionSensor) and part.mass != 0:
                    mass = SensorMass(table.add(part.mass), 1 / len(at))
                    self.masses += [(key, node, mass) for node in at]

    def number(self, kind: str, key: str, name: str, values: Array) -> Array | None:
        """A number (...) or vector (..., 3) of an actuator or sensor at values (..., s); None where it has none."""
        entries = self._entries[kind, key].get(name)
        return None if entries is None else values[..., entries]

    def mass_matrices(self, values: Array) -> list[tuple[str, int, Array]]:
        """Name, node and mass matrix (..., 6, 6) of the sensors that have a mass."""
        return [(key, node, mass.matrix(values)) for key, node, mass in self.masses]

    def described_mass(self, key: str, values: Array, positions: Array) -> Array:
        """Rigid-body mass matrix (6, 6) of a piezo stack about the part's origin, from its mass and section alone."""
        discrete = self.piezos[key]
        mass = float(discrete.mass(values))
        total = np.zeros((6, 6))
        section = discrete.section(values)
        if section is None:
            pieces = [(mass / 2, np.zeros((3, 3)), x) for x in positions]
        else:
            axis = positions[1] - positions[0]
            L = float(np.linalg.norm(axis))
            R = discrete.frame(positions)
            slender = L * L / 12
            local = np.array([(section.Iy + section.Iz) / section.A, slender + section.Iy / section.A,
                              slender + section.Iz / section.A])  # fmt: skip
            pieces = [(mass, R.T @ np.diag(mass * local) @ R, positions.mean(axis=0))]
        for m, inertia, centre in pieces:
            D = rigid_arm(centre)
            total += D.T @ rigid_mass(np.array(m), inertia) @ D
        return total
