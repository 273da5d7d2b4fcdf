"""A portal frame that was hit: responses with noise, on points and lines of its own, one of them measured askew."""

from __future__ import annotations

from functools import cache

import numpy as np

import flexura as fx
from flexura.pages.viewer.motions import triple
from flexura.testing.measurement import MeasuredChannel, MeasuredFRF, Measurement

FRAME = """
flexura: 1
name: portal frame
materials: {al: Al-7075-T6}
sections: {bar: {shape: rectangle, width: 12 mm, thickness: 4 mm}}
nodes:
  a: [0, 0, 0]
  b: [0, 0, 75 mm]
  c: [0, 0, 150 mm]
  d: [100 mm, 0, 150 mm]
  e: [200 mm, 0, 150 mm]
  f: [200 mm, 0, 75 mm]
  g: [200 mm, 0, 0]
links:
  ab: {nodes: [a, b], material: al, section: bar, reference: [0, 1, 0], elements: 4}
  bc: {nodes: [b, c], material: al, section: bar, reference: [0, 1, 0], elements: 4}
  cd: {nodes: [c, d], material: al, section: bar, reference: [0, 1, 0], elements: 4}
  de: {nodes: [d, e], material: al, section: bar, reference: [0, 1, 0], elements: 4}
  ef: {nodes: [e, f], material: al, section: bar, reference: [0, 1, 0], elements: 4}
  fg: {nodes: [f, g], material: al, section: bar, reference: [0, 1, 0], elements: 4}
ground: {a: clamped, g: clamped}
"""
POINTS = "bcdef"
ASKEW = (0.6, 0.8, 0.0)
HITS, BAND = ("c.tx", "c.ty"), (50.0, 1200.0)


@cache
def frame() -> fx.Mechanism:
    return fx.loads(FRAME)


@cache
def measured_frame(seed: int = 1) -> Measurement:
    """Responses of x, y and z at five points, and along ASKEW in place of x at f, with noise at a half per cent."""
    model = frame()
    names = [f"{p}.t{axis}" for p in POINTS for axis in "xyz"]
    hz = np.arange(BAND[0], BAND[1], 0.5)
    H = fx.frequency_response(
        model, frequency_hz=hz, inputs=HITS, outputs=names, quantity="accelerance", damping=0.005, order="full"
    )
    response = H.response.copy()
    own, across = names.index("f.tx"), names.index("f.ty")
    response[:, own] = ASKEW[0] * response[:, own] + ASKEW[1] * response[:, across]
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((2, *response.shape)) * np.abs(response).mean(axis=0) / 200
    channels = {name: _channel(name, "acceleration") for name in names} | {n: _channel(n, "force") for n in HITS}
    outputs = tuple(_channel(name, "acceleration") for name in names)
    inputs = tuple(channels[name] for name in HITS)
    frf = MeasuredFRF(hz, response + noise[0] + 1j * noise[1], inputs, outputs)
    trace = tuple(_place(name) for name in "abcdefg")
    return Measurement("portal frame", (), (frf,), traces=(trace,))


def _channel(name: str, quantity: str) -> MeasuredChannel:
    node, _, axis = name.partition(".")
    along = ASKEW if name == "f.tx" else triple(np.eye(3)["xyz".index(axis[-1])])
    return MeasuredChannel(name, quantity, node, along, _place(node))


def _place(node: str) -> tuple[float, float, float]:
    return triple(np.array(frame().nodes[node], dtype=float))
