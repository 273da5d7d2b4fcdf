"""Beam models of a mechanism against its solid: frequencies of the same modes, with the error the solid itself has.

The beam models are plain, corrected, and as the description has its members.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis import corrected
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener, announcer
from flexura.errors import FlexuraError, OptionError
from flexura.fem import MOST_MODES, SIZES, SolidMesh, as_beams, elastic_matrices, with_rigid_faces, with_solid_parts
from flexura.full_order import assemble
from flexura.mechanism import Mechanism, has_solid_members
from flexura.methods import Solution, counterparts, dynamic_stiffness, low_order_solution
from flexura.reduction import full_order_modes, reduce
from flexura.results import Tabular
from flexura.solid.interchange import calculix_matrices, need_program
from flexura.solid.modes import SURE, SolidModes, beam_mass, solid_modes
from flexura.solid.whole import WholeVerification, verify_whole
from flexura.structure import FullOrderModel, one_design
from flexura.tables import Facts, Item, Line, Scale, Table, in_hz, number, quantity, scale_for, signed_percent

Solve = Callable[[FullOrderModel, int], Solution]
Described = Literal["plain", "corrected", "as described"]


Solver = Literal["flexura", "calculix"]

FINE_SIZE = 0.7
"""Size of the fine mesh, relative to the meshers' own choice."""

COARSER = 2.0
"""The coarse mesh has cells so many times longer than the fine one."""

FINE_SIZES = (0.05, 2.5)
"""Smallest and largest size of the fine mesh."""

LEAST_ORDER = 1.5
"""Least order with the cell size to which frequencies are taken to converge (theory eq. E9)."""

UNCHANGED = 1e-3
"""Relative difference of two meshes up to which frequencies are not extrapolated: uneven cells make as much."""

PICTURED = "corrected, full order"
"""The row whose shapes stand beside the solid's in pictures, and whose nodes both are compared at."""

POOR = 0.9
"""A modal assurance criterion below this is marked."""

DESCRIBED = {
    "plain": "none is corrected, as in the plain rows",
    "corrected": "as in the corrected rows",
    "as described": "solid ones, or some corrected and some not: as described",
}
"""What the file says of its members."""


@dataclass(frozen=True)
class BeamModel:
    """A row before and after it is solved: what is assembled, and how its modes are found.

    `solution` has the shapes of all nodes of `model`; `seconds` are those from a plan to it. A model that cannot
    answer has `failure` instead.
    """

    label: str
    model: FullOrderModel
    method: Solve
    solution: Solution | None = None
    seconds: float | None = None
    failure: str = ""

    def solved(self, n: int) -> BeamModel:
        """The same with its `n` lowest modes, or why it has none."""
        begin = time.perf_counter()
        try:
            fresh = assemble(self.model.plan, self.model.parameters)
            solution = self.method(fresh, n)
        except FlexuraError as error:
            return replace(self, failure=str(error))
        return replace(self, solution=solution, seconds=time.perf_counter() - begin)


def beam_models(mechanism: Mechanism, parameters: Mapping[str, float]) -> tuple[list[BeamModel], Described]:
    """The models, and which of them has the members as they are described.

    Rows of their own are there for descriptions that correct some members only, or have solid ones. Raises ModelError
    and OptionError.
    """
    plain, full = (assemble(with_rigid_faces(as_beams(mechanism, which)), parameters) for which in ("none", "auto"))
    models = [
        BeamModel("plain, low order", plain, low_order),
        BeamModel("plain, full order", plain, full_order),
        BeamModel("corrected, low order", full, low_order),
        BeamModel("corrected, full order", full, full_order),
        BeamModel("corrected, exact", full, dynamic_stiffness),
    ]
    if not has_solid_members(mechanism):
        corrections = corrected(assemble(with_rigid_faces(mechanism), parameters))[0]
        if corrections == corrected(full)[0]:
            return models, "corrected"
        if corrections == corrected(plain)[0]:
            return models, "plain"
    described = assemble(with_solid_parts(mechanism, parameters))
    models += [
        BeamModel("as described, low order", described, low_order),
        BeamModel("as described, full order", described, full_order),
    ]
    return models, "as described"


