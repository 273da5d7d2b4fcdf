"""Whether the part's frequency lies within `model_error` of the printed one: sixty mechanisms against whole solids.

Every description of part_mechanisms.py is solved as it is printed, and once as one elastic piece in which nothing is
rigid but the bolted faces. Solids, which take most of the time, are kept in part_solids.csv, and the comparison in
part_error.csv; both are written after every mechanism, so that the next call goes on where the last one stopped.
`--again` compares anew with the solids that are there, `--files DIR` writes the descriptions. The table at the end is
in Markdown; `--page FILE` puts it between the marks of a page.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from part_mechanisms import mechanisms

import flexura as fx
from flexura.deadline import announcer
from flexura.describe import Flexure, Notch
from flexura.mechanism import with_rigid_bodies
from flexura.modal import pair_modes
from flexura.solid.whole import WholePart, elements
from flexura.structure import solids_of

HERE = Path(__file__).parent
SOLIDS, ERRORS = HERE / "part_solids.csv", HERE / "part_error.csv"
MODES, MORE = 6, 4
"""Modes that are held to account, and those beyond in which their counterparts may be."""

POINTS = 20
"""Nodes at which shapes are kept, displacements and rotations."""

STEPS = 99
"""Displacements are kept as whole numbers, the largest of a mode as this."""

SIZE, MESH, FINER = 1.3, (0.7, 1.0), (0.4, 2.0)
"""Size of tetrahedra, how fast they grow away from fine places and how many a radius of curvature is long; a mesh that
netgen makes where it cannot make the first."""

FALL = 10.0
"""Least distance of elements of one order less from those of the higher one, over that of these from the limit."""

MARKS = ("<!-- part error -->", "<!-- end of part error -->")
SOLID_HEAD = ("name", "mode", "hz", "known_to", "dofs", "seconds", "shape")
ERROR_HEAD = (
    "name",
    "family",
    "sizes",
    "mode",
    "printed_hz",
    "solid_hz",
    "solid_mode",
    "known_to",
    "likeness",
    "low",
    "high",
    "inside",
)


@dataclass(frozen=True)
class Solid:
    """Modes of a whole solid: frequencies (n,), Hz, their relative uncertainty (n,), shapes (points, 6, n) at nodes.

    Rotations are times half the width of a member.
    """

    nodes: tuple[str, ...]
    hz: np.ndarray
    known_to: np.ndarray
    shapes: np.ndarray
    dofs: int
    seconds: float


def spread_out(places: np.ndarray, count: int) -> np.ndarray:
    """Numbers of points (n, 3) that lie as far from each other as can be, beginning with the first."""
    chosen = [0]
    far = np.linalg.norm(places - places[0], axis=1)
    while len(chosen) < min(count, len(places)) and far.max() > 0:
        chosen.append(int(np.argmax(far)))
        far = np.minimum(far, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return np.array(chosen)


def scaled(model: fx.FullOrderModel, shapes: np.ndarray) -> np.ndarray:
    """Shapes (nodes, 6, n) with rotations times half the width of a member, in the middle of all."""
    wide = float(np.median(solids_of(model)[0].half.max(axis=1)))
    return shapes * np.array([1.0, 1.0, 1.0, wide, wide, wide])[:, None]


def meshed(mechanism: fx.Mechanism, model: fx.FullOrderModel) -> tuple[WholePart, int]:
    """The part in tetrahedra that take some 100 000 DOFs and are within half a per cent, and their order."""
    contours = [own.profile.contour.shape for own in flexures(mechanism) if isinstance(own.profile, Notch)]
    order = 4 if any(shape != "corner_filleted" for shape in contours) else 3
    for elements.GRADING, elements.CURVATURE in (MESH, FINER):
        try:
            return WholePart(model, order, SIZE, announcer(None)), order
        except fx.SolverError:
            continue
    raise fx.SolverError("netgen could not mesh the part")


def flexures(mechanism: fx.Mechanism) -> list[Flexure]:
    """All flexures that are described."""
    parts = (mechanism, *mechanism.substructures.values())
    return [own for part in parts for own in part.flexures.values()]


def solved(mechanism: fx.Mechanism) -> Solid:
    """The whole solid by elements of two orders, whose difference says how far off it is; shapes at nodes in it."""
    begin = time.perf_counter()
    model = fx.assemble(with_rigid_bodies(mechanism))
    part, order = meshed(mechanism, model)
    found, coarse = (part.modes(MODES + MORE, own) for own in (order, order - 1))
    shapes, rough = (scaled(model, np.array(own.shapes)) for own in (found, coarse))
    is_in = np.flatnonzero(np.isfinite(shapes).all(axis=(1, 2)))
    at = is_in[spread_out(np.array(model.geometry.positions)[is_in], POINTS)]
    hz, rough_hz = np.array(found.frequency_hz), np.array(coarse.frequency_hz)
    partner = paired(hz, shapes[at], rough_hz, rough[at])[0]
    off = np.abs(rough_hz[partner] - hz) / FALL / 2
    nodes = tuple(model.plan.topology.node_names[k] for k in at)
    seconds = time.perf_counter() - begin
    return Solid(nodes, hz - off, off / (hz - off), shapes[at], int(found.dofs), seconds)


def paired(
    hz: np.ndarray, shapes: np.ndarray, other_hz: np.ndarray, others: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The counterpart of every mode by shape, or what is left nearest by frequency, and their likeness, then 0."""
    n, m = len(hz), len(other_hz)
    found = pair_modes(hz, shapes.reshape(-1, n), model_hz=other_hz, model_shapes=others.reshape(-1, m))
    partner = found.partner.copy()
    likeness = np.array([found.likeness[k, j] if j >= 0 else 0.0 for k, j in enumerate(partner)])
    for k in np.flatnonzero(partner < 0):
        left = np.setdiff1d(np.arange(m), partner)
        partner[k] = left[np.argmin(np.abs(np.log(other_hz[left] / hz[k])))]
    return partner, likeness


