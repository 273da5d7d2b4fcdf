"""Arrays as annotations name them: real and complex numbers, numbers of things, truth values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]
Bools = NDArray[np.bool_]
