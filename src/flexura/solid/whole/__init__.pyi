from flexura.solid.whole.modes import WholeModes as WholeModes
from flexura.solid.whole.modes import whole_modes as whole_modes
