from flexura.analysis.natural_modes.evidence import Evidence as Evidence
from flexura.analysis.natural_modes.evidence import MassProperties as MassProperties
from flexura.analysis.natural_modes.evidence import MissedMode as MissedMode
from flexura.analysis.natural_modes.evidence import mass_evidence as mass_evidence
from flexura.analysis.natural_modes.evidence import rigid_mass_of as rigid_mass_of
from flexura.analysis.natural_modes.modes import Mode as Mode
from flexura.analysis.natural_modes.modes import Modes as Modes
from flexura.analysis.natural_modes.modes import modes as modes
