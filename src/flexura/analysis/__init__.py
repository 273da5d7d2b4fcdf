"""What is asked of a model: modes with evidence, statics, frequency and time response, and a check of what was
understood."""

from flexura.analysis import signals
from flexura.analysis.check import CheckReport, Doubt, check
from flexura.analysis.clashes import Clash
from flexura.analysis.drift import Drift, ScrewAxis, drift, screw_axis
from flexura.analysis.evidence import Evidence, MissedMode
from flexura.analysis.freedoms import ComplianceSpectrum, Freedom
from flexura.analysis.frequency_response import FrequencyResponse, frequency_response
from flexura.analysis.kinetostatics import Kinetostatics, kinetostatics
from flexura.analysis.left_out import LeftOut
from flexura.analysis.modes import Mode, Modes, modes
from flexura.analysis.preload import Preload, preload
from flexura.analysis.signals import SignalFile, read_signals
from flexura.analysis.statics import ActuatorState, Statics, compliance, statics
from flexura.analysis.stress import MemberStress, Stresses, internal_force_rows, member_stresses, stress_rows
from flexura.analysis.tangent import tangent_stiffness
from flexura.analysis.time_response import TimeResponse, time_response

__all__ = [
    "ActuatorState",
    "CheckReport",
    "Clash",
    "ComplianceSpectrum",
    "Doubt",
    "Drift",
    "Evidence",
    "Freedom",
    "FrequencyResponse",
    "Kinetostatics",
    "LeftOut",
    "MemberStress",
    "MissedMode",
    "Mode",
    "Modes",
    "Preload",
    "ScrewAxis",
    "SignalFile",
    "Statics",
    "Stresses",
    "TimeResponse",
    "check",
    "compliance",
    "drift",
    "frequency_response",
    "internal_force_rows",
    "kinetostatics",
    "member_stresses",
    "modes",
    "preload",
    "read_signals",
    "screw_axis",
    "signals",
    "statics",
    "stress_rows",
    "tangent_stiffness",
    "time_response",
]
