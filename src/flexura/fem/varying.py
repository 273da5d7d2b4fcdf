"""Planar parts whose thickness and outline vary: the mesh follows, and reduced matrices are polynomials in the sizes.

The sides of the mesh move with the lines and arcs of the outline, what is inside as a harmonic function, the thickness
by stretching. On every moved mesh the part is reduced anew in coordinates that keep their meaning (Panzer, Mohring, Eid
and Lohmann 2010): displacements of the interfaces, and amplitudes of shapes that differ from those of the first mesh by
no more than what these do not span. Such matrices are smooth, and polynomials through few of them meet all others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import product
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.deadline import checkpoint
from flexura.errors import ModelError, Problem, need
from flexura.fem.cad import Drawing, faces_of, mesh_name
from flexura.fem.curved import CurvedElements
from flexura.fem.geometry import MILLIMETRE
from flexura.outlines import Outline, Segment

WANTED = 1e-3
"""Difference in energy between polynomials and the matrices that they stand for, relative, that is left."""

FARTHEST = 1e-2
"""The same, at most; it counts as error of the mesh."""

MOST_DEGREE = 7
"""Degree of the polynomials, at most."""

FOLDED = 0.2
"""Volume of a part of a cell over what it was before the mesh moved, at least."""

MODES = 8
"""Modes that polynomials are held against."""

PLACES = 401
"""Sizes among which those of the moved meshes are chosen."""


class Span(NamedTuple):
    """A parameter where a part is meshed, and the least and most that it becomes, SI."""

    nominal: float
    least: float
    most: float


class Varied(NamedTuple):
    """With what a planar part varies: spans of parameters, its outline and thickness, m, for values of these, and texts
    that tell it from others."""

    spans: Mapping[str, Span]
    shape: Callable[[Mapping[str, float]], tuple[Outline, float]]
    texts: Sequence[str]


class Family(NamedTuple):
    """Polynomials in x, parameters less the nominal ones over `reach` (k,): K is the sum of x^powers[j] K[j].

    `powers` are (j, k), `K` and `M` (j, n, n), SI, `middles` (j, c, 3), m, those of the faces of the joints. `error` is
    how far K is off in energy, relative, about, `rougher` by how much the error for the mesh grows, and `lower` how
    much lower modes with the interfaces held become.
    """

    reach: Array
    powers: Index
    K: NDArray[np.floating[Any]]
    M: NDArray[np.floating[Any]]
    middles: NDArray[np.floating[Any]]
    error: float = 0.0
    rougher: float = 1.0
    lower: float = 1.0


class Reduction(Protocol):
    """A part that is reduced on one mesh."""

    @property
    def elements(self) -> CurvedElements:
        """Its elements."""
        ...

    @property
    def psi(self) -> Array:
        """Shapes (n, c) of least energy for unit motions of the joints."""
        ...

    @property
    def joined(self) -> Array:
        """T (m + c, j): what makes the shapes with the joints held of modes and of what inertia forces make."""
        ...

    @property
    def roughness(self) -> float:
        """Largest energy of stresses that are not smooth in a shape of unit energy."""
        ...

    def held_solve(self, forces: Array) -> Array:
        """Displacements (n, k) under forces (n, k) with the joints held."""
        ...


def family_of(
    drawing: Drawing,
    nominal: Reduction,
    modes: tuple[Array, Array],
    varied: Varied,
    places: Array,
    regions: Sequence[str],
    reduce: Callable[[CurvedElements], Reduction],
    announce: Callable[[str], None],
) -> Family:
    """How a reduced part varies.

    `modes` are squared angular frequencies (m,) and shapes (n, m) of the nominal part with its joints, at `places`
    (c, 3) and on faces of the mesh called `regions`, held. Raises ModelError where the outline or the mesh
    cannot follow.
    """
    motion, spans = _Motion(nominal.elements, drawing), varied.spans
    sizes = np.array([span.nominal for span in spans.values()])
    reach = np.array([max(span.most - span.nominal, span.nominal - span.least) for span in spans.values()])
    ends = [((s.least - s.nominal) / r, (s.most - s.nominal) / r) for s, r in zip(spans.values(), reach, strict=True)]
    chosen = [_spread(*each, MOST_DEGREE + 1) for each in ends]
    shapes = _Shapes(nominal, *modes, len(places))
    rough = nominal.roughness
    rougher, lower = 1.0, 1.0

    middles: list[Array] = []

    def sample(powers: Sequence[int]) -> tuple[Array, Array]:
        nonlocal rougher, lower
        if not any(powers):  # as it is meshed and reduced already
            middles.append(motion.middles(regions))
            K, M = shapes.matrices(nominal)
            shapes.lowest(K, M)
            return K, M
        x = np.array([at[power] for at, power in zip(chosen, powers, strict=True)])
        now = dict(zip(spans, (sizes + reach * x).tolist(), strict=True))
        announce("meshed for " + ", ".join(f"{name} = {size:.5g}" for name, size in now.items()))
        checkpoint()
        with motion.to(*varied.shape(now)):
            middles.append(motion.middles(regions))
            elements = CurvedElements(nominal.elements.mesh, nominal.elements.order, nominal.elements.materials)
            reduced = reduce(elements)
            K, M = shapes.matrices(reduced)
            if max(powers, default=0) in (1, 2) and np.count_nonzero(powers) == 1:  # at the ends
                rougher = max(rougher, reduced.roughness / rough)
        lower = min(lower, shapes.lowest(K, M))
        return K, M

    powers: list[tuple[int, ...]] = [(0,) * len(spans)]
    found = [sample(powers[0])]
    x = np.zeros((1, len(spans)))
    last, error = np.inf, 0.0
    for degree in range(1, MOST_DEGREE + 1):
        added = [each for each in product(range(degree + 1), repeat=len(spans)) if sum(each) == degree]
        new = [sample(each) for each in added]
        where = np.array([[own[p] for own, p in zip(chosen, each, strict=True)] for each in added])
        guesses = [_valued(x, powers, found, place) for place in where]
        off = max(_apart(*pair, places) for pair in zip(guesses, new, strict=True))
        powers, found, x = [*powers, *added], [*found, *new], np.vstack([x, where])
        error = off * min(1.0, off / last) if np.isfinite(off) else off
        if degree > 1:
            announce(f"polynomials of degree {degree} in {' and '.join(spans)} are off by {100 * error / 2:.2g} %")
        if degree > 1 and error <= WANTED:
            break
        last = off
    else:
        if error > FARTHEST:
            raise _refused(f"no polynomial of degree {MOST_DEGREE} follows the part over all its sizes")
    vandermonde = _powers(x, powers)
    stacks = [np.array(own) for own in (*zip(*found, strict=True), middles)]
    K, M, at = (np.linalg.solve(vandermonde, own.reshape(len(x), -1)).reshape(own.shape) for own in stacks)
    return Family(reach, np.array(powers), K, M, at, error, rougher, lower)


def _refused(rule: str) -> ModelError:
    return ModelError([Problem(("outline",), "", rule, "bring minimum and maximum of its parameters nearer together")])


class _Shapes:
    """The coordinates of a part in all its sizes: motions of the joints, and amplitudes."""

    def __init__(self, nominal: Reduction, values: Array, vectors: Array, joints: int) -> None:
        self._joined, self._first, self._c = nominal.joined, vectors * values, 6 * joints
        self._weights = np.empty((0, 0))
        self._scale = np.inf

    def _inner(self, reduced: Reduction) -> Array:
        """Shapes (n, j) with the joints held: what inertia makes of the nominal modes, and of motions of the joints."""
        M = reduced.elements.M
        found = reduced.held_solve(M @ np.hstack([self._first, reduced.psi])) @ self._joined
        if not self._weights.size:
            self._weights = M @ found
        return found @ np.linalg.inv(self._weights.T @ found)

    def matrices(self, reduced: Reduction) -> tuple[Array, Array]:
        """K and M (c + j,)."""
        elements, c = reduced.elements, self._c
        basis = np.hstack([reduced.psi, self._inner(reduced)])
        K, M = (basis.T @ (A @ basis) for A in (elements.K, elements.M))
        K[:c, c:] = 0.0
        K[c:, :c] = 0.0
        return (K + K.T) / 2, (M + M.T) / 2

    def lowest(self, K: Array, M: Array) -> float:
        """How much lower the lowest mode with the joints held is than that of the first part."""
        c = self._c
        hz = float(np.sqrt(la.eigh(K[c:, c:], M[c:, c:], eigvals_only=True)[0]))
        if not np.isfinite(self._scale):
            self._scale = hz
        return hz / self._scale


class _Motion:
    """How the mesh of a planar part follows its thickness and its outline."""

    def __init__(self, elements: CurvedElements, drawing: Drawing) -> None:
        self._ng = ng = need("ngsolve", "solid")
        self._mesh, self._order = elements.mesh, elements.order
        assert drawing.outline is not None and drawing.thickness is not None
        self._outline: Outline = drawing.outline
        self._thickness: float = drawing.thickness
        self._segments = _sides(drawing)
        self._sides = "|".join(map(mesh_name, self._segments))
        self._space = ng.H1(self._mesh, order=self._order, dirichlet=self._sides)
        u, v = self._space.TnT()
        self._laplace = ng.BilinearForm(ng.grad(u) * ng.grad(v) * ng.dx).Assemble()
        self._inverse = self._laplace.mat.Inverse(self._space.FreeDofs(), inverse="sparsecholesky")

    @contextmanager
    def to(self, outline: Outline, thickness: float) -> Iterator[None]:
        """While the mesh is that of a part of this outline and thickness, m. Raises ModelError where it folds."""
        ng, mesh = self._ng, self._mesh
        field = ng.GridFunction(ng.VectorH1(mesh, order=self._order))
        own, other = self._outline.segments, _followed(self._outline, outline)
        ways = {mesh_name(place): _displacement(ng, own[k], other[k]) for place, k in self._segments.items()}
        for axis in range(2):
            field.components[axis].vec.data = self._harmonic({name: way[axis] for name, way in ways.items()}).vec
        field.components[2].Set((thickness / self._thickness - 1) * ng.z)
        room = np.array(ng.Integrate(ng.Det(ng.Id(3) + ng.Grad(field)), mesh, element_wise=True))
        before = np.array(ng.Integrate(ng.CoefficientFunction(1.0), mesh, element_wise=True))
        if (room < FOLDED * before).any():
            raise _refused("the outline moves further than the mesh can follow")
        mesh.SetDeformation(field)
        try:
            yield
        finally:
            mesh.UnsetDeformation()

    def middles(self, regions: Sequence[str]) -> Array:
        """Middles (c, 3), m, of faces of the mesh as it is now."""
        ng, mesh, found = self._ng, self._mesh, []
        for region in regions:
            on = mesh.Boundaries(region)
            area = ng.Integrate(ng.CoefficientFunction(1.0), mesh, definedon=on)
            found.append([ng.Integrate(own, mesh, definedon=on) / area for own in (ng.x, ng.y, ng.z)])
        return np.array(found) * MILLIMETRE

    def _harmonic(self, ways: Mapping[str, Any]) -> Any:
        """The harmonic function with values on the sides."""
        ng, mesh = self._ng, self._mesh
        found = ng.GridFunction(self._space)
        found.Set(mesh.BoundaryCF(dict(ways), default=0.0), definedon=mesh.Boundaries(self._sides))
        rest = found.vec.CreateVector()
        rest.data = self._laplace.mat * found.vec
        found.vec.data -= self._inverse * rest
        return found


def _sides(drawing: Drawing) -> dict[int, int]:
    """By the place of every side face, which segment of the outline it stands on."""
    assert drawing.outline is not None and drawing.thickness is not None
    middles = np.array([own.at(np.linspace(0.0, 1.0, 201)).mean(axis=0) for own in drawing.outline.segments])
    found = {}
    for place, face in enumerate(faces_of(drawing.shape)):
        at = np.array([face.center.x, face.center.y, face.center.z]) * MILLIMETRE
        if abs(at[2] / drawing.thickness - 0.5) < 1e-6:
            found[place] = int(np.linalg.norm(middles - at[:2], axis=1).argmin())
    return found


def _followed(outline: Outline, moved: Outline) -> list[Segment]:
    """The segments of a moved outline in the order of those that they come from. Raises ModelError for others."""
    found, left = [], list(moved.loops)
    for loop in outline.loops:
        starts = np.array([own.start for own in loop.segments])
        alike = [other for other in left if len(other.segments) == len(starts)]
        if not alike:
            raise _refused("the outline has other sides where its parameters have other values")
        best = min(alike, key=lambda other: float(np.abs([own.start for own in other.segments] - starts).max()))
        left.remove(best)
        found += best.segments
    if any(own.is_line != other.is_line for own, other in zip(outline.segments, found, strict=True)):
        raise _refused("a line of the outline becomes an arc where its parameters have other values")
    return found


def _displacement(ng: Any, own: Segment, other: Segment) -> list[Any]:
    """Two functions of x and y, mm: what leads from the points of a segment to those of another one, share by share."""
    x, y = ng.x, ng.y

    def mm(point: Any) -> Array:
        return np.asarray(point) / MILLIMETRE

    if own.is_line:
        start, along = mm(own.start), mm(own.end) - mm(own.start)
        share = ((x - start[0]) * along[0] + (y - start[1]) * along[1]) / float(along @ along)
        first, change = mm(other.start) - start, mm(other.end) - mm(other.start) - along
        return [float(first[k]) + share * float(change[k]) for k in range(2)]
    centre, new = mm(own.centre), mm(other.centre)
    (a, b), (c, d) = mm(own.at(0.5)) - centre, mm(other.at(0.5)) - new
    u, v = x - centre[0], y - centre[1]
    angle = ng.atan2(a * v - b * u, a * u + b * v) * (other.angle / own.angle)
    return [new[0] + ng.cos(angle) * c - ng.sin(angle) * d - x, new[1] + ng.sin(angle) * c + ng.cos(angle) * d - y]


def _spread(low: float, high: float, count: int) -> Array:
    """Zero, and places from low to high, each as far from those before as can be (Leja 1957)."""
    chosen, candidates = [0.0], np.linspace(low, high, PLACES)
    while len(chosen) < count:
        far = np.log(np.maximum(np.abs(candidates[:, None] - np.array(chosen)), 1e-300)).sum(axis=1)
        chosen.append(float(candidates[far.argmax()]))
    return np.array(chosen)


def _powers(x: Array, powers: Sequence[tuple[int, ...]]) -> Array:
    """Monomials (p, j) at places (p, k)."""
    return np.prod(x[:, None, :] ** np.array(powers), axis=-1)


def _valued(
    x: Array, powers: Sequence[tuple[int, ...]], found: Sequence[tuple[Array, Array]], at: Array
) -> tuple[Array, Array]:
    """K and M at a place (k,) of the polynomials through those that are found at places (j, k)."""
    shares = np.linalg.solve(_powers(x, powers).T, _powers(at[None], powers)[0])
    K, M = (np.tensordot(shares, np.array(own), 1) for own in zip(*found, strict=True))
    return K, M


def _apart(guess: tuple[Array, Array], right: tuple[Array, Array], places: Array) -> float:
    """Largest relative difference of the energies of static motions of the joints against each other, and of the lowest
    squared frequencies with the first joint held; infinite where a guess has no frequencies."""
    c, off = 6 * len(places), 0.0
    if len(places) > 1:
        rigid = rigid_arm(places - places[0]).reshape(c, 6)
        unit = np.tile(np.repeat([1.0, 1 / float(np.ptp(places, axis=0).max())], 3), len(places))
        elastic = unit[:, None] * la.null_space((unit[:, None] * rigid).T)
        (K, _), (other, _) = right, guess
        K, other = (elastic.T @ A[:c, :c] @ elastic for A in (K, other))
        off = float(np.abs(la.eigh(other - K, K, eigvals_only=True)).max())
    try:
        values, known = (la.eigh(K[6:, 6:], M[6:, 6:], eigvals_only=True)[:MODES] for K, M in (guess, right))
    except la.LinAlgError:
        return np.inf
    return max(off, float(np.abs(values / known - 1).max()))
