from flexura.testing.identification.identification import LEAST_CONFIDENCE as LEAST_CONFIDENCE
from flexura.testing.identification.identification import Data as Data
from flexura.testing.identification.identification import frfs_of as frfs_of
from flexura.testing.identification.identification import identify as identify
from flexura.testing.identification.identification import matrices_of as matrices_of
from flexura.testing.identification.identification import mode_indicators as mode_indicators
from flexura.testing.identification.multi_setup import modes_of_setup as modes_of_setup
