"""A mechanism without instances that is the same as a nested one, and other rewritings of descriptions.

Rotations and inertia are worked out with scipy's Rotation and plain tensor algebra, independently of the placements and
matrices of flexura.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation as Turn

from flexura.mechanism import (
    Circle,
    CircularContour,
    CircularPattern,
    Flexure,
    LinearPattern,
    Mechanism,
    Notch,
    PointMass,
    RigidBody,
    RoundNotch,
    SectionConstants,
    Spring,
    Tube,
)
from flexura.mechanism.evaluation import scalars

Pose = tuple[np.ndarray, np.ndarray]
"""An orthogonal matrix Q and a translation t: x -> Q x + t."""
STILL: Pose = (np.eye(3), np.zeros(3))


def about(axis: Iterable[float], angle: float) -> np.ndarray:
    """Return the rotation matrix about an axis."""
    a = np.array(tuple(axis))
    return Turn.from_rotvec(angle * a / np.linalg.norm(a)).as_matrix()


def _then(first: Pose, second: Pose) -> Pose:
    return second[0] @ first[0], second[0] @ first[1] + second[1]


def _around(Q: np.ndarray, centre: Iterable[float]) -> Pose:
    c = np.array(tuple(centre))
    return Q, c - Q @ c


def placements(name: str, instance: Any) -> list[tuple[str, Pose]]:
    """Return name and place of every copy of an instance."""
    own = STILL
    for turn in instance.rotate:
        own = _then(own, (about(turn.axis, turn.angle), np.zeros(3)))
    places = [_then(own, (np.eye(3), np.array(instance.at)))]
    for pattern in instance.pattern:
        if isinstance(pattern, CircularPattern):
            angle = 2 * np.pi / pattern.count
            steps = [_around(about(pattern.axis, k * angle), pattern.centre) for k in range(pattern.count)]
        elif isinstance(pattern, LinearPattern):
            steps = [(np.eye(3), k * np.array(pattern.step)) for k in range(pattern.count)]
        else:
            n = np.array(pattern.normal) / np.linalg.norm(pattern.normal)
            steps = [STILL, _around(np.eye(3) - 2 * np.outer(n, n), pattern.point)]
        places = [_then(place, step) for step in steps for place in places]
    return [(name, places[0])] if not instance.pattern else [(f"{name}{k + 1}", p) for k, p in enumerate(places)]


def tensor(entries: Iterable[float]) -> np.ndarray:
    """Return the inertia tensor of 3 or 6 entries."""
    xx, yy, zz, xy, xz, yz = (*entries, 0.0, 0.0, 0.0)[:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def body_inertia(body: RigidBody, mechanism: Mechanism) -> tuple[float, np.ndarray]:
    """Return mass and inertia tensor of a body given by numbers or as a box."""
    if body.solid is None:
        mass, own = body.mass, tensor(body.inertia)
    else:
        size = np.array(body.solid.size)
        mass = mechanism.material(body.solid.material).rho * np.prod(size)
        own = mass / 12 * np.diag(np.sum(size**2) - size**2)
    Q = about(body.rotate.axis, body.rotate.angle) if body.rotate else np.eye(3)
    return float(mass), Q @ own @ Q.T


def _entries(T: np.ndarray) -> tuple[float, ...]:
    return tuple(float(T[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def _vector(v: np.ndarray) -> tuple[float, float, float]:
    return float(v[0]), float(v[1]), float(v[2])


def _six(Q: np.ndarray) -> np.ndarray:
    """Turn displacements and rotations; in a mirror image rotations turn the other way."""
    return np.block([[Q, np.zeros((3, 3))], [np.zeros((3, 3)), np.linalg.det(Q) * Q]])


class Flat:
    """Collects the parts of a mechanism in global axes."""

    def __init__(self, mechanism: Mechanism, place: Pose = STILL) -> None:
        self.mechanism = mechanism
        self.parts: dict[str, dict[str, Any]] = {
            kind: {} for kind in ("nodes", "links", "flexures", "masses", "springs", "bodies")
        }
        self._add(mechanism, "", place)

    def _add(self, part: Any, path: str, place: Pose) -> list[str]:
        Q, t = place
        own = [*part.nodes, *part.bodies]
        for key, instance in part.instances.items():
            for name, inner in placements(key, instance):
                prototype = self.mechanism.substructures[instance.of]
                self._add(prototype, f"{path}{name}.", _then(inner, place))
                own += [f"{name}.{node}" for node in prototype.interface]

        def full(node: str) -> str:
            return (path + node).replace(".", "_")

        def carry(member: Any) -> Any:
            turned = {
                "nodes": tuple(full(n) for n in member.nodes),
                "reference": None if member.reference is None else _vector(Q @ member.reference),
                "start_offset": _vector(Q @ member.start_offset),
                "end_offset": _vector(Q @ member.end_offset),
            }
            return member.model_copy(update=turned)

        parts = self.parts
        parts["nodes"] |= {full(name): _vector(Q @ x + t) for name, x in part.nodes.items()}
        for kind in ("links", "flexures"):
            parts[kind] |= {full(name): carry(member) for name, member in getattr(part, kind).items()}
        for name, point in part.masses.items():
            inertia = None if point.inertia is None else _entries(Q @ tensor(point.inertia) @ Q.T)
            moved = {"inertia": inertia, "offset": _vector(Q @ point.offset)}
            parts["masses"][full(name)] = PointMass(node=full(point.node), mass=point.mass, **moved)
        for name, spring in part.springs.items():
            X = _six(Q) @ _six(np.eye(3) if spring.rotate is None else about(spring.rotate.axis, spring.rotate.angle))
            own_K = spring.matrix if spring.stiffness is None else np.diag(list(spring.stiffness.model_dump().values()))
            K = X @ np.array(own_K) @ X.T
            K = (K + K.T) / 2
            ends = tuple(full(n) for n in spring.nodes)
            parts["springs"][full(name)] = Spring(nodes=ends, matrix=tuple(map(tuple, K.tolist())))
        for name, body in part.bodies.items():
            mass, inertia = body_inertia(body, self.mechanism)
            carried = tuple(full(n) for text in body.carries for n in own if fnmatchcase(n, text))
            moved = {"centre": _vector(Q @ body.centre + t), "inertia": _entries(Q @ inertia @ Q.T)}
            parts["bodies"][full(name)] = RigidBody(carries=carried, mass=mass, **moved)
        return own


def flatten(mechanism: Mechanism, place: Pose = STILL) -> Mechanism:
    """Return the same mechanism without instances, moved or mirrored by `place`; ground must be on own nodes."""
    fields = {name: getattr(mechanism, name) for name in ("materials", "theory", "corrections", "ground")}
    return Mechanism(**Flat(mechanism, place).parts, **fields)


def renamed(mechanism: Mechanism, name: Callable[[str], str]) -> Mechanism:
    """Return a flat mechanism with all names changed and all parts in reverse order."""

    def parts(kind: str, **update: Callable[[Any], Any]) -> dict[str, Any]:
        changed = {}
        for key, part in reversed(list(getattr(mechanism, kind).items())):
            new = {field: change(getattr(part, field)) for field, change in update.items()}
            changed[name(key)] = part.model_copy(update=new)
        return changed

    def names(nodes: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(name(n) for n in nodes)

    return Mechanism(
        nodes={name(n): x for n, x in reversed(list(mechanism.nodes.items()))},
        links=parts("links", nodes=names),
        flexures=parts("flexures", nodes=names),
        springs=parts("springs", nodes=names),
        masses=parts("masses", node=name),
        bodies=parts("bodies", carries=names),
        ground={name(n): support for n, support in reversed(list(mechanism.ground.items()))},
        materials=mechanism.materials,
        theory=mechanism.theory,
    )


def scaled(mechanism: Mechanism, s: float) -> Mechanism:
    """Return the mechanism with lengths s-fold, of the same materials.

    A quantity of dimension m^a kg^b s^c is then s^(a + 3b + c)-fold: density and moduli stay as they are.
    """

    def thawed(item: Any) -> Any:
        if isinstance(item, dict):
            return {key: thawed(value) for key, value in item.items()}
        return [thawed(value) for value in item] if isinstance(item, tuple | list) else item

    data = thawed(mechanism.model_dump())
    for path, quantity, value in scalars(mechanism):
        d = quantity.dimension
        target = data
        for key in path[:-1]:
            target = target[key]
        target[path[-1]] = value * s ** float(d.length + 3 * d.mass + d.time)
    return Mechanism.model_validate(data)


def split(mechanism: Mechanism, name: str) -> Mechanism:
    """Return a flat mechanism with a link of an even number of elements cut into two links of half as many."""
    link = mechanism.links[name]
    ends = [np.array(mechanism.nodes[n]) for n in link.nodes]
    middle = (ends[0] + link.start_offset + ends[1] + link.end_offset) / 2
    half = {"elements": link.elements // 2}
    still = (0.0, 0.0, 0.0)
    first = link.model_copy(update={"nodes": (link.nodes[0], "middle"), "end_offset": still, **half})
    second = link.model_copy(update={"nodes": ("middle", link.nodes[1]), "start_offset": still, **half})
    links = {key: value for key, value in mechanism.links.items() if key != name}
    links |= {"first": first, "second": second}
    nodes = {**mechanism.nodes, "middle": _vector(middle)}
    return mechanism.model_copy(update={"nodes": nodes, "links": links})


def _shape(member: Any, x: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A, Iy, Iz at distances x from the middle of a member."""
    one = np.ones_like(x)
    form = member.profile if isinstance(member, Flexure) else member.section
    match form:
        case SectionConstants():
            return form.A * one, form.Iy * one, form.Iz * one
        case Tube() | Circle() | RoundNotch():
            inner = form.inner_diameter if isinstance(form, Tube) else 0.0
            outer = form.outer_diameter if isinstance(form, Tube) else getattr(form, "diameter", None)
            outer = _thickness(form.contour, x, length) if outer is None else outer * one
            second = np.pi / 64 * (outer**4 - inner**4)
            return np.pi / 4 * (outer**2 - inner**2), second, second
    if isinstance(form, Notch):
        b, t = form.width * one, _thickness(form.contour, x, length)
    else:
        b, t = (np.interp(x / length, (-0.5, 0.5), np.broadcast_to(s, 2)) for s in (form.width, form.thickness))
    return b * t, b * t**3 / 12, t * b**3 / 12


