"""From full order to low order: constraint modes, Craig-Bampton, and quick evaluation of many designs."""

from flexura.lazy import face

face(__name__)
