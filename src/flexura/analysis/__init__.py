"""What is asked of a model: natural modes with evidence, and a check of what was understood."""

from flexura.analysis.check import CheckReport, Doubt, check
from flexura.analysis.evidence import Evidence, MissedMode
from flexura.analysis.modes import Mode, Modes, modes
from flexura.analysis.preload import Preload, preload

__all__ = ["CheckReport", "Doubt", "Evidence", "MissedMode", "Mode", "Modes", "Preload", "check", "modes", "preload"]