def read_solids() -> dict[str, Solid]:
    """What is kept, by name."""
    rows: dict[str, list[dict[str, str]]] = {}
    for row in read(SOLIDS):
        rows.setdefault(row["name"], []).append(row)
    found = {}
    for name, (head, *own) in rows.items():
        hz, known_to = (np.array([float(row[key]) for row in own]) for key in ("hz", "known_to"))
        shapes = np.array([np.array(row["shape"].split(), dtype=float).reshape(-1, 6) for row in own])
        found[name] = Solid(
            tuple(head["shape"].split()),
            hz,
            known_to,
            np.moveaxis(shapes, 0, -1),
            int(head["dofs"]),
            float(head["seconds"]),
        )
    return found


def write_solids(solids: dict[str, Solid]) -> None:
    """Keep them."""
    rows: list[Iterable[Any]] = []
    for name, own in solids.items():
        rows.append((name, 0, "", "", own.dofs, f"{own.seconds:.0f}", " ".join(own.nodes)))
        for k, hz in enumerate(own.hz):
            shape = own.shapes[:, :, k]
            whole = np.round(STEPS * shape / np.abs(shape).max()).astype(int)
            rows.append((name, k + 1, f"{hz:.6g}", f"{own.known_to[k]:.1e}", "", "", " ".join(map(str, whole.ravel()))))
    write(SOLIDS, SOLID_HEAD, rows)


