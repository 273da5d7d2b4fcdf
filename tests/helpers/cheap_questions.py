"""Questions whose answers are closed forms of the parameters, so that many designs take no time."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from flexura.errors import OptionError
from flexura.study.questions import Answers


@dataclass(frozen=True)
class CheapQuantity:
    """A quantity with a unit."""

    text: str
    unit: str
    is_bounded: bool = False

    @property
    def column(self) -> str:
        """Its heading."""
        return f"{self.text} [{self.unit}]"


@dataclass(frozen=True)
class Described:
    """What stands for a plan: a mechanism alone."""

    mechanism: Any


@dataclass(frozen=True)
class CheapQuestions:
    """`f1`, Hz, is a/b with bounds a part in a thousand apart, `mass`, kg, is a b; both fail where a > `limit`.

    A design takes `seconds`. A block with a design where `a` is between the two `deadly` values kills its process once
    for each file that is missing in `scratch`; one above `wrong` raises.
    """

    plan: Described
    limit: float = np.inf
    seconds: float = 0.0
    deadly: tuple[float, float] = (np.inf, np.inf)
    scratch: Path | None = None
    deaths: int = 0
    wrong: float = np.inf
    quantities: tuple[CheapQuantity, ...] = field(
        default=(CheapQuantity("f1", "Hz", is_bounded=True), CheapQuantity("mass", "kg"))
    )

    is_stacked = True

    @property
    def columns(self) -> tuple[str, ...]:
        """Headings."""
        return tuple(own.column for own in self.quantities)

    def values(self, parameters: Any) -> Answers:
        """Answers for designs."""
        a, b = np.broadcast_arrays(*(np.atleast_1d(parameters[name]) for name in ("a", "b")))
        time.sleep(self.seconds * len(a))
        if (a > self.wrong).any():
            raise OptionError("this cannot be")
        if ((a > self.deadly[0]) & (a < self.deadly[1])).any():
            self._die()
        answers = Answers.of(len(a), 2)
        good = a <= self.limit
        answers.value[good] = np.transpose([a / b, a * b])[good]
        answers.lower[:, 0], answers.upper[:, 0] = answers.value[:, 0] * 0.999, answers.value[:, 0] * 1.001
        answers.is_proven[:] = good & (a > 0.01)
        for number in np.flatnonzero(~good):
            answers.say(number, f"a = {a[number]:.3g} is too large")
        return answers

    def _die(self) -> None:
        for number in range(self.deaths):
            try:
                (self.scratch / f"died-{number}").touch(exist_ok=False)
            except FileExistsError:
                continue
            os.kill(os.getpid(), signal.SIGKILL)