def low_order(model: FullOrderModel, n: int) -> Solution:
    """The `n` lowest modes by constraint modes alone, the order of the paper."""
    return low_order_solution(reduce(model.plan, model.parameters), model, n)


def full_order(model: FullOrderModel, n: int) -> Solution:
    """The `n` lowest modes of all beam elements."""
    pairs = full_order_modes(model, n)
    hz = np.sqrt(pairs.values) / (2 * np.pi)
    return Solution("full order", model.order, hz, model.node_displacements(pairs.vectors))


@dataclass(frozen=True)
class VerificationRow:
    """One model's counterparts of the solid's modes.

    Of each mode of the solid: `frequency_hz`, its `number` in the row's own order from 1, the modal assurance criterion
    `mac` over the beam nodes, and the relative `error` against the solid's frequency; None where no mode of the row has
    a MAC of one half or more. Before there is a solid the fields hold the model's own modes in order, without the last
    two. `seconds` lead from a plan to frequencies and shapes. A model that cannot answer has `failure` and no numbers.
    """

    model: str
    order: int | None = None
    frequency_hz: tuple[float | None, ...] = ()
    number: tuple[int | None, ...] = ()
    mac: tuple[float | None, ...] = ()
    error: tuple[float | None, ...] = ()
    worst_error: float | None = None
    seconds: float | None = None
    failure: str = ""


@dataclass(frozen=True)
class SolidRow:
    """The solid on one mesh.

    `size` is relative to the mesher's own choice; `dofs` and `cells` of all meshes placed and of the distinct ones,
    `order` of the eigenvalue problem after reduction. `error` is relative to the converged estimate. Frequencies of the
    coarse mesh are those of the fine one's counterparts, None where there are none.
    """

    size: float
    order: int
    dofs: int
    meshed_dofs: int
    cells: int
    frequency_hz: tuple[float | None, ...]
    error: tuple[float | None, ...]
    seconds: float


@dataclass(frozen=True)
class ShapePairs:
    """Shapes of the solid's modes, and of their counterparts in the row `label`, for pictures.

    `beams` (n_nodes, 6, n) are of length one in the mass matrix of `model` and have the sign of the solid's, NaN where
    there is no counterpart; `solid` is that of the finest mesh.
    """

    label: str
    model: FullOrderModel
    beams: Array
    solid: SolidModes


