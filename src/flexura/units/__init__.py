"""Text with units to SI floats, and back."""

from flexura.units.format import customary_unit, format_number, format_quantity
from flexura.units.parse import FAMILIAR, Exponents, parse_quantity, parse_unit, split_quantity

__all__ = [
    "FAMILIAR",
    "Exponents",
    "customary_unit",
    "format_number",
    "format_quantity",
    "parse_quantity",
    "parse_unit",
    "split_quantity",
]
