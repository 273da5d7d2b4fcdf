"""Matrix Market files of K, M and C, with a table that says what the rows are."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.errors import OptionError
from flexura.files import complete_files
from flexura.io.contents import SecondOrder, model_error_notes, second_order
from flexura.mechanism import DOF_NAMES
from flexura.structure import FullOrderModel

_COLUMNS = ("row", "coordinate", "node", "dof", "x_m", "y_m", "z_m")


def write_matrix_market(what: Any, path: str | Path, damping: Any | None = None) -> list[Path]:
    """Write K, M and, when there is one, C as symmetric Matrix Market files, SI, and a table of the rows.

    A path ending in `.mtx` is a prefix, `part.mtx` for `part_K.mtx`, `part_M.mtx` and `part_dofs.csv`; any other is a
    folder, made when missing, for `K.mtx`, `M.mtx` and `dofs.csv`. Rows of the table count from 1, as in the files;
    rows that are no displacement of a node, such as amplitudes, have a name alone. Returns the paths. Raises
    OptionError for things without matrices, and when a file cannot be written.
    """
    from scipy.io import mmwrite

    own = second_order(what, damping)
    path = Path(path)
    if path.suffix == ".mtx":
        folder, prefix, make = path.parent, f"{path.stem}_", False
    else:
        folder, prefix, make = path, "", True
        if path.is_file():
            raise OptionError(
                f"{path} is a file; matrices go to a folder, or to files named by a prefix ending in .mtx"
            )
    matrices = {"K": own.K, "M": own.M} | ({} if own.C is None else {"C": own.C})
    notes = model_error_notes(own.model)
    with complete_files(folder, make) as scratch:
        for name, A in matrices.items():
            lower = sp.coo_matrix(A)
            comment = f"{name} of {' '.join(own.name.split())}, SI, rows in {prefix}dofs.csv"
            with (scratch / f"{prefix}{name}.mtx").open("wb") as stream:
                mmwrite(stream, lower, "\n".join((comment, *notes)), symmetry="symmetric", precision=17)
        with (scratch / f"{prefix}dofs.csv").open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, lineterminator="\n").writerows([_COLUMNS, *_rows(own)])
        written = sorted(file.name for file in scratch.iterdir())
    return [folder / name for name in written]


def _rows(own: SecondOrder) -> list[tuple[Any, ...]]:
    """Number, name, node, DOF and place of every coordinate."""
    topology, x = own.model.plan.topology, own.model.positions
    number = {name: k for k, name in enumerate(topology.node_names) if topology.has_position[k]}
    amplitudes = np.empty(0)
    if isinstance(own.model, FullOrderModel):
        amplitudes = np.flatnonzero(~topology.has_position[np.nonzero(topology.dof >= 0)[0]])
    skip, rows = set(amplitudes.tolist()), []
    for k, name in enumerate(own.coordinate_names):
        node, _, dof = name.rpartition(".")
        if k not in skip and dof in DOF_NAMES and node in number:
            rows.append((k + 1, name, node, dof, *map(repr, x[number[node]].tolist())))
        else:
            rows.append((k + 1, name, "", "", "", "", ""))
    return rows
