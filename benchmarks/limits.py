"""How far flexura is from what a question cannot do without: its arithmetic, its memory, and bare calls by hand.

    python benchmarks/limits.py [NAME ...]      the table of docs/speed.md, some minutes; names are those of ROWS

Arithmetic is counted in multiplications with an addition, and told in the time that NumPy's product of matrices of
order 512 takes for as many. Bytes are those that pass through memory, beyond the caches, in the time of a copy; the
longer of both is `their time`. By hand is what bare calls of LAPACK and BLAS, or of the system, take with all that they
need at hand, and nothing else. Ours has everything, as the other benchmarks ask it. All are medians of processor time,
on one thread.

By hand sparse matrices are factorised as bands by LAPACK's `dpbtrf`, in the order of Cuthill and McKee, and solved with
factors of SuperLU, which were quickest; counted are multiplications of L D L'. Six lowest values cost a factor and
blocks of nine vectors, as block Lanczos takes them; elements that turn, what is said at TURNED, and by hand nothing.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from itertools import count
from statistics import median
from typing import Any, NamedTuple

import designs
import gradients
import numpy as np
import optimize
import pairs
import scipy.sparse as sp
import speed
import start
import studies
import turning
from pairs import HERTZ, MODES, costs
from scipy.linalg import lapack
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu
from speed import RPR

import flexura as fx
from flexura.motion import NO_LOADS, Equations, MovingModel, TurningModel, kept_frames, newton
from flexura.pages.live import Ask, Described, Designs, FollowedModes
from flexura.reduction.chain_assembler import chain_assembler
from flexura.structure import Design
from flexura.study.questions import questions

PRODUCT = 512
COPIED = 1 << 26
"""Bytes of the array that is copied."""

BLOCKS, WIDTH = 4, MODES + 3
"""Blocks of so many vectors that six lowest values take."""

TURNED = 300, 1200
"""Multiplications of an element that turns, about: its relative pose, the logarithm of it, strains and forces, with
inertia; and its tangent, B' K B of a B of 6 x 12 and what forces add to it."""

QUARTIC = 6 * (56 + 21 + 6)
"""What a superelement takes more: its energy of fourth order in six deformations, contracted with these."""

SIZES, POSES, SAMPLES, STEPS = 15, 41, 64, 10_000
WHEEL = 4000
"""Branches of the largest mechanism."""


class Limit(NamedTuple):
    """What a question cannot do without, and what it takes: multiplications and bytes, seconds by hand and of ours, and
    what is done by hand."""

    arithmetic: float
    bare: float
    own: float
    which: str
    through: float = 0.0

    @property
    def least(self) -> float:
        """Seconds of arithmetic or of memory, whichever are more."""
        return max(self.arithmetic / rate(), self.through / copied())


@cache
def rate() -> float:
    """Multiplications with an addition a second, of a product of matrices."""
    A = np.ones((PRODUCT, PRODUCT))
    return PRODUCT**3 / alone(lambda: A @ A)