def _thickness(contour: Any, x: np.ndarray, length: float) -> np.ndarray:
    if isinstance(contour, CircularContour):
        return contour.web + 2 * (contour.radius - np.sqrt(contour.radius**2 - x**2))
    inside = np.maximum(np.abs(x) - (length / 2 - contour.fillet_radius), 0.0)
    return contour.web + 2 * (contour.fillet_radius - np.sqrt(contour.fillet_radius**2 - inside**2))


def _at(mass: float, inertia: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return mass and inertia at x as a 6 x 6 matrix on rigid motions about the origin."""
    cross = np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])
    B = np.block([[np.eye(3), -cross], [np.zeros((3, 3)), np.eye(3)]])
    own = np.zeros((6, 6))
    own[:3, :3], own[3:, 3:] = mass * np.eye(3), inertia
    return B.T @ own @ B


def rigid_mass(mechanism: Mechanism) -> np.ndarray:
    """Return the mass of a flat mechanism on rigid motions about the origin, summed over slices of its parts.

    A stepped element is uniform with the section at its middle, a tapered one is summed at six Gauss points. Slices
    have the inertia of their section about the member axis, and about the others unless the theory is
    Euler-Bernoulli.
    """
    M = np.zeros((6, 6))
    for member in (*mechanism.links.values(), *mechanism.flexures.values()):
        a, b = (np.array(mechanism.nodes[n]) for n in member.nodes)
        a, b = a + member.start_offset, b + member.end_offset
        L, n = float(np.linalg.norm(b - a)), member.elements
        x_axis = (b - a) / L
        reference = np.array(member.reference or np.eye(3)[np.argmin(abs(x_axis))])
        z_axis = reference - (reference @ x_axis) * x_axis
        z_axis /= np.linalg.norm(z_axis)
        y_axis = np.cross(z_axis, x_axis)
        points, weights = np.polynomial.legendre.leggauss(6)
        s = (np.arange(n)[:, None] + (1 + points) / 2) / n
        tapers = isinstance(member, Flexure) and member.integration == "tapered"
        at = s if tapers else np.broadcast_to((np.arange(n)[:, None] + 0.5) / n, s.shape)
        rho = mechanism.material(member.material).rho
        rotary = float((member.theory or mechanism.theory) != "euler_bernoulli")
        slices = zip(
            s.ravel(), np.tile(weights / 2, n), *(v.ravel() for v in _shape(member, (at - 0.5) * L, L)), strict=True
        )
        for where, weight, A, Iy, Iz in slices:
            across = rotary * (Iy * np.outer(y_axis, y_axis) + Iz * np.outer(z_axis, z_axis))
            inertia = (Iy + Iz) * np.outer(x_axis, x_axis) + across
            line = rho * weight * L / n
            M += _at(line * A, line * inertia, a + where * L * x_axis)
    for point in mechanism.masses.values():
        inertia = tensor(point.inertia or (0.0, 0.0, 0.0))
        M += _at(point.mass, inertia, np.array(mechanism.nodes[point.node]) + point.offset)
    for body in mechanism.bodies.values():
        M += _at(*body_inertia(body, mechanism), np.array(body.centre))
    return M
