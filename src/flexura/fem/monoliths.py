"""Parts reduced to their interfaces: meshes refined until they are fine enough, or given, and what is left out.

Curved tetrahedra (`curved`). Sizes of cells follow the energies of stresses that are not smooth (Zienkiewicz and Zhu
1987); what is reduced are shapes of least energy for motions of interfaces, and modes with these held (Craig and
Bampton 1968). A lower order on the same mesh tells how far off the stiffness may be.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.deadline import checkpoint
from flexura.errors import OptionError, SolverError, need
from flexura.fem.cache import Arrays, content_key, remembered
from flexura.fem.cad import Drawing, PartFace, faces_of, mesh_name
from flexura.fem.curved import CurvedElements, fit_forms, is_large
from flexura.fem.geometry import MILLIMETRE, SolidMaterial
from flexura.fem.given_meshes import GivenMesh
from flexura.fem.part_stress import surface_stress
from flexura.fem.reduced import balanced
from flexura.fem.surfaces import STORED, SurfaceStress
from flexura.fem.two_orders import CLOSE, ROUGH, SPARE_MODES, TwoOrders, lowest_modes
from flexura.fem.varying import Family, Varied, family_of
from flexura.linalg import Factor, factorise_large
from flexura.records import Kept

REVISION = 7
"""Goes up whenever meshes or reductions of parts change."""

ORDER = 3
"""Order of the elements that are reduced; their sizes are found with one less."""

COARSEST = 6.0
"""Size of a part over that of its largest cells, at least."""

FEWEST_CELLS = 1500
"""Cells of the first mesh, about, were they all alike: what is one cell thick tells too little."""

GRADING, CURVATURE = 0.4, 2.0
"""How fast cells grow away from fine places, and how many a radius of curvature is long (netgen's own measures)."""

GAINED = 5.2
"""Error with cells of the lower order over that of the order that is reduced, about: what the former is refined to."""

ROUNDS, MORE = 5, 2
"""How often a mesh of the lower order is made at most, and how often all is made again where it was too coarse."""

AIM = 0.5
"""Error for which the sizes of cells are asked over the wanted one: netgen's cells are larger than asked."""

CHANGES = (0.25, 2.0)
"""How much smaller or larger cells become at a time."""

CLOSE_ENOUGH = 1.2
"""Estimated over wanted error at which a mesh of the lower order is taken."""

MODES, MOST_MODES = 6, 96
"""Modes of a part that are to be right where no frequency is given, and most that are kept."""

LEAST_SHARE, SHARE = 0.25, 0.35
"""Error of the order that is reduced over its difference from the lower one, at least and at most, where a mesh is
refined: measured 0.08 to 0.34."""

UNREFINED = 0.8
"""The same where it is not: energy errors fall as order^-2 where stresses are those at a crack, and faster elsewhere
(Babuska, Szabo and Katz 1981), so that order 3 leaves (4/9) / (1 - 4/9) of what it gains on order 2."""

TRUNCATION = 1e-4
"""Largest error of modes for what is not kept, relative."""

DEPENDENT = 1e-8
"""Part of a shape that others lack, squared, below which it is made of them."""

INNER = "inner"
"""Name of faces between two solids."""

IN_MEMORY = Kept(most=16)


class Joint(NamedTuple):
    """Faces, by their places in the shape, that follow a node at a place (3,), m: rigidly or in the mean."""

    faces: tuple[int, ...]
    place: tuple[float, float, float]
    is_rigid: bool


@dataclass(frozen=True)
class ReducedPart:
    """K, M and E (n, n), SI, over six displacements of each interface, then amplitudes of modes with these held.

    `E` is how far K may be off for the mesh: strain energy of displacements v is uncertain by half of v' E v;
    `mesh_error` what that makes of the frequencies of the part, relative. Below `complete_hz` no mode with the
    interfaces held is left out. `points`, `facets` and `rows` are the surface and how it moves, `stress` what is
    stressed there, None where sides have four corners, `dofs` those of the mesh. `family` is how K and M vary, where
    they do.
    """

    K: Array
    M: Array
    E: Array
    complete_hz: float
    mesh_error: float
    points: Array
    facets: Index
    rows: NDArray[np.floating[Any]]
    stress: SurfaceStress | None
    dofs: int
    family: Family | None = None


def reduced_part(
    drawing: Drawing,
    materials: Mapping[str, SolidMaterial],
    joints: Sequence[Joint],
    tolerance: float,
    up_to_hz: float | None = None,
    announce: Callable[[str], None] = lambda _: None,
    varied: Varied | None = None,
) -> ReducedPart:
    """A part reduced to its joints, from the cache where the same one was before.

    `materials` by solid; `tolerance` is what the mesh may make frequencies wrong by, relative. Modes with the joints
    held are kept until those of the part, its rigid joints clamped, up to a frequency (else the six lowest) are
    right to 1e-4. `varied` says with what the shape of a planar part varies. Raises
    OptionError where the mesh would not fit into memory, ModelError where outline or mesh cannot follow the sizes, and
    SolverError where netgen fails.
    """
    materials = {name: materials[name] for name in drawing.solids}
    of_solids = [(name, metal.E, metal.nu, metal.rho) for name, metal in materials.items()]
    parts = (REVISION, drawing.digest, of_solids, [tuple(joint) for joint in joints], tolerance, up_to_hz or 0.0)
    if varied is not None:
        parts = (*parts, [(name, *span) for name, span in varied.spans.items()], varied.texts)

    def compute() -> Arrays:
        return _reduced(drawing, materials, joints, tolerance, up_to_hz, announce, varied)

    arrays = IN_MEMORY.once(content_key(parts), lambda: remembered("cad-part", parts, compute))
    names = ("K", "M", "E", "points", "facets", "rows")
    singles = {name: arrays[name].item() for name in ("complete_hz", "mesh_error", "dofs")}
    family = None
    if varied is not None:
        error, rougher, lower = (float(arrays[name].item()) for name in ("error", "rougher", "lower"))
        reach, powers, K, M, middles = (arrays[name] for name in ("reach", "powers", "Ks", "Ms", "middles"))
        family = Family(reach, powers, K, M, middles, error, rougher, lower)
    stressed = [arrays[key] for name in STORED if (key := f"stress_{name}") in arrays]
    stress = SurfaceStress(*stressed, names=drawing.solids) if stressed else None
    return ReducedPart(**{name: arrays[name] for name in names}, stress=stress, **singles, family=family)


def joint_of(faces: Sequence[PartFace], drawing: Drawing, is_rigid: bool, place: Array | None = None) -> Joint:
    """The joint of some faces of a drawing; its place is the middle of their area where none is given."""
    if place is None:
        area = np.array([face.area for face in faces])
        place = area @ np.array([face.centre for face in faces]) / area.sum()
    x, y, z = np.round(np.asarray(place, dtype=float), 12).tolist()
    return Joint(tuple(drawing.order[face.number - 1] for face in faces), (x, y, z), is_rigid)


def _reduced(
    drawing: Drawing,
    materials: Mapping[str, SolidMaterial],
    joints: Sequence[Joint],
    tolerance: float,
    up_to_hz: float | None,
    announce: Callable[[str], None],
    varied: Varied | None,
) -> Arrays:
    def reduced(elements: CurvedElements, low: _Reduction | None = None) -> _Reduction:
        return _Reduction(elements, joints, low)

    is_given = isinstance(drawing.shape, GivenMesh)
    mesher = _Given(drawing, joints) if is_given else _Mesher(drawing, joints)
    wanted, places = GAINED * tolerance, [np.array(joint.place) for joint in joints]
    attempt = 0
    while True:
        low, coarse = mesher.refined(materials, wanted, announce)
        low.release()
        # other sizes of what varies are factorised
        iterated = ORDER if varied is None else 0
        elements = CurvedElements(low.elements.mesh, ORDER, materials, announce, reduced=iterated)
        announce("reducing")
        high = reduced(elements, low)
        worst = _mesh_errors(low, high, high.fewest, mesher.shares)[1] / 2
        announce(f"frequencies may be off by {100 * worst:.2g} % for the mesh")
        if worst <= tolerance or is_given or (attempt := attempt + 1) > MORE:
            break
        wanted = coarse * max(0.2, 0.8 * tolerance / worst)
        del low, high, elements  # before others take as much memory
    announce("modes with the interfaces held")
    count, complete = high.choose(up_to_hz)
    off, _ = _mesh_errors(low, high, count, mesher.shares)
    K, M, basis = high.matrices(count)
    points, facets, rows = _surface(elements, basis)
    more: Arrays = {}
    if varied is not None:
        regions = ["|".join(map(mesh_name, joint.faces)) for joint in joints]
        found = family_of(drawing, high, high.modes(count), varied, np.array(places), regions, reduced, announce)
        Ks = np.stack([balanced(own, np.array(places)) for own in found.K])
        K, M = Ks[0], found.M[0]
        off, complete = found.rougher * off + found.error * K, complete * found.lower
        more = {"reach": found.reach, "powers": found.powers, "Ks": Ks, "Ms": found.M, "middles": found.middles}
        more |= {name: np.array(getattr(found, name)) for name in ("error", "rougher", "lower")}
    met = [mesh_name(place) for joint in joints for place in joint.faces]
    rigid = [mesh_name(place) for joint in joints if joint.is_rigid for place in joint.faces]
    if (facets[:, 2] == facets[:, 3]).all():  # what stress is known on
        more |= surface_stress(elements, basis, K, met, rigid, INNER)
    return {
        **more,
        "K": balanced(K, np.array(places)),
        "M": M,
        "E": off,
        "complete_hz": np.array(complete),
        "mesh_error": np.array(worst),
        "points": points,
        "facets": facets,
        "rows": rows,
        "dofs": np.array(elements.dofs),
    }


class _Mesher:
    """Meshes of a drawing whose cells become smaller where stresses are not smooth."""

    shares: tuple[float, float] = (LEAST_SHARE, SHARE)

    def __init__(self, drawing: Drawing, joints: Sequence[Joint]) -> None:
        self._ng = need("ngsolve", "solid")
        self._meshing = need("netgen.meshing", "solid")
        self._drawing, self._joints = drawing, joints
        faces = faces_of(drawing.shape)
        for place, face in enumerate(faces):
            face.name = mesh_name(place) if place in drawing.order else INNER
        for solid, name in zip(drawing.shape.solids, drawing.solids, strict=True):
            solid.name = name
        self._geometry = need("netgen.occ", "solid").OCCGeometry(drawing.shape)
        self._at = np.empty((0, 3))
        self._sizes = np.empty(0)

    def mesh(self) -> Any:
        """A mesh of the sizes that are known."""
        alike = (6 * np.sqrt(2) * float(self._drawing.shape.mass) / FEWEST_CELLS) ** (1 / 3)
        longest = min(self._drawing.size / MILLIMETRE / COARSEST, alike)
        parameters = self._meshing.MeshingParameters(maxh=longest, grading=GRADING, curvaturesafety=CURVATURE)
        for (x, y, z), h in zip(self._at.tolist(), self._sizes.tolist(), strict=True):
            parameters.RestrictH(x=x, y=y, z=z, h=h)
        checkpoint()
        try:
            return self._ng.Mesh(self._geometry.GenerateMesh(parameters))
        except Exception as error:
            text = " ".join(str(error).split())[:200]
            raise SolverError(f"{self._drawing.path}: netgen could not mesh the part: {text}") from None

    def refined(
        self, materials: Mapping[str, SolidMaterial], wanted: float, announce: Callable[[str], None]
    ) -> tuple[_Reduction, float]:
        """The part with elements of the lower order on a mesh on which frequencies are off by what is wanted, relative,
        about, and by how much they are."""
        step = 0
        while True:
            announce(f"mesh {(step := step + 1)}")
            mesh = self.mesh()
            reduction = _Reduction(CurvedElements(mesh, ORDER - 1, materials, announce, reduced=ORDER), self._joints)
            energies = reduction.unsmooth
            worst = reduction.roughness / 2
            self._resize(mesh, energies.sum(axis=1), AIM * float(energies.sum()) * wanted / worst)
            announce(f"off by {100 * worst:.2g} %, {100 * wanted:.2g} % wanted")
            if worst <= CLOSE_ENOUGH * wanted or step == ROUNDS:
                return reduction, worst
            del reduction  # before the next one takes as much memory

    def _resize(self, mesh: Any, energies: Array, total: float) -> None:
        """Sizes of the next mesh, on which each cell has the same energy, of some total."""
        points = np.array([v.point for v in mesh.vertices])
        corners = points[np.array([[v.nr for v in cell.vertices] for cell in mesh.Elements(self._ng.VOL)])]
        volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
        sizes = (6 * np.sqrt(2) * volumes) ** (1 / 3)
        change = (total / len(sizes) / np.maximum(energies, np.finfo(float).tiny)) ** (1 / (2 * (ORDER - 1)))
        self._at, self._sizes = corners.mean(axis=1), sizes * np.clip(change, *CHANGES)


class _Given:
    """The mesh of others, which stays as it is."""

    shares: tuple[float, float] = (0.0, UNREFINED)

    def __init__(self, drawing: Drawing, joints: Sequence[Joint]) -> None:
        self._mesh, self._joints = drawing.shape.mesh([mesh_name(place) for place in drawing.order]), joints

    def refined(
        self, materials: Mapping[str, SolidMaterial], wanted: float, announce: Callable[[str], None]
    ) -> tuple[_Reduction, float]:
        """The part with elements of the lower order, and the error that is wanted."""
        elements = CurvedElements(self._mesh, ORDER - 1, materials, announce, reduced=ORDER)
        return _Reduction(elements, self._joints), wanted


class _Reduction:
    """Shapes of a meshed part: of least energy for motions of its joints, and modes with these held."""

    def __init__(self, elements: CurvedElements, joints: Sequence[Joint], low: _Reduction | None = None) -> None:
        self.elements, self._lower = elements, low
        ng, space = need("ngsolve", "solid"), elements.space
        n, mesh = space.ndof, elements.mesh
        self._c = 6 * len(joints)
        self._places = [np.array(joint.place) for joint in joints]
        points = np.array([v.point for v in mesh.vertices]) * MILLIMETRE
        self._size = float(np.ptp(points, axis=0).max())
        self._unit = np.repeat([1.0, 1 / self._size], 3)
        follow, owner = np.zeros((n, self._c)), np.full(n, -1)
        means, at = [], []
        for k, joint in enumerate(joints):
            place = self._places[k]
            columns = np.arange(6 * k, 6 * k + 6)
            region = mesh.Boundaries("|".join(map(mesh_name, joint.faces)))
            motions = elements.rigid_motions @ rigid_arm(-place)
            if joint.is_rigid:
                rows = np.flatnonzero(np.array(space.GetDofs(region)))
                if (owner[rows] >= 0).any():
                    raise OptionError(
                        f"interfaces {owner[rows].max() + 1} and {k + 1} of a part share an edge, rigidly"
                    )
                owner[rows] = k
                follow[np.ix_(rows, columns)] = motions[rows]
                continue
            away = [x * MILLIMETRE - c for x, c in zip((ng.x, ng.y, ng.z), joint.place, strict=True)]
            forms = fit_forms(space.TestFunction(), away, 1.0, self._size, ng.ds(definedon=region))
            loads = elements.loads(forms)
            means.append(self._unit[:, None] ** -1 * np.linalg.solve(loads @ motions, loads))
            at += columns.tolist()
        self._free: Index = np.flatnonzero(owner < 0)
        self._follow = follow
        self._averaged: Index = np.array(at, dtype=np.intp)
        self._means = np.vstack([np.empty((0, n)), *means])
        self._pins = self._pinned(points) if not (owner >= 0).any() else np.empty(0, dtype=np.intp)
        self._kept = np.setdiff1d(np.arange(len(self._free)), self._pins)
        if isinstance(elements.K, TwoOrders):
            elements.K.hold(self._free[self._kept])
        self._rigid = elements.rigid_motions[self._free] * self._unit if len(self._pins) else np.empty((n, 0))
        self._B = self._means[:, self._free]
        ways = (False, True) if isinstance(elements.K, TwoOrders) else (False,)
        self._X = {about: self._pinned_solve(self._B.T, 1.0 if about else CLOSE) for about in ways}
        self._small = {about: self._bordered(self._X[about]) for about in ways}
        self.psi: Array = self._constraint_modes()
        self._values, self._vectors = np.empty(0), np.empty((n, 0))
        self._known = (-1, np.empty(0), np.empty((n, 0)))
        self.joined: Array = np.empty((0, 0))
        """What makes the shapes with the joints held of modes and of what inertia forces make, once they are known."""

    def _pinned(self, points: Array) -> Index:
        """Six of the DOFs of three vertices that hold the part like three, two and one supports."""
        n = self.elements.space.ndof // 3
        first = int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmax())
        second = int(np.linalg.norm(points - points[first], axis=1).argmax())
        along = points - points[first]
        third = int(np.linalg.norm(np.cross(along, along[second]), axis=1).argmax())
        rows = np.array([vertex + n * axis for vertex in (first, second, third) for axis in range(3)])
        pivots = la.qr((self.elements.rigid_motions[rows] * self._unit).T, pivoting=True, mode="r")[1]
        return np.sort(rows[pivots[:6]])

    @cached_property
    def _factor(self) -> Factor:
        kept = self._free[self._kept]
        return factorise_large(sp.csc_matrix(self.elements.K[kept][:, kept]))

    def release(self) -> None:
        """Work out what is asked for later, and give back the memory of factors of many DOFs."""
        if not is_large(self.elements.mesh, ORDER):
            return
        self._modes(2 * MODES + 1)
        _ = self._static
        self.__dict__.pop("_factor", None)
        if isinstance(self.elements.K, TwoOrders):
            self.elements.K.release()

    def _pinned_solve(self, loads: Array, close: float = CLOSE) -> Array:
        """Displacements of the free DOFs under loads (f, k), with the pins held, as close as iterations are
        to come, where these solve: at 1 what preconditions."""
        out, K = np.zeros(loads.shape), self.elements.K
        if not loads.shape[1]:
            return out
        if isinstance(K, TwoOrders):
            forces = np.zeros((K.shape[0], loads.shape[1]))
            forces[self._free[self._kept]] = loads[self._kept]
            return (K.precondition(forces) if close == 1 else K.solve(forces, close))[self._free]
        out[self._kept] = self._factor.solve(np.ascontiguousarray(loads[self._kept]))
        return out

    def _bordered(self, X: Array) -> Array:
        """The matrix of forces of means and rigid motions of a part whose means are held."""
        S, G = self._B @ X, self._B @ self._rigid if len(self._pins) else np.empty((len(self._B), 0))
        return np.block([[S, -G], [G.T, np.zeros((G.shape[1],) * 2)]])

    def _solve(self, loads: Array, means: Array | float = 0.0, close: float = CLOSE) -> Array:
        """Displacements (f, k) under loads (f, k) with given means of the averaged joints."""
        count, about = len(self._B), close == 1
        if about and count:  # what preconditions is rounded, and reactions are large
            loads = loads - self._B.T @ self._reactions(self._X[about].T @ loads, loads, about)[:count]
        x = self._pinned_solve(loads, close)
        if not count:
            return x
        small = self._reactions(self._B @ x - means, loads, about)
        x = x - self._X[about] @ small[:count]
        return x + self._rigid @ small[count:] if len(self._pins) else x

    def _with_means_held(self, x: Array) -> Array:
        count = len(self._B)
        return x - self._X[False] @ la.solve(self._small[False][:count, :count], self._B @ x) if count else x

    def _reactions(self, off: Array, loads: Array, about: bool) -> Array:
        """Forces of means that are off, and rigid motions of a part whose means are held."""
        rigid = self._rigid.T @ loads if len(self._pins) else np.empty((0, loads.shape[1]))
        return la.solve(self._small[about], np.vstack([off, rigid]))

    def _constraint_modes(self) -> Array:
        """Shapes (n, c) of least energy for unit motions of the joints."""
        n, rest = self.elements.space.ndof, slice(6, None)  # the first joint moves when all else does not
        loads = -(self.elements.K @ self._follow[:, rest])[self._free]
        means = np.zeros((len(self._B), self._c))
        means[np.arange(len(self._B)), self._averaged] = np.tile(1 / self._unit, len(self._B) // 6)
        means -= self._means @ self._follow
        psi = np.zeros((n, self._c))
        psi[self._free, rest] = self._solve(loads, means[:, rest])
        psi[:, rest] += self._follow[:, rest]
        arms = [rigid_arm(place - self._places[0]) for place in self._places[1:]]
        psi[:, :6] = self.elements.rigid_motions @ rigid_arm(-self._places[0])
        return psi - np.pad(psi[:, rest] @ np.vstack(arms), ((0, 0), (0, self._c - 6))) if arms else psi

    def _modes(self, count: int) -> None:
        """Work out so many modes with the joints held, where they are not known."""
        size = len(self._free)
        if not count:
            return
        count = min(count, size - len(self._B) - 1)
        if len(self._values) >= count:
            return
        if isinstance(self.elements.K, TwoOrders):
            self._iterated_modes(count)
            return
        K, M = (A.tocsr()[self._free][:, self._free] for A in (self.elements.K, self.elements.M))

        def solve(b: Array) -> Array:
            checkpoint()
            return self._solve(np.reshape(b, (-1, 1)))[:, 0]

        operator = spla.LinearOperator((size, size), matvec=solve, dtype=float)
        try:
            values, vectors = spla.eigsh(K, count, M=M, sigma=0.0, OPinv=operator, v0=np.cos(np.arange(size)), tol=1e-8)
        except spla.ArpackError as error:
            raise SolverError(f"the modes of a part with its interfaces held did not converge: {error}") from None
        order = np.argsort(values)
        self._values = values[order]
        self._vectors = np.zeros((self.elements.space.ndof, count))
        self._vectors[self._free] = vectors[:, order]

    def _iterated_modes(self, count: int) -> None:
        """The same by conjugate gradients, from those that are known."""
        n, kept = self.elements.space.ndof, np.zeros(self.elements.space.ndof, dtype=bool)
        kept[self._free] = True

        def about(forces: Array) -> Array:
            out = np.zeros(forces.shape)
            out[self._free] = self._solve(forces[self._free], close=1.0)
            return out

        known = self._vectors
        if not known.size and self._lower is not None and self._lower._values.size:
            known = self.elements.raised(self._lower._vectors) * kept[:, None]
            known[self._free] = self._with_means_held(known[self._free])
        waves = np.cos(np.outer(np.arange(n), 1.0 + np.arange(count + SPARE_MODES - known.shape[1])))
        start = np.hstack([known, about(self.elements.M @ waves)])
        self._values, self._vectors = lowest_modes(self.elements.K, self.elements.M, start, count, kept, about)

    def modes(self, count: int) -> tuple[Array, Array]:
        """Squared angular frequencies (m,) and shapes (n, m) of the lowest modes with the joints held."""
        self._modes(count)
        return self._values[:count], self._vectors[:, :count]

    @property
    def fixed_hz(self) -> Array:
        """Frequencies of the modes with the joints held that are known."""
        return np.sqrt(np.maximum(self._values, 0.0)) / (2 * np.pi)

    def _inner(self, count: int) -> tuple[Array, Array]:
        """Squared angular frequencies (j,) and shapes (n, j) with the joints held: the lowest modes, and what inertia
        forces of motions of the joints make of them (modal truncation augmentation, Dickens, Nakagawa and Wittbrodt
        1997)."""
        if self._known[0] == count:
            return self._known[1:]
        self._modes(count)
        modes, M = self._vectors[:, :count], self.elements.M
        shares = modes.T @ (M @ self._static)
        more = self._static - modes @ shares
        T = _independent(more, M)
        more = more @ T
        values, turn = la.eigh(more.T @ (self.elements.K @ more))
        self._known = (count, np.append(self._values[:count], values), np.hstack([modes, more @ turn]))
        self.joined = np.block([[np.eye(count), -shares @ T @ turn], [np.zeros((len(T), count)), T @ turn]])
        return self._known[1:]

    def matrices(self, count: int) -> tuple[Array, Array, Array]:
        """K, M (c + j,) and the shapes (n, c + j), with `count` modes."""
        values, inner = self._inner(count)
        basis = np.hstack([self.psi, inner])
        K, M = (basis.T @ (A @ basis) for A in (self.elements.K, self.elements.M))
        K[: self._c, self._c :] = 0.0
        K[self._c :, : self._c] = 0.0
        K[self._c :, self._c :] = np.diag(values)
        return (K + K.T) / 2, (M + M.T) / 2, basis

    def held_solve(self, forces: Array) -> Array:
        """Displacements (n, k) under forces (n, k) with the joints held."""
        out = np.zeros(forces.shape)
        out[self._free] = self._solve(forces[self._free])
        return out

    @cached_property
    def _static(self) -> Array:
        """Displacements (n, c) that inertia forces of motions of the joints make with these held."""
        return self.held_solve(self.elements.M @ self.psi)

    def left_out(self, count: int) -> Array:
        """Q (c + j,): what all shapes beyond those that are kept give to inertia forces of these."""
        values, inner = self._inner(count)
        basis = np.hstack([self.psi, inner])
        M = self.elements.M
        # exact modes move nothing else, and what joints make is kept
        at = np.arange(self._c + count, basis.shape[1])
        loads = (M @ basis[:, at])[self._free]
        shares = inner.T @ (M @ basis[:, at])
        rest = loads.T @ self._solve(loads, close=ROUGH) - (shares.T / values) @ shares
        found, vectors = la.eigh((rest + rest.T) / 2)
        Q = np.zeros((basis.shape[1],) * 2)
        Q[np.ix_(at, at)] = (vectors * np.maximum(found, 0.0)) @ vectors.T
        return Q

    @property
    def _clamped(self) -> Index:
        """Motions of rigid joints."""
        return np.flatnonzero(np.isin(np.arange(self._c), self._averaged, invert=True))

    @property
    def fewest(self) -> int:
        """Modes with the joints held that the lowest shapes need beside what inertia forces make."""
        return 0 if self._c > 6 else MODES

    def choose(self, up_to_hz: float | None) -> tuple[int, float]:
        """How many modes to keep, and the frequency up to which none is left out."""
        count = 2 * MODES
        while True:
            self._modes(count + 1)
            kept = min(count, len(self._values) - 1)
            complete = float(self.fixed_hz[kept])
            if kept < count or kept >= MOST_MODES or self._truncation(kept, complete, up_to_hz) <= TRUNCATION:
                return kept, complete
            count = min(2 * count, MOST_MODES)

    def _truncation(self, count: int, complete_hz: float, up_to_hz: float | None) -> float:
        """Largest relative error, as a bound, of the frequencies of the part with its rigid joints clamped."""
        K, M, _ = self.matrices(count)
        Q = self.left_out(count)
        moving = np.setdiff1d(np.arange(len(K)), self._clamped)
        K, M, Q = (A[np.ix_(moving, moving)] for A in (K, M, Q))
        values = _pencil(K, M)
        elastic = values[6:] if not len(self._clamped) else values
        limit = (2 * np.pi * up_to_hz) ** 2 if up_to_hz else float(elastic[min(MODES, len(elastic)) - 1])
        reach = (2 * np.pi * complete_hz) ** 2
        if limit >= 0.5 * reach:
            return np.inf
        asked = (values <= limit * (1 + 1e-9)) & (values > 1e-9 * limit)
        lower = _pencil(K, M + limit / (1 - limit / reach) * Q)
        return float((1 - lower[asked] / values[asked]).max(initial=0.0)) / 2

    @cached_property
    def unsmooth(self) -> Array:
        """Energies (cells, k) of stresses that are not smooth, in the shapes by which a mesh is judged."""
        return self.elements.unsmooth_energies(self.shapes())

    @property
    def roughness(self) -> float:
        """The largest of these energies of a shape."""
        return float(self.unsmooth.sum(axis=0).max())

    def shapes(self) -> Array:
        """Elastic shapes (n, k) of unit energy by which a mesh is judged: of the part with its rigid joints clamped,
        the lowest, and for motions of joints against each other."""
        K, M, basis = self.matrices(self.fewest)
        Kc = K[: self._c, : self._c]
        scale = np.tile(self._unit, self._c // 6)
        values, vectors = la.eigh(Kc * np.outer(scale, scale))
        elastic = values > 1e-9 * values[-1]
        chosen = [self.psi @ (scale[:, None] * vectors[:, elastic])] if self._c > 6 else []
        moving = np.setdiff1d(np.arange(len(K)), self._clamped)
        values, vectors = la.eigh(K[np.ix_(moving, moving)], M[np.ix_(moving, moving)])
        elastic = values > 1e-6 * values[-1] if not len(self._clamped) else values > 0
        found = np.hstack([*chosen, basis[:, moving] @ vectors[:, elastic][:, :MODES]])
        energy = np.einsum("ij,ij->j", found, self.elements.K @ found)
        return found / np.sqrt(energy)


def _independent(vectors: Array, M: Any) -> Array:
    """T (k, j) that makes of vectors (n, k) M-orthonormal ones, without what is made of the rest."""
    T = np.eye(vectors.shape[1])
    for _ in range(2):  # the second time for round-off
        gram = T.T @ (vectors.T @ (M @ (vectors @ T)))
        size = np.sqrt(gram.diagonal())
        is_there = size > 0
        T = T[:, is_there] / size[is_there]
        values, turn = la.eigh(gram[np.ix_(is_there, is_there)] / np.outer(size, size)[np.ix_(is_there, is_there)])
        kept = values > DEPENDENT * values[-1]
        T = T @ (turn[:, kept] / np.sqrt(values[kept]))
    return T


def _pencil(K: Array, M: Array) -> Array:
    """Eigenvalues of K x = v M x, ascending."""
    scale = 1 / np.sqrt(np.diagonal(M))
    K, M = (A * np.outer(scale, scale) for A in (K, M))
    return np.asarray(la.eigh(K, M, eigvals_only=True))


def _mesh_errors(low: _Reduction, high: _Reduction, count: int, shares: tuple[float, float]) -> tuple[Array, float]:
    """E (n, n), how far the stiffness may be off for the mesh, and the largest relative error of energies.

    A share of the difference of two orders: that of the unsmooth stresses of the higher one, which are too large at
    edges where stresses are infinite, and may miss some elsewhere, within the least and the most of `shares`.
    """
    (K, _, _), (other, _, _) = high.matrices(count), low.matrices(count)
    c = high._c
    size = np.tile(high._unit, c // 6)
    n = len(K)
    E = np.zeros((n, n))
    Kc, Lc = (A[:c, :c] * np.outer(size, size) for A in (K, other))
    values, vectors = la.eigh(Kc)
    elastic = values > 1e-9 * values[-1]
    if elastic.any() and c > 6:
        half = vectors[:, elastic] / np.sqrt(values[elastic])
        off, turn = la.eigh(half.T @ (Lc - Kc) @ half)
        back = vectors[:, elastic] * np.sqrt(values[elastic]) @ turn
        E[:c, :c] = ((back * np.abs(off)) @ back.T) / np.outer(size, size)
    at = np.arange(c, n)
    m = min(n, len(other)) - c
    E[at[:m], at[:m]] = np.abs(other[at[:m], at[:m]] - K[at[:m], at[:m]])
    largest = max(
        float(np.abs(off).max()) if elastic.any() and c > 6 else 0.0, float((E[at, at] / K[at, at])[:MODES].max())
    )
    least, most = shares
    share = min(most, max(least, high.roughness / largest)) if largest > 0 else most
    return share * E, share * largest


def _surface(elements: CurvedElements, basis: Array) -> tuple[Array, Index, NDArray[np.floating[Any]]]:
    """Vertices on the outside (p, 3), m, facets (t, 4) and rows (3 p, n) of their displacements."""
    ng, mesh = need("ngsolve", "solid"), elements.mesh
    sides = [[v.nr for v in side.vertices] for side in mesh.Elements(ng.BND) if side.mat != INNER]
    used, facets = np.unique([(*side, side[-1])[:4] for side in sides], return_inverse=True)
    points = np.array([v.point for v in mesh.vertices])[used] * MILLIMETRE
    n = elements.space.ndof // 3
    rows = np.stack([basis[used + n * axis] for axis in range(3)], axis=1).reshape(-1, basis.shape[1])
    return points, facets.reshape(-1, 4), rows.astype(np.float32)
