"""The greatest first frequency under limits: `fx.optimize` against optimisers on finite steps of the same full model.

    python benchmarks/optimize.py [EVALUATIONS] [PROBLEM ...]      at most 2000 of each other; guide, rpr

One run, one thread, one start, the design as it is. All others are given what a user writes in twenty lines: `fx.modes`
at full order and `fx.stroke` to the pose, worked out once for goal and limits, over a unit cube, in steps of 1e-5.
`to 0.1 %` is processor time until a design is within 0.1 % of the best frequency, and of the limits; pymoo is stopped
there. What `fx.optimize` takes is all of it, multipliers and proof included; `times` is how many times as long it was.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import contextlib
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

import flexura as fx

EXAMPLES = Path(__file__).parents[1] / "examples"
STEP = 1e-5
NEAR = 1e-3
SEED = 0


class Enough(Exception):  # noqa: N818  it ends a search that may take no more
    """As many designs were worked out as may be."""


@dataclass(frozen=True)
class Problem:
    """A file, ranges of parameters, SI or over their defaults, and limits: stress at poses, Pa; mass, kg; sizes, m."""

    name: str
    file: str
    ranges: dict[str, tuple[float, float]]
    is_relative: bool
    stress: dict[str, tuple[float, float]]
    most: dict[str, float] = field(default_factory=dict)

    @property
    def plan(self) -> fx.Plan:
        """Prepared anew."""
        return fx.Plan(fx.load(EXAMPLES / self.file))

    def limits(self) -> list[str]:
        """As `fx.optimize` is asked."""
        poses = [
            f"stress <= {limit / 1e6:g} MPa at {where} = {value * 1e3:g} {'mrad' if '.r' in where else 'mm'}"
            for where, (value, limit) in self.stress.items()
        ]
        sizes = [
            f"mass <= {1e3 * own:g} g" if name == "mass" else f"parameter({name}) <= {1e3 * own:g} mm"
            for name, own in self.most.items()
        ]
        return poses + sizes

    def box(self, plan: fx.Plan) -> dict[str, tuple[float, float]]:
        """Ranges, SI."""
        at = {name: float(plan.parameter_values()[name]) if self.is_relative else 1.0 for name in self.ranges}
        return {name: (low * at[name], high * at[name]) for name, (low, high) in self.ranges.items()}


PROBLEMS = {
    "guide": Problem(
        "guide, 2 sizes",
        "guide/guide.yaml",
        {"thickness": (0.2e-3, 0.6e-3), "length": (30e-3, 100e-3)},
        False,
        {"carriage.x": (2e-3, 400e6)},
    ),
    "rpr": Problem(
        "RPR mechanism, 8 sizes",
        "rpr/rpr.yaml",
        dict.fromkeys(
            (
                *("r_web", "u_web", "u_length", "plate"),
                *("leaf_thickness", "leaf_length", "arm_thickness", "arm_length"),
            ),
            (0.7, 1.4),
        ),
        True,
        {"platform.rx": (5e-3, 70e6), "platform.ry": (5e-3, 70e6)},
        {"mass": 2.38, "reach": 25e-3},
    ),
}


@dataclass
class Model:
    """Frequency and margins over a unit cube by plain verbs; knows the latest design, and when one was first good."""

    problem: Problem
    best: float
    most: int
    stops: bool = False
    evaluations: int = 0
    first: tuple[int, float] | None = None
    reached: tuple[float, float] = (0.0, np.inf)

    def __post_init__(self) -> None:
        self.began = time.process_time()
        self.plan = self.problem.plan
        self.box = self.problem.box(self.plan)
        self.low, high = np.array(list(self.box.values())).T
        self.range = high - self.low
        self.latest: tuple[bytes, np.ndarray] = (b"", np.empty(0))

    @property
    def start(self) -> np.ndarray:
        """The design as it is."""
        known = self.plan.parameter_values()
        return (np.array([float(known[name]) for name in self.box]) - self.low) / self.range

    def __call__(self, z: np.ndarray) -> np.ndarray:
        """Minus the frequency over the best, and margins over their limits."""
        key = np.asarray(z, dtype=float).tobytes()
        if key != self.latest[0]:
            if self.evaluations >= self.most:
                raise Enough
            self.evaluations += 1
            self.latest = key, self.worked_out(dict(zip(self.box, (self.low + z * self.range).tolist(), strict=True)))
            self.told(self.latest[1])
        return self.latest[1]

    def worked_out(self, sizes: dict[str, float]) -> np.ndarray:
        """The model of a user."""
        modes = fx.modes(self.plan, sizes, n=1, order="full")
        found = [-modes.modes[0].frequency_hz / self.best]
        for where, (value, limit) in self.problem.stress.items():
            pose = fx.stroke(self.plan, sizes, move={where: value}, steps=1)
            members = pose.stresses(len(pose.poses) - 1).members
            found.append(1 - max(own.von_mises for own in members if own.von_mises is not None) / limit)
        known = {"mass": modes.evidence.model_mass.mass} | self.plan.parameter_values(sizes)
        return np.array(found + [1 - float(known[name]) / own for name, own in self.problem.most.items()])

    def told(self, found: np.ndarray) -> None:
        """Keep what was reached."""
        missed = max(0.0, -float(found[1:].min()))
        if missed <= NEAR and -found[0] > self.reached[0]:
            self.reached = -float(found[0]), missed
        if self.first is None and missed <= NEAR and -found[0] >= 1 - NEAR:
            self.first = self.evaluations, time.process_time() - self.began
            if self.stops:
                raise Enough


def slsqp(model: Model) -> None:
    """SciPy's SLSQP."""
    limits: Any = {"type": "ineq", "fun": lambda z: model(z)[1:]}
    minimize(
        lambda z: float(model(z)[0]),
        model.start,
        method="SLSQP",
        bounds=[(0, 1)] * len(model.box),
        constraints=[limits],
        options={"eps": STEP, "ftol": 1e-8},
    )


