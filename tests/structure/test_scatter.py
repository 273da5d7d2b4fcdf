"""Sums of small matrices: where they go, by the kernel and in NumPy, beside sums written out."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from flexura.errors import OptionError
from flexura.structure import Scatter
from helpers.kernels import both, compiled

rng = np.random.default_rng(5)

CASES = {
    "none": (4, []),
    "nothing free": (0, [np.full((3, 2), -1)]),
    "one": (3, [np.array([[0, 1, 2]])]),
    "some dropped": (7, [rng.integers(-1, 7, (20, 3)), rng.integers(-1, 7, (4, 5))]),
    "a long column": (90, [np.stack([np.zeros(89, int), np.arange(1, 90)], axis=1)[::-1].copy()]),
    "a row twice in a matrix": (5, [np.array([[0, 3, 3, -1], [3, 1, 1, 3]])]),
    "empty ones between": (6, [np.empty((0, 12), int), rng.integers(-1, 6, (9, 2)), np.empty((0, 3), int)]),
    "many": (300, [rng.integers(-1, 300, (400, 12))]),
}


@compiled
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("symmetric", [True, False])
def test_kernel_numpy_and_the_sum_written_out(name, symmetric):
    n, dofs = CASES[name]
    dofs = [np.asarray(d, dtype=np.intp) for d in dofs]
    blocks = [rng.standard_normal((*d.shape, d.shape[1])) for d in dofs]
    if symmetric:
        blocks = [(block + np.swapaxes(block, 1, 2)) / 2 for block in blocks]
    expected = np.zeros((n, n))
    for d, block in zip(dofs, blocks, strict=True):
        for rows, A in zip(d, block, strict=True):
            for i, r in enumerate(rows):
                for j, c in enumerate(rows):
                    if r >= 0 and c >= 0:
                        expected[r, c] += A[i, j]

    def summed():
        found = Scatter(dofs, n, symmetric=symmetric)
        return found.sparse(blocks), found.dense(blocks)

    for sparse, dense in both(summed):
        assert sp.csc_matrix((sparse.data, sparse.indices, sparse.indptr), shape=(n, n)).has_canonical_format
        assert np.allclose(sparse.toarray(), expected, atol=1e-13)
        assert np.allclose(dense, expected, atol=1e-13)
        if symmetric:
            assert (sparse != sparse.T).nnz == 0


@compiled
def test_matrices_that_do_not_fit_the_pattern_are_refused():
    dofs = [np.array([[0, 1]]), np.array([[1, 2, 0]])]
    for summed in both(lambda: _patterned(Scatter(dofs, 3))):
        with pytest.raises(ValueError):
            summed([np.eye(2)[None], np.eye(2)[None]])


def _patterned(found):
    found.sparse([np.eye(2)[None], np.eye(3)[None]])
    return found.sparse


def test_a_sum_of_more_than_can_be_counted_is_refused(monkeypatch):
    monkeypatch.setattr("flexura.structure.assembly.MOST_ENTRIES", 12)
    dofs = [np.array([[0, 1]]), np.array([[1, 2, 0]])]
    with pytest.raises(OptionError, match="13 entries of small matrices are more than the 12 of a sparse sum"):
        Scatter(dofs, 3).sparse([np.eye(2)[None], np.eye(3)[None]])