@dataclass(frozen=True, repr=False)
class Verification(Tabular):
    """Beam models against the solid of the same mechanism.

    `described` says which rows have the members as the description has them: plain, corrected, or a row of its own.
    `frequency_hz` are the solid's converged frequencies as estimated from its meshes, `uncertainty` how far off,
    relative, that may be (theory eq. E9), None where coarser meshes have no such mode; with one mesh they are of that
    mesh, and nothing is known of the rest. They are fewer than `n` where fixed-interface modes of the solids would have
    to be known to too high frequencies; `notes` say so.
    `beam_mass` and `solid_mass`, kg, are those of the members alone: bodies and masses are the same in both.
    """

    name: str
    n: int
    solver: str
    described: Described
    parameters: dict[str, float]
    rows: tuple[VerificationRow, ...]
    solids: tuple[SolidRow, ...] = ()
    frequency_hz: tuple[float, ...] = ()
    uncertainty: tuple[float | None, ...] = ()
    beam_mass: float = 0.0
    solid_mass: float | None = None
    notes: tuple[str, ...] = ()
    shapes: ShapePairs | None = field(default=None, repr=False, compare=False)

    @property
    def mass_error(self) -> float | None:
        """Relative difference of the beams' mass from the solids'."""
        return None if not self.solid_mass else self.beam_mass / self.solid_mass - 1

    def _data(self) -> dict[str, Any]:
        """Everything but the shapes."""
        return {**super()._data(), "mass_error": self.mass_error}

    def presentation(self) -> Iterator[Item]:
        """A column for every model and a row for every mode of the solid, then the evidence."""
        rows, solids = [row for row in self.rows if not row.failure], self.solids
        count = max([len(self.frequency_hz), *(len(row.frequency_hz) for row in self.rows)])
        scale = scale_for([f for row in (*rows, *solids) for f in row.frequency_hz if f is not None], "Hz")
        models: dict[str, list[Any]] = {
            "model": [row.model for row in rows],
            "DOFs": [row.order for row in rows],
            "time": [quantity(row.seconds or 0.0, "s", 3) for row in rows],
            "worst": [signed_percent(row.worst_error) for row in rows],
        }
        for solid in solids:
            worst = max((e for e in solid.error if e is not None), key=abs, default=0.0)
            cells = (
                f"solid, size {solid.size:.3g}",
                solid.dofs,
                quantity(solid.seconds, "s", 3),
                signed_percent(worst),
            )
            for column, cell in zip(models.values(), cells, strict=True):
                column.append(cell)
        if solids:
            for column, cell in zip(models.values(), ("solid, limit", None, "", ""), strict=True):
                column.append(cell)
        for k in range(count):
            cells = [_cell(row, k, scale) for row in rows]
            cells += [_with_error(solid.frequency_hz[k], solid.error[k], scale) for solid in solids]
            models[scale.heading(f"mode {k + 1}")] = cells + (
                [_with_error(self.frequency_hz[k], None, scale)] if solids else []
            )
        yield Table(models, "models")
        yield Facts({row.model: row.failure for row in self.rows if row.failure})
        yield Facts({"members of the file itself": DESCRIBED[self.described]})
        yield from map(Line, self._evidence() if solids else ["no solid yet: modes by their own numbers"])

    def _evidence(self) -> Iterator[str]:
        """Shapes that differ, the solid's own error, the masses."""
        doubtful = [
            f"{row.model} mode {k + 1} MAC {mac:.2f}"
            for row in self.rows
            for k, mac in enumerate(row.mac)
            if mac is not None and mac < POOR
        ]
        if doubtful:
            yield f"* shapes differ: {', '.join(doubtful)}"
        if len(self.solids) == 1:
            yield "one mesh: how far it is from the limit is not known"
        else:
            each = ", ".join("unknown" if u is None else f"{100 * u:.2g}" for u in self.uncertainty)
            yield f"limit estimated from {len(self.solids)} meshes, uncertain by {each} %"
        finest = self.solids[-1]
        cells = f"{finest.cells} distinct cells, {finest.meshed_dofs} DOFs of {finest.dofs} placed"
        yield f"fine mesh: {cells}, reduced to {finest.order}; solver {self.solver}"
        if self.mass_error is not None:
            masses = f"{quantity(self.beam_mass, 'kg')} as beams, {quantity(self.solid_mass, 'kg')} as solids"
            difference = "equal" if abs(self.mass_error) < 1e-6 else signed_percent(self.mass_error)
            yield f"mass of members {masses} ({difference})"

    def _title(self) -> str:
        return "beam models, errors against the converged solid" if self.solids else "beam models"

    def _columns(self) -> dict[str, Any]:
        """A row for each mode of the solid and each model."""
        lines = [
            (row.model, k + 1, hz, row.frequency_hz[k], row.error[k], row.mac[k])
            for row in self.rows
            for k, hz in enumerate(self.frequency_hz[: len(row.error)])
        ]
        names = ("model", "mode", "solid frequency [Hz]", "frequency [Hz]", "relative error", "mac")
        return {name: [line[k] for line in lines] for k, name in enumerate(names)}

    def __repr__(self) -> str:
        worst = ", ".join(
            f"{row.model} {'failed' if row.worst_error is None else f'{100 * row.worst_error:+.2g} %'}"
            for row in self.rows
        )
        return f"Verification({self.name!r}, worst errors: {worst})"