def trust(model: Model) -> None:
    """SciPy's trust-constr."""
    minimize(
        lambda z: float(model(z)[0]),
        model.start,
        method="trust-constr",
        jac="2-point",
        bounds=Bounds(np.zeros(len(model.box)), np.ones(len(model.box)), keep_feasible=True),
        constraints=[NonlinearConstraint(lambda z: model(z)[1:], 0, np.inf, jac="2-point", finite_diff_rel_step=STEP)],
        options={"finite_diff_rel_step": STEP},
    )


def genetic(model: Model) -> None:
    """pymoo's GA."""
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize as evolve

    class Asked(ElementwiseProblem):
        def __init__(self) -> None:
            super().__init__(n_var=len(model.box), n_obj=1, n_ieq_constr=len(model(model.start)) - 1, xl=0.0, xu=1.0)

        def _evaluate(self, x: np.ndarray, out: dict[str, Any], *_: Any, **__: Any) -> None:
            found = model(x)
            out["F"], out["G"] = found[0], -found[1:]

    evolve(Asked(), GA(pop_size=40), ("n_eval", model.most), seed=SEED)


def openmdao(model: Model) -> None:
    """OpenMDAO's driver of SLSQP on a component with finite steps."""
    import openmdao.api as om

    class Mechanism(om.ExplicitComponent):
        def setup(self) -> None:
            self.add_input("z", shape=len(model.box))
            self.add_output("goal")
            self.add_output("margins", shape=len(model(model.start)) - 1)
            self.declare_partials("*", "*", method="fd", step=STEP)

        def compute(self, inputs: Any, outputs: Any) -> None:
            found = model(np.asarray(inputs["z"]))
            outputs["goal"], outputs["margins"] = found[0], found[1:]

    problem = om.Problem(reports=False)
    problem.model.add_subsystem("mechanism", Mechanism(), promotes=["*"])
    problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-8, disp=False)
    problem.model.add_design_var("z", lower=0.0, upper=1.0)
    problem.model.add_objective("goal")
    problem.model.add_constraint("margins", lower=0.0)
    problem.setup()
    problem.set_val("z", model.start)
    problem.run_driver()


OTHERS: dict[str, Callable[[Model], None]] = {
    "SciPy SLSQP, finite steps": slsqp,
    "SciPy trust-constr, finite steps": trust,
    "OpenMDAO, SLSQP, finite steps": openmdao,
    "pymoo GA": genetic,
}


def compared(problem: Problem, most: int) -> None:
    """Print a problem."""
    plan = problem.plan
    began = time.process_time()
    found = fx.optimize(plan, vary=problem.box(plan), maximise="f1", subject_to=problem.limits(), starts=1)
    own = time.process_time() - began
    assert isinstance(found, fx.Optimum)
    best = Model(problem, 1.0, most)
    check = best(np.array([(found.design[name] - best.low[k]) / best.range[k] for k, name in enumerate(best.box)]))
    hertz = -float(check[0])
    print(f"{problem.name + ', Hz':<34}{'designs':>9}{'to 0.1 %':>10}{'in all':>10}{'f1':>10}{'missed':>9}{'times':>7}")
    missed = max(0.0, -float(check[1:].min()))
    row = f"{found.evaluations:>9}{'':>10}{own:>8.1f} s{hertz:>10.4f}{missed:>9.1g}{1:>7}"
    print(f"{'fx.optimize, exact slopes':<34}{row}", flush=True)
    for name, search in OTHERS.items():
        model = Model(problem, hertz, most, stops=search is genetic)
        with tempfile.TemporaryDirectory() as own_folder, contextlib.chdir(own_folder), contextlib.suppress(Enough):
            search(model)
        whole = time.process_time() - model.began
        designs, used = model.first if model.first is not None else (model.evaluations, float("nan"))
        ended = f"{'-' if model.evaluations >= model.most or model.stops else f'{whole:.1f} s':>10}"
        reached, missed = model.reached
        at_least = "" if model.first is not None else ">"
        times = f"{at_least}{(used if model.first is not None else whole) / own:.1f}"
        early = f"{used:.1f} s" if model.first is not None else "never"
        print(f"{name:<34}{designs:>9}{early:>10}{ended}{reached * hertz:>10.4f}{missed:>9.1g}{times:>7}", flush=True)


def main() -> None:
    """Measure and print."""
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    first = Model(PROBLEMS["guide"], 1.0, 1)  # so that nobody's time has that of imports in it
    first(first.start)
    fx.optimize(first.plan, vary=first.box, maximise="f1", starts=1)
    for name in sys.argv[2:] or PROBLEMS:
        compared(PROBLEMS[name], most)


if __name__ == "__main__":
    main()
