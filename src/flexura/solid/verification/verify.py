"""Beam models of a mechanism against its solid: frequencies of the same modes, with the error the solid itself has."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener, told
from flexura.errors import OptionError
from flexura.mechanism import Mechanism
from flexura.methods import Solution, mac_matrix
from flexura.modal import pair_by_mac
from flexura.results import Tabular
from flexura.solid.fem import MOST_MODES, SURE, SolidModes, beam_mass, elastic_matrices, solid_modes
from flexura.solid.interchange import calculix_matrices, need_program
from flexura.solid.mesh import SolidMesh
from flexura.solid.verification.beam_models import BeamModel, Described, beam_models
from flexura.solid.verification.whole import WholeVerification
from flexura.solid.verification.whole import whole as whole_part
from flexura.structure import FullOrderModel, one_design
from flexura.tables import Facts, Table, in_hz, percent, quantity

Solver = Literal["flexura", "calculix"]

FINE = 0.7
"""Size of the fine mesh, relative to the meshers' own choice."""

COARSER = 2.0
"""The coarse mesh has cells so many times longer than the fine one."""

COARSEST = 5.0
"""Largest size of any mesh."""

SIZES = (0.05, 2.5)
"""Smallest and largest size of the fine mesh."""

LEAST_ORDER = 1.5
"""Least order with the cell size to which frequencies are taken to converge (theory eq. E9)."""

SAME = 1e-3
"""Relative difference of two meshes up to which frequencies are not extrapolated: uneven cells make as much."""

PICTURED = "corrected, full order"
"""The row whose shapes stand beside the solid's in pictures, and whose nodes both are compared at."""


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


MOST_SHOWN = 5
"""Models that a notebook shows."""


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

    def _view(self) -> Iterator[Facts | Table]:
        solid = {
            "mode": range(1, len(self.frequency_hz) + 1),
            "solid [Hz]": self.frequency_hz,
            "known to": [percent(own) or "unknown" for own in self.uncertainty],
        }
        for row in [row for row in self.rows if not row.failure][:MOST_SHOWN]:
            solid[row.model] = [percent(error) or "no counterpart" for error in row.error]
        yield Table(solid, "modes")
        failed = {row.model: row.failure for row in self.rows if row.failure}
        yield Facts(
            {
                "mass of the beams": quantity(self.beam_mass, "kg"),
                "against the solids": percent(self.mass_error),
                **failed,
            }
        )

    def _columns(self) -> dict[str, Any]:
        """A row for each mode of the solid and each model."""
        found = [
            (row.model, k + 1, hz, row.frequency_hz[k], row.error[k], row.mac[k])
            for row in self.rows
            for k, hz in enumerate(self.frequency_hz[: len(row.error)])
        ]
        names = ("model", "mode", "solid frequency [Hz]", "frequency [Hz]", "relative error", "mac")
        return {name: [own[k] for own in found] for k, name in enumerate(names)}

    def __repr__(self) -> str:
        worst = ", ".join(
            f"{row.model} {'failed' if row.worst_error is None else f'{100 * row.worst_error:+.2g} %'}"
            for row in self.rows
        )
        return f"Verification({self.name!r}, worst errors: {worst})"


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
        return whole_part(model, parameters, int(n), 1.0 if size is None else float(size), told(progress))
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
    fine = FINE if size is None else float(size)
    least, most = SIZES
    if not least <= fine <= most:
        raise OptionError(f"the mesh size is relative to the default, from {least:g} to {most:g}, not {size!r}")
    single = one_design(parameters)
    matrices, announce = _matrices(solver), told(progress)
    models, described = beam_models(model, single)
    corrected = next(own.model for own in models if own.label == PICTURED)
    corrected.plan.refuse_loads("solid elements, which feel no preload", corrected.values)
    if corrected.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    done = Verification(model.name, int(n), solver, described, single, (), beam_mass=beam_mass(corrected))
    solved: list[BeamModel] = []
    for own in models:
        announce(own.label)
        solved.append(own.solved(3 * int(n) + 6))
        done = replace(done, rows=tuple(_row(own, int(n)) for own in solved))
        yield done
    found: list[tuple[SolidModes, float]] = []
    for relative in (factor * fine for factor in (COARSER**2, COARSER, 1.0) if factor * fine <= COARSEST):
        begin = time.perf_counter()
        own = solid_modes(
            corrected,
            int(n),
            relative,
            more=2,
            hexahedra=solver == "flexura",
            matrices=matrices,
            announce=announce,
        )
        found.append((own, time.perf_counter() - begin))
        done = _against(done, solved, found)
        yield done


def _row(own: BeamModel, n: int) -> VerificationRow:
    """A row with its own lowest modes, while there is no solid yet."""
    if own.solution is None:
        return VerificationRow(own.label, failure=own.failure)
    hz = _floats(own.solution.frequency_hz[:n])
    return VerificationRow(own.label, own.solution.order, hz, tuple(range(1, len(hz) + 1)), seconds=own.seconds)


