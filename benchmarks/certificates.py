"""How tight certificates are: bound against true error over random mechanisms and the examples.

    python benchmarks/certificates.py [--mechanisms 3000]

The true error comes from a dense solve of the full-order model, refined in extended precision.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from hypothesis import given, settings
from hypothesis import strategies as st

import flexura as fx
from helpers.random_mechanisms import FEW, mechanisms
from helpers.true_frequencies import holds, true_frequencies

VISIBLE = 1e-7
"""Relative errors below this drown in the round-off of assembled stiffness and are left out of the ratios."""


def main() -> None:
    """Print how many certificates held, and quantiles of bound over true error."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mechanisms", type=int, default=3000)
    wanted = parser.parse_args().mechanisms
    indexed, contained, kept, complete = [], [], [], []

    @settings(FEW, max_examples=wanted)
    @given(mechanisms(), st.integers(0, 3), st.integers(1, 12))
    def measure(mechanism: fx.Mechanism, keep: int, n: int) -> None:
        low, model = fx.reduce(mechanism, keep=keep), fx.assemble(mechanism)
        if not low.order:
            return
        true = true_frequencies(model)
        proof = fx.models.certify(low, model, n=n)
        kept.append(holds(proof, true))
        complete.append(proof.is_complete)
        for k, (hz, bound, by_number) in enumerate(
            zip(proof.frequency_hz, proof.error_bound, proof.is_indexed, strict=True)
        ):
            error = abs(hz / (true[k] if by_number else true[np.argmin(abs(true - hz))]) - 1)
            if error > VISIBLE and np.isfinite(bound):
                (indexed if by_number else contained).append(bound / error)

    measure()
    print(f"random mechanisms: {len(kept)}, certificates that hold: {sum(kept)}, nothing missing: {sum(complete)}")
    for label, ratios in (("enclosed number by number", indexed), ("contained", contained)):
        low, middle, high = np.quantile(ratios, [0.1, 0.5, 0.9])
        print(f"bound / true error, {label}: median {middle:.3g}, 10 % {low:.3g}, 90 % {high:.3g} ({len(ratios)})")


if __name__ == "__main__":
    main()
