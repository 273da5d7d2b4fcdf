"""Hand-over of models and results to other programs: one module per format."""

from flexura.io.formats import FORMATS, Format, export, format_of
from flexura.io.python_control import to_control

__all__ = ["FORMATS", "Format", "export", "format_of", "to_control"]
