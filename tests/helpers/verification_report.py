"""What the verification tests measured, and the page `docs/verification.md` made from it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

REPRINT = 5e-6
"""Relative difference between a printed and a newly measured number that counts as the same: last-digit noise."""

INTRODUCTION = """\
# Verification

Every table below puts numbers that flexura computes beside numbers that it did not produce: published benchmarks,
closed-form solutions of the same theory, or another program. The tests that measure them fail when an error exceeds
the tolerance of its row, and when this page no longer says what they measure.

* *Reference* is the published or closed-form value. Where a source prints few digits, the tolerance is half a unit of
  its last one; elsewhere it covers the discretisation error of the mesh in use, and it is stated, not fitted to pass.
* *Relative error* is |computed / reference - 1|, as measured when the page was written.
* Agreement shows that the equations of the named theory are solved correctly. It does not show that the theory
  describes a given part: short wide leaves, steep notches and clamped torsion are beyond plain beams. Most cases are
  therefore computed with `corrections: none`; the section on flexures puts the corrections to the test.

To write the page anew: `make verification`, which is
`pytest tests/literature tests/opensees -m '' --verification-page docs/verification.md`.
"""

_HEAD = "| quantity | unit | reference | computed | relative error | tolerance |\n|---|---|---|---|---|---|\n"
_ROW = re.compile(r"\| (?P<cells>.+) \|$")


@dataclass(frozen=True)
class Case:
    """A verification case: its name, where the reference comes from, the theory, and what to know about it."""

    name: str
    source: str
    theory: str
    note: str = ""


@dataclass(frozen=True)
class Measurement:
    """One number beside its reference; `tolerance` is relative."""

    case: Case
    quantity: str
    unit: str
    reference: float
    computed: float
    tolerance: float

    @property
    def key(self) -> tuple[str, str]:
        """Case and quantity, which name a row of the page."""
        return self.case.name, self.quantity

    @property
    def error(self) -> float:
        """Relative error."""
        return abs(self.computed / self.reference - 1)

    def row(self) -> str:
        """The row of the page."""
        floor = min(1e-8, self.tolerance)  # below, digits are round-off and differ between machines
        error = f"{self.error:.1e}" if self.error >= floor else f"< {floor:.0e}"
        numbers = f"{self.reference:.7g} | {self.computed:.7g} | {error} | {self.tolerance:.1e}"
        return f"| {self.quantity} | {self.unit} | {numbers} |"

    def check(self) -> None:
        """Raise AssertionError when the error exceeds the tolerance."""
        assert self.error <= self.tolerance, (
            f"{self.case.name}, {self.quantity}: {self.computed:.9g} {self.unit} instead of {self.reference:.9g}, "
            f"relative error {self.error:.2e} > {self.tolerance:.2e}"
        )


@dataclass(frozen=True)
class PrintedRow:
    """A row as it stands in the page."""

    reference: float
    computed: float
    tolerance: float

    def differs_from(self, measured: Measurement) -> bool:
        """True when the page no longer says what was measured."""
        pairs = ((self.reference, measured.reference), (self.computed, measured.computed))
        moved = any(abs(printed - now) > REPRINT * abs(now) for printed, now in pairs)
        return moved or f"{self.tolerance:.1e}" != f"{measured.tolerance:.1e}"


def measurements(
    case: Case,
    quantity: str,
    computed: float | Sequence[float],
    reference: float | Sequence[float],
    tolerance: float | Sequence[float],
    unit: str,
) -> list[Measurement]:
    """One measurement, or one for each entry of sequences; their quantities are then numbered from 1."""
    if not hasattr(reference, "__len__"):
        return [Measurement(case, quantity, unit, float(reference), float(computed), float(tolerance))]
    tolerances = tolerance if hasattr(tolerance, "__len__") else [tolerance] * len(reference)
    rows = zip(reference, computed, tolerances, strict=True)
    return [
        Measurement(case, f"{quantity} {k}", unit, float(r), float(c), float(t))
        for k, (r, c, t) in enumerate(rows, start=1)
    ]


def write(path: Path, measured: Iterable[Measurement]) -> None:
    """Write the page."""
    by_case: dict[Case, list[Measurement]] = {}
    for measurement in measured:
        by_case.setdefault(measurement.case, []).append(measurement)
    text = [INTRODUCTION]
    for case in sorted(by_case, key=lambda case: case.name):
        facts = [f"* Source: {case.source}", f"* Theory: {case.theory}"]
        facts += [f"* {case.note}"] if case.note else []
        rows = "\n".join(m.row() for m in by_case[case])
        text.append(f"## {case.name}\n\n" + "\n".join(facts) + f"\n\n{_HEAD}{rows}\n")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(text), encoding="utf-8")


def read(path: Path) -> dict[tuple[str, str], PrintedRow]:
    """The rows of the page by case and quantity; empty when there is no page."""
    rows: dict[tuple[str, str], PrintedRow] = {}
    case = ""
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        if line.startswith("## "):
            case = line.removeprefix("## ")
        elif (match := _ROW.match(line)) and not line.startswith("| quantity"):
            quantity, _, reference, computed, _, tolerance = match["cells"].split(" | ")
            rows[case, quantity] = PrintedRow(float(reference), float(computed), float(tolerance))
    return rows
