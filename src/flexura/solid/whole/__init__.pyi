from flexura.solid.whole.modes import ORDER as ORDER
from flexura.solid.whole.modes import WholeModes as WholeModes
from flexura.solid.whole.modes import WholePart as WholePart
