from flexura.study.tolerances.nets import Estimate as Estimate
from flexura.study.tolerances.nets import SobolIndices as SobolIndices
from flexura.study.tolerances.result import QuantitySpread as QuantitySpread
from flexura.study.tolerances.result import Tolerance as Tolerance
from flexura.study.tolerances.result import ToleratedSize as ToleratedSize
from flexura.study.tolerances.result import Yield as Yield
from flexura.study.tolerances.tolerance import tolerance as tolerance
from flexura.study.tolerances.worst_case import Extreme as Extreme
