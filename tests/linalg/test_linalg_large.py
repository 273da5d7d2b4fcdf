"""Factors of large matrices: the library that makes them is found without a search of the disk."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import distributions

import pytest

UNSEARCHED = """
import glob, os
def refuse(*_, **__): raise AssertionError("the environment was searched")
glob.glob = refuse
import numpy as np, scipy.sparse as sp
from flexura.linalg import factorise_large
A = sp.diags([-np.ones(99), 2.0 * np.ones(100), -np.ones(99)], [-1, 0, 1]).tocsc()
found = factorise_large(A)
assert type(found).__name__ == "Pardiso", found
assert "PYPARDISO_MKL_RT" not in os.environ
x = np.arange(1, 101)
np.testing.assert_allclose(np.ravel(found.solve(np.ones(100))), x * (101 - x) / 2, rtol=1e-12)
"""


def test_the_library_of_pardiso_is_found_without_a_search():
    pytest.importorskip("pypardiso")
    if not any(own.metadata["Name"] == "mkl" for own in distributions()):
        pytest.skip("MKL is of another package")
    subprocess.run([sys.executable, "-c", UNSEARCHED], check=True, timeout=120)
