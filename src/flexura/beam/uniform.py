"""The uniform beam as its rigidities and inertias per length: all that its dynamics depends on, whatever the theory.

The theory is folded into the numbers: without shear the shear flexibilities are zero, without rotary inertia the
rotary inertias are, and effective rigidities stand for effects beyond beam theory.
"""

from typing import Any, NamedTuple

import numpy as np

from flexura.beam._columns import FloatArray, combine
from flexura.beam.element import MASS_BASIS, mass_coefficients, stiffness
from flexura.beam.section import SectionProperties


class UniformBeam(NamedTuple):
    """Uniform beams; the fields are arrays (...) of one common shape.

    EA        axial rigidity, N
    GJ        torsional rigidity, N m^2
    EIy       bending rigidity about local y (bending in the xz plane), N m^2
    EIz       bending rigidity about local z (bending in the xy plane), N m^2
    shear_y   shear flexibility 1/(ky G A) along local y, 1/N; zero where shear is left out
    shear_z   shear flexibility 1/(kz G A) along local z, 1/N; zero where shear is left out
    mass      mass per length, kg/m
    polar     polar inertia per length, rho (Iy + Iz), kg m
    rotary_y  rotary inertia per length about local y, kg m; zero where it is left out
    rotary_z  rotary inertia per length about local z, kg m; zero where it is left out
    length    m
    """

    EA: FloatArray
    GJ: FloatArray
    EIy: FloatArray
    EIz: FloatArray
    shear_y: FloatArray
    shear_z: FloatArray
    mass: FloatArray
    polar: FloatArray
    rotary_y: FloatArray
    rotary_z: FloatArray
    length: FloatArray

    def take(self, index: Any) -> "UniformBeam":
        """The beams at an index of the leading axes."""
        return UniformBeam(*(field[index] for field in self))

    def cut(self, pieces: int) -> "UniformBeam":
        """One of `pieces` equal lengths of each beam."""
        return self._replace(length=self.length / pieces)

    @property
    def section(self) -> SectionProperties:
        """Rigidities as a section of a material with E = G = 1 Pa."""
        flexible = [(shear > 0, shear * self.EA) for shear in (self.shear_y, self.shear_z)]
        ky, kz = (np.where(shears, 1 / np.where(shears, product, 1.0), np.inf) for shears, product in flexible)
        return SectionProperties(self.EA, self.EIy, self.EIz, self.GJ, ky, kz)


def element_stiffness(beam: UniformBeam) -> FloatArray:
    """Return the static stiffness (..., 12, 12) of the beams as elements, N/m, N, N m (theory eq. 15)."""
    return stiffness(1.0, 1.0, beam.section, beam.length, 1.0)


def element_mass(beam: UniformBeam) -> FloatArray:
    """Return the consistent mass (..., 12, 12) of the beams as elements, kg, kg m, kg m^2 (theory eq. 19)."""
    L2 = beam.length * beam.length
    phi_y, phi_z = 12 * beam.EIz * beam.shear_y / L2, 12 * beam.EIy * beam.shear_z / L2
    inertia = SectionProperties(beam.mass, beam.rotary_y, beam.rotary_z, beam.polar, beam.mass, beam.mass)
    coefficients = mass_coefficients(1.0, inertia, beam.length, phi_y, phi_z, 1.0)
    coefficients[..., 1] = beam.polar * beam.length
    return combine(coefficients, MASS_BASIS, 12)
