"""How well modes of outputs alone are identified, beside pyOMA2 where it is installed, and how long it takes.

    python benchmarks/outputs_alone.py [--records 20]

Six modes between 5 and 31 Hz, two of them 5 % apart, damping between 0.5 and 2 %, four accelerometers, sampled at
100 Hz, white noise in six forces, sensors' noise of 5 %; records of 80 to 2000 s. Found means within 2 % of the
frequency. `within` is the share of frequencies and damping ratios that lie within two of the standard deviations told.
pyOMA2 (MIT, github.com/dagghe/pyOMA2) is asked for the poles nearest to the true frequencies, as a user who knows them
would pick them in its diagram, by SSIcov with uncertainty, 20 block rows and orders up to 40.
"""

from __future__ import annotations

import argparse
import os
import time

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import numpy as np
from scipy.signal import lfilter

import flexura as fx

RATE = 100.0
HZ = np.array([5.0, 8.0, 8.4, 17.0, 25.0, 31.0])
RATIO = np.array([0.01, 0.02, 0.01, 0.005, 0.015, 0.01])
POLES = 2 * np.pi * HZ * (-RATIO + 1j * np.sqrt(1 - RATIO**2))
_rng = np.random.default_rng(0)
SHAPES, FORCES = _rng.standard_normal((4, 6)), _rng.standard_normal((6, 6))
DURATIONS = (80, 200, 600, 2000)


def record(seed: int, samples: int) -> np.ndarray:
    """Accelerations (4, samples)."""
    rng = np.random.default_rng(seed)
    force = FORCES @ rng.standard_normal((6, samples + 4000))
    states = [lfilter([0, 1], [1, -np.exp(s / RATE)], f + 0j) for s, f in zip(POLES, force, strict=True)]
    moved = np.array([(s**2 * q / (2j * s.imag)).real[4000:] for s, q in zip(POLES, states, strict=True)])
    y = SHAPES @ (moved / moved.std(axis=1, keepdims=True))
    return y + 0.05 * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)


def by_flexura(y: np.ndarray) -> np.ndarray:
    """Frequency, damping ratio and their relative standard deviations (n, 4)."""
    channels = tuple(fx.testing.MeasuredChannel(f"a{k}", "acceleration") for k in range(len(y)))
    modes = fx.identify(fx.Measurement("ambient", (fx.testing.Recording(RATE, y, channels, ()),)))
    spread = [(e.frequency_sigma, e.damping_sigma) for e in modes.evidence]
    return np.column_stack([modes.frequency_hz, modes.damping_ratio, np.array(spread)])


def by_pyoma(y: np.ndarray) -> np.ndarray:
    """The same of pyOMA2; of modes that it does not find, nothing."""
    from pyoma2.algorithms import SSI
    from pyoma2.setup import SingleSetup

    setup = SingleSetup(y.T.copy(), fs=RATE)
    algorithm = SSI(name="ssi", method="cov", br=20, ordmax=40, calc_unc=True, nb=50)
    setup.add_algorithms(algorithm)
    setup.run_by_name("ssi")
    try:
        setup.mpe("ssi", sel_freq=list(HZ), order_in="find_min")
    except Exception:  # it raises where a frequency has no stable pole
        return np.zeros((0, 4))
    result = algorithm.result
    f, z = np.asarray(result.Fn), np.asarray(result.Xi)
    return np.column_stack([f, z, np.asarray(result.Fn_std) / f, np.asarray(result.Xi_std) / z])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", type=int, default=20)
    count = parser.parse_args().records
    programs = {"flexura": by_flexura}
    try:
        import pyoma2  # noqa: F401

        programs["pyOMA2"] = by_pyoma
    except ImportError:
        print("pyOMA2 is not installed")
    print("| record | by | found | false | frequency off, rms | damping off, rms | within | time |")
    print("|---|---|---|---|---|---|---|---|")
    for duration in DURATIONS:
        for name, program in programs.items():
            off, sigma, false, started = [], [], 0, time.process_time()
            for seed in range(count):
                rows = program(record(seed, int(duration * RATE)))
                for f, z, *spread in rows:
                    k = int(np.argmin(np.abs(HZ - f)))
                    if abs(f / HZ[k] - 1) > 0.02:
                        false += 1
                        continue
                    off.append((f / HZ[k] - 1, z / RATIO[k] - 1))
                    sigma.append(spread)
            spent = (time.process_time() - started) / count
            a, s = np.array(off), np.array(sigma)
            f, z = (np.sqrt(np.mean(x**2)) for x in a.T)
            within = np.mean(np.abs(a) < 2 * s)
            print(
                f"| {duration} s | {name} | {len(a)} of {6 * count} | {false} | {100 * f:.2g} % | {100 * z:.2g} % |"
                f" {100 * within:.0f} % | {spent:.2g} s |",
                flush=True,
            )


if __name__ == "__main__":
    main()
