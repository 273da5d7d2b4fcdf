"""How modes are identified from the data that peers ship, by them and here, and how long each takes.

    python benchmarks/shipped_data.py [--sdypy FOLDER] [--points FOLDER] [--record FILE.npy --rate HZ --band 1 40]

Data stay where their authors have put them, none are copied here:

* pyOMA2 (MIT, pip install pyOMA_2) makes the record of its first example, a frame of five floors at 100 Hz for 300 s,
  whose modes are known. Its measured records are fetched from the net by its examples.
* --sdypy: an unpacked source of sdypy-EMA (MIT), whose tests make responses of five masses in a row (that takes pyLump)
  with known modes; its measured FRFs, data/acc_data.npy, are in its repository alone, and are read where they are.
* --points: the folder `data` of the repository of pyuff (MIT), with accelerances of a beam at three points, measured at
  lines 1 Hz apart (meas_point_1.txt and so on).
* --record: samples (N, channels), as pyOMA (GPL) has them in tests/files/measurement_1/measurement_1.npy, 256 Hz.

A peer is told which modes to take, as its user who reads them off a diagram would: the true frequencies where these are
known, else peaks. flexura is told nothing. Times are processor times with one thread, the least of turns taken by each
in its turn. `misfit` is that of residues and residuals which least squares give each program's poles, over the measured
responses: the same yardstick for both.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import numpy as np
from scipy.linalg import eigvals
from scipy.signal import csd, find_peaks

import flexura as fx

Poles = np.ndarray
"""Frequency, Hz, and damping ratio of every mode (n, 2)."""

ORDER = 60
"""Largest order of sdypy-EMA; flexura has the same one by default."""


def by_sdypy(hz: np.ndarray, H: np.ndarray, picks: Sequence[float]) -> Poles:
    """Poles of responses (outputs, f) by the least squares of sdypy-EMA, residues included."""
    model = import_module("sdypy.EMA").Model(frf=H, freq=hz, lower=hz[0], upper=hz[-1], pol_order_high=ORDER)
    model.get_poles(method="lscf", show_progress=False)
    model.select_closest_poles(list(picks))
    model.get_constants(whose_poles="own", FRF_ind="all")
    return np.column_stack([model.nat_freq, model.nat_xi])


def of_responses(quantity: str, hz: np.ndarray, H: np.ndarray) -> Poles:
    """The same of flexura."""
    outputs = tuple(fx.testing.MeasuredChannel(f"p{k}", quantity) for k in range(len(H)))
    hammer = fx.testing.MeasuredChannel("hammer", "force")
    modes = fx.identify(fx.testing.MeasuredFRF(hz, H.T[:, :, None], (hammer,), outputs), order=ORDER)
    return np.column_stack([modes.frequency_hz, modes.damping_ratio])


SIMULATED, MEASURED = {"method": "dat"}, {"method": "cov", "calc_unc": True}
"""What the examples of pyOMA2 take for a simulated record, and for a measured one, with uncertainties."""


def by_pyoma(
    y: np.ndarray, rate: float, band: tuple[float, float] | None, picks: Sequence[float], how: dict[str, Any]
) -> Poles:
    """Poles of samples (N, channels) by subspaces of pyOMA2, as its examples have them."""
    algorithms, setups = import_module("pyoma2.algorithms"), import_module("pyoma2.setup")
    setup = setups.SingleSetup(y.copy(), fs=rate)
    setup.detrend_data()
    if band is not None:
        setup.filter_data(Wn=band[0], order=4, btype="highpass")
        setup.decimate_data(q=int(rate / (2 * band[1])))
    own = algorithms.SSI(name="ssi", br=30, ordmax=30, **how)
    setup.add_algorithms(own)
    setup.run_by_name("ssi")
    found: list[np.ndarray] = []
    for pick in picks:  # one by one: of several it takes only orders at which all are stable
        setup.mpe("ssi", sel_freq=[float(pick)], order_in="find_min")
        found.append(np.column_stack([own.result.Fn, own.result.Xi]))
    return np.vstack(found)


def of_record(y: np.ndarray, rate: float, band: tuple[float, float] | None) -> Poles:
    """The same of flexura."""
    channels = tuple(fx.testing.MeasuredChannel(f"a{k}", "acceleration") for k in range(y.shape[1]))
    record = fx.testing.Recording(rate, np.ascontiguousarray(y.T), channels, ())
    modes = fx.identify(fx.Measurement("record", (record,)), band=band)
    return np.column_stack([modes.frequency_hz, modes.damping_ratio])


def in_turns(programs: dict[str, Callable[[], Poles]], turns: int) -> dict[str, tuple[Poles, float]]:
    """Poles and the least processor time of each program; None of those that are not installed or give none."""
    found: dict[str, tuple[Poles, float]] = {}
    for _ in range(turns):
        for name, program in programs.items():
            begun = time.process_time()
            try:
                poles = program()
            except Exception as error:  # peers raise anything where a pick has no stable pole
                print(f"{name} is left out: {type(error).__name__}: {error}")
                continue
            spent = time.process_time() - begun
            found[name] = poles, min(spent, found[name][1] if name in found else np.inf)
    return found


def misfit(hz: np.ndarray, H: np.ndarray, poles: Poles, power: int) -> float:
    """Over H (outputs, f), what is left of it when residues and residuals are fitted to poles by least squares."""
    s = 2j * np.pi * hz
    w = 2 * np.pi * poles[:, 0] * (-poles[:, 1] + 1j * np.sqrt(1 - poles[:, 1] ** 2))
    pairs = [f for p in w for f in (1 / (s - p) + 1 / (s - p.conj()), 1j / (s - p) - 1j / (s - p.conj()))]
    A = np.array([*pairs, 1 / s**2, np.ones_like(s)]).T * s[:, None] ** power
    A, B = np.vstack([A.real, A.imag]), np.vstack([H.T.real, H.T.imag])
    x = np.linalg.lstsq(A / np.linalg.norm(A, axis=0), B, rcond=None)[0]
    return float(np.linalg.norm(A / np.linalg.norm(A, axis=0) @ x - B) / np.linalg.norm(B))


def told(title: str, found: dict[str, tuple[Poles, float]], truth: Poles | None, left: Callable[[Poles], float] | None):
    """Print a table of what was found, against the truth or mode by mode."""
    print(f"\n{title}\n")
    if truth is not None:
        print("| by | found | frequency off, largest | damping off, largest | time |\n|---|---|---|---|---|")
    for name, (poles, spent) in found.items():
        if truth is None:
            rows = " · ".join(f"{f:.5g} Hz {100 * z:.3g} %" for f, z in poles)
            more = "" if left is None else f", misfit {100 * left(poles):.2g} %"
            print(f"* {name}, {spent:.2g} s{more}: {rows}")
            continue
        off = poles[np.abs(poles[:, :1] - truth[:, 0]).argmin(axis=0)] / truth - 1
        is_found = np.abs(off[:, 0]) < np.maximum(truth[:, 1], 0.005)
        f, z = 100 * np.abs(off[is_found]).max(axis=0)
        print(f"| {name} | {is_found.sum()} of {len(truth)} ({len(poles)}) | {f:.2g} % | {z:.2g} % | {spent:.2g} s |")


def of_pyoma2(turns: int) -> None:
    """The record of the first example of pyOMA2."""
    try:
        y, _, (hz, ratio, _) = import_module("pyoma2.functions.gen").example_data()
    except ImportError as error:
        print(f"the record of pyOMA2 is left out: {error}")
        return
    programs = {
        "pyOMA2": partial(by_pyoma, y, 100.0, None, hz, SIMULATED),
        "flexura": partial(of_record, y, 100.0, None),
    }
    found = in_turns(programs, turns)
    told("pyOMA2's frame of five floors, outputs alone", found, np.array([(f, ratio) for f in hz]), None)


def of_masses(folder: Path, turns: int) -> None:
    """The five masses of the tests of sdypy-EMA; poles are those of their matrices."""
    sys.path.insert(0, str(folder / "tests" / "test_tools"))
    hz, H, picks, _, model = import_module("generate_synth_frf").generate_synth_frf(5)
    M, C, K = (getattr(model, f"get_{kind}_matrix")() for kind in ("mass", "damping", "stiffness"))
    zero = np.zeros_like(M)
    s = eigvals(np.block([[zero, np.eye(len(M))], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]]))
    s = s[s.imag > 0][np.argsort(np.abs(s[s.imag > 0]))]
    truth = np.column_stack([np.abs(s) / (2 * np.pi), -s.real / np.abs(s)])
    programs = {"sdypy-EMA": partial(by_sdypy, hz, H, picks), "flexura": partial(of_responses, "displacement", hz, H)}
    told("sdypy-EMA's five masses, without noise", in_turns(programs, turns), truth, None)


def of_beam(title: str, hz: np.ndarray, H: np.ndarray, turns: int) -> None:
    """Measured accelerances (outputs, f) of a beam; modes that are picked are peaks 20 dB above the median."""
    size = np.abs(H).sum(axis=0)
    peaks = find_peaks(20 * np.log10(size), prominence=20, distance=20)[0]
    programs = {"sdypy-EMA": partial(by_sdypy, hz, H, hz[peaks])}
    programs["flexura"] = partial(of_responses, "acceleration", hz, H)
    told(title, in_turns(programs, turns), None, lambda poles: misfit(hz, H, poles, 2))


def of_file(path: Path, rate: float, band: tuple[float, float], turns: int) -> None:
    """A measured record in a band: channels on one scale, picks are peaks of the largest singular value."""
    y = np.load(path)
    y = (y - y.mean(axis=0)) / y.std(axis=0)
    hz, S = csd(y.T[:, None], y.T[None], fs=rate, nperseg=4096)
    first = 10 * np.log10(np.linalg.svd(np.moveaxis(S, -1, 0), compute_uv=False)[:, 0])
    peaks = hz[find_peaks(first, prominence=10, distance=8)[0]]
    picks = peaks[(peaks > band[0]) & (peaks < band[1])]
    programs = {
        "pyOMA2": partial(by_pyoma, y, rate, band, picks, MEASURED),
        "flexura": partial(of_record, y, rate, band),
    }
    print(f"\npeaks of {path.name}: {', '.join(f'{f:.4g}' for f in picks)} Hz")
    told(f"{path.name}, outputs alone", in_turns(programs, turns), None, None)


def main() -> None:
    """Print a table for all data that are there."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdypy", type=Path)
    parser.add_argument("--points", type=Path)
    parser.add_argument("--record", type=Path)
    parser.add_argument("--rate", type=float, default=256.0)
    parser.add_argument("--band", type=float, nargs=2, default=(1.0, 40.0))
    parser.add_argument("--turns", type=int, default=3)
    given = parser.parse_args()
    of_pyoma2(given.turns)
    if given.sdypy is not None:
        of_masses(given.sdypy, given.turns)
        measured = given.sdypy / "data" / "acc_data.npy"
        if measured.is_file():
            hz, H = np.load(measured, allow_pickle=True)
            of_beam("sdypy-EMA's beam, measured", hz[10:5000], H[:, 1, 10:5000], given.turns)
        else:
            print(f"\nsdypy-EMA's beam is left out: {measured} is not there")
    if given.points is not None:
        files = sorted(given.points.glob("meas_point_*.txt"))
        H = np.array([np.genfromtxt(file, dtype=complex) for file in files])
        hz = np.arange(H.shape[1], dtype=float)
        of_beam("pyuff's beam, measured at three points", hz[10:990], H[:, 10:990], given.turns)
    if given.record is not None:
        of_file(given.record, given.rate, tuple(given.band), given.turns)


if __name__ == "__main__":
    main()
