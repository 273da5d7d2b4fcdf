"""What a correlation has found: pairs of modes, channels, and how alike test and model are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Complex
from flexura.results import Tabular
from flexura.structure import FullOrderModel
from flexura.tables import Facts, Table, percent
from flexura.testing.correlation.expansion import Expansion
from flexura.testing.correlation.overlay import FRFOverlay
from flexura.testing.rig import ChannelMatch, ChannelPairing, UnmatchedChannel


@dataclass(frozen=True)
class ModePair:
    """A mode of the test and its counterpart in the model, both numbered from 1.

    `error` is the model's frequency over that of the test, less one. `mac` compares the two shapes; `space_mac` is the
    share of the one within the space of the other's close modes `test_space` and `model_space`, equal to `mac` where
    there are none. `expansion_error` is what the model's shapes cannot represent of the test shape, relative.
    """

    test: int
    model: int
    test_hz: float
    model_hz: float
    error: float
    damping_ratio: float
    mac: float
    space_mac: float
    test_space: tuple[int, ...]
    model_space: tuple[int, ...]
    expansion_error: float


MOST_LISTED = 12
"""Modes without a counterpart that a notebook lists."""


@dataclass(frozen=True, repr=False)
class Correlation(Tabular):
    """A test against a model of the mechanism.

    Shapes at the q matched sensors: `test_shapes` (q, n) complex, `model_shapes` (q, k), rotations times `reach`, m.
    A channel that is not `used` (q,) is faulty, see `notes`, and takes no part in what follows but `comac` and `gain`.
    `mac` (n, k), `auto_mac_test` (n, n), `auto_mac_model` (k, k). Over the pairs: `comac` and `gain` (q,) of the
    channels, `self_orthogonality` (r, r) of the r paired test shapes and `cross_orthogonality` (r, r) with those of the
    model. `expanded` (n_nodes, 6, n) are the test shapes on the whole mechanism and `counterparts` (n_nodes, 6, r) the
    model's, in m and rad and of the same size; close modes are turned within their space to be nearest to the test's.
    `modes` (n_nodes, 6, k) are the model's own.
    """

    name: str
    test_name: str
    pairs: tuple[ModePair, ...]
    matched: tuple[ChannelMatch, ...]
    unmatched: tuple[UnmatchedChannel, ...]
    test_hz: Array
    test_damping: Array
    model_hz: Array
    test_shapes: Complex
    model_shapes: Array
    used: NDArray[np.bool_]
    reach: float
    mac: Array
    auto_mac_test: Array
    auto_mac_model: Array
    comac: Array
    gain: Array
    reduced_mass: str
    self_orthogonality: Array
    cross_orthogonality: Array
    expanded: Array
    counterparts: Array
    modes: Array
    expansion: Expansion
    frfs: tuple[FRFOverlay, ...]
    model: FullOrderModel
    sensors: ChannelPairing
    notes: tuple[str, ...] = ()

    @property
    def unpaired_test(self) -> tuple[int, ...]:
        """Numbers of test modes without a counterpart."""
        return tuple(sorted(set(range(1, len(self.test_hz) + 1)) - {p.test for p in self.pairs}))

    @property
    def unpaired_model(self) -> tuple[int, ...]:
        """Numbers of the model's modes below the highest test frequency that the test has not."""
        own = {int(k) + 1 for k in np.flatnonzero(self.model_hz <= self.test_hz.max(initial=0.0))}
        return tuple(sorted(own - {p.model for p in self.pairs}))

    def _data(self) -> dict[str, Any]:
        """Everything but the shapes over the mechanism."""
        numbers = ("test_hz", "test_damping", "model_hz", "mac", "auto_mac_test", "auto_mac_model")
        tables = ("self_orthogonality", "cross_orthogonality")
        return {
            "name": self.name,
            "test": self.test_name,
            "pairs": self.pairs,
            "unpaired_test": self.unpaired_test,
            "unpaired_model": self.unpaired_model,
            "channels": [
                {
                    "name": m.channel.name,
                    "node": m.node,
                    "how": m.how,
                    "distance": m.distance,
                    "gain": g,
                    "used": u,
                }
                for m, g, u in zip(self.matched, self.gain, self.used, strict=True)
            ],
            "unmatched": [
                {"name": u.channel.name, "reason": u.reason, "nearest": u.nearest, "distance": u.distance}
                for u in self.unmatched
            ],
            **{name: getattr(self, name) for name in (*numbers, *tables)},
            "comac": self.comac,
            "reduced_mass": self.reduced_mass,
            "frac": [{"setup": o.measured.setup, "frac": o.frac} for o in self.frfs],
        }

    def _title(self) -> str:
        return f"against {self.test_name}"

    def _view(self) -> Iterator[Facts | Table]:
        own = self.pairs
        columns = {
            "test mode": [p.test for p in own],
            "test [Hz]": [p.test_hz for p in own],
            "model mode": [p.model for p in own],
            "model [Hz]": [p.model_hz for p in own],
            "error": [percent(p.error) for p in own],
            "damping": [percent(p.damping_ratio) for p in own],
            "MAC": [f"{p.mac:.3f}" for p in own],
            "MAC of close modes": [f"{p.space_mac:.3f}" for p in own],
        }
        yield Table(columns, "pairs")
        alone = {"test": self.unpaired_test, "model": self.unpaired_model}
        yield Facts(
            {f"modes of the {of} alone": ", ".join(map(str, numbers[:MOST_LISTED])) for of, numbers in alone.items()}
        )

    def _columns(self) -> dict[str, Any]:
        """A row for each pair of modes."""
        own = self.pairs
        return {
            "test mode": [p.test for p in own],
            "model mode": [p.model for p in own],
            "test frequency [Hz]": [p.test_hz for p in own],
            "model frequency [Hz]": [p.model_hz for p in own],
            "relative error": [p.error for p in own],
            "damping ratio": [p.damping_ratio for p in own],
            "mac": [p.mac for p in own],
            "space mac": [p.space_mac for p in own],
        }
