"""How well modes are identified from noisy frequency responses of known systems, and how long it takes.

    python benchmarks/identification.py [--systems 12] [--times]

First six modes between 5 and 90 Hz, eight outputs, lines 0.125 Hz apart, random shapes, neighbours 3 % apart at least,
damping between 0.2 and 3 %, white noise below the root mean square of each response by so many decibels; then two modes
in a band of 5 to 60 Hz that cuts through their skirts, four outputs. Found means within half the damping ratio, and
within 0.2 % at least. `sure` is the least confidence in a true mode, without a threshold; `left out` counts true modes
below the threshold. Two neighbours that come out as one count as missed and, if neither is near, as one not there.

--times: seconds of processor time with one BLAS thread for 1500 to 24000 lines, alone.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import flexura as fx
from flexura.testing.identification import LEAST_CONFIDENCE
from helpers.modal_systems import System, measured, modal, random_modal

LINES = np.arange(0.0, 100.0, 0.125)
BAND = (3.0, 95.0)


@dataclass
class Tally:
    """Counts and relative errors over systems."""

    missed: int = 0
    false: int = 0
    left_out: int = 0
    sure: float = 1.0
    frequency: list[float] = field(default_factory=list)
    damping: list[float] = field(default_factory=list)

    def add(self, system: System, frf: fx.testing.MeasuredFRF, count: int, band: tuple[float, float]) -> None:
        """Identify one system."""
        try:
            result = fx.identify(frf, band=band, least_confidence=0.0)
        except fx.OptionError:
            self.missed += count
            return
        poles, ratio = system.poles[:count], system.damping_ratio[:count]
        off = np.abs(result.poles[:, None] - poles) / np.abs(poles)
        found, which = off.min(axis=0) < np.maximum(ratio / 2, 0.002), off.argmin(axis=0)
        true = np.unique(which[found])
        self.missed += int((~found).sum())
        sure = result.confidence >= LEAST_CONFIDENCE
        self.false += int(sure.sum() - sure[true].sum())
        self.left_out += int((~sure[true]).sum())
        self.sure = min([self.sure, *result.confidence[true]])
        self.frequency += np.abs(result.frequency_hz[which] / system.frequency_hz[:count] - 1)[found].tolist()
        self.damping += np.abs(result.damping_ratio[which] / ratio - 1)[found].tolist()

    def __str__(self) -> str:
        sizes = [100 * of(x) for x in (self.frequency, self.damping) for of in (np.median, np.max)]
        counts = f"{self.missed} | {self.false} | {self.left_out} | {self.sure:.2f}"
        return counts + "".join(f" | {x:.1g} %" for x in sizes)


def two_modes(seed: int) -> System:
    """Two modes 5 % apart at least, 8 to 55 Hz."""
    rng = np.random.default_rng(seed)
    low, high = np.sort(rng.uniform(8, 55, 2))
    return modal([low, max(high, 1.05 * low)], 10 ** rng.uniform(-2.7, -1.5, 2), outputs=4, seed=seed)


def accuracy(systems: int) -> None:
    """Print the tables."""
    heading = (
        "inputs | noise | missed | not there | left out | sure | frequency off, median | largest | damping | largest"
    )
    for title, build, count, band, many in (
        (f"six modes, {systems} systems a row", random_modal, 6, BAND, systems),
        (f"two modes, {5 * systems} systems a row", two_modes, 2, (5.0, 60.0), 5 * systems),
    ):
        print(title, f"| {heading} |", sep="\n")
        for inputs in (1, 2, 3):
            for decibels in (60, 40, 30, 20):
                tally = Tally()
                for k in range(many):
                    system = build(k)
                    frf = measured(system, LINES, range(inputs), decibels=decibels, seed=k)
                    tally.add(system, frf, count, band)
                print(f"| {inputs} | {decibels} dB | {tally} |", flush=True)


def times() -> None:
    """Print seconds by number of lines, six modes of the random system 1, three inputs, eight outputs."""
    print("| lines | noise | seconds |")
    system = random_modal(1)
    fx.identify(measured(system, LINES, decibels=40), band=BAND)
    for lines in (1500, 6000, 24000):
        for decibels in (40, None):
            frf = measured(system, np.linspace(0, 100, lines), (0, 1, 2), decibels=decibels)
            start = time.process_time()
            fx.identify(frf, band=BAND)
            print(
                f"| {lines} | {'none' if decibels is None else f'{decibels} dB'} | {time.process_time() - start:.2f} |"
            )


def main() -> None:
    """Print tables of accuracy, or times."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--systems", type=int, default=12)
    parser.add_argument("--times", action="store_true")
    given = parser.parse_args()
    if given.times:
        times()
    else:
        accuracy(given.systems)


if __name__ == "__main__":
    main()
