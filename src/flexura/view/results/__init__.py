"""Charts of results: responses, tests, studies."""

from flexura.lazy import face

face(__name__)
