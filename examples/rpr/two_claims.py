"""Both claims of the paper in one table: its hammer test, beams of order 54, the solid, and a simulated hammer test.

    python examples/rpr/two_claims.py [FOLDER]

prints the table and saves the picture `two_claims.png` in FOLDER. It takes a minute, most of it for the solid.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import flexura as fx

HERE = Path(__file__).parent
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Claims:
    """Six frequencies each, Hz: measured for the paper, of order 54, of the solid (+-), found by a simulated test."""

    measured_hz: Array
    beams_hz: Array
    solid_hz: Array
    solid_uncertainty_hz: Array
    tested_hz: Array

    def table(self) -> str:
        """Frequencies in rad/s, as the paper prints them, with differences from the column before the bar."""
        lines = ["      Table 5  |  order 54         |  solid     +-    beams to it |  simulated test"]
        for mode, row in enumerate(self._rows(), 1):
            measured, beams, solid, uncertain, tested = 2 * np.pi * np.array(row)
            lines.append(
                f"{mode:>4}  {measured:7.3f}  |  {beams:7.2f}  {100 * (beams / measured - 1):+5.1f} % "
                f" |  {solid:6.2f}  {uncertain:5.2f}  {100 * (beams / solid - 1):+10.1f} % "
                f" |  {tested:7.2f}  {100 * (tested / measured - 1):+5.1f} %"
            )
        return "\n".join(lines)

    def draw(self) -> Figure:
        """Differences from the measured frequencies, with the 15 % that the paper leaves between beams and solid."""
        figure = Figure(figsize=(9, 4.2), layout="constrained")
        axes, mode = figure.subplots(), np.arange(1, 7)
        off = {name: 100 * (value / self.measured_hz - 1) for name, value in self._named().items()}
        solid = off["solid"]
        ends = np.array([100 * (self.beams_hz / factor / self.measured_hz - 1) for factor in (1.15, 0.85)])
        axes.bar(
            mode, ends[1] - ends[0], bottom=ends[0], width=0.7, color="0.92", label="solid within 15 % of the beams"
        )
        axes.axhline(0, color="0.3", linewidth=1)
        axes.errorbar(
            mode + 0.12,
            solid,
            100 * self.solid_uncertainty_hz / self.measured_hz,
            fmt="s",
            color="tab:red",
            capsize=3,
            label="solid finite elements",
        )
        axes.plot(mode, off["order 54"], "o", color="tab:blue", label="plain beams, order 54")
        axes.plot(mode - 0.12, off["simulated test"], "x", color="k", label="simulated hammer test, 10 g sensors")
        axes.set(xlabel="mode", ylabel="from the measured frequency, %", title="RPR mechanism against Table 5")
        axes.set_xticks(mode, [f"{m}\n{hz:.2f} Hz" for m, hz in zip(mode, self.measured_hz, strict=True)])
        axes.legend(ncols=2, fontsize="small", loc="upper right")
        axes.set_ylim(1.1 * float(ends.min()), 1.35 * float(ends.max()))
        return figure

    def _named(self) -> dict[str, Array]:
        return {"order 54": self.beams_hz, "solid": self.solid_hz, "simulated test": self.tested_hz}

    def _rows(self) -> list[tuple[float, ...]]:
        columns = (self.measured_hz, self.beams_hz, self.solid_hz, self.solid_uncertainty_hz, self.tested_hz)
        return list(zip(*columns, strict=True))


def claims() -> Claims:
    """Solve, verify and test the mechanism."""
    mechanism = fx.load(HERE / "rpr.yaml")
    verified = fx.verify(mechanism)
    solid = np.array(verified.frequency_hz)
    test = fx.virtual_test(fx.load(HERE / "rpr_test.yaml"))
    return Claims(
        measured_hz=np.array(fx.testing.read_frequencies(HERE / "table5.csv").frequency_hz),
        beams_hz=fx.modes(mechanism, n=6).frequency_hz,
        solid_hz=solid,
        solid_uncertainty_hz=solid * np.array(verified.uncertainty),
        tested_hz=np.array([mode.identified_hz for mode in test.modes]),
    )


def main(folder: str = ".") -> Claims:
    """Print the table, save the picture."""
    found = claims()
    print(found.table())
    Path(folder).mkdir(parents=True, exist_ok=True)
    found.draw().savefig(Path(folder) / "two_claims.png", dpi=110)
    return found


if __name__ == "__main__":
    main(*sys.argv[1:])
