"""Interface reduction by characteristic constraint modes (Castanier, Tan and Pierre 2001; theory eq. R6)."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.linalg import count_below, lowest
from flexura.reduction.model import LowOrderModel, SubstructureBasis


@verb
def interface_reduction(low: LowOrderModel, *, count: int = 0, below_hz: float = 0.0) -> LowOrderModel:
    """Replace the interface displacements of a model from `reduce` by their lowest normal modes.

    The lowest `count` characteristic constraint modes are kept, and all below `below_hz` Hz if that is more; amplitudes
    of substructures' normal modes stay. Static response stays exact at the static nodes. Raises OptionError when
    nothing is to be kept, or for a model whose coordinates are not those of substructures.
    """
    if not isinstance(low.basis, SubstructureBasis):
        raise OptionError("interface reduction is for the coordinates of substructures: apply it before other steps")
    if count < 0 or not (np.isfinite(below_hz) and below_hz >= 0) or not (count or below_hz):
        raise OptionError("say how many characteristic constraint modes to keep, or below which frequency in Hz")
    n = len(low.basis.assembler.physical)
    K, M = low.K[:n][:, :n], low.M[:n][:, :n]
    if below_hz:
        count = max(count, count_below(K, M, (2 * np.pi * below_hz) ** 2))
    count = min(max(count, 1), n)
    modes = lowest(K, M, count).vectors
    T = la.block_diag(modes, np.eye(low.order - n))
    names = [f"characteristic constraint mode {k + 1}" for k in range(count)] + low.coordinate_names[n:]
    return low.projected(T, names, f"{count} of {n} characteristic constraint modes of the interface")
