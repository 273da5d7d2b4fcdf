"""How far what is identified is from the truth, over seeds of noise and hits of the RPR mechanism's test.

python benchmarks/virtual_test.py [SEEDS]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

import flexura as fx

EXAMPLE = Path(__file__).parents[1] / "examples" / "rpr" / "rpr_test.yaml"


def main(seeds: int) -> None:
    """Print the worst errors over all modes and seeds."""
    mechanism = fx.load(EXAMPLE)
    worst = np.zeros(3)
    missed = false = 0
    seconds, weakest = [], np.inf
    for seed in range(seeds):
        begin = time.perf_counter()
        found = fx.virtual_test(mechanism, seed=seed)
        seconds.append(time.perf_counter() - begin)
        for mode in found.modes:
            if mode.error is None or mode.damping_error is None:
                missed += 1
                continue
            placed = [abs(own / true - 1) for true, own in mode.placement_hz.values() if own is not None]
            worst = np.maximum(worst, [abs(mode.error), max(placed), abs(mode.damping_error)])
        false += len(found.false_hz)
        noise = float(found.test.acceleration_noise)
        rms = [record.samples[1:].std(axis=1).min() for record in found.measurement.recordings]
        weakest = min(weakest, 20 * np.log10(min(rms) / noise))
    joined, placement, damping = 100 * worst
    print(f"{seeds} seeds, {np.median(seconds):.2f} s each: {missed} modes missed, {false} false")
    print(f"weakest channel {weakest:.0f} dB above its noise (which it contains)")
    print(f"worst: frequency {joined:.3f} %, in one placement {placement:.3f} %, damping ratio {damping:.2f} %")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 20)
