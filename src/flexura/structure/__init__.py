"""From a mechanism to named DOFs, element arrays, and the matrices K and M."""

from flexura.structure.design import Design
from flexura.structure.full_order import assemble
from flexura.structure.model import FullOrderModel
from flexura.structure.plan import Geometry, Plan

__all__ = ["Design", "FullOrderModel", "Geometry", "Plan", "assemble"]
