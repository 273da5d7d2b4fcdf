"""What is wrong with a description that no single part of it can see."""

from flexura.lazy import face

face(__name__)
