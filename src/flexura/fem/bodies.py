"""Composites as solids: drawn and meshed by netgen, and reduced to the shapes in which they bend (theory eq. O6)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arrays import Array, Index
from flexura.beam import FiniteSolid, Patches, Tetrahedra, along_axes, fitted_rows, rigid_arm
from flexura.errors import ModelError, Problem
from flexura.expressions import Expression
from flexura.fem.cache import Arrays, content_key, remembered
from flexura.fem.geometry import MILLIMETRE, SolidMaterial
from flexura.fem.matrices import elastic_matrices
from flexura.fem.occ import ShapeError, composite_shape, kernel, tetrahedra
from flexura.fem.solid_mesh import TETRA_EDGES, SolidMesh, outer_sides, rigid_motions
from flexura.linalg import factorise_large
from flexura.mechanism import (
    TOP,
    Composite,
    Mechanism,
    Parameter,
    RigidBody,
    Substructure,
    evaluated,
    scalars,
)
from flexura.records import Kept
from flexura.structure import Pieces, Plan, rigid_mass
from flexura.thresholds import SAME_PLACE

P = TypeVar("P", bound=Substructure)

REVISION = 4
"""Goes up whenever meshes or shapes of composites change."""

CELL = 0.6
"""Length of cells over the mean thickness, twice the volume over the surface."""

COARSE = 3.0
"""The same of a coarse mesh, which tells what the solid meets."""

AROUND, COARSE_AROUND = 12, 8
"""Cells around a circle, and of the coarse mesh."""

MODES, ITERATIONS = 12, 4
"""Vectors from which its lowest modes are sought among the shapes of a composite, and how often (inverse iteration)."""

LARGER, SMALLER = 1.3, 0.7
"""Sizes of patches, relative, whose deflections are among the shapes beside those of the patches themselves: members
may become thicker and thinner."""

SOFT = 1e-4
"""What keeps a free solid in place where it is factorised, over its lowest squared frequency, about."""

DEPENDENT = 1e-11
"""Part of a shape that the others lack, squared, below which it is made of them."""

STIFFEST = 0.495
"""Poisson's ratio above which quadratic cells would lock."""

NO_MATERIAL = SolidMaterial("", 1.0, 0.0, 1.0)

IN_MEMORY = Kept(most=16)
"""Arrays of the composites that were asked for last."""


