"""The shell's `flexura VERB FILE`: the same verbs as in Python, printed."""

from flexura.lazy import face

face(__name__)
