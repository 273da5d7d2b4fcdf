"""Spatial beam elements: sections, member frames, notch contours, uniform and tapered elements.

The element follows Sections 3.1-3.2 of "Dynamic Modeling and Experimental Verification of an RPR Type
Compliant Parallel Mechanism with Low Orders", Chinese Journal of Mechanical Engineering, 2024,
doi 10.1186/s10033-024-01050-4, cited below as "the RPR paper".

Conventions: SI units; node freedoms (tx ty tz rx ry rz); member axis along local x; rotation matrices hold
the local axes as rows, v_local = R v_global; every function is pure and broadcasts over leading axes.
"""

from flexura.lazy import face

face(__name__)