@dataclass(frozen=True)
class MeshedBody:
    """A composite in the axes of its body and from its centre; material: E, Pa, nu, rho, kg/m^3.

    Raises ShapeError, when it is first looked at, where its pieces are no solid, OptionError without netgen, and
    SolverError where that fails.
    """

    pieces: Pieces
    material: tuple[float, float, float]

    def mesh(self, announce: Callable[[], None] = lambda: None) -> Arrays:
        """Mass properties for a density of one, and meshes; `announce` is called where they are made."""
        parts = (REVISION, CELL, self.pieces)

        def make() -> Arrays:
            announce()
            return _meshed(self.pieces)

        return IN_MEMORY.once(content_key(parts), lambda: remembered("body-mesh", parts, make))

    @cached_property
    def _mesh(self) -> Arrays:
        return self.mesh()

    @property
    def rigid(self) -> Array:
        """Mass matrix (6, 6) about the origin."""
        return np.asarray(self.material[2] * self._mesh["rigid"])

    @property
    def volume(self) -> float:
        """Volume, m^3."""
        return float(self._mesh["rigid"][0, 0])

    @property
    def thickness(self) -> float:
        """Mean thickness, m: twice the volume over the surface."""
        return float(self._mesh["thickness"])

    @property
    def cell(self) -> float:
        """Length of the cells of its mesh, m."""
        return CELL * self.thickness

    @property
    def cells(self) -> Array:
        """Corners (c, 4, 3), m, of the tetrahedra of a coarse mesh."""
        return self._mesh["coarse"]

    @property
    def surface(self) -> tuple[Array, Index]:
        """Points (n, 3), m, and triangles (t, 3), outside anticlockwise."""
        return self._mesh["corners"], self._mesh["triangles"]

    def solid(self, patches: Patches, held: tuple[int, int] | None) -> FiniteSolid:
        """What it does when it is pulled at patches, one design, free or held at a face of the box around it.

        Raises ShapeError where nothing of that face is left.
        """
        E, nu, rho = self.material
        parts = (REVISION, CELL, self.pieces, nu, patches.points.round(12), patches.weights.round(9), held)
        key = content_key(parts)
        unit = IN_MEMORY.once(key, lambda: remembered("body-shapes", parts, lambda: self._shapes(nu, patches, held)))
        root = rho**0.5
        modes = unit["shapes"] / np.float32(root), E / rho * unit["squared"], root * unit["momentum"]
        return FiniteSolid(self._tetrahedra, modes, self.rigid, held)

    def held_points(self, held: tuple[int, int]) -> Index:
        """Points of the mesh on a face of the box around what is added. Raises ShapeError where fewer are left than
        hold a solid."""
        low, high = self.pieces.box
        points, level = self._mesh["points"], (low, high)[held[1] > 0][held[0]]
        on_face = np.flatnonzero(np.abs(points[:, held[0]] - level) < SAME_PLACE * float((high - low).max()))
        spread = (
            np.linalg.svd(points[on_face] - points[on_face].mean(axis=0), compute_uv=False) if len(on_face) else [0, 0]
        )
        if len(on_face) < 6 or spread[1] < SAME_PLACE * spread[0]:
            face = "xyz"[held[0]] + ("-" if held[1] < 0 else "+")
            raise ShapeError(("held", "face"), face, "nothing is left of the face that is held", "hold another one")
        return on_face

    @cached_property
    def _tetrahedra(self) -> Tetrahedra:
        return Tetrahedra(self._mesh["points"], self._mesh["tetrahedra"])

    def _shapes(self, nu: float, patches: Patches, held: tuple[int, int] | None) -> Arrays:
        """Shapes (n, 3, s) of unit modal mass, their squared frequencies (s,) and momenta (6, s), for E = rho = 1."""
        points, cells = self._mesh["points"], self._mesh["tetrahedra"]
        material = SolidMaterial("", 1.0, min(nu, STIFFEST), 1.0)
        mesh = SolidMesh(points, {"tetra10": cells}, {"tetra10": np.zeros(len(cells), dtype=np.intp)}, (material,))
        K, M = elastic_matrices(mesh)
        rigid = rigid_motions(points)
        is_free = np.ones(len(points), dtype=bool)
        if held is not None:
            is_free[self.held_points(held)] = False
        free = np.flatnonzero(np.repeat(is_free, 3))
        size = float(np.ptp(points, axis=0).max())
        shift = SOFT * (self.thickness / size**2) ** 2 if held is None else 0.0
        Kf, Mf = (A[free][:, free] for A in (K, M))
        factor = factorise_large(sp.csc_matrix(Kf + shift * Mf))
        loads = _loads(self._tetrahedra, len(points), patches)[:, free]
        known = np.empty((len(free), 0))
        if held is None:
            known = _independent(rigid[free], Mf)
            loads = loads - (loads @ known) @ (Mf @ known).T
        X = factor.solve(np.ascontiguousarray(loads.T))
        again = factor.solve(np.ascontiguousarray(Mf @ X[:, : 6 * len(patches.nodes)]))
        lowest = np.random.default_rng(0).standard_normal((len(free), MODES))
        for _ in range(ITERATIONS):
            lowest = lowest - known @ ((Mf @ known).T @ lowest)
            lowest = factor.solve(np.ascontiguousarray(Mf @ (lowest / np.linalg.norm(lowest, axis=0))))
        V = np.hstack([lowest, X, again])
        V = V - known @ ((Mf @ known).T @ V)
        V = _independent(V, Mf)
        squared, turn = la.eigh(V.T @ (Kf @ V))
        shapes = np.zeros((3 * len(points), len(squared)))
        shapes[free] = V @ turn
        return {
            "shapes": shapes.reshape(len(points), 3, -1).astype(np.float32),
            "squared": squared,
            "momentum": rigid.T @ (M @ shapes),
        }


def with_meshed_bodies(
    plan: Plan,
    mechanism: Mechanism,
    shaped: Mapping[str, Mapping[str, RigidBody]],
    parameters: Mapping[str, ArrayLike] | None,
    announce: Callable[[str], None],
) -> Mechanism:
    """The mechanism with composites `shaped`, by prototype, meshed, and the parameters on which these depend held;
    `plan` is of the same with boxes in their place. Raises ModelError with all that are no solids."""
    if not shaped:
        return mechanism
    values = plan.scoped_values(parameters)
    changed: dict[str, dict[str, RigidBody]] = {}
    needed, wrong = set[str](), list[Problem]()
    for name, described in shaped.items():
        changed[name] = {}
        for key, body in described.items():
            solid = body.solid
            assert isinstance(solid, Composite)
            metal: Any = mechanism.material(solid.material)
            found = [x for part in (solid, metal) for _, _, x in scalars(part) if isinstance(x, Expression)]
            needed |= {n for x in found for n in x.names}
            own: Any = evaluated(metal, values)
            nu = float(own.nu) if own.nu is not None else float(own.E) / (2 * float(own.G)) - 1
            meshed = MeshedBody(Pieces.of(evaluated(solid, values)), (float(own.E), nu, float(own.rho)))
            place = ".".join(filter(None, (name, key)))
            try:
                meshed.mesh(lambda place=place: announce(f"solid of {place}: mesh"))
                if body.held is not None:
                    meshed.held_points(("xyz".index(body.held.face[0]), 1 if body.held.face[1] == "+" else -1))
            except ShapeError as error:
                above = ("substructures", name) if name else ()
                inner = error.path if error.path[0] == "held" else ("solid", *error.path)
                wrong.append(Problem((*above, "bodies", key, *inner), error.value, error.rule, error.hint))
            changed[name][key] = body.replaced({"solid": solid.replaced({"meshed": meshed})})
    if wrong:
        raise ModelError(wrong)

    def with_bodies(part: P, name: str) -> P:
        return part.replaced({"bodies": {**part.bodies, **changed.get(name, {})}})

    parts = {name: with_bodies(part, name) for name, part in mechanism.substructures.items()}
    held = held_parameters(plan, mechanism, needed, parameters)
    return with_bodies(mechanism, TOP).replaced({"substructures": parts, "parameters": held})


