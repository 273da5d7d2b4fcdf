from flexura.solid.whole.modes import ORDER as ORDER
from flexura.solid.whole.modes import WholeMode as WholeMode
from flexura.solid.whole.modes import WholeModes as WholeModes
from flexura.solid.whole.modes import WholePart as WholePart
from flexura.solid.whole.modes import WholeVerification as WholeVerification
from flexura.solid.whole.modes import lowest_of_solid as lowest_of_solid
from flexura.solid.whole.modes import verify_whole as verify_whole
