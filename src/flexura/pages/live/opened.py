"""The file that a page has open: read, watched, and varied into new files beside it.

What a page asks of a mechanism when it is opened: responses, bands and loads that make sense for it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from flexura.analysis import motions
from flexura.errors import FlexuraError, OptionError
from flexura.expressions import Expression
from flexura.files import write_file
from flexura.full_order import plan_of
from flexura.linalg import Eigenpairs
from flexura.mechanism import DOF_NAMES
from flexura.modelfile import Changed, files_of, load, variant_text
from flexura.pages.live.described import Described, notes_of
from flexura.pages.live.designs import told
from flexura.pages.live.sliders import parameters_of
from flexura.reduction import HERTZ
from flexura.structure import FullOrderModel, Ports

BEYOND = 1.6
"""The band of a response ends so many times above the highest frequency shown, and begins as far below the lowest."""

STROKE = 0.01
"""Stroke that is assumed where none is described, over the longest side."""


def questions(model: FullOrderModel, found: Eigenpairs, n: int) -> dict[str, Any]:
    """Plain data: names of `inputs` and `outputs`, the `response` to begin with, `loads` that are described, and the
    DOF whose motion a stroke is, with its amplitude, `assumed` where the file has none."""
    ports = Ports(model.design)
    places = list(_dofs(model, found))
    free = places[0] if places else ""
    limited = [i.channel.name for i in ports.inputs() if np.isfinite(i.limits).any()]
    inputs, outputs = [*ports.actuators, *places], [*ports.sensors, *places]
    hz = np.sqrt(np.maximum(found.values[:n], 0)) / HERTZ
    elastic = hz[hz > 0]
    low, high = (elastic[0] / 3, elastic[-1] * BEYOND) if len(elastic) else (1.0, 1000.0)
    first = {
        "input": next(iter(inputs), ""),
        "output": next((name for name in _motion_sensors(ports)), free),
        "low": float(f"{low:.2g}"),
        "high": float(f"{high:.2g}"),
    }
    kinds = ["described"] * model.plan.is_loaded + ["actuators"] * bool(limited)
    described = _stroke(model)
    dof, amplitude = described or (free, _assumed_stroke(model, free))
    return {
        "inputs": inputs,
        "outputs": outputs,
        "response": first if first["input"] and first["output"] else None,
        "loads": kinds + ["move"] * bool(free),
        "stroke": {"dof": dof, "amplitude": amplitude, "assumed": described is None},
    }


def _motion_sensors(ports: Ports) -> Iterator[str]:
    return (out.channel.name for out in ports.outputs() if out.row.any())


def _dofs(model: FullOrderModel, found: Eigenpairs) -> Iterator[str]:
    """DOFs of bodies, else of nodes of the mechanism itself, that of the largest part in the first mode first."""
    plan = model.plan
    names = {name: k for k, name in reversed(list(enumerate(plan.topology.node_names)))}
    nodes = [name for name in plan.mechanism.bodies if name in names] or [
        name for name in plan.mechanism.nodes if name in names
    ]
    if not nodes:
        return
    u = model.node_displacements(found.vectors[:, :1])
    own = motions(model, u)[0].bodies
    first = next((body for body in own if body.body in nodes), None)
    size = np.ptp(model.positions, axis=0).max() or 1.0
    if first is not None:
        nodes = [first.body, *(name for name in nodes if name != first.body)]
    for k, name in enumerate(nodes):
        held = model.plan.topology.dof[plan.topology.root[names[name]]] < 0
        moved = np.abs(u[names[name], :, 0]) * [1, 1, 1, size, size, size]
        order = np.argsort(-moved, kind="stable") if k == 0 else range(6)
        yield from (f"{name}.{DOF_NAMES[d]}" for d in order if not held[d])


def _assumed_stroke(model: FullOrderModel, dof: str) -> float:
    """STROKE of the longest side, m, or as many radians, to two digits."""
    size = float(np.ptp(model.positions, axis=0).max())
    return float(f"{STROKE * (1.0 if dof[-2:] in ('rx', 'ry', 'rz') else size or 1e-3):.2g}")


def _stroke(model: FullOrderModel) -> tuple[str, float] | None:
    """The first DOF that the described motion moves, and how far, m or rad."""
    motion = model.plan.mechanism.motion
    for node, moved in (motion.move if motion is not None else {}).items():
        for axis in ("x", "y", "z", "rx", "ry", "rz"):
            ends = getattr(moved, axis)
            if ends is not None and all(isinstance(end, float) for end in ends):
                return f"{node}.{axis if axis[0] == 'r' else f't{axis}'}", max(map(abs, ends))
    return None


_NAME = re.compile(r"[^\W.][\w. ()+=,-]{0,120}")
"""What a new file may be called before its suffix: no folder, nothing hidden."""

Signature = tuple[tuple[str, tuple[int, ...] | None], ...]
"""Files, with what changes when they are written; None where a file is missing."""


@dataclass(frozen=True)
class Opened(Described):
    """What was read of a file. `files` are the file and those that it extends."""

    path: Path
    files: tuple[Path, ...]

    @property
    def name(self) -> str:
        """That of the mechanism."""
        return self.plan.name

    @staticmethod
    def of(path: Path, revision: int, modes: int) -> Opened:
        """Read the file. Raises FlexuraError for one that cannot be used."""
        mechanism = load(path)
        plan = plan_of(mechanism)
        own = Opened(plan, modes, notes_of(mechanism, plan), revision, path, files_of(path))
        _ = own.greeting, own.scene  # what cannot be solved or drawn as it is described is refused here
        return own

    def again(self) -> Opened:
        """What the file holds now. Raises FlexuraError as `of`."""
        return Opened.of(self.path, self.revision + 1, self.modes)

    def files_now(self) -> tuple[Path, ...]:
        """The files that there are to be read now."""
        return files_of(self.path)

    def greetings(self) -> list[tuple[str, str | bytes]]:
        """What a page is told of the file, by kind."""
        return [("scene", self.scene), ("opened", told("opened", **self.greeting))]

    @cached_property
    def greeting(self) -> dict[str, Any]:
        """What a page is told of the file: name, sliders, what may be asked, and notes; plain data."""
        plan, (model, found) = self.plan, self.reference
        copies = plan.topology.copies.items()
        return {
            "revision": self.revision,
            "name": plan.name,
            "file": self.path.name,
            "description": plan.mechanism.description,
            "sliders": [own.to_dict() for own in self.sliders.values()],
            "modes": self.modes,
            "notes": [*self.notes, *self.drawn[0].notes],
            **questions(model, found, self.modes + self.rigid),
            "members": sum(len(plan.parts[name].members) * len(own.paths) for name, own in copies),
        }

    def save(self, file: str, numbers: Mapping[str, float], overwrite: bool = False) -> Path:
        """Write a file beside the one that is open that extends it with these numbers of sliders.

        Raises FileExistsError unless it may `overwrite`, OptionError for names that are no such file or where nothing
        is changed, ModelError for designs that cannot be, and OptionError where it cannot be written.
        """
        target = target_of(self.path, file, (".yaml", ".yml"), self.files, overwrite)
        parameters = parameters_of(self.sliders, numbers)
        described = self.plan.parameter_values()
        changed = {name: value for name, value in parameters.items() if value != described[name]}
        if not changed:
            raise OptionError("nothing differs from the file: there is nothing to save")
        self.plan.verify(changed)
        own = {name: Changed(value, self._source(name)) for name, value in changed.items()}
        text = variant_text(self.plan.mechanism, f"{self.plan.name}, {target.stem}", self.path, target, own)
        return write_file(target, lambda part: part.write_text(text, encoding="utf-8", newline="\n"))

    def _source(self, name: str) -> str:
        """Where a changed value comes from, and what the file has."""
        value, own = self.plan.mechanism.parameters[name].value, self.sliders[name]
        before = str(value) if isinstance(value, Expression) else f"{own.value:.9g} {own.unit}".strip()
        return f"chosen on the live page; {self.path.name} has {before}"


def target_of(path: Path, file: str, suffixes: Sequence[str], files: Iterable[Path], overwrite: bool = False) -> Path:
    """Where a new file is written beside one that is open, of which nothing in `files` is replaced.

    Raises FileExistsError unless it may `overwrite`, and OptionError for names that are no plain ones.
    """
    target, suffix = path.absolute().parent / file, Path(file).suffix
    if suffix not in suffixes or not _NAME.fullmatch(file.removesuffix(suffix)):
        ends = f"{', '.join(suffixes[:-1])} or {suffixes[-1]}"
        raise OptionError(f"{file!r}: a plain file name that ends in {ends} is expected, without a folder")
    if target.is_symlink() or any(_same(target, own) for own in files):
        raise OptionError(f"{file} is the file that is open, one that it is read with, or a link: give another name")
    if os.path.lexists(target) and not overwrite:
        raise FileExistsError(file)
    return target


def signature(files: Iterable[Path]) -> Signature:
    """What changes when one of some files is written, comes or goes."""
    found = []
    for file in files:
        try:
            own = file.stat()
            found.append((str(file), (own.st_mtime_ns, own.st_size, own.st_ino)))
        except OSError:
            found.append((str(file), None))
    return tuple(found)


def problems_of(error: FlexuraError) -> list[dict[str, str]]:
    """What is wrong with a file, each with the line that it stands at."""
    problems = getattr(error, "problems", None)
    if problems is None:
        return [{"where": "", "text": str(error), "hint": ""}]
    return [
        {"where": p.where, "text": f"{p.place}: {p.rule}" + (f" (found {p.value})" if p.value else ""), "hint": p.hint}
        for p in problems
    ]


def _same(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except OSError:
        return False