def held_parameters(
    plan: Plan, mechanism: Mechanism, needed: set[str], parameters: Mapping[str, ArrayLike] | None
) -> dict[str, Parameter]:
    """Parameters with the given values, those that solids depend on held between bounds that leave no room."""
    values = plan.parameter_values(parameters)
    before = None
    while needed != before:
        before = set(needed)
        derived = [p.value for n, p in mechanism.parameters.items() if n in needed and isinstance(p.value, Expression)]
        needed = needed | {name for value in derived for name in value.names}
    held = {}
    for name, parameter in mechanism.parameters.items():
        update: dict[str, Any] = {}
        if name in (parameters or {}):
            update["value"] = float(values[name])
        if name in needed:
            update |= {"minimum": float(values[name]), "maximum": float(values[name])}
        held[name] = parameter.model_copy(update=update)
    return held


def _loads(mesh: Tetrahedra, count: int, patches: Patches) -> Array:
    """Rows (18 p, 3 n), by points of a mesh, of the motions of patches, then of larger and of smaller ones."""
    centre = (patches.weights[..., None] * patches.points).sum(axis=-2, keepdims=True)
    every = [patches.points, *(centre + factor * (patches.points - centre) for factor in (LARGER, SMALLER))]
    points, weights = np.concatenate(every), np.tile(patches.weights, (3, 1))
    nodes, N = mesh.at(points)
    values = np.zeros((*nodes.shape[:-1], count))
    np.put_along_axis(values, nodes, N, axis=-1)
    rows = fitted_rows(Patches(points, weights, np.tile(patches.nodes, (3, 1))), values, along_axes)
    return np.swapaxes(rows.reshape(len(rows), 3, count), 1, 2).reshape(len(rows), -1)


def _independent(vectors: Array, M: Any) -> Array:
    """M-orthonormal vectors (n, j) that span others (n, k), without what is made of the rest."""
    vectors = vectors / np.sqrt(np.einsum("ij,ij->j", vectors, M @ vectors))
    values, turn = la.eigh(vectors.T @ (M @ vectors))
    kept = values > DEPENDENT * values[-1]
    return vectors @ (turn[:, kept] / np.sqrt(values[kept]))


def _meshed(pieces: Pieces) -> Arrays:
    """Mass properties for a density of one, and the meshes of a composite."""
    with kernel() as occ:
        solid = composite_shape(occ, pieces)
        V, centre, inertia = float(solid.mass), np.array(list(solid.center)) * MILLIMETRE, solid.inertia
        about = np.array([[inertia[i, j] for j in range(3)] for i in range(3)]) * MILLIMETRE**5
        thickness = 2 * V * MILLIMETRE / sum(face.mass for face in solid.faces)
        rough, four, _ = tetrahedra(occ, solid, COARSE * thickness, COARSE_AROUND)
        points, ten, _ = tetrahedra(occ, solid, CELL * thickness, AROUND)
    for middle, pair in zip(ten[:, 4:].T, TETRA_EDGES, strict=True):
        points[middle] = points[ten[:, pair]].mean(axis=1)
    arm = rigid_arm(centre)
    whole = SolidMesh(points, {"tetra10": ten}, {"tetra10": np.zeros(len(ten), dtype=np.intp)}, (NO_MATERIAL,))
    used, facets = outer_sides(whole)
    return {
        "rigid": arm.T @ rigid_mass(np.array(V * MILLIMETRE**3), about) @ arm,
        "thickness": np.array(thickness),
        "coarse": rough[four[:, :4]],
        "points": points,
        "tetrahedra": ten,
        "corners": points[used],
        "triangles": facets[:, :3],
    }
