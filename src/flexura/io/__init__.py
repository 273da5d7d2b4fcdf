"""Hand-over of models and results to other programs: one module per format."""

from flexura.lazy import face

face(__name__)
