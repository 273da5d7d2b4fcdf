"""C code of a continuous linear model for an FMU: nonzeros by rows, diagonal blocks of A; and its shared library."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.files import scratch_folder
from flexura.systems import StateSpace

TYPICAL_INPUT = {"expansion": 1e-5}
"""Ordinary size of an input by quantity, SI; 1 for those not listed."""

LARGEST_BLOCK = 1000
"""Order of the largest block of coupled states; its exponential costs some 50 products of that order."""


@dataclass(frozen=True)
class Blocks:
    """States in groups that A couples: block k has the states member[first[k]:first[k + 1]]."""

    first: Index
    member: Index

    @property
    def sizes(self) -> Index:
        """Number of states of each."""
        return np.diff(self.first)


def blocks_of(A: Array) -> Blocks:
    """Connected components of the pattern of A (n, n), in the order of their first states."""
    n = len(A)
    if not n:
        return Blocks(np.zeros(1, dtype=np.intp), np.empty(0, dtype=np.intp))
    _, label = connected_components(sp.csr_matrix(A != 0), directed=False)
    _, first_state = np.unique(label, return_index=True)
    rank = np.argsort(np.argsort(first_state))[label]
    member = np.argsort(rank, kind="stable")
    return Blocks(np.concatenate([[0], np.cumsum(np.bincount(rank))]).astype(np.intp), member.astype(np.intp))


def refuse_unfit(model: StateSpace) -> None:
    """Raise OptionError for a model that an FMU of a linear continuous system cannot stand for."""
    if model.is_discrete:
        raise OptionError(f"an FMU takes a continuous model, and this one has steps of {model.dt} s: export the first")
    if model.delay:
        raise OptionError(
            f"an FMU has no dead time, and this model has {model.delay} s: set its delay to zero and put the dead time"
            " in front of the FMU, in the tool that reads it"
        )
    if not len(model.outputs):
        raise OptionError("a model without outputs has no results: name at least one")
    if not all(np.isfinite(X).all() for X in (model.A, model.B, model.C, model.D)):
        raise OptionError("the matrices of the model have entries that are not finite")
    sizes = blocks_of(model.A).sizes
    if len(sizes) and sizes.max() > LARGEST_BLOCK:
        raise OptionError(
            f"{sizes.max()} states are coupled with each other, at most {LARGEST_BLOCK} can be: reduce the model, or"
            " take its modal form"
        )


def balance(A: Array, blocks: Blocks) -> Array:
    """Powers of two s (n,) for which s_i^-1 A_ij s_j has rows and columns of like size (Parlett and Reinsch 1969)."""
    scale = np.ones(len(A))
    for k in np.flatnonzero(blocks.sizes > 1):
        states = blocks.member[blocks.first[k] : blocks.first[k + 1]]
        _, (factor, _) = la.matrix_balance(A[np.ix_(states, states)], permute=False, separate=True)
        scale[states] = factor
    return scale


def pole_sizes(A: Array, blocks: Blocks) -> Array:
    """|eigenvalues| (n,) of A, rad/s, block by block; zeros to round-off come out as zero."""
    size = np.zeros(len(A))
    for k in range(len(blocks.sizes)):
        span = slice(blocks.first[k], blocks.first[k + 1])
        states = blocks.member[span]
        size[span] = np.abs(la.eigvals(A[np.ix_(states, states)]))
    return np.where(size > 1e-9 * size.max(initial=0.0), size, 0.0)


def nominals(model: StateSpace, blocks: Blocks) -> tuple[Array, Array]:
    """Ordinary sizes (n,), (p,) of states and outputs under inputs of typical size.

    They are 2 |(s - A)^-1 B| u at real s as large as the eigenvalues: away from resonance, and of the right ratio
    between displacements and velocities. 1 for what no input moves.
    """
    u = np.array([TYPICAL_INPUT.get(c.quantity, 1.0) for c in model.inputs])
    x = np.zeros(model.order)
    for k in range(len(blocks.sizes)):
        states = blocks.member[blocks.first[k] : blocks.first[k + 1]]
        A, B = model.A[np.ix_(states, states)], model.B[states]
        size = np.abs(la.eigvals(A))
        size = np.unique(size[size > 1e-9 * max(size.max(), 1e-300)])
        if len(size) and B.any():
            s = size[np.unique(np.linspace(0, len(size) - 1, 8).astype(int))]
            s = s if (la.eigvals(A).real <= 0).all() else 2 * size[-1:]
            response = np.linalg.solve(s[:, None, None] * np.eye(len(states)) - A, B)
            x[states] = 2 * (np.abs(response) @ u).max(axis=0)
    y = np.abs(model.C) @ x + np.abs(model.D) @ u
    return _ordinary(x), _ordinary(y)


def _ordinary(size: Array) -> Array:
    """Sizes to two digits; 1 where there is none."""
    return np.array([float(f"{v:.1e}") if np.isfinite(v) and v > 1e-30 else 1.0 for v in size])


SOURCES = ("fmi2.c", "step.c", "model.c")
HEADERS = ("fmi2.h", "step.h", "model.h")
FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-Wall", "-Wextra", "-Werror")
PLATFORMS = {("linux", "x86_64"): ("linux64", ".so")}


def c_sources(model: StateSpace, guid: str) -> dict[str, str]:
    """All C files of a model by name: fixed ones, and `model.c` with its numbers."""
    folder = files("flexura.io.fmu") / "sources"
    fixed = {name: (folder / name).read_text(encoding="utf-8") for name in (*SOURCES, *HEADERS) if "model" not in name}
    return {**fixed, "model.h": f'#define MODEL_GUID "{guid}"\n', "model.c": model_data(model)}


def model_data(model: StateSpace) -> str:
    """`model.c`: the numbers of a model, each as the shortest decimal text that reads back to the same double."""
    blocks = blocks_of(model.A)
    x, _ = nominals(model, blocks)
    matrices = {name: sp.csr_matrix(getattr(model, name)) for name in "ABCD"}
    sizes = blocks.sizes
    largest, squares = int(sizes.max(initial=1)), int((sizes**2).sum())
    scale = balance(model.A, blocks)
    lines = ['#include "step.h"\n']
    for name, matrix in matrices.items():
        lines += [
            _integers(f"{name}_start", matrix.indptr),
            _integers(f"{name}_column", matrix.indices),
            _doubles(f"{name}_value", matrix.data),
        ]
    lines += [
        _integers("first", blocks.first),
        _integers("member", blocks.member),
        _integers("offset", np.concatenate([[0], np.cumsum(sizes**2)])),
        _integers("place", _places(blocks)),
        _doubles("scale", scale),
        _doubles("start", np.zeros(model.order)),
        _doubles("nominal", x),
    ]
    counts = f"{model.order}, {len(model.inputs)}, {len(model.outputs)}, {len(sizes)}, {largest}, {squares}"
    rows = ", ".join(f"{{{name}_start, {name}_column, {name}_value}}" for name in matrices)
    lines += [f"const Model flexura_model = {{{counts}, {rows}, first, member, offset, place, scale, start, nominal}};"]
    return "\n".join(lines) + "\n"


def _places(blocks: Blocks) -> Index:
    place = np.empty_like(blocks.member)
    place[blocks.member] = np.arange(len(blocks.member)) - np.repeat(blocks.first[:-1], blocks.sizes)
    return place


def _integers(name: str, values: NDArray[Any]) -> str:
    return f"static const int {name}[] = {{{_lines([str(int(v)) for v in values] or ['0'])}}};"


def _doubles(name: str, values: Array) -> str:
    return f"static const double {name}[] = {{{_lines([repr(float(v)) for v in values] or ['0.0'])}}};"


def _lines(words: list[str]) -> str:
    return ",\n  ".join(", ".join(words[k : k + 8]) for k in range(0, len(words), 8))


def binary_place(identifier: str) -> str:
    """Where the shared library for this machine stands in an FMU. Raises OptionError on others."""
    system = "linux" if sys.platform.startswith("linux") else sys.platform
    target = PLATFORMS.get((system, platform.machine()))
    if target is None:
        raise OptionError(
            f"shared libraries are built on Linux x86_64 only, not on {sys.platform} {platform.machine()}:"
            " `binary=False` writes an FMU with sources alone, which tools can compile"
        )
    return f"binaries/{target[0]}/{identifier}{target[1]}"


def shared_library(sources: dict[str, str]) -> bytes:
    """The sources compiled and linked by the system's C compiler. Raises OptionError when there is none."""
    name = os.environ.get("CC", "cc")
    compiler = shutil.which(name) or shutil.which("gcc")
    if compiler is None:
        raise OptionError(
            f"there is no C compiler {name!r}: install one (Debian: apt install gcc libc6-dev), or write the FMU with"
            " sources alone (`binary=False`)"
        )
    with scratch_folder() as folder:
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, "-o", "model.bin", *SOURCES, "-lm"]
        env = {**os.environ, "TMPDIR": str(folder)}  # the compiler's own files go with the folder
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=env)
        if done.returncode:
            output = " ".join(done.stderr.split())[:300]
            raise OptionError(
                f"the C compiler {compiler} failed (Debian: apt install gcc libc6-dev has all it needs): {output}"
            )
        return (folder / "model.bin").read_bytes()
