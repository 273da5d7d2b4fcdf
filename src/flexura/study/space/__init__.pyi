from flexura.study.space.sampling import SAMPLINGS as SAMPLINGS
from flexura.study.space.sampling import Sampling as Sampling
from flexura.study.space.sampling import Space as Space
from flexura.study.space.variables import Distribution as Distribution
from flexura.study.space.variables import Variable as Variable
from flexura.study.space.variation import Varied as Varied
from flexura.study.space.variation import variables as variables
