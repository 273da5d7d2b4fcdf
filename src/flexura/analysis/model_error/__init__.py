"""The second margin: how far the part may be from the model, and what that rests on."""

from flexura.lazy import face

face(__name__)
