"""What the verification tests measured, and what is made from it: `docs/verification.csv`, a row for every number, and
`docs/verification.md`, a row for every case."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

REPRINT = 5e-6
"""Relative difference between a printed and a newly measured number that counts as the same: last-digit noise."""

INTRODUCTION = """\
# Verification

Numbers that flexura computes beside numbers that it did not produce: published benchmarks, closed-form solutions of the
same theory, or another program. [A table](verification.csv) has each of the {count} numbers with its reference, and
below is a row for each of the {cases} cases. The tests that measure them fail when an error exceeds the tolerance of
its row, and when the table no longer says what they measure.

* *Error* is |computed / reference - 1| of the number that comes nearest to its *tolerance*. Where a source prints few
  digits, the tolerance is half a unit of its last one; elsewhere it covers the discretisation error of the mesh in use,
  and it is stated, not fitted to pass.
* Agreement shows that the equations of the named theory are solved correctly. It does not show that the theory
  describes a given part: short wide leaves, steep notches and clamped torsion are beyond plain beams. Most cases are
  therefore computed with `corrections: none`; those that are named corrected put the corrections to the test.

To write both anew: `make verification`.

| case | reference | theory | numbers | error | tolerance | exact members |
|---|---|---|---|---|---|---|
"""

TWIN = ", exact dynamic stiffness"
"""How a case ends that asks the exact members the same: it stands in the row of the other, in the last column."""

_COLUMNS = ("case", "quantity", "unit", "reference", "computed", "relative error", "tolerance")


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
        """Case and quantity, which name a row."""
        return self.case.name, self.quantity

    @property
    def error(self) -> float:
        """Relative error."""
        return abs(self.computed / self.reference - 1)

    @property
    def error_text(self) -> str:
        """The error, or its floor: below, digits are round-off and differ between machines."""
        floor = min(1e-8, self.tolerance)
        return f"{self.error:.1e}" if self.error >= floor else f"< {floor:.0e}"

    def row(self) -> tuple[str, ...]:
        """The row of the table, under `_COLUMNS`."""
        numbers = (f"{self.reference:.7g}", f"{self.computed:.7g}", self.error_text, f"{self.tolerance:.1e}")
        return (*self.key, self.unit, *numbers)

    def check(self) -> None:
        """Raise AssertionError when the error exceeds the tolerance."""
        assert self.error <= self.tolerance, (
            f"{self.case.name}, {self.quantity}: {self.computed:.9g} {self.unit} instead of {self.reference:.9g}, "
            f"relative error {self.error:.2e} > {self.tolerance:.2e}"
        )


@dataclass(frozen=True)
class PrintedRow:
    """A row as it stands in the table."""

    reference: float
    computed: float
    tolerance: float

    def differs_from(self, measured: Measurement) -> bool:
        """True when the table no longer says what was measured."""
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
    """Write the page, and the table of the same name beside it."""
    by_case: dict[Case, list[Measurement]] = {}
    for measurement in measured:
        by_case.setdefault(measurement.case, []).append(measurement)
    cases = sorted(by_case, key=lambda case: case.name)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.with_suffix(".csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(_COLUMNS)
        table.writerows(row.row() for case in cases for row in by_case[case])
    rows = "\n".join(_summary(case, by_case) for case in cases if not case.name.endswith(TWIN))
    notes: dict[str, dict[str, None]] = {}
    for case in cases:
        if case.note:
            notes.setdefault(case.note, {})[case.name.removesuffix(TWIN)] = None
    remarks = "\n".join(f"* {', '.join(names)}: {note}" for note, names in notes.items())
    introduction = INTRODUCTION.format(count=sum(map(len, by_case.values())), cases=len(cases))
    path.write_text(f"{introduction}{rows}\n\n## What to know about some\n\n{remarks}\n", encoding="utf-8")


def _summary(case: Case, by_case: Mapping[Case, Sequence[Measurement]]) -> str:
    """The row of a case on the page: that number of it which comes nearest to its tolerance."""
    rows = by_case[case]
    worst = max(rows, key=lambda row: row.error / row.tolerance)
    twins = [row for other, own in by_case.items() if other.name == case.name + TWIN for row in own]
    exact = max(twins, key=lambda row: row.error / row.tolerance, default=None)
    last = f"{len(twins)}: {exact.error_text} of {exact.tolerance:.1e}" if exact else ""
    cells = (case.name, case.source, case.theory, str(len(rows)), worst.error_text, f"{worst.tolerance:.1e}", last)
    return f"| {' | '.join(cells)} |"


def read(path: Path) -> dict[tuple[str, str], PrintedRow]:
    """The rows of the table beside the page, by case and quantity; empty when there is none."""
    table = path.with_suffix(".csv")
    if not table.exists():
        return {}
    with table.open(encoding="utf-8", newline="") as file:
        return {
            (row["case"], row["quantity"]): PrintedRow(
                *(float(row[key]) for key in ("reference", "computed", "tolerance"))
            )
            for row in csv.DictReader(file)
        }
