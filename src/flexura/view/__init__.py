"""Pictures of mechanisms and mode shapes."""

from flexura.view.curves import draw_bode, draw_nyquist, draw_response_matrix, draw_time
from flexura.view.files import save_figures, save_pictures
from flexura.view.pictures import draw_mechanism, draw_mode, draw_sheet
from flexura.view.scene import Kind, Solids
from flexura.view.solids import solids

__all__ = [
    "Kind",
    "Solids",
    "draw_bode",
    "draw_mechanism",
    "draw_mode",
    "draw_nyquist",
    "draw_response_matrix",
    "draw_sheet",
    "draw_time",
    "save_figures",
    "save_pictures",
    "solids",
]
