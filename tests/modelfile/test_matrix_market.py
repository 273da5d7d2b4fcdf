"""Matrix Market files are read as SciPy reads them."""

from __future__ import annotations

import io

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.io import mmread, mmwrite

from flexura.modelfile.superelements import read_entries, read_header


@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("kind", [float, int])
@pytest.mark.parametrize("make", [np.asarray, sp.coo_array])
def test_what_scipy_writes(make, kind, symmetry):
    A = np.round(np.random.default_rng(1).normal(size=(7, 7)) * (8 if kind is int else 1e-3), 0 if kind is int else 17)
    A = (A + A.T if symmetry == "symmetric" else A) * (np.add.outer(range(7), range(7)) % 3 > 0)
    stream = io.BytesIO()
    mmwrite(stream, make(A.astype(kind)), "one line\nand another", symmetry=symmetry, precision=17)
    content = stream.getvalue()
    expected = mmread(io.BytesIO(content), spmatrix=False)
    assert np.array_equal(read_entries(content, read_header(content)), getattr(expected, "toarray", lambda: expected)())
