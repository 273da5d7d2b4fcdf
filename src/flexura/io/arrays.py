"""State spaces, second-order models and responses for NumPy, HDF5, MATLAB, Matrix Market, python-control and SciPy."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from flexura._version import __version__
from flexura.analysis import ScheduledPlant
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError, need
from flexura.files import complete_files, write_file
from flexura.io.contents import (
    SecondOrder,
    contents,
    is_sparse,
    model_error_notes,
    plain_name,
    refuse_clashes,
    second_order,
    signal_names,
)
from flexura.mechanism import DOF_NAMES
from flexura.structure import FullOrderModel
from flexura.systems import StateSpace

if TYPE_CHECKING:
    import control
    from scipy import signal

_MATLAB_NAMES = {
    "dt": "Ts",
    "delay": "InputDelay",
    "name": "Name",
    "notes": "Notes",
    "kind": "Kind",
    "frequency_hz": "FrequencyHz",
    "response": "ResponseData",
    "sigma": "Sigma",
    "input_names": "InputName",
    "output_names": "OutputName",
    "state_names": "StateName",
    "input_units": "InputUnit",
    "output_units": "OutputUnit",
    "input_quantities": "InputQuantity",
    "output_quantities": "OutputQuantity",
    "coordinate_names": "CoordinateName",
    "parameter": "ParameterName",
    "up_to_hz": "UpToHz",
}
_COLUMNS = ("row", "coordinate", "node", "dof", "x_m", "y_m", "z_m")


def write_npz(what: Any, path: str | Path, damping: Any | None = None) -> Path:
    """Write a NumPy archive, which needs no pickling to be read; see `contents` for the names of its arrays.

    A sparse matrix K is `K.data`, `K.indices`, `K.indptr` (by columns) and `K.shape`. Continuous models have dt = 0.
    Raises OptionError for things that have no arrays and when the file cannot be written.
    """
    arrays: dict[str, Any] = {"flexura": np.array(__version__)}
    value: Any
    for name, value in contents(what, damping).items():
        if is_sparse(value):
            arrays |= {f"{name}.{part}": np.asarray(getattr(value, part)) for part in ("data", "indices", "indptr")}
            arrays[f"{name}.shape"] = np.array(value.shape)
        else:
            arrays[name] = np.array(value, dtype=str) if isinstance(value, list) else np.asarray(value)

    def write(file: Path) -> None:
        with file.open("wb") as stream:
            np.savez_compressed(stream, **arrays)

    return write_file(path, write)


def write_hdf5(what: Any, path: str | Path, damping: Any | None = None) -> Path:
    """Write an HDF5 file with a dataset for every array and list of texts, and numbers and texts as attributes.

    A sparse matrix is a group with `data`, `indices`, `indptr` (by columns) and the attribute `shape`. Continuous
    models have dt = 0. Raises OptionError without h5py, for things that have no arrays, and when the file cannot be
    written.
    """
    h5py = need("h5py", "export")
    items = contents(what, damping)

    def write(file: Path) -> None:
        with h5py.File(file, "w") as root:
            root.attrs["flexura"] = __version__
            for name, value in items.items():
                if is_sparse(value):
                    group = root.create_group(name)
                    group.attrs["shape"] = value.shape
                    for part in ("data", "indices", "indptr"):
                        group[part] = getattr(value, part)
                elif isinstance(value, list):
                    root.create_dataset(name, (len(value),), h5py.string_dtype(), value)
                elif isinstance(value, np.ndarray):
                    root[name] = value
                else:
                    root.attrs[name] = value

    return write_file(path, write)


def write_mat(what: Any, path: str | Path, damping: Any | None = None) -> Path:
    """Write a MATLAB file (version 5) with the names that `ss` and `frd` use for their properties.

    State space: A, B, C, D, Ts (0 when continuous), InputDelay in s, and names and units as cell arrays of columns,
    names that occur twice with their quantity behind them. Frequency response: ResponseData (p, m, f) at FrequencyHz.
    Second-order model: K, M, C and CoordinateName. Scheduled plant: A, B, C, D and all else with the k poses last,
    (n, n, k), vectors as columns (n, 1, k), and the poses as a column (k, 1). Raises OptionError for things that have
    no arrays, and when the file cannot be written.
    """
    items = contents(what, damping)
    if isinstance(what, StateSpace | ScheduledPlant):
        names = signal_names(what)
        items |= {"input_names": list(names.inputs), "output_names": list(names.outputs)}
    if isinstance(what, ScheduledPlant):
        items |= {name: _poses_last(items[name]) for name in what.arrays()}
    if isinstance(what, StateSpace):
        items["delay"] = np.full((len(what.inputs), 1), what.delay if what.dt is None else 0.0)
    if "response" in items:
        items["response"] = items["response"].transpose(1, 2, 0)
        items["frequency_hz"] = items["frequency_hz"][:, None]
    return save_mat({_MATLAB_NAMES.get(name, name): value for name, value in items.items()}, path)


def save_mat(items: dict[str, Any], path: str | Path) -> Path:
    """Write arrays, numbers, texts and lists of texts (as cell columns) as variables of a MATLAB file."""
    from scipy.io import savemat

    variables = {name: _cell(value) if isinstance(value, list) else value for name, value in items.items()}

    def write(file: Path) -> None:
        savemat(str(file), variables, appendmat=False, long_field_names=True, do_compression=True)

    return write_file(path, write)


def _poses_last(values: Array) -> Array:
    """Matrices (n, m, k), or columns (n, 1, k), of those (k, n, m) and (k, n); numbers (k,) as a column."""
    columns = values[..., None] if values.ndim < 3 else values
    return columns.transpose(1, 2, 0) if values.ndim > 1 else columns


def _cell(texts: list[str]) -> Any:
    cell = np.empty((len(texts), 1), dtype=object)
    cell[:, 0] = texts
    return cell


def write_matrix_market(what: Any, path: str | Path, damping: Any | None = None) -> list[Path]:
    """Write K, M and, when there is one, C as symmetric Matrix Market files, SI, and a table of the rows.

    A path ending in `.mtx` is a prefix, `part.mtx` for `part_K.mtx`, `part_M.mtx` and `part_dofs.csv`; any other is a
    folder, made when missing, for `K.mtx`, `M.mtx` and `dofs.csv`. Rows of the table count from 1, as in the files;
    rows that are no displacement of a node, such as amplitudes, have a name alone. Returns the paths. Raises
    OptionError for things without matrices, and when a file cannot be written.
    """
    from scipy.io import mmwrite

    second = second_order(what, damping)
    path = Path(path)
    if path.suffix == ".mtx":
        folder, prefix, make = path.parent, f"{path.stem}_", False
    else:
        folder, prefix, make = path, "", True
        if path.is_file():
            raise OptionError(
                f"{path} is a file; matrices go to a folder, or to files named by a prefix ending in .mtx"
            )
    matrices = {"K": second.K, "M": second.M} | ({} if second.C is None else {"C": second.C})
    notes = model_error_notes(second.model)
    with complete_files(folder, make) as scratch:
        for name, A in matrices.items():
            lower = sp.coo_matrix(A)
            comment = f"{name} of {' '.join(second.name.split())}, SI, rows in {prefix}dofs.csv"
            with (scratch / f"{prefix}{name}.mtx").open("wb") as stream:
                mmwrite(stream, lower, "\n".join((comment, *notes)), symmetry="symmetric", precision=17)
        with (scratch / f"{prefix}dofs.csv").open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, lineterminator="\n").writerows([_COLUMNS, *_rows(second)])
        written = sorted(file.name for file in scratch.iterdir())
    return [folder / name for name in written]


def _rows(second: SecondOrder) -> list[tuple[Any, ...]]:
    """Number, name, node, DOF and place of every coordinate."""
    topology, x = second.model.plan.topology, second.model.positions
    number = {name: k for k, name in enumerate(topology.node_names) if topology.has_position[k]}
    amplitudes = np.empty(0)
    if isinstance(second.model, FullOrderModel):
        amplitudes = np.flatnonzero(~topology.has_position[np.nonzero(topology.dof >= 0)[0]])
    skip, rows = set(amplitudes.tolist()), []
    for k, name in enumerate(second.coordinate_names):
        node, _, dof = name.rpartition(".")
        if k not in skip and dof in DOF_NAMES and node in number:
            rows.append((k + 1, name, node, dof, *map(repr, x[number[node]].tolist())))
        else:
            rows.append((k + 1, name, "", "", "", "", ""))
    return rows


@verb
def to_control(model: StateSpace) -> control.StateSpace:
    """The model as `control.StateSpace`, with its step and the names of its inputs, outputs and states.

    python-control allows no dots in names: `stage.tx` becomes `stage_tx`, and what is no letter or digit an underscore.
    Names that inputs and outputs share get their quantity behind them (`stage_tx_force`), since python-control connects
    signals of equal names. Raises OptionError without the package, for names that clash, and for a continuous model
    with dead time: `discretised` has it inside.
    """
    library: Any = need("control", "control")
    _refuse_dead_time(model, "python-control")
    plain = [tuple(plain_name(name) for name in names) for names in signal_names(model)]
    refuse_clashes([name for names in plain for name in names], " once dots have become underscores")
    inputs, outputs, states = plain
    matrices = (model.A, model.B, model.C, model.D)
    time = model.dt if model.dt is not None else 0
    names = {"name": plain_name(model.name), "inputs": inputs, "outputs": outputs, "states": states}
    return library.StateSpace(*matrices, time, **names, remove_useless_states=False)


@verb
def to_scipy(model: StateSpace) -> signal.StateSpace:
    """The model as `scipy.signal.StateSpace`, continuous or with its step; names of signals are not part of one.

    Raises OptionError for a continuous model with dead time: `discretised` has it inside.
    """
    from scipy import signal

    _refuse_dead_time(model, "SciPy")
    step = {} if model.dt is None else {"dt": model.dt}
    return signal.StateSpace(model.A, model.B, model.C, model.D, **step)


def _refuse_dead_time(model: StateSpace, who: str) -> None:
    if model.delay and not model.is_discrete:
        raise OptionError(
            f"{who} has no dead time, and this model has {model.delay} s: export model.discretised(step),"
            " which contains it, or set the delay to zero"
        )
