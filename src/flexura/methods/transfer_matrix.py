"""The transfer matrix method for chains of beams, and for branches joined in loops (Pestel and Leckie 1963).

Every chain between two junctions is multiplied up into one 12 x 12 matrix. Unknown are the displacements of the
junctions and the wrench at the start of every chain; chains give compatibility at their ends, junctions equilibrium.
The matrix of these equations has no poles and is singular at the natural frequencies (theory eqs. W1-W3).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Index
from flexura.beam import rigid_arm, transfer_at_pole, transfer_rooted, transfer_turned
from flexura.beam import transfer_matrix as beam_transfer
from flexura.methods.chain_equations import ChainEquations
from flexura.methods.exact_chains import ExactChains
from flexura.methods.roots import natural_frequencies
from flexura.methods.solution import Solution
from flexura.structure import FullOrderModel

Array = NDArray[Any]


class TransferMatrices(ChainEquations):
    """The equations of all chains and junctions of a mechanism at any complex frequency; a chain's own unknowns are the
    wrench at its start."""

    def add_chains(
        self, local: Array, chains: ExactChains, first: Index, last: Index, own: Index, lam: complex
    ) -> None:
        """Compatibility at the ends of chains, and what they exert on their nodes (theory eqs. W2-W3)."""
        back = rigid_arm(-chains.arms[:, -1])
        for k, matrix in enumerate(chain_transfer(chains, lam)):
            w, a, e = own[k], first[k], last[k]
            local[np.ix_(w, a)] += matrix[:6, :6]
            local[np.ix_(w, w)] += matrix[:6, 6:]
            local[np.ix_(w, e)] -= back[k]
            local[a, w] -= 1.0
            local[np.ix_(e, a)] += back[k].T @ matrix[6:, :6]
            local[np.ix_(e, w)] += back[k].T @ matrix[6:, 6:]


def chain_transfer(chains: ExactChains, lam: complex) -> Array:
    """Transfer matrices (c, 12, 12) of whole chains, twist and wrench at their poles."""
    own = beam_transfer(chains.beam, lam)[chains.kind]
    length = chains.beam.length[chains.kind].ravel()
    own = transfer_rooted(own.reshape(-1, 12, 12), chains.root.reshape(-1, 2), chains.roots, length).reshape(own.shape)
    phi = transfer_at_pole(own, chains.X)
    if chains.reverse.any():
        phi = np.where(chains.reverse[..., None, None], transfer_turned(phi), phi)
    whole = phi[:, 0]
    for k in range(1, phi.shape[1]):
        whole = phi[:, k] @ whole
    return whole


def transfer_matrix(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies by transfer matrices, found on contours in the complex plane.

    Raises OptionError when nothing can move, SolverError when the contours do not separate the frequencies. Loses
    digits where waves decay over a whole chain: at many wavelengths per chain.
    """
    equations = TransferMatrices(model)
    hz = natural_frequencies(equations.matrix, model, count)
    return Solution("transfer matrix", None, hz, note="chains multiplied up, junctions joined in loops")
