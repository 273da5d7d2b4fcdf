"""C code of a linear model for an FMU, and its shared library."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from importlib.resources import files
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.arrays import Index
from flexura.errors import OptionError
from flexura.files import scratch_folder
from flexura.io.linear import Array, Blocks, balance, blocks_of, nominals
from flexura.systems import StateSpace

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
    found = PLATFORMS.get((system, platform.machine()))
    if found is None:
        raise OptionError(
            f"shared libraries are built on Linux x86_64 only, not on {sys.platform} {platform.machine()}:"
            " `binary=False` writes an FMU with sources alone, which tools can compile"
        )
    return f"binaries/{found[0]}/{identifier}{found[1]}"


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
            said = " ".join(done.stderr.split())[:300]
            raise OptionError(
                f"the C compiler {compiler} failed (Debian: apt install gcc libc6-dev has all it needs): {said}"
            )
        return (folder / "model.bin").read_bytes()
