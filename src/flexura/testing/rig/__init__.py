"""The mechanism under test: where hammer and sensors sit, what channels read of the model, and what sensors weigh."""

from flexura.lazy import face

face(__name__)
