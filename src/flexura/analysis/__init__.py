"""What is asked of a model: modes with evidence, statics, frequency and time response, and a check of the
description."""

from flexura.lazy import face

face(__name__, former={"Doubt": "Diagnostic"})
