"""How wide is the set of sizes with which both claims of the paper hold? Many designs walk through it at random.

    python examples/rpr/how_wide.py [STEPS]

A design belongs to the set where the frequencies of plain beams are within 3 % of Table 5 and within 15 % of those of
corrected beams, which stand for the solid (they lie 1.1 to 2.6 % above it at the sizes of rpr.yaml), and where branches
and platform have room. 128 walkers start around rpr.yaml and take stretch moves (Goodman and Weare 2010, Comm. App.
Math. Comp. Sci. 5, 65), uniform in the logarithms of the sizes, within the part of the set that hangs together with
rpr.yaml. On the way frequencies are those of constraint modes, whose error is proven for the last designs.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import flexura as fx

HERE = Path(__file__).parent
TABLE_5, TABLE_4 = 0.03, 0.15
WALKERS, STEPS, LONGEST = 128, 1000, 2.0  # the stretch of a move is at most LONGEST
Array = NDArray[np.float64]
Held = Callable[[dict[str, Array]], NDArray[np.bool_]]


def claims(plain: fx.Mechanism) -> Held:
    """Which designs meet both claims; sizes (designs,) in metres, by name."""
    beams, corrected = fx.Plan(plain), fx.Plan(plain.model_copy(update={"corrections": "auto"}))
    measured = np.asarray(fx.testing.read_frequencies(HERE / "table5.csv").frequency_hz)

    def held(sizes: dict[str, Array]) -> NDArray[np.bool_]:
        found = has_room(plain, sizes)
        sizes = {name: size[found] for name, size in sizes.items()}
        if found.any():
            paper, solid = (fx.unproven_frequencies(plan, sizes, n=6) for plan in (beams, corrected))
            close = (abs(paper / measured - 1) < TABLE_5) & (abs(paper / solid - 1) < TABLE_4)
            found[found] = close.all(axis=1)
        return found

    return held


def has_room(plain: fx.Mechanism, sizes: dict[str, Array]) -> NDArray[np.bool_]:
    """Which designs are within bounds, with branches that do not meet in the middle and a platform over the pairs."""
    p = plain.parameters
    within = [(sizes[name] > p[name].minimum) & (sizes[name] < p[name].maximum) for name in sizes]
    reach = sizes["output_width"] / 2 + 2 * sizes["leaf_length"] + sizes["arm_length"] + sizes["input_thickness"]
    middle = reach + sizes["plate"] / 2 < p["upr_distance"].value
    under = sizes["platform_size"] / 2 > p["rpu_distance"].value + p["u_width"].value / 2
    arms = 2 * sizes["arm_height"] + sizes["arm_thickness"] + sizes["leaf_offset"]
    return np.all([*within, middle, under, arms < 40e-3 - p["r_radius"].value - sizes["u_length"] / 2], axis=0)


def walk(held: Held, start: dict[str, float], steps: int, seed: int = 0) -> dict[str, Array]:
    """Sizes (steps, walkers) of designs that are all in the set. Raises ValueError where the start is not."""
    random, names = np.random.default_rng(seed), list(start)
    origin = np.log(np.array(list(start.values())))
    there = origin + 1e-3 * random.standard_normal((WALKERS, len(names)))
    there[~held(as_sizes(names, there))] = origin
    if not held(as_sizes(names, there)).all():
        raise ValueError("the start itself does not meet both claims")
    path = np.empty((steps, WALKERS, len(names)))
    for step in range(steps):
        halves = np.array_split(random.permutation(WALKERS), 2)
        for movers, others in (halves, halves[::-1]):
            least = 1 / np.sqrt(LONGEST)
            stretch = (least + (np.sqrt(LONGEST) - least) * random.random(len(movers))) ** 2
            base = there[random.choice(others, len(movers))]
            moved = base + stretch[:, None] * (there[movers] - base)
            taken = random.random(len(movers)) < stretch ** (len(names) - 1)
            taken[taken] = held(as_sizes(names, moved[taken]))
            there[movers[taken]] = moved[taken]
        path[step] = there
        print(f"\r{step + 1} of {steps} steps", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return as_sizes(names, path)


def as_sizes(names: list[str], logarithms: Array) -> dict[str, Array]:
    """Sizes by name from their logarithms (..., names)."""
    return dict(zip(names, np.moveaxis(np.exp(logarithms), -1, 0), strict=True))


def main(steps: int = STEPS) -> dict[str, Array]:
    """Walk, print the range of every size, and give sizes (steps, walkers) of the last two thirds of the walk."""
    plain = fx.load(HERE / "rpr.yaml")
    start = {name: p.value for name, p in plain.parameters.items() if p.minimum is not None}
    path = {name: size[steps // 3 :] for name, size in walk(claims(plain), start, steps).items()}
    print(f"{'mm':<20}{'rpr.yaml':>10}{'least':>10}{'95 % of the set':>20}{'largest':>10}")
    for name, size in path.items():
        low, high = np.quantile(size, (0.025, 0.975))
        print(f"{name:<20}{1e3 * start[name]:>10.4g}{1e3 * size.min():>10.4g}", end="")
        print(f"{1e3 * low:>10.4g} to {1e3 * high:>6.4g}{1e3 * size.max():>10.4g}")
    last = {name: size[-1] for name, size in path.items()}
    proven = fx.natural_frequencies(plain, last, n=6).resolved()
    error = abs(fx.unproven_frequencies(plain, last, n=6) / proven.frequency_hz - 1).max() + proven.error_bound.max()
    print(f"frequencies of the last {WALKERS} designs are proven within {100 * error:.1g} %")
    return path


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
