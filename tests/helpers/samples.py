"""Small mechanisms whose frequencies follow by hand, as files with parameters."""

import flexura as fx

BODY = """
flexura: 1
name: body on springs
parameters:
  kx: {value: 4 N/mm, minimum: 0.5 N/mm, maximum: 32 N/mm}
  ky: {value: 9 N/mm, minimum: 1 N/mm, maximum: 80 N/mm}
  mass: {value: 0.4 kg, minimum: 0.1 kg, maximum: 1.6 kg}
bodies:
  stage: {centre: [0, 0, 0], mass: mass, inertia: [200 kg*mm^2, 300 kg*mm^2, 500 kg*mm^2]}
springs:
  all:
    nodes: [stage]
    stiffness: {tx: kx, ty: ky, tz: 900 N/mm, rx: 900 N*m/rad, ry: 900 N*m/rad, rz: 900 N*m/rad}
"""
"""Two low modes, along x at sqrt(kx/m) and along y at sqrt(ky/m); the others are far above."""

BEAM = """
flexura: 1
name: cantilever with a tip mass
theory: euler_bernoulli
corrections: none
parameters:
  length: {value: 80 mm, minimum: 20 mm, maximum: 300 mm}
  thickness: {value: 1 mm, minimum: 0.2 mm, maximum: 4 mm}
  width: {value: 6 mm, minimum: 1 mm, maximum: 30 mm}
  tip_mass: {value: 20 g, minimum: 1 g, maximum: 200 g}
  modulus: {value: 70 GPa, minimum: 30 GPa, maximum: 200 GPa}
materials:
  metal: {E: modulus, nu: 0.3, rho: 2700 kg/m^3}
nodes: {root: [0, 0, 0], tip: [length, 0, 0]}
links:
  beam:
    nodes: [root, tip]
    material: metal
    section: {shape: rectangle, width: width, thickness: thickness}
    reference: z
    elements: 3
masses:
  load: {node: tip, mass: tip_mass}
ground: {root: clamped}
"""


def body(**values):
    """The body on springs, with some parameters set."""
    return with_values(fx.loads(BODY), values)


def beam(**values):
    """The cantilever, with some parameters set."""
    return with_values(fx.loads(BEAM), values)


def with_values(mechanism, values):
    """A mechanism with other values of its parameters, SI."""
    parameters = dict(mechanism.parameters)
    for name, value in values.items():
        parameters[name] = parameters[name].model_copy(update={"value": value})
    return mechanism.model_copy(update={"parameters": parameters})
