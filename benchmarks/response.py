"""Frequency response, time steps, state space of the RPR platform; python-control, OpenSeesPy and exudyn beside them.

    python benchmarks/response.py

One BLAS thread, half a minute. Every time is the median of repeated calls; ratios compare medians of this run. Machines
differ and are noisy: quote the ratios. The low-order model has 54 coordinates, all modes kept (108 states), the
full-order one 1062. OpenSeesPy and exudyn integrate the full-order model by the average-acceleration method (Newmark
1959) with the linear algebra that was found fastest, factorised once. Time per step is what a longer run adds.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from speed import RPR, median_ms, report

import flexura as fx
from flexura.systems import System

ROOT = Path(__file__).parents[1]
PLATFORM = [f"platform.{dof}" for dof in ("tx", "ty", "tz", "rx", "ry", "rz")]
DISPLACEMENTS = PLATFORM[:3]
MIXED = ["platform.tx", "platform.ty:velocity", "platform.tz:acceleration"]
DT, STEPS = 1e-4, 10_000
RAYLEIGH = {"rayleigh": {"frequencies": [7.0, 100.0], "ratios": [0.01, 0.01]}}


def frequency_responses(low: fx.LowOrderModel) -> None:
    """10 000 frequencies, six inputs, six outputs."""
    modes = fx.system(low, inputs=PLATFORM, outputs=PLATFORM, damping=0.01).modal()
    model = fx.state_space(modes)
    hz = np.geomspace(1, 1000, 10_000)
    own = median_ms(lambda: fx.frequency_response(modes, frequency_hz=hz), 15)
    report(f"FRF, 10 000 frequencies, 6 x 6, {modes.order} modes", own, "ms")
    report("    by the state space, from its poles", median_ms(lambda: model.frequency_response(hz), 1, 0), "ms")
    try:
        import control
    except ImportError:
        print("python-control is not installed: pip install control")
        return
    theirs = fx.to_control(model)
    found = np.moveaxis(np.asarray(theirs(2j * np.pi * hz)), 2, 0)
    other = median_ms(lambda: theirs.frequency_response(2 * np.pi * hz), 3, 0)
    with_slycot = "with" if control.slycot_check() else "without"  # type: ignore[attr-defined]
    text = f"python-control {control.__version__} {with_slycot} slycot, same state space ({model.order} states)"
    report(f"    {text}", other, "ms")
    H = fx.frequency_response(modes, frequency_hz=hz).response
    scale = np.abs(H).max(axis=0)
    report("    largest difference beside the largest value", float((np.abs(found - H) / scale).max()), "")
    report("    modal sum against python-control", other / own, "times faster")


def low_order_steps(low: fx.LowOrderModel) -> float:
    """10 000 steps of the low-order model; ms for one force and three displacements."""
    u = np.random.default_rng(1).standard_normal(STEPS + 1)
    first = 0.0
    for outputs in (DISPLACEMENTS, MIXED):
        modes = fx.system(low, inputs=["platform.tz"], outputs=outputs, damping=RAYLEIGH).modal()
        ms = median_ms(lambda modes=modes: fx.time_response(modes, inputs={"platform.tz": u}, dt=DT), 40)
        first = first or ms
        kinds = "displacements" if outputs is DISPLACEMENTS else "displacement, velocity, acceleration"
        report(f"{STEPS} steps, {modes.order} modes, 1 force, 3 outputs: {kinds}", ms, "ms")
    modes = fx.system(low, inputs=["platform.tz"], outputs=DISPLACEMENTS, damping=RAYLEIGH).modal()
    kept = median_ms(lambda: fx.time_response(modes, inputs={"platform.tz": u}, dt=DT, keep_modes=True), 10)
    report("    and all modal coordinates kept", kept, "ms")
    return first


def per_step_us(run: Callable[[int], float], steps: int) -> tuple[float, float]:
    """What a step adds to the processor time of a run, us, and the motion at the end of `steps`."""
    times, last = [], 0.0
    for count in (steps, 3 * steps):
        found = []
        for _ in range(3):
            start = time.process_time()
            last = run(count) if count == steps else (run(count), last)[1]
            found.append(time.process_time() - start)
        times.append(float(np.median(found)))
    return 1e6 * (times[1] - times[0]) / (2 * steps), last


def full_order_steps(low_ms: float) -> None:
    """The full-order model under a force that grows linearly, in our own and in other integrators."""
    mechanism = fx.load(RPR).model_copy(update={"theory": "euler_bernoulli"})
    full = fx.system(mechanism, inputs=["platform.tz"], outputs=["platform.tz"], order="full", damping=RAYLEIGH)

    def own(steps: int) -> float:
        ramp = DT * np.arange(steps + 1)
        found = fx.time_response(
            full, inputs={"platform.tz": ramp}, dt=DT, method="generalised_alpha", rho_infinity=1.0
        )
        return float(found.response[0, -1])

    low_us, steps = 1e3 * low_ms / STEPS, 100
    own_us, reference = per_step_us(own, steps)
    report(f"one step, order {full.order}, our generalised-alpha", own_us, "us")
    reduced = fx.system(fx.reduce(mechanism), inputs=["platform.tz"], outputs=["platform.tz"], damping=RAYLEIGH).modal()
    low = fx.time_response(reduced, inputs={"platform.tz": DT * np.arange(steps + 1)}, dt=DT).response[0, -1]
    report("    low-order exact steps beside it: difference at the end", abs(low / reference - 1), "")
    for name, build in (("OpenSeesPy", opensees), ("exudyn", exudyn)):
        try:
            run = build(full)
        except (ImportError, RuntimeError) as error:
            print(f"{name} is not available: {error}")
            continue
        us, last = per_step_us(run, steps)
        report(f"one step, order {full.order}, {name}", us, "us")
        report("    difference from ours at the end", abs(last / reference - 1), "")
        report("    our low-order steps against it", us / low_us, "times faster")
        report("    our full-order steps against it", us / own_us, "times faster")


def opensees(full: System) -> Callable[[int], float]:
    """Run so many steps of the mesh in OpenSeesPy; gives the motion at the end."""
    sys.path.insert(0, str(ROOT / "tests"))
    from helpers.opensees_mesh import OpenSeesMesh, ops  # type: ignore[import-not-found]

    model = full.model
    assert isinstance(model, fx.FullOrderModel)
    mesh = OpenSeesMesh(model)
    tag = fx.modes(model.plan, n=1, order="full").node_names.index("platform") + 1

    def run(steps: int) -> float:
        mesh.build()
        ops.rayleigh(full.law.alpha, 0.0, full.law.beta, 0.0)
        ops.timeSeries("Linear", 1)
        ops.pattern("Plain", 1, 1)
        ops.load(tag, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        ops.numberer("RCM")
        ops.system("ProfileSPD")
        ops.algorithm("Linear", "-factorOnce")
        ops.integrator("Newmark", 0.5, 0.25)
        ops.analysis("Transient")
        if ops.analyze(steps, DT):
            raise RuntimeError("OpenSees did not converge")
        return float(ops.nodeDisp(tag, 3))

    return run


def exudyn(full: System) -> Callable[[int], float]:
    """Run so many steps of M, C, K, sparse or dense, in exudyn; gives the motion at the end."""
    import exudyn as exu
    from exudyn import itemInterface

    n = full.order
    matrices = []
    is_sparse = sp.issparse(full.K)
    for A in (full.M, full.K, full.C):
        matrices.append(exu.MatrixContainer())
        if is_sparse:
            matrices[-1].SetWithSparseMatrix(A.tocsr())
        else:
            matrices[-1].SetWithDenseMatrix(np.asarray(A))
    multibody = exu.SystemContainer().AddSystem()
    zeros = [0.0] * n
    node: Any = multibody.AddNode(
        itemInterface.NodeGenericODE2(
            numberOfODE2Coordinates=n,
            referenceCoordinates=zeros,
            initialCoordinates=zeros,
            initialCoordinates_t=zeros,
        )
    )
    M, K, C = matrices
    multibody.AddObject(
        itemInterface.ObjectGenericODE2(
            nodeNumbers=[node], massMatrix=M, stiffnessMatrix=K, dampingMatrix=C, forceVector=[]
        )
    )
    (at,) = np.flatnonzero(full.B[:, 0])
    marker: Any = multibody.AddMarker(itemInterface.MarkerNodeCoordinate(nodeNumber=node, coordinate=int(at)))

    def ramp(mbs: object, t: float, load: float) -> float:  # noqa: ARG001
        return t

    multibody.AddLoad(itemInterface.LoadCoordinate(markerNumber=marker, loadUserFunction=ramp))
    multibody.Assemble()
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.verboseMode = 0
    integration.generalizedAlpha.spectralRadius = 1.0
    integration.newton.useModifiedNewton = True
    integration.newton.modifiedNewtonJacUpdatePerStep = False
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse if is_sparse else exu.LinearSolverType.EXUdense
    settings.parallel.numberOfThreads = 1

    def run(steps: int) -> float:
        integration.numberOfSteps, integration.endTime = steps, steps * DT
        multibody.SolveDynamic(settings)
        return float(full.rows[0] @ multibody.GetNodeOutput(node, exu.OutputVariableType.Coordinates))

    return run


def other_responses() -> None:
    """Direct solution of the full-order model and exact dynamic stiffness, per frequency."""
    plan = fx.Plan(fx.load(RPR))
    hz = np.linspace(5, 200, 100)

    def cost(**how: object) -> float:
        def call(hz: np.ndarray) -> Callable[[], object]:
            return lambda: fx.frequency_response(
                plan, frequency_hz=hz, inputs=PLATFORM, outputs=PLATFORM, damping=RAYLEIGH, **how
            )  # type: ignore[arg-type]

        return (median_ms(call(hz), 3, 1) - median_ms(call(hz[[0, -1]]), 3, 1)) / (len(hz) - 2)

    report("FRF 6 x 6, one frequency, full order, direct", cost(order="full", method="direct"), "ms")
    report("FRF 6 x 6, one frequency, exact dynamic stiffness", cost(order="exact"), "ms")


def state_spaces() -> None:
    """From the file of the driven platform to twelve states."""
    path = ROOT / "examples" / "rpr" / "rpr_piezo.yaml"

    def whole(order: str) -> fx.StateSpace:
        return fx.state_space(fx.system(fx.load(path), order=order), n=6)

    report("reading rpr_piezo.yaml", median_ms(lambda: fx.load(path), 5), "ms")
    for order in ("full", "low"):
        text = f"file to {whole(order).order} states, four piezos, seven sensors, {order} order"
        report(text, median_ms(lambda order=order: whole(order), 5, 0), "ms")


def main() -> None:
    low = fx.reduce(fx.load(RPR))
    frequency_responses(low)
    full_order_steps(low_order_steps(low))
    other_responses()
    state_spaces()


if __name__ == "__main__":
    main()
