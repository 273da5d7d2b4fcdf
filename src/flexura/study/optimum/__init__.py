"""The best design under limits: exact gradients, several starts, multipliers, and a proof at full order."""

from flexura.lazy import face

face(__name__)
