"""From full order to low order: constraint modes, Craig-Bampton, and quick evaluation of many designs."""

from flexura.reduction.craig_bampton import ReducedPart, craig_bampton
from flexura.reduction.low_order import natural_frequencies, reduce
from flexura.reduction.model import LowOrderModel

__all__ = ["LowOrderModel", "ReducedPart", "craig_bampton", "natural_frequencies", "reduce"]
