"""Universal files of measurements and of models, with one vocabulary of datasets, channels and units."""

from flexura.lazy import face

face(__name__)
