"""Classes of which results are made, for annotations: rows, channels, diagnostics of files."""

from flexura.lazy import face

face(__name__)
