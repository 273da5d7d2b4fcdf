"""The lowest modes of the part itself as one solid, beside the described model, and what its assumptions make."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array
from flexura.deadline import Say, checkpoint
from flexura.errors import OptionError, SolverError
from flexura.fem import as_beams
from flexura.full_order import assemble
from flexura.linalg import SingularError, factorise_large
from flexura.mechanism import Mechanism, with_rigid_bodies, with_rigid_roots, without_fillets
from flexura.methods import Counterpart, Solution, counterparts
from flexura.reduction import full_order_modes
from flexura.results import Tabular
from flexura.solid.whole.elements import Elements, Lumped, meshed
from flexura.solid.whole.pieces import Block, is_ground, pieces_of
from flexura.solid.whole.shapes import Part, part_of
from flexura.structure import FullOrderModel, one_design
from flexura.tables import Item, Line, Table, percent, quantity

ORDER = 3
"""Order of the tetrahedra."""
TETRAHEDRON_ORDERS = (2, 5)
"""Least and largest order of the tetrahedra."""
TETRAHEDRON_SIZES = (0.25, 4.0)
"""Least and largest size of the tetrahedra."""
INSIDE = 1e-3
"""How far into its piece a node on the surface is moved to be found in a curved mesh, over the thickness."""
EIGENVALUE_TOLERANCE = 1e-7
"""Relative tolerance of eigenvalues."""


STIFFENED = 1e4
"""How many times as stiff bodies and ground are made to see what their giving does."""

CONVERGENCE = 10.0
"""How far the lower order is from the higher one, over how far this is from the limit: measured 9 to 17."""

SPARE_MODES = 6
"""Modes of every model beyond those asked for, among which counterparts are looked for."""


@dataclass(frozen=True)
class WholeModes:
    """Modes of the part as one solid: `frequency_hz` (n,), ascending; `shapes` (n_nodes, 6, n), displacements and
    rotations (half the curl) at the nodes of the plan, NaN where a node lies in no solid.

    `order` and `size` of the tetrahedra, `cells` and `dofs` of them; `mass`, kg, of all solids, ground included;
    `seconds` of the run. `notes` say what was held how, and what is lumped.
    """

    frequency_hz: Array
    shapes: Array = field(repr=False)
    order: int
    size: float
    cells: int
    dofs: int
    mass: float
    seconds: float
    notes: tuple[str, ...] = ()


class WholePart:
    """The part of a mechanism, drawn and meshed once, whose modes are found for some orders and stiffnesses.

    Members and bodies are one piece where they touch, and nothing is rigid but what is held; point masses, springs and
    piezo stacks act on mean motions of patches. `size` of the tetrahedra is relative to the thickness of what they are
    in. Raises ModelError for what cannot be drawn, OptionError for what does not fit into memory, and SolverError.
    `order` is the largest that will be asked for: memory for it is looked at before anything is solved.
    """

    def __init__(self, model: FullOrderModel, order: int, size: float, say: Say) -> None:
        if not TETRAHEDRON_ORDERS[0] <= order <= TETRAHEDRON_ORDERS[1]:
            raise OptionError(
                f"the order of the tetrahedra is from {TETRAHEDRON_ORDERS[0]} to {TETRAHEDRON_ORDERS[1]}, not {order}"
            )
        if not TETRAHEDRON_SIZES[0] <= size <= TETRAHEDRON_SIZES[1]:
            raise OptionError(
                f"the size of the tetrahedra is from {TETRAHEDRON_SIZES[0]:g} to {TETRAHEDRON_SIZES[1]:g}, not {size!r}"
            )
        model.plan.refuse_loads("the part as one solid", model.values)
        if any(part.elastic for part in model.plan.parts.values()):
            model = assemble(with_rigid_bodies(model.plan.mechanism), model.parameters)
        self.model: FullOrderModel = model
        """The description, whose bodies are rigid: nodes are those of this."""
        self.size: float = size
        self._say = say
        say("drawing the whole part")
        self.part: Part = part_of(pieces_of(model))
        self.mesh: Any = meshed(self.part, order, size, say)

    @property
    def held(self) -> frozenset[int]:
        """Numbers of the blocks that are held: bodies that are clamped and blocks of ground."""
        clamped: NDArray[np.bool_] = np.asarray(self.model.plan.topology.held.all(axis=1))
        return frozenset(k for k, block in enumerate(self.part.pieces.blocks) if clamped[block.root])

    @property
    def bodies(self) -> frozenset[int]:
        """Numbers of the blocks that move."""
        return frozenset(range(len(self.part.pieces.blocks))) - self.held

    def modes(self, n: int, order: int, stiffer: Collection[int] = (), *, factor: float = 1.0) -> WholeModes:
        """The `n` lowest modes with elements of some order, some pieces `factor` times as stiff."""
        began = time.perf_counter()
        elements = Elements(self.part, self.mesh, order, self._say, dict.fromkeys(stiffer, factor))
        lumped = Lumped(self.model, self.part, elements)
        self._say("factorising")
        values, vectors = lowest_of_solid(lumped.K, lumped.M, n, lumped.is_free)
        return WholeModes(
            np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi),
            self._at_nodes(elements, vectors[: elements.dofs]),
            order,
            self.size,
            self.mesh.ne,
            elements.dofs,
            elements.mass,
            time.perf_counter() - began,
            (*self.part.pieces.notes, *lumped.notes),
        )

    def _at_nodes(self, elements: Elements, vectors: Array) -> Array:
        """Displacements and rotations (n_nodes, 6, k) at the nodes that lie in a solid, NaN at others."""
        points = self.model.positions.copy()
        inside = np.zeros(len(points), dtype=bool)
        for piece in self.part.pieces.all:
            if is_ground(piece):
                continue
            thin = piece.thickness
            new = (piece.beyond(points) < 1e-3 * thin) & ~inside
            if isinstance(piece, Block):
                inward = piece.centre - points[new]
            else:
                middle = piece.local(points[new])
                middle[:, 0] = np.clip(middle[:, 0], 0.02 * piece.length, 0.98 * piece.length)
                middle[:, 1:] = 0.0
                inward = piece.placed(middle) - points[new]
            depth = np.linalg.norm(inward, axis=1, keepdims=True)
            points[new] += inward * np.minimum(INSIDE * thin / np.where(depth > 0, depth, 1.0), 1.0)
            inside |= new
        inside &= self.model.plan.topology.has_position
        motions = np.full((len(points), 6, vectors.shape[1]), np.nan)
        motions[inside] = elements.motions_at(points[inside], vectors)
        return motions


def lowest_of_solid(K: sp.csr_matrix, M: sp.csr_matrix, n: int, is_free: bool = False) -> tuple[Array, Array]:
    """The `n` lowest eigenpairs; a free part is shifted below zero."""
    shift = 0.0
    if is_free:
        shift = -1e-6 * float(np.median(K.diagonal())) / float(np.median(M.diagonal()))
    try:
        factor = factorise_large(K - shift * M if shift else K)
    except SingularError:
        raise SolverError("the whole part can move freely: something of it touches nothing that is held") from None
    d = factor.scale

    def solve(b: Array) -> Array:
        checkpoint()
        return d * factor.solve_scaled(np.ascontiguousarray(d * np.ravel(b))).ravel()

    count = n + 2
    operator = spla.LinearOperator(K.shape, matvec=solve, dtype=float)
    search = {"v0": np.cos(np.arange(K.shape[0])), "ncv": 2 * count + 8, "tol": EIGENVALUE_TOLERANCE}
    try:
        values, vectors = spla.eigsh(K, count, M=M, sigma=shift, OPinv=operator, **search)
    except spla.ArpackError as error:
        raise SolverError(f"the eigenvalue search did not converge: {error}") from None
    first = np.argsort(values)[:n]
    return values[first], vectors[:, first]


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

    def presentation(self) -> Iterator[Item]:
        """A row for every mode of the whole part, and the mesh."""
        yield Table(self.columns(), "modes")
        yield Line(
            "difference: described over whole; beams: beam theory; roots, bodies, ground: what elastic roots lower, and"
        )
        yield Line("what rigid bodies and a rigid ground would raise")
        seconds = quantity(self.seconds, "s", 3)
        yield Line(f"{self.cells} curved cells of order {self.order}, {self.dofs} DOFs, {seconds}")

    def _title(self) -> str:
        return "the part as one solid beside the described model"

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
            **{headings.get(name, name): values for name, values in rows.items()},
        }

    def __repr__(self) -> str:
        worst = max((m.difference for m in self.modes if m.difference is not None), key=abs, default=None)
        return f"WholeVerification({self.name!r}, worst difference {percent(worst) or 'unknown'})"


def verify_whole(
    model: Mechanism, parameters: Mapping[str, ArrayLike] | None, n: int, size: float, say: Say
) -> WholeVerification:
    """The `n` lowest modes of the part as one solid beside the described model. Raises as `WholePart`."""
    began, single = time.perf_counter(), one_design(parameters)
    beams = as_beams(model)
    sharp = without_fillets(beams)
    corners = () if sharp == beams else ("fillets are left out, of the solid and of the described model beside it",)
    beams = sharp
    described, stiff_bodies = assemble(beams, single), with_rigid_bodies(beams)
    stiff, rigid = assemble(stiff_bodies, single), assemble(with_rigid_roots(stiff_bodies), single)
    names = described.plan.topology.node_names
    common = [names.index(name) for name in stiff.plan.topology.node_names]
    if described.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    part, more = WholePart(stiff, ORDER, size, say), n + SPARE_MODES
    say(f"the part with elements of order {ORDER}")
    fine = part.modes(more, ORDER)
    say("the same with a lower order, for the uncertainty")
    coarse = part.modes(more, ORDER - 1)
    both = part.bodies | part.held if part.bodies and part.held else frozenset[int]()
    stiffened = {"bodies": part.bodies, "ground": part.held, "bodies and ground": both}
    variants: dict[str, WholeModes] = {}
    for label, blocks in stiffened.items():
        if blocks:
            say(f"the same with {label} {STIFFENED:g} times as stiff")
            variants[label] = part.modes(more, ORDER - 1, blocks, factor=STIFFENED)
    say("the described model")
    inside = np.isfinite(fine.shapes).all(axis=(1, 2), keepdims=True)
    count = min(n, len(fine.frequency_hz))

    def at_nodes_inside(hz: Array, shapes: Array) -> Solution:
        return Solution("", None, hz, np.where(inside, shapes, 0.0))

    def matched(solution: Solution) -> list[Counterpart | None]:
        return counterparts(stiff, at_nodes_inside(fine.frequency_hz, fine.shapes), solution, count)

    def of_beams(beam_model: FullOrderModel) -> list[Counterpart | None]:
        pairs = full_order_modes(beam_model, min(more, beam_model.order))
        hz = np.sqrt(pairs.values) / (2 * np.pi)
        shapes = beam_model.node_displacements(pairs.vectors)
        return matched(at_nodes_inside(hz, shapes[common] if beam_model is described else shapes))

    def of_solid(modes: WholeModes | None) -> list[float | None]:
        if modes is None:
            return [None] * count
        return [mode and mode.frequency_hz for mode in matched(at_nodes_inside(modes.frequency_hz, modes.shapes))]

    all_elastic, elastic_roots, rigid_roots = of_beams(described), of_beams(stiff), of_beams(rigid)
    lower = of_solid(coarse)
    bodies, ground = of_solid(variants.get("bodies")), of_solid(variants.get("ground"))
    all_rigid = of_solid(list(variants.values())[-1] if variants else coarse)
    modes = []
    for k, hz in enumerate(fine.frequency_hz[:count].tolist()):
        low = lower[k]
        uncertain = abs(low - hz) / CONVERGENCE if low else hz
        limit = hz - uncertain if low else hz
        mode, roots_mode, rigid_mode = all_elastic[k], elastic_roots[k], rigid_roots[k]
        rigid_hz = rigid_mode and rigid_mode.frequency_hz
        described_hz = mode and mode.frequency_hz
        between_rigid = all_rigid[k]
        if between_rigid is not None and low:
            between_rigid *= limit / low  # the same mesh has the same error
        modes.append(
            WholeMode(
                frequency_hz=limit,
                uncertainty=uncertain / limit if limit else 0.0,
                described_hz=described_hz,
                mac=mode and mode.mac,
                difference=_over(described_hz, limit),
                beams=_over(rigid_hz, between_rigid),
                roots=_over(roots_mode and roots_mode.frequency_hz, rigid_hz),
                bodies=_over(bodies[k], low),
                ground=_over(ground[k], low),
            )
        )
    return WholeVerification(
        name=model.name,
        parameters=single,
        modes=tuple(modes),
        order=ORDER,
        size=size,
        cells=fine.cells,
        dofs=fine.dofs,
        mass=fine.mass,
        seconds=time.perf_counter() - began,
        notes=(*fine.notes, *corners),
    )


def _over(value: float | None, base: float | None) -> float | None:
    return None if value is None or not base else value / base - 1
