"""From a mechanism to named DOFs, element arrays, and the matrices K and M."""

from flexura.structure.full_order import FullOrderModel, assemble
from flexura.structure.plan import Geometry, Plan

__all__ = ["FullOrderModel", "Geometry", "Plan", "assemble"]
