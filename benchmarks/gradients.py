"""Derivatives of six frequencies by fifteen parameters of the paper's mechanism: exact, and by finite differences.

One prepared plan, new sizes in every run, best of several on one thread. An evaluation is the same six frequencies of
one design: proven by `natural_frequencies`, or of the full order, which the derivatives are of. Finite differences are
what a user has without them: SciPy's `eigsh` about zero on the matrices that flexura assembles, in `approx_fprime`.

    python benchmarks/gradients.py
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import approx_fprime
from scipy.sparse.linalg import eigsh

import flexura as fx
from flexura.derivatives import free_names, frequency_slopes
from flexura.structure import Design, stiffness_and_mass

RUNS, PARAMETERS, MODES = 20, 15, 6


def best(run: Callable[[dict[str, float]], object], designs: list[dict[str, float]]) -> float:
    """Least processor time of a run, s."""
    run(designs[0])
    found = []
    for design in designs[1:]:
        start = time.process_time()
        run(design)
        found.append(time.process_time() - start)
    return min(found)


def times() -> tuple[float, float, float, float]:
    """Least times, s: of an evaluation, proven and by eigsh, of exact derivatives and of finite differences."""
    plan = fx.Plan(fx.load(Path(__file__).parents[1] / "examples" / "rpr" / "rpr.yaml"))
    names = free_names(plan, None)[:PARAMETERS]
    at = {name: float(plan.parameter_values()[name]) for name in names}
    rng = np.random.default_rng(0)
    designs = [{n: v * (1 + 1e-3 * rng.random()) for n, v in at.items()} for _ in range(RUNS)]

    def full(design: dict[str, float]) -> np.ndarray:
        K, M = stiffness_and_mass(Design.of(plan, design))
        values = eigsh(K, MODES, M, sigma=0.0, return_eigenvectors=False)
        return np.sqrt(np.sort(values)) / (2 * np.pi)

    def stepped(design: dict[str, float]) -> object:
        values = np.array([design[n] for n in names])
        return approx_fprime(values, lambda x: full(dict(zip(names, x.tolist(), strict=True))), 1e-6 * values)

    proven = best(lambda design: fx.natural_frequencies(plan, design, n=MODES), designs)
    whole = best(full, designs)
    exact = best(lambda design: frequency_slopes(Design.with_slopes(plan, design, names), MODES), designs)
    differences = best(stepped, designs[:4])
    return proven, whole, exact, differences


def main() -> None:
    """Measure and print."""
    proven, whole, exact, differences = times()
    print(f"one evaluation, proven       {1e3 * proven:8.1f} ms")
    print(f"one evaluation, eigsh        {1e3 * whole:8.1f} ms")
    ratios = f"{exact / proven:.1f} proven or {exact / whole:.1f} of eigsh"
    print(f"frequencies and derivatives  {1e3 * exact:8.1f} ms = {ratios}")
    print(f"by finite differences        {1e3 * differences:8.1f} ms = {differences / exact:.1f} times the exact ones")


if __name__ == "__main__":
    main()
