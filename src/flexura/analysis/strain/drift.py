"""Instantaneous screw axes of motions, and how far they drift when a mechanism is displaced."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from flexura.analysis.strain.numbers import finite_numbers
from flexura.analysis.strain.tangent import tangent_stiffness
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.errors import OptionError, SolverError
from flexura.linalg import factorise, is_definite
from flexura.results import Result
from flexura.structure import FullOrderModel
from flexura.tables import Facts, Table, in_mm, quantity

Vector = tuple[float, float, float]

FAR = 1e6
"""Distance, m, of an axis beyond which a motion counts as a translation."""


@dataclass(frozen=True, repr=False)
class ScrewAxis(Result):
    """The axis about and along which a rigid body moves at an instant (theory eq. S22).

    `direction` is a unit vector; `point` is the point of the axis nearest to the point that was asked for, m; `pitch`
    is the advance per angle, m/rad. A pure translation has an infinite pitch, its direction, and the point asked for.
    """

    direction: Vector
    point: Vector
    pitch: float

    @property
    def _along(self) -> str:
        return " ".join(f"{x:+.4f}" for x in self.direction)

    def _view(self) -> Iterator[Facts | Table]:
        if self.is_translation:
            yield Facts({"translation along": self._along})
        else:
            yield Facts(
                {
                    "direction": self._along,
                    "through": f"({in_mm(self.point)}) mm",
                    "pitch": quantity(self.pitch, "m/rad", 4),
                }
            )

    @property
    def is_translation(self) -> bool:
        """True when nothing turns."""
        return bool(np.isinf(self.pitch))


@dataclass(frozen=True, repr=False)
class Drift(Result):
    """The screw axis of a node's motion under one load, at rest and about a displaced state.

    `shift` (3,) leads from the point of the axis at rest to that of the displaced one, m, `distance` is its length,
    and `tilt` is the angle between the axes, rad. Translations have no shift. `twists` (2, 6) are the motions per load,
    m/N, rad/N or of the load's unit, of the node at rest and displaced.
    """

    rest: ScrewAxis
    displaced: ScrewAxis
    twists: Array

    _shown = ("distance", "tilt")
    _told = ("rest", "displaced", "twists", "shift", "distance", "tilt")

    def _view(self) -> Iterator[Facts | Table]:
        yield Facts({"distance": quantity(self.distance, "m", 4), "tilt": quantity(self.tilt, "rad", 4)})
        both = (self.rest, self.displaced)
        yield Table(
            {
                "": ("undeformed", "displaced"),
                "direction": [a._along for a in both],
                "through [mm]": [in_mm(a.point) for a in both],
                "pitch": [quantity(a.pitch, "m/rad") for a in both],
            }
        )

    @property
    def shift(self) -> Vector:
        """From the point at rest to the displaced one, m; zero unless both turn."""
        if self.rest.is_translation or self.displaced.is_translation:
            return 0.0, 0.0, 0.0
        return _vector(np.subtract(self.displaced.point, self.rest.point))

    @property
    def distance(self) -> float:
        """Length of the shift, m."""
        return float(np.linalg.norm(self.shift))

    @property
    def tilt(self) -> float:
        """Angle between the directions, rad."""
        a, b = np.array(self.rest.direction), np.array(self.displaced.direction)
        return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


@verb
def screw_axis(twist: ArrayLike, near: ArrayLike = (0.0, 0.0, 0.0), *, at: ArrayLike = (0.0, 0.0, 0.0)) -> ScrewAxis:
    """The screw axis of a twist (theory eq. S22).

    twist: (6,) translation of the body's point `at`, m, and rotation, rad, small or per time or load; near, at: (3,) m.
    The axis is given by its point nearest to `near`. Raises OptionError for what is no motion.
    """
    motion = finite_numbers("a twist", twist, 6)
    origin, wanted = finite_numbers("at", at, 3), finite_numbers("near", near, 3)
    v, w = motion[:3], motion[3:]
    speed, rate = float(np.linalg.norm(v)), float(np.linalg.norm(w))
    if rate * FAR <= speed:
        if not speed:
            raise OptionError("a twist of nothing but zeros has no axis")
        return ScrewAxis(_vector(v / speed), _vector(wanted), np.inf)
    direction = w / rate
    foot = origin + np.cross(direction, v) / rate
    nearest = foot + direction * (direction @ (wanted - foot))
    return ScrewAxis(_vector(direction), _vector(nearest), float(direction @ v) / rate)


@verb
def drift(
    model: FullOrderModel,
    u: ArrayLike,
    *,
    node: str,
    load: ArrayLike,
    near: ArrayLike | None = None,
    loads: Mapping[str, ArrayLike] | None = None,
) -> Drift:
    """How the axis about which a small load moves a node drifts when the mechanism is displaced.

    u: (n,) displaced state, m and rad; load: (6,) N and N m at the node, global frame, which is small and tells axes
    apart where there are several freedoms; near: (3,) m, by default the node at rest; loads: as in `tangent_stiffness`.
    Axes are those of K^-1 at rest and K_t^-1 about the displaced state, first order in u.

    Raises OptionError for unknown nodes and loads that are none, SolverError when something can move freely.
    """
    state, wrench = finite_numbers("displacements", u, model.order), finite_numbers("load", load, 6)
    if not is_definite(model.K):
        raise SolverError("something can move freely under the load: hold it, or attach it by a stiffness")
    topology = model.plan.topology
    number = topology.numbers([node])
    root = topology.root[number[0]]
    at = model.geometry.positions[number[0]]
    arm = at - model.geometry.positions[root] if topology.is_rigid[number[0]] else np.zeros(3)
    own = np.append(state, 0.0)[topology.dof[root]]
    turned = Rotation.from_rotvec(own[3:]).apply(arm)
    moved = at - arm + own[:3] + turned
    wanted = at if near is None else finite_numbers("near", near, 3)
    twists = np.stack(
        [
            _response(model.K, topology.dof[root], arm, wrench),
            _response(tangent_stiffness(model, state, loads=loads), topology.dof[root], turned, wrench),
        ]
    )
    return Drift(screw_axis(twists[0], wanted, at=at), screw_axis(twists[1], wanted, at=moved), twists)


def _response(K: sp.csc_matrix, dof: NDArray[np.intp], arm: Array, load: Array) -> Array:
    """Motion (6,) of a point on an arm from the node with the DOFs, -1 where held, per load (6,) on it."""
    D = rigid_arm(arm)
    free = dof >= 0
    force = np.zeros(K.shape[0])
    force[dof[free]] = (D.T @ load)[free]
    u = factorise(K).solve(force)
    return D @ np.where(free, u[dof], 0.0)


def _vector(v: Array) -> Vector:
    x, y, z = (float(c) + 0.0 for c in v)
    return x, y, z
