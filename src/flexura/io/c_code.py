"""C99 for microcontrollers: the steps of a state space, of an observer or of an input shaper, in float32.

Two files of fixed size and cost, without library calls: `NAME.h` says what is in it and how far it may be from double
precision, `NAME.c` has its numbers. Written with the rules of MISRA C:2012 in mind (docs/export.md).
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from flexura._version import __version__
from flexura.analysis import Observer, Shaper
from flexura.errors import OptionError
from flexura.files import complete_files
from flexura.systems import UNIT, SinglePrecision, StateSpace, rounded_up, single_precision
from flexura.tables import in_hz, number

LONGEST_NAME = 16
"""Characters of a prefix, so that names of C differ within the 31 that C99 promises."""

WIDTH = 100

HEADER = Template("""\
/*
$comment
 */
#ifndef ${NAME}_H
#define ${NAME}_H

$sizes

typedef struct {
$members
} ${name}_state;

#ifdef __cplusplus
extern "C" {
#endif

$functions

#ifdef __cplusplus
}
#endif

#endif
""")

GUARD = """\
#ifdef __FAST_MATH__
#error "sums of float are taken as they are written: compile without -ffast-math"
#endif
#if defined(__FLT_EVAL_METHOD__) && ((__FLT_EVAL_METHOD__ == 1) || (__FLT_EVAL_METHOD__ == 2))
#error "sums of float are to be rounded to float: compile with -mfpmath=sse"
#endif
"""

STEPS = Template("""\
#include "$name.h"

#include <stdint.h>

$GUARD
void ${name}_init(${name}_state *self)
{
    uint32_t i;

    for (i = 0U; i < ${NAME}_STATES; i++) {
        self->x[i] = 0.0f;
        self->rest[i] = 0.0f;
    }$forget
}

void ${name}_step(${name}_state *self, $arguments)
{
$tables
    float w[${NAME}_DRIVES];
    float change[${NAME}_STATES];
    uint32_t i;
    uint32_t j;

$gather
    for (i = 0U; i < ${NAME}_OUTPUTS; i++) {
        float sum = 0.0f;
        for (j = 0U; j < ${NAME}_DRIVES; j++) {
            sum += D[i][j] * w[j];
        }
        for (j = 0U; j < ${NAME}_STATES; j++) {
            sum += C[i][j] * self->x[j];
        }
        $result[i] = sum;
    }

    for (i = 0U; i < ${NAME}_STATES; i += 2U) {
        const float first = self->x[i];
        const float second = self->x[i + 1U];
        float upper = 0.0f;
        float lower = 0.0f;
        for (j = 0U; j < ${NAME}_DRIVES; j++) {
            upper += B[i][j] * w[j];
            lower += B[i + 1U][j] * w[j];
        }
        upper += A[i][0] * first;
        upper += A[i][1] * second;
        lower += A[i + 1U][0] * first;
        lower += A[i + 1U][1] * second;
        change[i] = upper;
        change[i + 1U] = lower;
    }

    /* x += change, and what the sum loses is carried in rest */
    for (i = 0U; i < ${NAME}_STATES; i++) {
        const float before = self->x[i];
        const float own = self->rest[i] + change[i];
        const float total = before + own;
        const float part = total - before;
        const float kept = total - part;
        self->rest[i] = (before - kept) + (own - part);
        self->x[i] = total;
    }$shift
}
""")


SHAPER = Template("""\
#include "$name.h"

#include <stdint.h>

void ${name}_init(${name}_state *self, float start)
{
    uint32_t i;

    for (i = 0U; i < ${NAME}_LENGTH; i++) {
        self->before[i] = start;
    }
    self->at = 0U;
}

