"""From full order to low order: constraint modes, Craig-Bampton, and quick evaluation of many designs."""

from flexura.reduction.batch import NaturalFrequencies, natural_frequencies
from flexura.reduction.certificate import Certificate, certify
from flexura.reduction.condensation import condense
from flexura.reduction.craig_bampton import CraigBampton, ReducedPart
from flexura.reduction.interface import interface_reduction
from flexura.reduction.low_order import reduce
from flexura.reduction.model import LowOrderModel
from flexura.reduction.nesting import NestedModel, nested
from flexura.reduction.unproven import unproven_frequencies

__all__ = [
    "Certificate",
    "CraigBampton",
    "LowOrderModel",
    "NaturalFrequencies",
    "NestedModel",
    "ReducedPart",
    "certify",
    "condense",
    "interface_reduction",
    "natural_frequencies",
    "nested",
    "reduce",
    "unproven_frequencies",
]