@cache
def copied() -> float:
    """Bytes a second that a copy reads and writes."""
    A = np.ones(COPIED // 8)
    B = A.copy()
    return 2 * COPIED / alone(lambda: np.copyto(B, A))


def alone(call: Callable[[], object]) -> float:
    """Median processor time of a call, s."""
    return costs(call, lambda: None)[0]


@contextmanager
def counted(owner: type, name: str) -> Iterator[list[object]]:
    """One entry for each call of a method."""
    true, found = getattr(owner, name), list[object]()
    setattr(owner, name, lambda *given, **named: (found.append(None), true(*given, **named))[1])
    try:
        yield found
    finally:
        setattr(owner, name, true)


class Sparse:
    """A positive definite matrix (n, n): multiplications of its factor and of a solution, and both by hand."""

    def __init__(self, K: Any) -> None:
        self.K = sp.csc_matrix(K)
        self.K.eliminate_zeros()
        order = reverse_cuthill_mckee(sp.csr_matrix(self.K), symmetric_mode=True)
        A = sp.coo_matrix(sp.tril(self.K[order][:, order]))
        self._band = np.zeros((int((A.row - A.col).max()) + 1, A.shape[0]), order="F")
        self._band[A.row - A.col, A.col] = A.data
        assert lapack.dpbtrf(self._band, lower=1)[1] == 0
        self._lu = splu(self.K, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        below = np.diff(self._lu.L.indptr) - 1
        self.factor = float((below * (below + 3)).sum()) / 2
        self.solve = float(2 * below.sum() + len(below))
        self.product = float(self.K.nnz)

    def by_hand(self, factors: float, solutions: float, columns: int = 1) -> float:
        """Seconds of so many factors, and of solutions for so many columns."""
        b = np.ones((self.K.shape[0], columns))
        factor, solution = alone(lambda: lapack.dpbtrf(self._band, lower=1)), alone(lambda: self._lu.solve(b))
        return factors * factor + solutions * solution

    def multiplied(self, columns: int) -> float:
        """Seconds of a product with so many columns, by SciPy."""
        X = np.ones((self.K.shape[0], columns))
        return alone(lambda: self.K @ X)

    @property
    def lowest(self) -> float:
        """Multiplications to six lowest values."""
        return self.factor + BLOCKS * WIDTH * (self.solve + self.product)

    def lowest_by_hand(self, factors: int = 1) -> float:
        """Seconds to six lowest values, with factors to count besides."""
        return self.by_hand(factors, BLOCKS, WIDTH) + BLOCKS * self.multiplied(WIDTH)


@cache
def plan() -> fx.Plan:
    return fx.Plan(fx.load(RPR))


@cache
def whole() -> Sparse:
    """The stiffness of full order; masses have the same pattern."""
    return Sparse(fx.assemble(plan()).K)


@cache
def guide() -> tuple[Sparse, int]:
    """The stiffness of the guide of the studies, about its rest, and how many elements it has."""
    full = fx.assemble(fx.load(optimize.EXAMPLES / "guide" / "guide.yaml"))
    return turned(Equations(MovingModel.of(full.design))), elements(full.design)


def elements(design: Design) -> int:
    """Elements of all copies."""
    topology = design.plan.topology
    return sum(len(own.elements.K) * len(topology.copies[name].offset) for name, own in design.matrices.items())


def turned(equations: Equations) -> Sparse:
    """The stiffness about a state a little away from rest, in which nothing stands along the axes."""
    model = equations.model
    away = 1e-9 * np.random.default_rng(0).standard_normal(model.n_dof)
    frames = model.rest.moved(equations.displacements(away / equations.scale))
    K = equations.tangent(frames, NO_LOADS, np.zeros(len(equations.drives)))[0].K
    return Sparse(K + K.T)


def of_chains(with_bounds: bool) -> float:
    """Of chains of e elements: their masses moved to the pole, flexibilities, static motions, loads and what these do;
    with bounds the wrenches of inertia, closed, and their energies besides."""
    e = sum(group.elements.size for reducer in chain_assembler(plan()).reducers.values() for group in reducer.chains)
    masses, flexibility, motions, loads, mass = 3 * 12 * 27, 9 * 27, 6**3, 4 * 6**3, 6**3
    closed, energies = 2 * 36 * 12, 6 * 78
    return e * (masses + flexibility + motions + loads + mass + with_bounds * (closed + energies))


def of_branches(arrow: object, with_bounds: bool) -> float:
    """Of chains at their places, insides of branches that follow, Ritz vectors and projections; with bounds each branch
    is eliminated below six values."""
    matrices = 3 if with_bounds else 2
    placed = sum(len(kind.copies) for kind in chain_assembler(plan()).branches.kinds) * 1.5 * 12 * 72 * matrices
    total = placed
    for block in arrow.blocks:  # type: ignore[attr-defined]
        (q, n), r, m = block.A.shape[2:4], block.T.shape[-3], block.inside
        i, p = n - m, block.T.shape[-1]
        follow = m**3 / 2 + m * m * i + matrices * (n * n * i + n * i * i)
        vectors = m**3 + m * m * i + r * (i * p * p + n * i * p + 3 * m * m * p)
        project = r * matrices * (n * n * p + n * p * p)
        eliminated = MODES * (n**3 / 6 + i**3 / 6 + r * 2 * i * p * p) if with_bounds else 0.0
        total += q * (follow + vectors + project + eliminated)
    return total


def low() -> Limit:
    """One design of order 54 from its sizes: dposv of the three kinds of substructures, products with the constraint
    modes, and dsygvx for six values."""
    webs = (3e-4 * (1 + 1e-4 * k) for k in count())
    matrices = Design.of(plan()).matrices
    parts = []
    for name, reducer in chain_assembler(plan()).reducers.items():
        if len(reducer.interior_dofs) and name:
            K, M = (A.toarray() for A in reducer.assembled(matrices[name]))
            inner, ends = reducer.interior_dofs, reducer.boundary_dofs
            parts.append((np.asfortranarray(K[np.ix_(inner, inner)]), np.asfortranarray(K[np.ix_(inner, ends)]), M))
    reduced = fx.reduce(plan(), keep=0)
    K, M = np.asfortranarray(reduced.K), np.asfortranarray(reduced.M)

    def bare() -> object:
        for stiffness, side, mass in parts:
            T = lapack.dposv(stiffness, side)[1]
            _ = side.T @ T, T.T @ (mass[: len(T), : len(T)] @ T)
        return lapack.dsygvx(M, K, jobz="N", range="I", il=len(K) - MODES + 1, iu=len(K))

    own, least = costs(lambda: fx.unproven_frequencies(plan(), {"r_web": next(webs)}, n=MODES), bare)
    true = np.sqrt(1 / bare()[0][:MODES][::-1]) / HERTZ  # type: ignore[index]
    assert np.allclose(true, fx.unproven_frequencies(plan(), n=MODES), rtol=1e-6)
    arrow = chain_assembler(plan()).unproven(Design.of(plan()).stacked())
    text = "`dposv` of the three substructures and `dsygvx`"
    return Limit(of_chains(False) + of_branches(arrow, False), least, own, text)


def proven() -> Limit:
    """One of many proven designs: dsygvx alone of order 54."""
    case = designs.CASES[0]
    reduced = fx.reduce(plan(), keep=0)
    K, M = np.asfortranarray(reduced.K), np.asfortranarray(reduced.M)
    n = 1024
    own = median(designs.worked(("proven", case, n, seed))[1] for seed in range(5)) / n
    least = alone(lambda: lapack.dsygvx(M, K, range="I", il=len(K) - MODES + 1, iu=len(K)))
    arrow = chain_assembler(plan())(Design.of(plan()).stacked())
    return Limit(of_chains(True) + of_branches(arrow, True), least, own, "`dsygvx` of order 54 alone")


def full() -> Limit:
    """Six frequencies of full order, counted: a second factor counts."""
    K = whole()
    own = next(pairs.full()).own
    text = "two `dpbtrf`, four solutions and products of nine columns"
    return Limit(K.lowest + K.factor, K.lowest_by_hand(2), own, text)


def slopes() -> Limit:
    """The same with derivatives by fifteen sizes: x' (K' - w^2 M') x of each size."""
    K, own = whole(), gradients.times()[2]
    contracted = SIZES * (2 * K.product * MODES + 2 * K.K.shape[0] * MODES)
    least = K.lowest_by_hand(2) + SIZES * 2 * K.multiplied(MODES)
    return Limit(K.lowest + K.factor + contracted, least, own, "the same, and 30 products of six columns")


def frf() -> Limit:
    """6 x 6 responses at 10 000 frequencies: products of shapes at hand times gains, complex; 36 rows are written."""
    hz, modes = 10_000, 54
    products, gains = np.ones((36, modes)), np.ones((modes, 2 * hz))
    arithmetic = 36 * modes * 2 * hz + 6 * modes * hz
    return Limit(arithmetic, alone(lambda: products @ gains), next(pairs.frf()).own, "`dgemm` of gains", 36 * 16 * hz)


def steps() -> Limit:
    """10 000 steps of 54 modes, one force, three displacements: two products a mode and step for the recursion, two for
    the force, three for the outputs."""
    modes, outputs = np.ones((54, STEPS)), np.ones((3, 54))

    def bare() -> object:
        modes[:, 1:] *= 0.5
        return outputs @ modes

    return Limit(7 * 54 * STEPS, alone(bare), next(pairs.steps()).own, "`dgemm` of outputs, a pass over the modes")


def newmark() -> Limit:
    """A step by average acceleration at full order: a solution, and products with masses and damping."""
    K, own = whole(), next(pairs.newmark()).own
    least = K.by_hand(0, 1) + 2 * K.multiplied(1)
    return Limit(K.solve + 2 * K.product, least, own, "a solution, two products with one column")


def poses() -> Limit:
    """41 poses of a guide of two leaves, six frequencies each, with as many solutions as ours takes."""
    import stroke_exudyn

    own = stroke_exudyn.Flexura(3)
    with counted(Equations, "solver") as made:
        own.stroke()
    K = turned(own.equations)
    n = len(made)
    arithmetic = n * (K.factor + K.solve + elements(own.equations.model.design) * sum(TURNED)) + POSES * K.lowest
    least = K.by_hand(n, n) + POSES * K.lowest_by_hand()
    text = f"{n} `dpbtrf` and solutions, and values of {POSES}"
    return Limit(arithmetic, least, stroke_exudyn.timed(own.stroke)[0], text)


def large(order: str) -> Limit:
    """A step of large motion, of full or low order: iterations and new matrices as ours takes them."""
    model = MovingModel.of(fx.assemble(plan()).design)
    inside = elements(model.design)
    if order == "low":
        turning_model = TurningModel.of(model, kept_frames(model))
        model, inside = turning_model.low, sum(len(group.node) for group, _ in turning_model.groups)
    with counted(newton._ByKernel, "look") as asked, counted(newton.Newton, "renew") as made:
        turning.over_time(model)
    K = turned(Equations(model))
    each, new = len(asked) / turning.STEPS, len(made) / turning.STEPS
    force, tangent = (one + QUARTIC * (order == "low") for one in TURNED)
    arithmetic = each * (K.solve + inside * force) + new * (K.factor + inside * tangent)
    own = median(turning.over_time(model)[1] for _ in range(5)) / 1e3
    return Limit(arithmetic, K.by_hand(new, each), own, f"{each:.1f} solutions, {new:.2g} `dpbtrf`")


def optimum() -> Limit:
    """An evaluation of the optimum of the guide: six values, a pose, and both with slopes by two sizes."""
    problem = optimize.PROBLEMS["guide"]
    asked: dict[str, Any] = {"vary": problem.box(problem.plan), "maximise": "f1", "subject_to": problem.limits()}
    with counted(Equations, "solver") as made:
        fx.optimize(problem.plan, **asked, starts=1)
    begun = time.process_time()
    found = fx.optimize(problem.plan, **asked, starts=1)
    own = (time.process_time() - begun) / found.evaluations
    (K, inside), n = guide(), len(made) / found.evaluations
    arithmetic = K.lowest + n * (K.factor + K.solve + inside * sum(TURNED)) + 2 * (K.solve + 4 * K.product)
    least = K.lowest_by_hand() + K.by_hand(n, n + 2) + 8 * K.multiplied(1)
    return Limit(arithmetic, least, own, f"{n:.0f} `dpbtrf` and solutions, and values")


def sample() -> Limit:
    """A sample of a tolerance of the guide with a stress at a pose, of many."""
    asked = questions(fx.Plan(fx.load(optimize.EXAMPLES / "guide" / "guide.yaml")), "stress at x = 2 mm")
    near = np.linspace(0.98, 1.02, SAMPLES)
    drawn = {name: float(asked.plan.parameter_values()[name]) * near for name in ("thickness", "length")}
    with counted(Equations, "solver") as made:
        asked.values(drawn)
    own = alone(lambda: asked.values(drawn)) / SAMPLES
    (K, inside), n = guide(), len(made) / SAMPLES
    arithmetic = n * (K.factor + K.solve + inside * sum(TURNED))
    return Limit(arithmetic, K.by_hand(n, n), own, f"{n:.0f} `dpbtrf` and solutions")


def slider() -> Limit:
    """The numbers of a moved slider: a proven design, and shapes of full order from those before in two rounds."""
    own = Described(plan(), MODES, (), 0)
    page, place = Designs(own, FollowedModes()), own.sliders["leaf_thickness"].value
    thick = (place * (1 + 1e-4 * k) for k in count())
    seconds = alone(
        lambda: page.numbers(Ask(type="design", serial=0, values={"leaf_thickness": next(thick)}, modes=MODES))
    )
    K, one, shapes = whole(), proven(), MODES + 4
    arithmetic = one.arithmetic + K.factor + 2 * shapes * (K.solve + 2 * K.product)
    least = one.bare + K.by_hand(1, 2, shapes) + 4 * K.multiplied(shapes)
    return Limit(arithmetic, least, seconds, "`dsygvx`, `dpbtrf`, two solutions and four products of ten columns")


def assembly() -> Limit:
    """4000 branches under the platform: every element turned to its place, every entry of K and M written once."""
    model = fx.assemble(plan())
    share = WHEEL / 4
    through = share * sum(A.data.nbytes + A.indices.nbytes for A in (model.K, model.M))
    command = [sys.executable, speed.__file__, "--branches", str(WHEEL), "full"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=speed.LARGE)
    arithmetic = share * elements(model.design) * 2 * 2 * 16 * 27
    least = alone(lambda: np.ones(int(through / 8)))
    return Limit(arithmetic, least, json.loads(done.stdout)["assemble"], "ones written to new memory", through)


def start_up() -> Limit:
    """`flexura modes` of a small file, a whole process."""

    def process(name: str) -> float:
        return median(studies.timed(lambda: start.seconds(start.COMMANDS[name]))[1] for _ in range(5))

    return Limit(0.0, process(start.BARE), process(start.MODES), "imports of the packages that it needs")


ROWS: dict[str, tuple[str, Callable[[], Limit]]] = {
    "low": ("low order, 54, one design", low),
    "proven": ("a proven design of many, section sizes vary", proven),
    "full": ("full order, 1062, counted", full),
    "slopes": ("the same with derivatives by 15 sizes", slopes),
    "frf": ("6 x 6 responses at 10 000 frequencies", frf),
    "steps": ("10 000 time steps of 54 modes", steps),
    "newmark": ("a step by average acceleration, 1062", newmark),
    "poses": ("41 poses of a guide", poses),
    "large": ("a step of large motion, 1062", lambda: large("full")),
    "small": ("the same at low order, 54", lambda: large("low")),
    "optimum": ("an evaluation of an optimum, its proof in it", optimum),
    "sample": ("a tolerance sample, stress at a pose", sample),
    "slider": ("numbers of a moved slider", slider),
    "assembly": ("assembly of 4000 branches", assembly),
    "start": ("`flexura modes` of a small file", start_up),
}


def number(value: float) -> str:
    """To two digits, or three where the first is a one."""
    own = float(f"{value:.{3 if f'{value:e}'[0] == '1' else 2}g}")
    return f"{own / 1e6:g} million" if own >= 1e6 else f"{own:,.0f}".replace(",", " ") if own >= 1e4 else f"{own:g}"


def lasting(seconds: float) -> str:
    """A time to two or three digits, in the unit that suits it."""
    unit, size = next((own for own in (("s", 1.0), ("ms", 1e-3)) if seconds >= own[1]), ("us", 1e-6))
    return f"{number(seconds / size)} {unit}"


def main() -> None:
    print(f"{rate() / 1e9:.0f} multiplications with an addition and {copied() / 1e9:.0f} bytes copied a nanosecond\n")
    print("| | multiplications | bytes | their time | by hand | ours | over it |\n|---|---|---|---|---|---|---|")
    for name in sys.argv[1:] or ROWS:
        text, measured = ROWS[name]
        found = measured()
        through = f"{number(found.through / 1e6)} MB" if found.through else ""
        counts = (number(found.arithmetic), through, lasting(found.least)) if found.arithmetic else ("", "", "")
        taken = f"{found.which}: {lasting(found.bare)}", lasting(found.own), number(found.own / found.bare)
        print("|", " | ".join((text, *counts, *taken)).replace("|  |", "| |").replace("|  |", "| |"), "|", flush=True)


if __name__ == "__main__":
    main()
