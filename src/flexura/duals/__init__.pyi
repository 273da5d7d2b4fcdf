from flexura.duals.dual import Dual as Dual
from flexura.duals.dual import real as real
