"""Natural frequencies by CalculiX itself."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.errors import SolverError
from flexura.fem.solid_mesh import SolidMesh
from flexura.files import scratch_folder
from flexura.solid.interchange.calculix import run_calculix, write_calculix

Array = NDArray[np.float64]


def calculix_frequencies(
    mesh: SolidMesh,
    n: int = 6,
    *,
    fixed: Sequence[str] = (),
    rigid: Mapping[str, ArrayLike] | None = None,
    timeout: float = 600.0,
    program: str = "ccx",
) -> Array:
    """The `n` lowest natural frequencies (n,), Hz, by CalculiX; arguments as in `write_calculix`.

    Raises OptionError when the program is not installed, and SolverError when it fails or takes longer than `timeout`.
    """
    with scratch_folder() as folder:
        deck = write_calculix(mesh, folder / "solid.inp", fixed=fixed, rigid=rigid)
        deck.write_text(deck.read_text().replace("*FREQUENCY,SOLVER=MATRIXSTORAGE\n6\n", f"*FREQUENCY\n{n}\n"))
        run_calculix(deck, timeout, program)
        return read_frequencies(deck.with_suffix(".dat"))[:n]


def read_frequencies(path: str | Path) -> Array:
    """Natural frequencies, Hz, ascending, from the table of eigenvalues of a .dat file; unstable modes are below zero.

    Raises SolverError when there is no such table.
    """
    found: list[float] = []
    inside = False
    for line in Path(path).read_text().splitlines():
        if "E I G E N V A L U E" in line:
            inside = True
        elif inside and "P A R T I C I P A T I O N" in line:
            break
        elif inside and len(line.split()) == 5 and line.split()[0].isdigit():
            _, eigenvalue, _, cycles, imaginary = (float(text) for text in line.split())
            found.append(cycles if eigenvalue >= 0 else -abs(imaginary) / (2 * np.pi))
    if not found:
        raise SolverError(f"{path} holds no eigenvalues")
    return np.sort(found)
