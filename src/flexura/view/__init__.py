"""Pictures of mechanisms and mode shapes."""

from flexura.view.files import save_pictures
from flexura.view.pictures import draw_mechanism, draw_mode, draw_sheet
from flexura.view.scene import Kind, Solids
from flexura.view.solids import solids

__all__ = ["Kind", "Solids", "draw_mechanism", "draw_mode", "draw_sheet", "save_pictures", "solids"]
