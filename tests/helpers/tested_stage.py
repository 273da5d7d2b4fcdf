"""A body on springs with six different frequencies, 16 to 55 Hz, and a test of it in two placements."""

STAGE = """
flexura: 1
bodies:
  stage: {centre: [0, 0, 0], mass: 0.4 kg, inertia: [200 kg*mm^2, 300 kg*mm^2, 500 kg*mm^2]}
springs:
  mount:
    nodes: [stage]
    stiffness: {tx: 4 kN/m, ty: 6 kN/m, tz: 9 kN/m, rx: 9 N*m/rad, ry: 20 N*m/rad, rz: 60 N*m/rad}
damping: 0.01
"""
TEST = """
test:
  sample_rate: 400 Hz
  duration: 5 s
  pulse: 12 ms
  hammer:
    h1: {node: stage, direction: z, at: [20 mm, 15 mm, 0]}
    h2: {node: stage, direction: x, at: [0, 25 mm, 10 mm]}
    h3: {node: stage, direction: y, at: [20 mm, 0, 10 mm]}
  accelerometers:
    az: {node: stage, direction: z, at: [30 mm, 30 mm, 5 mm], mass: 8 g}
    ax: {node: stage, direction: x, at: [0, 30 mm, 5 mm], mass: 5 g}
    ay: {node: stage, direction: -y, at: [30 mm, 0, 5 mm], mass: 5 g}
    bz: {node: stage, direction: z, at: [-30 mm, 30 mm, 5 mm], mass: 8 g}
    cz: {node: stage, direction: z, at: [30 mm, -30 mm, 5 mm], mass: 8 g}
  placements: {first: [az, ax, ay], second: [bz, cz]}
  force_noise: 10 mN
  acceleration_noise: 0.02 m/s^2
"""
