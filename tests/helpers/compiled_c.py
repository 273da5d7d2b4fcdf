"""C that is written for microcontrollers, compiled with every warning an error and run on signals."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

FLAGS = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wdouble-promotion", "-O2"]
NATIVE = (shutil.which("cc") or shutil.which("gcc") or "cc", [])
ARM = ("arm-linux-gnueabihf-gcc", ["qemu-arm", "-L", "/usr/arm-linux-gnueabihf"])
"""Compilers, and what runs their programs on this machine."""

MAIN = """
#include "NAME.h"
#include <stdio.h>
int main(void)
{
    static NAME_state one;
    float in[IN], out[OUT];
    NAME_init(&one);
    while (fread(in, sizeof in, 1, stdin) == 1) {
        NAME_step(&one, ARGUMENTS);
        fwrite(out, sizeof out, 1, stdout);
    }
    return 0;
}
"""


def has(target: tuple[str, Sequence[str]]) -> bool:
    """Whether a compiler and what runs its programs are there."""
    return all(shutil.which(program) for program in (target[0], *target[1][:1]))


def run(
    path: Path, inputs: np.ndarray, outputs: int, parts: Sequence[int] = (), target=NATIVE, flags: Sequence[str] = ()
) -> np.ndarray:
    """Outputs (k, outputs) of the steps in NAME.c under inputs (k, m), which come as arrays of so many `parts`."""
    name, m = path.stem, inputs.shape[1]
    starts = np.cumsum([0, *(parts or [m])])[:-1]
    arguments = ", ".join([*(f"in + {start}" for start in starts), "out"])
    text = MAIN.replace("NAME", name).replace("ARGUMENTS", arguments)
    main = path.with_name("main.c")
    main.write_text(text.replace("IN]", f"{m}]").replace("OUT]", f"{outputs}]"))
    program = path.with_name("program")
    subprocess.run([target[0], *FLAGS, *flags, "-o", program, path, main], check=True)
    done = subprocess.run(
        [*target[1], program], input=inputs.astype(np.float32).tobytes(), capture_output=True, check=True
    )
    return np.frombuffer(done.stdout, dtype=np.float32).reshape(-1, outputs)
