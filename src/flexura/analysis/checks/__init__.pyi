from flexura.analysis.checks.check import CheckReport as CheckReport
from flexura.analysis.checks.check import check as check
from flexura.analysis.checks.check import corrected as corrected
from flexura.analysis.checks.clashes import Clash as Clash
