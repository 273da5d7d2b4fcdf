from flexura.duals.dual import Dual as Dual
from flexura.duals.dual import moves as moves
from flexura.duals.dual import plain as plain
from flexura.duals.dual import real as real
from flexura.duals.dual import slope_of as slope_of
from flexura.duals.dual import with_slopes_of as with_slopes_of
from flexura.duals.dual import without_slopes as without_slopes
from flexura.duals.dual import zeros as zeros
