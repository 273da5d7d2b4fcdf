"""What is asked of a model: modes with evidence, statics, frequency and time response, and a check of what was
understood."""

from flexura.lazy import face

face(__name__)