def _cell(row: VerificationRow, k: int, scale: Scale) -> str:
    """A frequency with its error, marked where the two shapes differ visibly."""
    hz = row.frequency_hz[k] if k < len(row.frequency_hz) else None
    if hz is None or not row.error:
        return _with_error(hz, None, scale)
    mac = row.mac[k]
    return _with_error(hz, row.error[k], scale, "*" if mac is not None and mac < POOR else "")


def _with_error(hz: float | None, error: float | None, scale: Scale, mark: str = "") -> str:
    if hz is None:
        return "none"
    return f"{number(hz / scale.size)}{mark}" + ("" if error is None else f" {100 * error:+.2f}%")


@overload
def verify(
    model: Mechanism,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    n: int = 6,
    size: float | None = None,
    solver: Solver = "flexura",
    whole: Literal[False] = False,
    progress: Listener | None = None,
) -> Verification: ...
@overload
def verify(
    model: Mechanism,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    n: int = 6,
    size: float | None = None,
    solver: Solver = "flexura",
    whole: Literal[True],
    progress: Listener | None = None,
) -> WholeVerification: ...
@verb
def verify(
    model: Mechanism,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    n: int = 6,
    size: float | None = None,
    solver: Solver = "flexura",
    whole: bool = False,
    progress: Listener | None = None,
) -> Verification | WholeVerification:
    """The `n` lowest modes of the solid beside those of the beam models, plain and corrected, paired by shape.

    `size` of the fine mesh is relative to the meshers' own choice; two more are coarser. `solver` makes the solid's
    matrices: this package's elements, or CalculiX, which has tetrahedra alone. With `whole` the part itself is one
    solid, nothing rigid but what is held, beside the model as `modes` describes it; NGSolve solves it. `progress` is
    told of every model and mesh. Raises ModelError, OptionError and SolverError.
    """
    if whole:
        _check(model, n)
        if solver != "flexura":
            raise OptionError(f"the whole part is solved by NGSolve, not by {solver}")
        return verify_whole(model, parameters, int(n), 1.0 if size is None else float(size), announcer(progress))
    *_, last = progressively(model, parameters, n=n, size=size, solver=solver, progress=progress)
    return last


def progressively(
    model: Mechanism,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    n: int = 6,
    size: float | None = None,
    solver: Solver = "flexura",
    progress: Listener | None = None,
) -> Iterator[Verification]:
    """`verify` after every row and mesh; `progress` is told each before it starts."""
    _check(model, n)
    fine = FINE_SIZE if size is None else float(size)
    least, most = FINE_SIZES
    if not least <= fine <= most:
        raise OptionError(f"the mesh size is relative to the default, from {least:g} to {most:g}, not {size!r}")
    single = one_design(parameters)
    matrices, announce = _matrices(solver), announcer(progress)
    models, described = beam_models(model, single)
    pictured = next(model.model for model in models if model.label == PICTURED)
    pictured.plan.refuse_loads("solid elements, which feel no preload", pictured.values)
    if pictured.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    done = Verification(model.name, int(n), solver, described, single, (), beam_mass=beam_mass(pictured))
    solved: list[BeamModel] = []
    for beams in models:
        announce(beams.label)
        solved.append(beams.solved(3 * int(n) + 6))
        done = replace(done, rows=tuple(_row(row, int(n)) for row in solved))
        yield done
    meshes: list[tuple[SolidModes, float]] = []
    for relative in (factor * fine for factor in (COARSER**2, COARSER, 1.0) if factor * fine <= SIZES[1]):
        begin = time.perf_counter()
        hexahedra = solver == "flexura"
        solid = solid_modes(
            pictured, int(n), relative, more=2, hexahedra=hexahedra, matrices=matrices, announce=announce
        )
        meshes.append((solid, time.perf_counter() - begin))
        done = _against(done, solved, meshes)
        yield done


