"""Model files: YAML with units and expressions, to and from a Mechanism."""

from flexura.modelfile.override import parse_override
from flexura.modelfile.reader import VERSION, load, loads
from flexura.modelfile.schema import schema
from flexura.modelfile.writer import dumps, save

__all__ = ["VERSION", "dumps", "load", "loads", "parse_override", "save", "schema"]
