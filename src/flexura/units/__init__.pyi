from flexura.units.format import customary_unit as customary_unit
from flexura.units.format import format_number as format_number
from flexura.units.format import format_quantity as format_quantity
from flexura.units.parse import FAMILIAR as FAMILIAR
from flexura.units.parse import is_unit as is_unit
from flexura.units.parse import parse_quantity as parse_quantity
from flexura.units.parse import parse_unit as parse_unit
from flexura.units.parse import split_quantity as split_quantity
