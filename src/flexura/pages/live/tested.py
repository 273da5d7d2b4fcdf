"""A test that a page has open: poles at every order, those that are picked, and the modes that these give.

All that is worked out is what `identify` would return for the same picks and options.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, TypeAdapter

from flexura.errors import OptionError, SolverError
from flexura.io import described_in, read_measurement, write_modes
from flexura.linalg import ranked
from flexura.pages.live.designs import Finite, Message, Name, told, understood
from flexura.pages.live.opened import target_of
from flexura.pages.live.session import Outbox, PageSession, Worker
from flexura.pages.viewer import Buffer, scene_of_test, to_message
from flexura.results import plain
from flexura.tables import Table, percent
from flexura.testing.identification import (
    Select,
    Stabilisation,
    frfs_of,
    has_outputs_alone,
    mode_indicators,
    modes_of_setup,
    stabilisation,
)
from flexura.testing.measurement import IdentifiedModes, Measurement, Repeated, ResponseMatrix

KEPT = 4
"""Diagrams of other options that are kept."""

SUFFIXES = (".json", ".csv", ".uff")
"""Of files that modes are saved in."""


class Options(Message):
    """How poles are found, as `identify` has it."""

    band: tuple[Finite, Finite] | None = None
    order: Annotated[int, Field(ge=2, le=500)] | None = None
    setups: Literal["each", "together"] = "each"
    method: Literal["plscf", "ssi"] | None = None

    @property
    def command(self) -> list[str]:
        """The same as options of the shell."""
        words = [] if self.band is None else ["--band", f"{self.band[0]:g},{self.band[1]:g} Hz"]
        words += [] if self.order is None else ["--order", str(self.order)]
        words += [] if self.setups == "each" else ["--setups", self.setups]
        return words + ([] if self.method is None else ["--method", self.method])


class Choose(Message):
    """Picks, each a frequency, Hz, and a model order or none; without a list modes are chosen by themselves. `setup`
    and `pair` (output, input) say by position what is shown of the responses."""

    type: Literal["choose"]
    serial: Annotated[int, Field(ge=0)]
    options: Options = Options()
    picks: Annotated[list[tuple[Finite, int | None]], Field(max_length=200)] | None = None
    refine: bool = True
    setup: Annotated[int, Field(ge=0)] = 0
    pair: tuple[int, int] | None = None

    @property
    def select(self) -> Select | None:
        """The picks as `identify` takes them."""
        return None if self.picks is None else [hz if n is None else (hz, n) for hz, n in self.picks]

    @property
    def command(self) -> list[str]:
        """What gives the same modes in the shell, behind the file."""
        picks = [f"{hz:.9g}" if n is None else f"{hz:.9g}@{n}" for hz, n in self.picks or ()]
        words = ["--select", f"{','.join(picks)} Hz"] if picks else []
        return [*words, *self.options.command, *([] if self.refine else ["--no-refine"])]


class Keep(Message):
    """A file to be written beside the data, of the modes that are shown."""

    type: Literal["save"]
    file: Name
    serial: Annotated[int, Field(ge=0)]
    overwrite: bool = False


_READER: TypeAdapter[Choose | Keep] = TypeAdapter(Annotated[Choose | Keep, Field(discriminator="type")])


@dataclass(frozen=True)
class OpenedTest:
    """What was read of measured data, and the `files` that it was read from; `revision` counts readings."""

    path: Path
    channels: Path | None
    repeated: Repeated | None
    revision: int
    data: Measurement
    files: tuple[Path, ...]
    _kept: dict[str, Stabilisation] = field(default_factory=dict)

    @staticmethod
    def of(path: Path, channels: Path | None, repeated: Repeated | None, revision: int = 1) -> OpenedTest:
        """Read the data. Raises FlexuraError for those that cannot be read, or hold nothing to identify modes from."""
        data = read_measurement(path, channels, repeated=repeated)
        if not has_outputs_alone(data):
            data = replace(data, frfs=tuple(frfs_of(data)[1]))
        beside = described_in(path, channels)
        files = (path,) if beside is None else (path, beside)
        own = OpenedTest(path, channels, repeated, revision, data, files)
        with suppress(SolverError):  # of another band or order there may be poles
            own.poles(Options())
        return own

    @property
    def name(self) -> str:
        """That of the test."""
        return self.data.name

    def again(self) -> OpenedTest:
        """What the files hold now. Raises FlexuraError as `of`."""
        return OpenedTest.of(self.path, self.channels, self.repeated, self.revision + 1)

    def files_now(self) -> tuple[Path, ...]:
        """The files that there are to be read now."""
        return self.files

    def greetings(self) -> list[tuple[str, str | bytes]]:
        """What a page is told first."""
        own = {"revision": self.revision, "name": self.name, "file": self.path.name, "notes": self.data.notes}
        return [("opened", told("opened", **own))]

    def poles(self, options: Options) -> Stabilisation:
        """Poles of all orders, found once for the same options. Raises OptionError and SolverError."""
        key = options.model_dump_json()
        if key not in self._kept:
            found = stabilisation(self.data, **options.model_dump())
            while len(self._kept) >= KEPT:
                self._kept.pop(next(iter(self._kept)))
            self._kept[key] = found
        return self._kept[key]


class PickSession(PageSession):
    """A page of a test: modes are worked out of what is picked."""

    read: Callable[[str], Any] = staticmethod(lambda text: understood(_READER, text))

    def __init__(self, worker: Worker, opened: Callable[[], OpenedTest], outbox: Outbox) -> None:
        super().__init__(worker, outbox)
        self._opened = opened
        self._drawn: tuple[Stabilisation, int] | None = None
        self._shown: tuple[int, IdentifiedModes] | None = None

    def receive(self, message: Choose | Keep) -> None:
        """Have done what the page asks for."""
        if isinstance(message, Keep):
            own = message
            self._worker.submit((self._key, "save"), lambda: self._saved(own.file, lambda: self._save(own)))
        else:
            self._worker.submit(self._key, lambda: self._choose(message))

    def _choose(self, ask: Choose) -> None:
        self._shown = None
        try:
            opened = self._opened()
            poles = opened.poles(ask.options)
            k = min(ask.setup, len(poles.setups) - 1)
            if self._drawn is None or self._drawn[0] is not poles or self._drawn[1] != k:
                self._say("diagram", **diagram(poles, k))
                self._drawn = poles, k
            modes = poles.modes(ask.select, refine=ask.refine)
            message = to_message({"type": "modes", **chosen(opened, ask, poles.setups[k].matrix, modes, k)})
        except Exception as error:  # whatever it is, the page is told and the others go on
            self._say("no modes", serial=ask.serial, text=str(error) or type(error).__name__)
        else:
            self._shown = ask.serial, modes
            self.outbox.put("modes", message)

    def _save(self, own: Keep) -> Path:
        """Write the modes that are shown, as `identify` would."""
        if self._shown is None or self._shown[0] != own.serial:
            raise OptionError("there are no modes of these picks to be saved")
        opened = self._opened()
        return write_modes(self._shown[1], target_of(opened.path, own.file, SUFFIXES, opened.files, own.overwrite))


def diagram(poles: Stabilisation, k: int) -> dict[str, Any]:
    """Plain data: all poles of a setup by frequency, the first mode indicator function, and what was measured."""
    setup = poles.setups[k]
    found, matrix = setup.diagram, setup.matrix
    at = np.argsort(found.frequency_hz, kind="stable")
    return {
        "poles": {
            "hz": found.frequency_hz[at],
            "order": found.order[at],
            "damping": found.damping_ratio[at],
            "stable": found.stable[at],
        },
        "indicator": {"hz": matrix.frequency_hz, "values": mode_indicators(matrix)[:, 0]},
        "setups": [own.matrix.setup or f"setup {n}" for n, own in enumerate(poles.setups, 1)],
        "setup": k,
        "outputs": [c.name for c in matrix.outputs],
        "inputs": [c.name for c in matrix.inputs],
    }


def chosen(opened: OpenedTest, ask: Choose, matrix: ResponseMatrix, modes: IdentifiedModes, k: int) -> dict[str, Any]:
    """What a page is told of modes: their table, a response beside what they give back of it, shapes, and how the shell
    gives the same."""
    own = modes.setups[k] if modes.setups else modes
    i, j = ask.pair or (0, 0)
    p, m = matrix.response.shape[1:]
    if ask.pair is None or not (0 <= i < p and 0 <= j < m):
        i, j = divmod(int(ranked(np.abs(matrix.scaled).max(axis=0).ravel())[0]), m)
    measured, back = matrix.response[:, i, j], modes_of_setup(own, matrix)[:, i, j]
    curves = [part for H in (measured, back) for part in (np.abs(H), np.degrees(np.angle(H)))]
    try:
        scene, told_of_shapes = scene_of_test(modes), ""
    except OptionError as error:
        scene, told_of_shapes = None, str(error)
    table = next(item for item in modes.presentation() if isinstance(item, Table))
    return {
        "serial": ask.serial,
        "columns": plain(table.columns),
        "hz": plain(own.frequency_hz),
        "misfit": percent(modes.synthesis_error, 2),
        "notes": modes.notes,
        "pair": [i, j],
        "curves": Buffer.floats([matrix.frequency_hz, *curves]),
        "scene": scene,
        "shapes": told_of_shapes,
        "command": shlex.join(["flexura", "identify", opened.path.name, *ask.command]),
    }
