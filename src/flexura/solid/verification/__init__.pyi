from flexura.solid.verification.verify import ShapePairs as ShapePairs
from flexura.solid.verification.verify import SolidRow as SolidRow
from flexura.solid.verification.verify import Verification as Verification
from flexura.solid.verification.verify import VerificationRow as VerificationRow
from flexura.solid.verification.verify import progressively as progressively
from flexura.solid.verification.verify import verify as verify
from flexura.solid.whole import WholeModes as WholeModes
from flexura.solid.whole import whole_modes as whole_modes
