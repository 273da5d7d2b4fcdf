"""Kernels beside the same in NumPy."""

from __future__ import annotations

import shutil

import pytest

from flexura.kernels import is_compiled, without

compiled = pytest.mark.skipif(shutil.which("cc") is None and not is_compiled(), reason="no C compiler made the kernels")
"""Where a compiler is, kernels that are not there are a fault."""


def both(calculate):
    """What a function gives by kernels and without."""
    assert is_compiled()
    by_kernel = calculate()
    with without():
        return by_kernel, calculate()
