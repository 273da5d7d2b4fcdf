"""Model files that tests start from, and how to look at what is wrong with one."""

from __future__ import annotations

import pytest

from flexura.errors import ModelError, Problem
from flexura.modelfile import loads

AMPLIFIER = """\
flexura: 1
name: amplifier
description: A bridge amplifier with a stage, in three branches.
theory: timoshenko
parameters:
  t: 0.3 mm
  m: {value: 20 g, minimum: 10 g, maximum: 50 g, source: measured}
  L: {value: 10 mm, minimum: 5 mm}
  half: L/2
  phi: 30 deg
materials:
  al: Al-7075-T6
  mine: {E: 70 GPa, rho: 2700 kg/m^3, nu: 0.33, loss_factor: 1e-3}
sections:
  bar: {shape: rectangle, width: 10 mm, thickness: 5 mm}
substructures:
  amp:
    nodes:
      a: [0, 0, 0]
      b: [L, 0, 0]
      c: [2*L + 1 mm, 0, 0]
    flexures:
      leaf:
        nodes: [a, b]
        material: al
        reference: z
        profile: {type: notch, width: 10 mm, contour: {shape: circular, radius: half, web: t}}
    links:
      bar: {nodes: [b, c], material: mine, section: bar, reference: -z, elements: 2}
    interface: [a, c]
instances:
  amp: {of: amp, pattern: {type: circular, count: 3, axis: z}, rotate: {axis: z, angle: 90 deg}}
bodies:
  stage:
    centre: [0, 0, 10 mm]
    mass: 0.5 kg
    inertia: [1e-4 kg*m^2, 1e-4 kg*m^2, 1.5e-4 kg*m^2]
    carries: ["amp*.c"]
masses:
  tip: {node: stage, mass: m}
springs:
  soft: {nodes: [stage], stiffness: {tx: 2 N/um, rz: 3 N*m/rad}}
ground: {"amp*.a": clamped}
"""

BEAM = """\
parameters: {t: 1 mm}
nodes:
  a: [0, 0, 0]
  b: [100 mm, 0, 0]
links:
  beam: {nodes: [a, b], material: Al-6061-T6, section: {shape: circle, diameter: t}}
ground: {a: clamped}
"""


def problems_in(text: str) -> tuple[Problem, ...]:
    """What is wrong with a model file that must not be accepted."""
    with pytest.raises(ModelError) as caught:
        loads(text, "model.yaml")
    return caught.value.problems


def only_problem_in(text: str) -> Problem:
    """The one thing that is wrong with a model file."""
    problems = problems_in(text)
    assert len(problems) == 1, "\n".join(map(str, problems))
    return problems[0]