def _against(done: Verification, solved: list[BeamModel], found: list[tuple[SolidModes, float]]) -> Verification:
    """Everything against the solid as far as it is known."""
    finest = found[-1][0]
    n = min(done.n, len(finest.solution.frequency_hz))
    pictured = next(own for own in solved if own.label == PICTURED)
    limit, uncertainty, meshes = _limit(pictured.model, [own for own, _ in found], n)
    solids = tuple(
        SolidRow(s.size, s.order, s.dofs, s.meshed_dofs, s.cells, _known(f), _known(_relative(f, limit)), seconds)
        for (s, seconds), f in zip(found, meshes, strict=True)
    )
    rows = []
    for own in solved:
        row = _row(own, n)
        if own.solution is not None:
            reference, solution = _on_common_nodes(own, pictured.model, finest.solution)
            hz, number, mac = _counterparts(own.model, reference, solution, n)
            error = [None if f is None else float(f / b - 1) for f, b in zip(hz, limit, strict=True)]
            worst = max((e for e in error if e is not None), key=abs, default=None)
            row = replace(row, frequency_hz=tuple(hz), number=number, mac=mac, error=tuple(error), worst_error=worst)
        rows.append(row)
    return replace(
        done,
        notes=_left_out(done.n, finest),
        rows=tuple(rows),
        solids=solids,
        frequency_hz=_floats(limit),
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
        np.array([np.nan if f is None else f for f in _counterparts(model, finest.solution, mesh.solution, n)[0]])
        for mesh in meshes[:-1]
    ]
    if not coarser:
        return hz, None, [hz]
    limit, off = extrapolated([*coarser, hz])
    return limit, off + finest.truncation[:n], [*coarser, hz]


def extrapolated(meshes: list[Array]) -> tuple[Array, Array]:
    """Limits of frequencies (n,) of two or three meshes, and how far off, relative, they may be (theory eq. E9).

    Every mesh has cells half as long as the one before. Frequencies are extrapolated where three meshes show the
    order at which they come down, with that order or LEAST_ORDER if this is more; not where they agree within SAME.
    """
    fine, coarse = meshes[-1], meshes[-2]
    change = coarse - fine
    limit = fine
    if len(meshes) > 2:
        before = meshes[-3] - coarse
        falls = (change > SAME * fine) & (before > change)
        order = np.log2(np.where(falls, before / np.where(falls, change, 1.0), 2.0))
        limit = np.where(falls, fine - change / (2.0 ** np.maximum(order, LEAST_ORDER) - 1), fine)
    moved = fine - limit
    return limit, np.maximum(np.abs(change) - moved, moved) / np.where(limit > 0, limit, 1.0)


def _left_out(n: int, finest: SolidModes) -> tuple[str, ...]:
    """Why there are fewer modes than asked for."""
    found = len(finest.solution.frequency_hz)
    if found >= n or not np.isfinite(finest.complete_hz):
        return ()
    return (
        f"{found} of {n} modes: of the solids {MOST_MODES} fixed-interface modes at most are kept, which reach to "
        f"{in_hz(finest.complete_hz, 3)}; modes of the mechanism above"
        f" {in_hz(finest.complete_hz / SURE, 3)} are not given",
    )


def _on_common_nodes(own: BeamModel, model: FullOrderModel, reference: Solution) -> tuple[Solution, Solution]:
    """The reference, of the nodes of `model`, and the row's own solution, both at the nodes that the two share."""
    assert own.solution is not None
    if own.model.plan is model.plan or own.model.plan.topology.node_names == model.plan.topology.node_names:
        return reference, own.solution
    assert reference.shapes is not None and own.solution.shapes is not None
    number = {name: k for k, name in enumerate(model.plan.topology.node_names)}
    at = np.array([number.get(name, -1) for name in own.model.plan.topology.node_names])
    shared = (at >= 0)[:, None, None]
    base = np.where(shared, reference.shapes[at], 0.0)
    return replace(reference, shapes=base), replace(own.solution, shapes=np.where(shared, own.solution.shapes, 0.0))


def _pairs(pictured: BeamModel, finest: SolidModes, n: int) -> ShapePairs | None:
    """Shapes of the counterparts with the signs of the solid's."""
    model, solution, reference = pictured.model, pictured.solution, finest.solution.shapes
    if solution is None or solution.shapes is None or reference is None:
        return None
    number = _counterparts(model, finest.solution, solution, n)[1]
    nodes, components = np.nonzero(model.plan.topology.dof >= 0)
    beams = np.full((*reference.shape[:2], n), np.nan)
    for k, j in enumerate(number):
        if j is not None:
            own = solution.shapes[:, :, j - 1]
            along = own[nodes, components] @ (model.M @ reference[nodes, components, k])
            beams[:, :, k] = own if along >= 0 else -own
    return ShapePairs(pictured.label, model, beams, finest)


def _counterparts(
    model: FullOrderModel, reference: Solution, solution: Solution, n: int
) -> tuple[list[float | None], tuple[int | None, ...], tuple[float | None, ...]]:
    """Frequency, number and MAC of the counterparts of the first `n` modes, by shape alone (theory eq. E8)."""
    mac = mac_matrix(model, reference, solution)
    partner = pair_by_mac(mac, reference.frequency_hz, solution.frequency_hz).tolist()
    found = [partner.index(k) if k in partner else None for k in range(n)]
    hz = [None if j is None else float(solution.frequency_hz[j]) for j in found]
    number = tuple(None if j is None else j + 1 for j in found)
    return hz, number, tuple(None if j is None else float(mac[k, j]) for k, j in enumerate(found))


def _relative(values: Array, base: Array) -> Array:
    return values / np.where(base > 0, base, 1.0) - np.where(base > 0, 1.0, 0.0)


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(float(v) for v in values)


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