def read(path: Path) -> list[dict[str, str]]:
    """Rows of a table, none where there is no file."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def write(path: Path, head: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """A table, in one step."""
    partial = path.with_suffix(".part")
    with partial.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        writer.writerows(rows)
    partial.replace(path)


def compared(name: str, family: str, mechanism: fx.Mechanism, solid: Solid) -> list[dict[str, Any]]:
    """A row for each printed mode and its counterpart in the solid by shape, or what is left nearest by frequency."""
    printed = fx.modes(mechanism, n=MODES + MORE)
    names = list(printed.node_names)
    own = scaled(printed.model, printed.shapes)[[names.index(node) for node in solid.nodes]]
    n, hz = len(printed.frequency_hz), printed.frequency_hz
    partner, likeness = paired(hz, own, solid.hz, solid.shapes)
    margins = getattr(printed, "model_error", None) or [(None, None)] * n
    rows = []
    for k, margin in enumerate(margins[:MODES]):
        low, high = margin or (None, None)
        j = int(partner[k])
        off, own_off = solid.hz[j] / hz[k] - 1, solid.known_to[j]
        inside = "" if low is None or high is None else "yes" if low - own_off <= off <= high + own_off else "no"
        bounds = ["" if x is None else f"{x:.4f}" for x in (low, high)]
        words = mechanism.description if family != "gallery" else ""
        values = (
            name,
            family,
            words,
            k + 1,
            f"{hz[k]:.6g}",
            f"{solid.hz[j]:.6g}",
            j + 1,
            f"{solid.known_to[j]:.1e}",
            f"{likeness[k]:.2f}",
            *bounds,
            inside,
        )
        rows.append(dict(zip(ERROR_HEAD, map(str, values), strict=True)))
    return rows


def error(row: dict[str, str]) -> float:
    """How far the solid is from the printed frequency, relative to this."""
    return float(row["solid_hz"]) / float(row["printed_hz"]) - 1


def outside(row: dict[str, str]) -> float:
    """How far the solid lies outside the margin, relative, beyond what it is known to; 0 inside."""
    off = max(float(row["low"]) - error(row), error(row) - float(row["high"]))
    return max(off - float(row["known_to"]), 0.0)


def table(rows: list[dict[str, str]]) -> str:
    """Coverage and width by family, in Markdown."""
    lines = [
        "| family | parts | solids known to | inside | median width | widest | farthest outside | largest difference |",
        "|---|---|---|---|---|---|---|---|",
    ]
    families = list(dict.fromkeys(row["family"] for row in rows))
    for family in (*families, "all"):
        own = [row for row in rows if family in ("all", row["family"])]
        known = [row for row in own if row["inside"]]
        worst = max((error(row) for row in own), key=abs)
        held = ["unknown", "", "", ""]
        if known:
            width = [float(row["high"]) - float(row["low"]) for row in known]
            share = f"{sum(row['inside'] == 'yes' for row in known)} of {len(own)}"
            held = [share, *(f"{100 * x:.1f} %" for x in (np.median(width), max(width), max(map(outside, known))))]
        count = len({row["name"] for row in own})
        known_to = f"{100 * np.median([float(row['known_to']) for row in own]):.2f} %"
        lines.append(f"| {family} | {count} | {known_to} | {' | '.join(held)} | {100 * worst:+.1f} % |")
    return "\n".join(lines)


def put_into(page: Path, text: str) -> None:
    """Write a text between the marks of a page."""
    before, rest = page.read_text().split(MARKS[0])
    page.write_text(f"{before}{MARKS[0]}\n\n{text}\n\n{MARKS[1]}{rest.split(MARKS[1])[1]}")


def run(chosen: argparse.Namespace) -> list[dict[str, str]]:
    """Solve and compare what is wanted and not there yet; rows of all that is."""
    solids = read_solids()
    known: dict[str, list[dict[str, str]]] = {}
    for row in read(ERRORS):
        known.setdefault(row["name"], []).append(row)
    makers: dict[str, tuple[str, Callable[[], fx.Mechanism]]] = mechanisms()
    wanted = [name for start in chosen.only or [""] for name in makers if name.startswith(start)]
    for name in dict.fromkeys(wanted):
        family, make = makers[name]
        is_there = name in solids
        if (is_there and name in known and not chosen.again) or (chosen.again and name not in solids):
            continue
        mechanism = make()
        if not is_there and not chosen.again:
            try:
                solids[name] = solved(mechanism)
            except fx.FlexuraError as failure:
                print(f"{name}: {failure}", flush=True)
                continue
            write_solids({key: solids[key] for key in makers if key in solids})
        known[name] = compared(name, family, mechanism, solids[name])
        write(ERRORS, ERROR_HEAD, (row.values() for key in makers for row in known.get(key, [])))
        off = " ".join(f"{100 * (1 / (1 + error(row)) - 1):+.1f}" for row in known[name])
        print(
            f"{name:22} {solids[name].dofs:7} DOFs {solids[name].seconds:4.0f} s  printed over solid, %: {off}",
            flush=True,
        )
    return [row for key in makers for row in known.get(key, [])]


def main() -> None:
    """Run, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", action="append", metavar="NAME", help="mechanisms whose names begin so")
    parser.add_argument("--again", action="store_true", help="compare anew with solids that are there")
    parser.add_argument("--files", type=Path, metavar="DIR", help="write the descriptions, and stop")
    parser.add_argument("--page", type=Path, metavar="FILE", help="put the table between the marks of a page")
    chosen = parser.parse_args()
    if chosen.files:
        chosen.files.mkdir(parents=True, exist_ok=True)
        for name, (_, make) in mechanisms().items():
            fx.save(make(), chosen.files / f"{name}.yaml")
        return
    rows = run(chosen)
    if rows:
        print(table(rows))
        if chosen.page:
            put_into(chosen.page, table(rows))


if __name__ == "__main__":
    main()
