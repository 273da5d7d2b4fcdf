"""Spatial beam elements: sections, member frames, notch contours, uniform and tapered elements.

The element follows Sections 3.1-3.2 of "Dynamic Modeling and Experimental Verification of an RPR Type
Compliant Parallel Mechanism with Low Orders", Chinese Journal of Mechanical Engineering, 2024,
doi 10.1186/s10033-024-01050-4, cited below as "the RPR paper".

Conventions: SI units; node freedoms (tx ty tz rx ry rz); member axis along local x; rotation matrices hold
the local axes as rows, v_local = R v_global; every function is pure and broadcasts over leading axes.
"""

from flexura.beam import contour
from flexura.beam.element import (
    MASS_BASIS,
    STIFFNESS_BASIS,
    flexibility,
    interpolation,
    mass,
    mass_coefficients,
    partial_flexibility,
    phi,
    shape_functions,
    stiffness,
    stiffness_coefficients,
    stiffness_from_flexibility,
)
from flexura.beam.frames import block_rotation, member_frame, rigid_arm, skew
from flexura.beam.section import SectionProperties, circle, rectangle, tube
from flexura.beam.tapered import gauss_stations, integration_matrices, tapered
from flexura.beam.uniform import UniformBeam, element_mass, element_stiffness

__all__ = [
    "MASS_BASIS",
    "STIFFNESS_BASIS",
    "SectionProperties",
    "UniformBeam",
    "block_rotation",
    "circle",
    "contour",
    "element_mass",
    "element_stiffness",
    "flexibility",
    "gauss_stations",
    "integration_matrices",
    "interpolation",
    "mass",
    "mass_coefficients",
    "member_frame",
    "partial_flexibility",
    "phi",
    "rectangle",
    "rigid_arm",
    "shape_functions",
    "skew",
    "stiffness",
    "stiffness_coefficients",
    "stiffness_from_flexibility",
    "tapered",
    "tube",
]