def _row(beams: BeamModel, n: int) -> VerificationRow:
    """A row with its own lowest modes, while there is no solid yet."""
    if beams.solution is None:
        return VerificationRow(beams.label, failure=beams.failure)
    hz = tuple(beams.solution.frequency_hz[:n].tolist())
    return VerificationRow(beams.label, beams.solution.order, hz, tuple(range(1, len(hz) + 1)), seconds=beams.seconds)


def _against(done: Verification, solved: list[BeamModel], meshes: list[tuple[SolidModes, float]]) -> Verification:
    """Everything against the solid as far as it is known."""
    finest = meshes[-1][0]
    n = min(done.n, len(finest.solution.frequency_hz))
    pictured = next(beams for beams in solved if beams.label == PICTURED)
    limit, uncertainty, hz_of_meshes = _limit(pictured.model, [solid for solid, _ in meshes], n)
    above_zero = np.where(limit > 0, limit, 1.0)
    solids = tuple(
        SolidRow(
            size=solid.size,
            order=solid.order,
            dofs=solid.dofs,
            meshed_dofs=solid.meshed_dofs,
            cells=solid.cells,
            frequency_hz=_known(hz),
            error=_known(hz / above_zero - np.where(limit > 0, 1.0, 0.0)),
            seconds=seconds,
        )
        for (solid, seconds), hz in zip(meshes, hz_of_meshes, strict=True)
    )
    rows = []
    for beams in solved:
        row = _row(beams, n)
        if beams.solution is not None:
            modes = counterparts(beams.model, *_on_common_nodes(beams, pictured.model, finest.solution), n)
            error = [mode and float(mode.frequency_hz / hz - 1) for mode, hz in zip(modes, limit, strict=True)]
            row = replace(
                row,
                frequency_hz=tuple(mode and mode.frequency_hz for mode in modes),
                number=tuple(mode and mode.number + 1 for mode in modes),
                mac=tuple(mode and mode.mac for mode in modes),
                error=tuple(error),
                worst_error=max((e for e in error if e is not None), key=abs, default=None),
            )
        rows.append(row)
    return replace(
        done,
        notes=_left_out(done.n, finest),
        rows=tuple(rows),
        solids=solids,
        frequency_hz=tuple(limit.tolist()),
        uncertainty=() if uncertainty is None else _known(uncertainty),
        solid_mass=finest.mass,
        shapes=_pairs(pictured, finest, n),
    )


def _check(model: object, n: object) -> None:
    """Raise OptionError for what cannot be verified."""
    if not isinstance(n, int | np.integer) or n < 1:
        raise OptionError(f"the number of modes is a whole number, at least 1, not {n!r}")
    if not isinstance(model, Mechanism):
        raise OptionError(f"a Mechanism is expected, not a {type(model).__name__}; flexura.load reads a file")
    if model.at:
        raise OptionError(
            "verification: of the undeformed mechanism alone, not at the pose that is described; take `at` out for it"
        )


def _limit(model: FullOrderModel, meshes: list[SolidModes], n: int) -> tuple[Array, Array | None, list[Array]]:
    """Converged frequencies, their uncertainty, and the frequencies of every mesh (theory eq. E9)."""
    finest = meshes[-1]
    hz = finest.solution.frequency_hz[:n]
    coarser = [
        np.array([mode.frequency_hz if mode else np.nan for mode in modes])
        for modes in (counterparts(model, finest.solution, mesh.solution, n) for mesh in meshes[:-1])
    ]
    if not coarser:
        return hz, None, [hz]
    limit, off = extrapolated([*coarser, hz])
    return limit, off + finest.truncation[:n], [*coarser, hz]