float ${name}_step(${name}_state *self, float command)
{
    static const uint32_t late[${NAME}_WEIGHTS] = {
$late
    };
$weights
    float sum = 0.0f;
    uint32_t i;

    self->before[self->at] = command;
    for (i = 0U; i < ${NAME}_WEIGHTS; i++) {
        uint32_t place = self->at + (${NAME}_LENGTH - late[i]);
        if (place >= ${NAME}_LENGTH) {
            place -= ${NAME}_LENGTH;
        }
        sum += weight[i] * self->before[place];
    }
    self->at += 1U;
    if (self->at >= ${NAME}_LENGTH) {
        self->at = 0U;
    }

    return sum;
}
""")


def write_c(what: StateSpace | SinglePrecision | Observer | Shaper, path: str | Path) -> list[Path]:
    """Write `NAME.c` and `NAME.h` for the path NAME.c; names in C begin with NAME.

    Raises OptionError for names that are none in C, for what `single_precision` refuses, and when the files cannot be
    written.
    """
    path = Path(path)
    name = prefix_of(path)
    if isinstance(what, Shaper):
        header, source = _shaper_in_c(what, name)
    elif isinstance(what, Observer):
        header, source = _steps_in_c(single_precision(what.estimator), name, len(what.sensors))
    else:
        header, source = _steps_in_c(single_precision(what) if isinstance(what, StateSpace) else what, name)
    with complete_files(path.parent) as scratch:
        (scratch / f"{name}.h").write_text(header, encoding="ascii")
        (scratch / f"{name}.c").write_text(source, encoding="ascii")
    return [path.with_name(f"{name}.c"), path.with_name(f"{name}.h")]


def prefix_of(path: Path) -> str:
    """The prefix of names in C. Raises OptionError for what is none."""
    name = path.stem
    if path.suffix != ".c" or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or len(name) > LONGEST_NAME:
        raise OptionError(
            f"{path.name}: names in C begin with that of the file, NAME.c, which is a letter, then letters, digits and"
            f" underscores, {LONGEST_NAME} at most"
        )
    return name


def _header(name: str, lines: Sequence[str], sizes: dict[str, int], members: Sequence[str], functions: str) -> str:
    """The header: what is in it, its sizes, its state and its functions."""
    return HEADER.substitute(
        name=name,
        NAME=name.upper(),
        comment=comment(lines),
        sizes="\n".join(f"#define {name.upper()}_{size} {count}U" for size, count in sizes.items()),
        members="\n".join(f"    {line}" for line in members),
        functions=functions,
    )


def _steps_in_c(of: SinglePrecision, name: str, readings: int = 0) -> tuple[str, str]:
    """Header and source of a model in float32, or of an observer, whose last inputs are readings."""
    NAME, before = name.upper(), of.steps_before * len(of.inputs)
    known = len(of.inputs) - readings
    ends = [("u", "INPUTS", known), ("y", "READINGS", readings)] if readings else [("u", "INPUTS", known)]
    ends = [end for end in ends if end[2]]
    result = "xhat" if readings else "y"
    words = [*(f"const float {word}[{NAME}_{size}]" for word, size, _ in ends), f"float {result}[{NAME}_OUTPUTS]"]
    arguments = (",\n" + " " * len(f"void {name}_step(")).join(words)
    what = (
        "Estimates xhat of the next sample from inputs u, held until then, and readings y of this one."
        if readings
        else "Outputs y of this step under inputs u, which are held until the next."
    )
    sizes = {size: count for _, size, count in ends}
    sizes |= {"OUTPUTS": len(of.outputs), "STATES": of.order, "DRIVES": of.B.shape[1]}
    sizes |= {"BEFORE": before} if before else {}
    members = [f"float x[{NAME}_STATES];", f"float rest[{NAME}_STATES];"]
    members += [f"float before[{NAME}_BEFORE];"] if before else []
    functions = f"/* At rest. */\nvoid {name}_init({name}_state *self);\n\n"
    functions += f"/* {what} */\nvoid {name}_step({name}_state *self, {arguments});"
    words = [(word, k) for word, _, count in ends for k in range(count)]
    header = _header(name, _about(of, words, result), sizes, members, functions)
    tables = {"A": of.change.reshape(-1, 2), "B": of.B, "C": of.C, "D": of.D}
    source = STEPS.substitute(
        name=name,
        NAME=NAME,
        GUARD=GUARD,
        arguments=arguments,
        result=result,
        tables="\n".join(table(key, of) for key, of in tables.items()),
        forget=_loop(f"{NAME}_BEFORE", "self->before[i] = 0.0f;") if before else "",
        gather="\n".join(_gather(NAME, ends, before)),
        shift=_loop(f"{NAME}_BEFORE", "self->before[i] = w[i];") if before else "",
    )
    return header, source


def _shaper_in_c(of: Shaper, name: str) -> tuple[str, str]:
    """Header and source of an input shaper."""
    NAME, weights = name.upper(), of.weights.astype(np.float32)
    terms = (len(weights) + 1) * UNIT
    off = float(np.abs(weights - of.weights).sum() + terms / (1 - terms) * np.abs(weights).sum())
    modes = zip(of.modes, of.frequency_hz.tolist(), of.damping_ratio.tolist(), strict=True)
    lines = [
        f"{of.name}: {of.kind} input shaper in steps of {number(of.dt, 9)} s, written by flexura {__version__}.",
        "",
        *(f"mode {k}, {in_hz(f, 6)}, damping ratio {number(z, 4)}" for k, f, z in modes),
        "",
        *of.notes,
        f"What is commanded arrives {number(of.duration, 6)} s later. Results differ from those in exact arithmetic by",
        f"at most {rounded_up(off)} of the largest command.",
    ]
    sizes = {"WEIGHTS": len(weights), "LENGTH": int(of.steps[-1]) + 1}
    functions = f"/* At rest where all commands were start. */\nvoid {name}_init({name}_state *self, float start);\n\n"
    functions += f"/* The shaped command. */\nfloat {name}_step({name}_state *self, float command);"
    members = [f"float before[{NAME}_LENGTH];", "uint32_t at;"]
    header = _header(name, lines, sizes, members, functions)
    header = header.replace(f"#define {NAME}_H\n", f"#define {NAME}_H\n\n#include <stdint.h>\n", 1)
    late = "\n".join(_folded(", ".join(f"{k}U" for k in of.steps.tolist())))
    source = SHAPER.substitute(name=name, NAME=NAME, late=late, weights=table("weight", weights))
    return header, source


def _gather(NAME: str, ends: Sequence[tuple[str, str, int]], before: int) -> Iterator[str]:
    """Inputs, and those of steps before, as one array."""
    at = ""
    for word, size, _ in ends:
        yield _loop(f"{NAME}_{size}", f"w[i{at}] = {word}[i];").lstrip("\n")
        at += f" + {NAME}_{size}"
    if before:
        yield _loop(f"{NAME}_BEFORE", f"w[i{at}] = self->before[i];").lstrip("\n")


def _loop(count: str, line: str) -> str:
    return f"\n    for (i = 0U; i < {count}; i++) {{\n        {line}\n    }}"


def _about(of: SinglePrecision, words: Sequence[tuple[str, int]], result: str) -> list[str]:
    """What the header says of a model, whose inputs go by these words and whose outputs by that of the result."""
    lines = [f"{of.name}: one step of {number(of.dt, 9)} s in float32, written by flexura {__version__}.", ""]
    inputs = [f"{word}[{k}]" for word, k in words]
    lines += [f"{word}  {c.name}, {c.quantity} [{c.unit}]" for word, c in zip(inputs, of.inputs, strict=True)]
    lines += ["", *(f"{result}[{k}]  {c.name}, {c.quantity} [{c.unit}]" for k, c in enumerate(of.outputs))]
    lines += ["", *of.notes, "", "From rest, at all times, and for every input, results differ from those of the"]
    lines += ["model in exact arithmetic, inputs being what is given as float, by at most"]
    for k, row in enumerate(of.bound):
        terms = [f"{rounded_up(b)} max|{word}|" for word, b in zip(inputs, row.tolist(), strict=True) if b]
        lines.append(f"  {result}[{k}]: {' + '.join([*terms, rounded_up(float(of.floor[k]))])}")
    lines.append(f"which is at most {rounded_up(of.share, 2)} of the largest response of each channel. That needs sums")
    lines.append("rounded to float as IEEE 754 has them; contracted products and sums may be, and numbers below")
    lines.append("2^-126 may be taken as zero.")
    return lines


def comment(lines: Sequence[str]) -> str:
    """Lines of a comment in ASCII that do not end it."""
    found: list[str] = []
    for line in lines:
        plain = (
            re.sub(r"[*\\?]|//", "_", line.replace("µ", "u").replace("°", " deg")).encode("ascii", "replace").decode()
        )
        plain = plain.replace("?", "_").rstrip()
        found += [f" * {own}".rstrip() for own in textwrap.wrap(plain, WIDTH - 3, subsequent_indent="    ") or [""]]
    return "\n".join(found)


def table(name: str, of: Any) -> str:
    """A constant array (n, m) or (n,), each number with the nine digits that give it back."""
    shape = "".join(f"[{size}]" for size in of.shape)
    rows = [", ".join(map(single, row)) for row in np.atleast_2d(of)]
    lines = [f"{{{row}}}" for row in rows] if of.ndim == 2 else rows
    wrapped = [own for line in lines for own in _folded(line)]
    return f"    static const float {name}{shape} = {{\n" + "\n".join(wrapped) + "\n    };"


def _folded(line: str) -> list[str]:
    return textwrap.wrap(line + ",", WIDTH, initial_indent=" " * 8, subsequent_indent=" " * 9)


def single(x: Any) -> str:
    """A number as a constant of type float."""
    text = f"{float(x):.9g}"
    return f"{text}{'' if '.' in text or 'e' in text else '.0'}f"
