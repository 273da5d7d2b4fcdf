from flexura.testing.correlation.correlated import Correlation as Correlation
from flexura.testing.correlation.correlated import FRFOverlay as FRFOverlay
from flexura.testing.correlation.correlated import ModePair as ModePair
from flexura.testing.correlation.correlation import UNSEEN as UNSEEN
from flexura.testing.correlation.correlation import correlate as correlate
from flexura.testing.correlation.correlation import identified_modes as identified_modes
from flexura.testing.correlation.correlation import shapes_of as shapes_of
