"""What each parameter does to what is asked, by exact slopes."""

from flexura.lazy import face

face(__name__)
