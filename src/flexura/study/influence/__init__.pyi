from flexura.study.influence.sensitivity import Sensitivity as Sensitivity
from flexura.study.influence.sensitivity import sensitivity as sensitivity
