"""Numbers with exact derivatives: arrays with their slopes by parameters, which NumPy's functions accept."""

from flexura.lazy import face

face(__name__)
