"""Pictures of mechanisms and mode shapes."""

from flexura.view.correlation import (
    draw_correlation,
    draw_frf_overlay,
    draw_sensors,
    draw_shape_pair,
    save_correlation,
)
from flexura.view.curves import draw_bode, draw_nyquist, draw_response_matrix, draw_time
from flexura.view.doubts import draw_doubts, save_doubts
from flexura.view.files import save_figures, save_modes, save_pictures
from flexura.view.pictures import draw_mechanism, draw_mode, draw_sheet
from flexura.view.scene import Kind, Solids
from flexura.view.solids import solids
from flexura.view.verification import draw_mode_pair, draw_verification, save_verification

__all__ = [
    "Kind",
    "Solids",
    "draw_bode",
    "draw_correlation",
    "draw_doubts",
    "draw_frf_overlay",
    "draw_mechanism",
    "draw_mode",
    "draw_mode_pair",
    "draw_nyquist",
    "draw_response_matrix",
    "draw_sensors",
    "draw_shape_pair",
    "draw_sheet",
    "draw_time",
    "draw_verification",
    "save_correlation",
    "save_doubts",
    "save_figures",
    "save_modes",
    "save_pictures",
    "save_verification",
    "solids",
]
