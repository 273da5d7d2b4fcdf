"""Kernels: what takes many small steps of arithmetic, in C, for where Python's calls would take longer than these.

Beside each there is the same in NumPy, which is read, tested against it to 1e-13 or to what its differences keep, and
used where no library is there.
"""

from flexura.lazy import face

face(__name__)
