"""Masses on springs and dashpots that are disturbed, of which mean squares are known in closed form."""

from __future__ import annotations

import flexura as fx

ONE = """
name: one mass
bodies:
  block: {{centre: [0, 0, 0], mass: 2 kg, inertia: [1e-3 kg*m^2, 1e-3 kg*m^2, 1e-3 kg*m^2]}}
springs:
  spring: {{nodes: [block], stiffness: {{tx: 800 N/m}}}}
dashpots:
  damper: {{nodes: [block], damping: {{tx: 4 N*s/m}}}}
ground:
  block: {{free: [tx]}}
sensors:
  x: {{type: displacement, nodes: [block], direction: x}}
  v: {{type: velocity, nodes: [block], direction: x}}
  a: {{type: acceleration, nodes: [block], direction: x}}
disturbances: {disturbances}
"""
TWO = """
name: two masses
parameters:
  k2: 300 N/m
bodies:
  low: {{centre: [0, 0, 0], mass: 2 kg, inertia: [1e-3 kg*m^2, 1e-3 kg*m^2, 1e-3 kg*m^2]}}
  top: {{centre: [1 m, 0, 0], mass: 0.5 kg, inertia: [1e-3 kg*m^2, 1e-3 kg*m^2, 1e-3 kg*m^2]}}
springs:
  spring: {{nodes: [low], stiffness: {{tx: 800 N/m}}}}
  between: {{nodes: [low, top], stiffness: {{tx: k2}}}}
dashpots:
  damper: {{nodes: [low], damping: {{tx: 4 N*s/m}}}}
  inner: {{nodes: [low, top], damping: {{tx: 0.7 N*s/m}}}}
ground:
  low: {{free: [tx]}}
  top: {{free: [tx]}}
actuators:
  coil: {{type: force, nodes: [low], direction: x}}
sensors:
  x: {{type: displacement, nodes: [top], direction: x}}
  v: {{type: velocity, nodes: [top], direction: x}}
disturbances: {disturbances}
"""


def one_mass(disturbances: str) -> fx.Mechanism:
    """Mass 2 kg, stiffness 800 N/m, damping 4 N s/m."""
    return fx.loads(ONE.format(disturbances=disturbances))


def two_masses(disturbances: str) -> fx.Mechanism:
    """Masses 2 kg and 0.5 kg in series, `coil` on the first, read at the second."""
    return fx.loads(TWO.format(disturbances=disturbances))
