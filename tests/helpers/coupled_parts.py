"""Two described parts and the assembly of both as one mechanism, and responses from closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

import flexura as fx
from flexura.structure import Channel

DOFS = ("tx", "ty", "tz", "rx", "ry", "rz")
HZ = np.linspace(20.0, 3000.0, 60)

_HEAD = """
materials: {al: Al-7075-T6}
sections: {bar: {shape: rectangle, width: 12 mm, thickness: 8 mm}}
damping: {loss_factor: 0.01}
corrections: none
"""
_FRAME = """
  one: {nodes: [root, mid], material: al, section: bar, reference: [0, 1, 2], elements: 2}
  two: {nodes: [mid, tip], material: al, section: bar, reference: [0, 1, 2], elements: 2}"""
_ARM = """
  three: {nodes: [START, side], material: al, section: bar, reference: [0, 1, 0], elements: 2}
  four: {nodes: [side, end], material: al, section: bar, reference: [0, 1, 0], elements: 2}"""
_FRAME_NODES = "root: [0, 0, 0], mid: [50 mm, 10 mm, 0], tip: [100 mm, 0, 0]"
_ARM_NODES = "side: [120 mm, 0, 60 mm], end: [200 mm, 0, 0]"
_HELD = "\nground: {root: clamped}\n"

FRAME = f"{_HEAD}nodes: {{{_FRAME_NODES}}}\nlinks:{_FRAME}{_HELD}"
ARM = f"{_HEAD}nodes: {{start: [100 mm, 0, 0], {_ARM_NODES}}}\nlinks:{_ARM.replace('START', 'start')}\n"
WHOLE = f"{_HEAD}nodes: {{{_FRAME_NODES}, {_ARM_NODES}}}\nlinks:{_FRAME}{_ARM.replace('START', 'tip')}{_HELD}"

FRAME_NAMES = [*(f"tip.{dof}" for dof in DOFS), "mid.ty"]
ARM_NAMES = [*(f"start.{dof}" for dof in DOFS), "end.tz", "side.tx"]
WHOLE_NAMES = [*FRAME_NAMES, "end.tz", "side.tx"]


@cache
def response(text: str, names: tuple[str, ...], quantity: str = "accelerance") -> fx.FrequencyResponse:
    """That of a described part, solved directly at full order."""
    ends = {"inputs": list(names), "outputs": list(names)}
    return fx.frequency_response(
        fx.loads(text), frequency_hz=HZ, **ends, quantity=quantity, order="full", method="direct"
    )


def frame() -> fx.FrequencyResponse:
    return response(FRAME, tuple(FRAME_NAMES))


def arm() -> fx.FrequencyResponse:
    return response(ARM, tuple(ARM_NAMES), "receptance")


def whole() -> fx.FrequencyResponse:
    return response(WHOLE, tuple(WHOLE_NAMES))


def given(hz: np.ndarray, H: np.ndarray, inputs: Sequence[Channel], outputs: Sequence[Channel]) -> fx.FrequencyResponse:
    """A response of numbers."""
    return fx.FrequencyResponse("given", hz, H, tuple(inputs), tuple(outputs), hz[:0], hz[:0], 0)


def along(names: Sequence[str], hz: np.ndarray, H: np.ndarray, quantity: str = "displacement") -> fx.FrequencyResponse:
    """A response of numbers (f, n, n) between forces and motions of the same names, of which no place is known."""
    return given(hz, H, [Channel(n, "force") for n in names], [Channel(n, quantity) for n in names])
