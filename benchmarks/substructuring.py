"""Coupling and virtual points beside pyFBS.

    python benchmarks/substructuring.py

pyFBS (pip install pyFBS) has the virtual point transformation; its examples couple by the formula of de Klerk, Rixen
and Voormeeren (2008) with NumPy's pseudo-inverse, which is done here in the same way. Without pyFBS its part is left
out, and it says so.
"""

from __future__ import annotations

import time
from importlib import import_module

import numpy as np

import flexura as fx
from flexura.structure import Channel

HZ = np.linspace(5.0, 2000.0, 2000)
POINT = np.array([0.04, 0.01, 0.062])
MOTIONS, LOADS = ("ux", "uy", "uz", "rx", "ry", "rz"), ("fx", "fy", "fz", "mx", "my", "mz")


def around(rng, count, name, quantity):
    """Channels at random places near the point in random directions."""
    directions = rng.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    places = POINT + 0.02 * rng.standard_normal((count, 3))
    ends = zip(directions.tolist(), places.tolist(), strict=True)
    return [Channel(f"{name}{k}", quantity, "tip", tuple(e), tuple(p)) for k, (e, p) in enumerate(ends)]


def given(H, inputs, outputs):
    return fx.FrequencyResponse("random", HZ, H, tuple(inputs), tuple(outputs), HZ[:0], HZ[:0], 0)


def modal(rng, outputs, inputs, modes=12):
    """Receptances (f, p, m) of random modes with 1 % of damping."""
    w = 2 * np.pi * np.sort(rng.uniform(50.0, 3000.0, modes))
    shapes, loads = rng.standard_normal((outputs, modes)), rng.standard_normal((modes, inputs))
    s = 2j * np.pi * HZ[:, None]
    return (shapes * (1 / (w**2 + 0.02 * s * w + s**2))[:, None, :]) @ loads


def of_pyfbs(channels, descriptions, pandas):
    """Channels and their virtual point as tables of pyFBS."""

    def row(name, position, direction, **more):
        at = {f"Position_{k + 1}": x for k, x in enumerate(position)}
        along = {f"Direction_{k + 1}": x for k, x in enumerate(direction)}
        return {"Name": name, "Quantity": "Acceleration", "Grouping": 1, **at, **along, **more}

    table = pandas.DataFrame([row(c.name, c.position, c.direction) for c in channels])
    point = pandas.DataFrame([row(text, POINT, (0, 0, 0), Description=text) for text in descriptions])
    return table, point


def beside_pyfbs(rng):
    """Largest differences of virtual points, and of consistency for one input, from those of pyFBS."""
    try:
        pandas, interface = import_module("pandas"), import_module("pyfbs.interface")
    except ImportError as error:
        print(f"pyFBS is left out: {error}")
        return
    sensors, impacts = around(rng, 12, "s", "acceleration"), around(rng, 15, "h", "force")
    H = modal(rng, 12, 15)
    (outs, to), (ins, by) = of_pyfbs(sensors, MOTIONS, pandas), of_pyfbs(impacts, LOADS, pandas)
    vpt = interface.VPT(outs, ins, to, by)
    vpt.apply_vpt(HZ, H)
    own = fx.virtual_points(given(H, impacts, sensors), {"tip": tuple(POINT)})
    print(f"virtual points, from pyFBS: {np.abs(own.response - vpt.frf).max() / np.abs(vpt.frf).max():.1e}")
    one = H.copy()
    one[:, :, 1:] = 0
    vpt.apply_vpt(HZ, one)
    vpt.consistency([1], [1])
    consistency = fx.virtual_points(given(one, impacts, sensors), {"tip": tuple(POINT)}).sensor_consistency
    found = np.array([own.mean() for own in consistency.values()])
    print(f"consistency of sensors for one input, from pyFBS: {np.abs(found - vpt.specific_sensor).max():.1e}")


def beside_formula(rng):
    """Largest difference from the formula with NumPy's pseudo-inverse, and times."""
    n = 30
    Y = [modal(rng, n, n, modes=60) for _ in range(2)]
    names = [f"{k}" for k in range(n)]
    parts = {
        part: given(y, [Channel(k, "force") for k in names], [Channel(k, "displacement") for k in names])
        for part, y in zip("AB", Y, strict=True)
    }
    B = np.hstack([np.eye(6, n), -np.eye(6, n)])
    begun = time.perf_counter()
    both = np.zeros((len(HZ), 2 * n, 2 * n), dtype=complex)
    both[:, :n, :n], both[:, n:, n:] = Y
    plain = both - both @ B.T @ np.linalg.pinv(B @ both @ B.T) @ B @ both
    formula = time.perf_counter() - begun
    begun = time.perf_counter()
    everything = [f"{part}.{k}" for part in "AB" for k in names]
    joins = [(f"A.{k}", f"B.{k}") for k in range(6)]
    own = fx.couple(parts, joins=joins, inputs=everything, outputs=everything)
    ours = time.perf_counter() - begun
    begun = time.perf_counter()
    fx.couple(parts, joins=joins, inputs=everything, outputs=everything, noise={"A": 1e-3})
    noisy = time.perf_counter() - begun
    print(f"coupling, from the formula: {np.abs(own.response - plain).max() / np.abs(plain).max():.1e}")
    print(f"{len(HZ)} lines, 60 channels, 6 joined: formula {formula:.2f} s, {ours:.2f} s, with scatter {noisy:.2f} s")


if __name__ == "__main__":
    rng = np.random.default_rng(1)
    beside_pyfbs(rng)
    beside_formula(rng)
