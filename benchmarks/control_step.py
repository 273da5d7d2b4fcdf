"""Cost of one control step of a reduced model: as C in float32, as C of an FMU, that through ctypes, and in NumPy.

    python benchmarks/control_step.py [MODES]

The RPR platform with its lowest MODES modes (default 6, 12 states), three inputs and three outputs: set the inputs,
step, read the outputs. One thread; every time is the median of repeated runs. `coupled` is the same model after a
change of coordinates that fills A. The changed step shows what a new step size costs.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import ctypes
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.linalg as la

import flexura as fx
from flexura.compilers import FLAGS
from flexura.io import shared_library, unit_of
from flexura.structure import Channel
from flexura.systems import StateSpace

ROOT = Path(__file__).parents[1]
STEP = 1e-4
REPEATS = 9

LOOP = """
#include "fmi2.h"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "model.h"
#define INPUTS 3
fmi2Component fmi2Instantiate(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions *, int, int);
fmi2Status fmi2ExitInitializationMode(fmi2Component);
fmi2Status fmi2SetReal(fmi2Component, const fmi2ValueReference *, size_t, const double *);
fmi2Status fmi2GetReal(fmi2Component, const fmi2ValueReference *, size_t, double *);
fmi2Status fmi2DoStep(fmi2Component, double, double, int);
int main(int argc, char **argv)
{
    const int steps = atoi(argv[1]);
    const double change = atof(argv[2]);
    const fmi2ValueReference in[] = {0, 1, 2}, out[] = {3, 4, 5};
    double u[INPUTS], y[INPUTS] = {0}, sum = 0.0, t = 0.0;
    struct timespec a, b;
    fmi2Component c = fmi2Instantiate("one", fmi2CoSimulation, MODEL_TOKEN, "", NULL, 0, 0);
    (void)argc;
    fmi2ExitInitializationMode(c);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    for (int k = 0; k < steps; k++) {
        const double h = 1e-4 * (1.0 + change * (k & 1));
        for (int i = 0; i < INPUTS; i++)
            u[i] = 1.0 - 10.0 * y[i];
        fmi2SetReal(c, in, INPUTS, u);
        if (fmi2DoStep(c, t, h, 1) != fmi2OK)
            return 1;
        fmi2GetReal(c, out, INPUTS, y);
        t += h;
        sum += y[0];
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    printf("%.17g %.17g\\n", ((b.tv_sec - a.tv_sec) + 1e-9 * (b.tv_nsec - a.tv_nsec)) / steps, sum);
    return 0;
}
"""


SINGLE_LOOP = """
#include "plant.h"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
int main(int argc, char **argv)
{
    const int steps = atoi(argv[1]);
    static plant_state one;
    float u[PLANT_INPUTS], y[PLANT_OUTPUTS] = {0}, sum = 0.0f;
    struct timespec a, b;
    (void)argc;
    plant_init(&one);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    for (int k = 0; k < steps; k++) {
        for (int i = 0; i < 3; i++)
            u[i] = 1.0f - 10.0f * y[i];
        plant_step(&one, u, y);
        sum += y[0];
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    printf("%.17g %.9g\\n", ((b.tv_sec - a.tv_sec) + 1e-9 * (b.tv_nsec - a.tv_nsec)) / steps, (double)sum);
    return 0;
}
"""


def platform(modes: int) -> StateSpace:
    """Force along z and moments about x and y at the platform to displacement and rotations; 1 % damping."""
    found = fx.modes(fx.load(ROOT / "examples" / "rpr" / "rpr.yaml"), n=modes, order="full")
    w, shape = found.angular_frequency, found.shapes[found.node_names.index("platform")][2:5]
    A = la.block_diag(*([[0, 1], [-(k**2), -0.02 * k]] for k in w))
    B, C = np.zeros((2 * modes, 3)), np.zeros((3, 2 * modes))
    B[1::2], C[:, 0::2] = shape.T, shape
    names = ("platform.tz", "platform.rx", "platform.ry")
    ins = tuple(map(Channel, names, ("force", "moment", "moment")))
    outs = tuple(map(Channel, names, ("displacement", "rotation", "rotation")))
    return StateSpace(A, B, C, np.zeros((3, 3)), ins, outs, tuple(f"x{k}" for k in range(2 * modes)), name="platform")


def filled(model: StateSpace) -> StateSpace:
    """The model in coordinates in which A has no zeros."""
    scale = np.tile([np.abs(model.poles()).mean(), 1.0], model.order // 2)
    T = la.qr(np.random.default_rng(0).standard_normal((model.order, model.order)))[0] * scale
    return replace(model, A=T @ model.A @ la.inv(T), B=T @ model.B, C=model.C @ la.inv(T))


def in_c(model: StateSpace, steps: int, change: float = 0.0) -> tuple[float, float]:
    """Seconds per step of a C loop around the FMU's functions, and the sum of the first output."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name, text in {**unit_of(model).sources("own", 2), "main.c": LOOP}.items():
            (folder / name).write_text(text)
        flags = [flag for flag in FLAGS if flag != "-Wextra"]
        compiler = shutil.which("cc") or "cc"
        command = [
            compiler,
            *flags,
            "-D_POSIX_C_SOURCE=199309L",
            "-o",
            "loop",
            "main.c",
            *unit_of(model).compiled(2),
            "-lm",
        ]
        subprocess.run(command, cwd=folder, check=True)
        runs = [
            subprocess.run([folder / "loop", str(steps), str(change)], capture_output=True, text=True, check=True)
            for _ in range(REPEATS)
        ]
    found = [[float(word) for word in run.stdout.split()] for run in runs]
    return statistics.median(first for first, _ in found), found[0][1]


def in_single_precision(model: StateSpace, steps: int) -> float:
    """Seconds per step of a C loop around the functions in float32, compiled apart from it."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        fx.export(model.discretised(STEP), folder / "plant.c")
        (folder / "main.c").write_text(SINGLE_LOOP)
        flags = ["-std=c99", "-O2", "-D_POSIX_C_SOURCE=199309L", "-Wall", "-Werror"]
        subprocess.run([shutil.which("cc") or "cc", *flags, "-o", "loop", "main.c", "plant.c"], cwd=folder, check=True)
        runs = [
            subprocess.run([folder / "loop", str(steps)], capture_output=True, text=True, check=True)
            for _ in range(REPEATS)
        ]
    return statistics.median(float(run.stdout.split()[0]) for run in runs)


def through_ctypes(model: StateSpace, steps: int) -> float:
    """Seconds per step with the three calls made from Python."""
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "model.so"
        path.write_bytes(shared_library(unit_of(model).sources("own", 2), unit_of(model).compiled(2), "x86_64-linux"))
        library = ctypes.CDLL(str(path))
        library.fmi2Instantiate.restype = ctypes.c_void_p
        one = ctypes.c_void_p(library.fmi2Instantiate(b"one", 1, b"own", b"", None, 0, 0))
        library.fmi2ExitInitializationMode(one)
        ins, outs = (ctypes.c_uint * 3)(0, 1, 2), (ctypes.c_uint * 3)(3, 4, 5)
        u, y, three = (ctypes.c_double * 3)(), (ctypes.c_double * 3)(), ctypes.c_size_t(3)
        h, zero = ctypes.c_double(STEP), ctypes.c_double(0.0)

        def run() -> None:
            for _ in range(steps):
                u[0], u[1], u[2] = 1.0 - 10.0 * y[0], 1.0 - 10.0 * y[1], 1.0 - 10.0 * y[2]
                library.fmi2SetReal(one, ins, three, u)
                library.fmi2DoStep(one, zero, h, 1)
                library.fmi2GetReal(one, outs, three, y)

        return per_step(run, steps)


def in_numpy(model: StateSpace, steps: int) -> tuple[float, float]:
    """Seconds per step of x = E x + F u, y = C x with dense matrices, and the sum of the first output."""
    own = model.discretised(STEP)
    E, F, C, total = own.A, own.B, own.C, 0.0

    def run() -> None:
        nonlocal total
        x, y, total = np.zeros(own.order), np.zeros(3), 0.0
        for _ in range(steps):
            x = E @ x + F @ (1.0 - 10.0 * y)
            y = C @ x
            total += y[0]

    return per_step(run, steps), float(total)


def per_step(run: Callable[[], None], steps: int) -> float:
    """Median seconds of processor time per step."""
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        run()
        times.append((time.process_time() - start) / steps)
    return statistics.median(times)


def main() -> None:
    """Print one JSON document."""
    modes = int(sys.argv[1]) if len(sys.argv) > 1 else 6
    model = platform(modes)
    coupled, steps = filled(model), 20_000
    modal, _ = in_c(model, 20 * steps)
    dense, _ = in_c(coupled, 5 * steps)
    numpy_step, sum_numpy = in_numpy(model, steps)
    _, sum_short = in_c(model, steps)
    result = {
        "states": model.order,
        "c_float32_ns": round(1e9 * in_single_precision(model, 20 * steps), 1),
        "c_modal_ns": round(1e9 * modal, 1),
        "c_coupled_ns": round(1e9 * dense, 1),
        "c_modal_changed_step_ns": round(1e9 * in_c(model, steps, 0.1)[0], 1),
        "c_coupled_changed_step_ns": round(1e9 * in_c(coupled, steps // 10, 0.1)[0], 1),
        "ctypes_ns": round(1e9 * through_ctypes(model, steps), 1),
        "numpy_ns": round(1e9 * numpy_step, 1),
        "numpy_over_c": round(numpy_step / modal, 1),
        "relative_difference": abs(sum_short / sum_numpy - 1),
    }
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
