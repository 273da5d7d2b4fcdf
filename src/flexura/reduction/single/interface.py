"""Interface reduction by characteristic constraint modes (Castanier, Tan and Pierre 2001; theory eq. R6)."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.linalg import count_below, lowest
from flexura.reduction.single.model import LowOrderModel, SubstructureBasis


@verb
def interface_reduction(low: LowOrderModel, *, n: int = 0, up_to: float = 0.0) -> LowOrderModel:
    """Replace the interface displacements of a model from `reduce` by their lowest normal modes.

    The lowest `n` characteristic constraint modes are kept, and all up to `up_to` Hz if that is more; amplitudes of
    substructures' normal modes stay. Static response stays exact at the static nodes. Raises OptionError when nothing
    is to be kept, or for a model whose coordinates are not those of substructures.
    """
    if not isinstance(low.basis, SubstructureBasis):
        raise OptionError("interface reduction is for the coordinates of substructures: apply it before other steps")
    if n < 0 or not (np.isfinite(up_to) and up_to >= 0) or not (n or up_to):
        raise OptionError("say how many characteristic constraint modes to keep, or up to which frequency in Hz")
    size = len(low.basis.assembler.physical)
    K, M = low.K[:size][:, :size], low.M[:size][:, :size]
    if up_to:
        n = max(n, count_below(K, M, (2 * np.pi * up_to) ** 2))
    n = min(max(n, 1), size)
    modes = lowest(K, M, n).vectors
    T = la.block_diag(modes, np.eye(low.order - size))
    names = [f"characteristic constraint mode {k + 1}" for k in range(n)] + low.coordinate_names[size:]
    return low.projected(T, names, f"{n} of {size} characteristic constraint modes of the interface")