def extrapolated(meshes: list[Array]) -> tuple[Array, Array]:
    """Limits of frequencies (n,) of two or three meshes, and how far off, relative, they may be (theory eq. E9).

    Every mesh has cells half as long as the one before. Frequencies are extrapolated where three meshes show the
    order at which they come down, with that order or LEAST_ORDER if this is more; not where they agree within
    UNCHANGED.
    """
    fine, coarse = meshes[-1], meshes[-2]
    change = coarse - fine
    limit = fine
    if len(meshes) > 2:
        before = meshes[-3] - coarse
        falls = (change > UNCHANGED * fine) & (before > change)
        order = np.log2(np.where(falls, before / np.where(falls, change, 1.0), 2.0))
        limit = np.where(falls, fine - change / (2.0 ** np.maximum(order, LEAST_ORDER) - 1), fine)
    moved = fine - limit
    return limit, np.maximum(np.abs(change) - moved, moved) / np.where(limit > 0, limit, 1.0)


def _left_out(n: int, finest: SolidModes) -> tuple[str, ...]:
    """Why there are fewer modes than asked for."""
    count = len(finest.solution.frequency_hz)
    if count >= n or not np.isfinite(finest.complete_hz):
        return ()
    return (
        f"{count} of {n} modes: of the solids {MOST_MODES} fixed-interface modes at most are kept, which reach to "
        f"{in_hz(finest.complete_hz, 3)}; modes of the mechanism above"
        f" {in_hz(finest.complete_hz / SURE, 3)} are not given",
    )


def _on_common_nodes(beams: BeamModel, model: FullOrderModel, reference: Solution) -> tuple[Solution, Solution]:
    """The reference, of the nodes of `model`, and the row's own solution, both at the nodes that the two share."""
    solution, names = beams.solution, beams.model.plan.topology.node_names
    assert solution is not None
    if beams.model.plan is model.plan or names == model.plan.topology.node_names:
        return reference, solution
    assert reference.shapes is not None and solution.shapes is not None
    number = {name: k for k, name in enumerate(model.plan.topology.node_names)}
    at = np.array([number.get(name, -1) for name in names])
    shared = (at >= 0)[:, None, None]
    base = np.where(shared, reference.shapes[at], 0.0)
    return replace(reference, shapes=base), replace(solution, shapes=np.where(shared, solution.shapes, 0.0))


def _pairs(pictured: BeamModel, finest: SolidModes, n: int) -> ShapePairs | None:
    """Shapes of the counterparts with the signs of the solid's."""
    model, solution, reference = pictured.model, pictured.solution, finest.solution.shapes
    if solution is None or solution.shapes is None or reference is None:
        return None
    nodes, components = np.nonzero(model.plan.topology.dof >= 0)
    beams = np.full((*reference.shape[:2], n), np.nan)
    for k, mode in enumerate(counterparts(model, finest.solution, solution, n)):
        if mode is not None:
            shape = solution.shapes[:, :, mode.number]
            along = shape[nodes, components] @ (model.M @ reference[nodes, components, k])
            beams[:, :, k] = shape if along >= 0 else -shape
    return ShapePairs(pictured.label, model, beams, finest)


def _known(values: Array) -> tuple[float | None, ...]:
    return tuple(None if np.isnan(v) else float(v) for v in values)


def _matrices(solver: Solver) -> Any:
    """What makes K and M of a mesh."""
    if solver == "flexura":
        return elastic_matrices
    if solver == "calculix":
        need_program()
        return _calculix_matrices
    raise OptionError(f"the solver is flexura or calculix, not {solver!r}")


def _calculix_matrices(mesh: SolidMesh) -> tuple[Any, Any]:
    """K and M by CalculiX with our numbers of DOFs."""
    stored = calculix_matrices(mesh)
    place = np.empty(mesh.order, dtype=np.intp)
    place[3 * (stored.node - 1) + stored.component] = np.arange(mesh.order)
    return stored.K[place][:, place], stored.M[place][:, place]
