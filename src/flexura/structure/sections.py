"""From section and profile descriptions to section properties at stations, for groups of members of one kind."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.beam import Laminate, Powers, SectionProperties, circle, laminate, notch, rectangle, tube
from flexura.mechanism import Flexure, Layered, Leaf, Link, Mechanism, Notch, Part, RoundNotch, TwoAxisNotch
from flexura.structure.values import ValueTable
from flexura.thresholds import SAME_SIZE

_FAMILIES = {
    "leaf": "rectangle",
    "tapered": "rectangle",
    "notch": "rectangle",
    "two_axis": "rectangle",
    "round": "circle",
}

_EVEN: dict[str, tuple[str, ...]] = {
    "rectangle": ("width", "thickness"),
    "leaf": ("width", "thickness"),
    "circle": ("diameter",),
    "tube": ("outer_diameter", "inner_diameter"),
    "constants": SectionProperties._fields,
}
"""Sizes that are the arguments of the section formula."""

Sizes = dict[str, Array]
"""Sizes by field name, (..., members, 1); tables are (..., members, 1, points)."""

_CONTOURS: dict[str, Callable[[Array, Array, Sizes], Array]] = {
    "circular": lambda x, _, s: notch.circular(x, s["radius"], s["web"]),
    "elliptical": lambda x, a, s: notch.elliptical(x, a, s["depth"], s["web"]),
    "parabolic": lambda x, a, s: notch.parabolic(x, a, s["depth"], s["web"]),
    "hyperbolic": lambda x, a, s: notch.hyperbolic(x, a, s["depth"], s["web"]),
    "corner_filleted": lambda x, a, s: notch.corner_filleted(x, a, s["fillet_radius"], s["web"]),
    "v_shaped": lambda x, _, s: notch.v_shaped(x, s["angle"], s["root_radius"], s["web"]),
    "table": lambda x, a, s: notch.tabulated(x + a, s["positions"], s["thicknesses"]),
    "straight": lambda x, _, s: s["web"] + 0 * x,
}

_ROOTS: dict[str, Callable[[Array, Sizes], Array]] = {
    "circular": lambda _, s: s["radius"],
    "elliptical": lambda a, s: a * a / s["depth"],
    "parabolic": lambda a, s: a * a / (2 * s["depth"]),
    "hyperbolic": lambda a, s: a * a * s["web"] / (2 * s["depth"] * (s["depth"] + s["web"])),
    "corner_filleted": lambda _, s: np.where(s["fillet_radius"] > 0, s["fillet_radius"], np.inf),
    "v_shaped": lambda _, s: s["root_radius"],
}
"""Radius of curvature at the root of contours that have one; a fillet without radius counts as none."""


_KERNEL_SHAPES: dict[str, tuple[str, ...]] = {
    "size": (),
    "circular": ("radius",),
    "elliptical": ("depth",),
    "parabolic": ("depth",),
    "hyperbolic": ("depth",),
    "corner_filleted": ("fillet_radius",),
    "v_shaped": ("angle", "root_radius"),
    "straight": (),
}
"""Contours as kernels number them, and a size as it stands, with what they have beside a web."""


class Contour(NamedTuple):
    """An argument of a section formula as kernels work it out: the number of its shape, entries (members, 4) of two
    sizes, the web, or the size as it stands, and the shift, -1 for none, and to which side it is shifted."""

    shape: int
    entries: Index
    side: float


@dataclass
class SectionGroup:
    """Members whose sections follow one formula.

    `kind` names the formula, `members` are positions in the part's list of members, and `entries` hold the sizes.
    """

    kind: tuple[str, ...]
    members: list[int] = field(default_factory=list)
    entries: dict[str, list[int | list[int]]] = field(default_factory=dict)

    def freeze(self) -> None:
        """Turn the collected lists into index arrays."""
        self.index: Index = np.array(self.members, dtype=np.intp)
        self._entry_arrays = {name: np.array(entries, dtype=np.intp)[:, None] for name, entries in self.entries.items()}

    @property
    def family(self) -> str:
        """The section formula that applies: `rectangle`, `circle`, `tube`, `layered` or `constants`."""
        return _FAMILIES.get(self.kind[0], self.kind[0])

    @property
    def contours(self) -> list[Contour]:
        """How the arguments of the section formula follow from entries; none where NumPy alone works them out."""
        match self.kind:
            case (shape,) if shape in _EVEN:
                found = [self._contour("size", (name,)) for name in _EVEN[shape]]
            case ("notch", shape):
                found = [self._contour("size", ("width",)), self._contour(shape)]
            case ("round", shape):
                found = [self._contour(shape)]
            case ("two_axis", y_shape, z_shape):
                found = [self._contour(y_shape, prefix="y_", side=1.0), self._contour(z_shape, prefix="z_", side=-1.0)]
            case _:
                found = [None]
        known = [contour for contour in found if contour is not None]
        return known if len(known) == len(found) else []

    def _contour(self, shape: str, names: Sequence[str] = (), *, prefix: str = "", side: float = 0.0) -> Contour | None:
        """One of them; None of shapes that kernels do not know."""
        if shape not in _KERNEL_SHAPES:
            return None
        number, sizes = list(_KERNEL_SHAPES).index(shape), _KERNEL_SHAPES[shape]
        entries = np.full((len(self.index), 4), -1)
        for column, name in [*enumerate(sizes), *((2, name) for name in names or ["web"])]:
            entries[:, column] = self._entry_arrays[prefix + name][:, 0]
        if side:
            entries[:, 3] = self._entry_arrays["shift"][:, 0]
        return Contour(number, entries, side)

    @property
    def has_stress(self) -> bool:
        """Whether stresses follow from internal forces: not of constants, nor where layers strain freely."""
        return self.kind not in (("constants",), ("layered", "driven"))

    def laminate(self, values: Array) -> Laminate:
        """The layers of layered members (..., members)."""
        sizes = self._filled(values)
        return laminate(*(sizes[name][..., 0, :] for name in ("thicknesses", "E", "nu", "rho")))

    def width(self, values: Array) -> Array:
        """Width of layered members (..., members), m."""
        return self._filled(values)["width"][..., 0]

    def layers(self, values: Array, name: str) -> Array:
        """Free strains (..., members, layers) of layered members per `voltage`, 1/V, or `temperature`, 1/K."""
        return self._filled(values)[name][..., 0, :]

    def _filled(self, values: Array) -> Sizes:
        """Sizes by field name."""
        return {name: values[..., entries] for name, entries in self._entry_arrays.items()}

    def sizes(self, values: Array, length: Array, fractions: Array) -> tuple[Array, ...]:
        """Arguments of the family's section formula, each (..., members, stations) or broadcastable to that.

        Width and thickness; diameter; outer and inner diameter; or the six constants. `values` are all entries,
        `length` (..., members) belongs to this group's members, and `fractions`, (stations,) or (members, stations),
        of it are the stations.
        """
        sizes = self._filled(values)
        match self.kind:
            case (shape,) if shape in _EVEN:
                return tuple(sizes[name] for name in _EVEN[shape])
            case ("layered", _):
                layers = self.laminate(values)
                return sizes["width"], layers.kz[..., None], layers.thickness[..., None]
            case ("tapered",):
                width, thickness = sizes["width"], sizes["thickness"]
                return tuple((1 - fractions) * s[..., 0] + fractions * s[..., 1] for s in (width, thickness))
        L = length[..., None]
        x = (fractions - 0.5) * L
        match self.kind:
            case ("notch", shape):
                return sizes["width"], _CONTOURS[shape](x, L / 2, sizes)
            case ("round", shape):
                return (_CONTOURS[shape](x, L / 2, sizes),)
        _, y_shape, z_shape = self.kind
        half = (L - np.abs(sizes["shift"])) / 2
        y_sizes, z_sizes = _of_axis(sizes, "y_"), _of_axis(sizes, "z_")
        y, z = (np.minimum(np.maximum(x + sign * sizes["shift"] / 2, -half), half) for sign in (1, -1))
        return _CONTOURS[y_shape](y, half, y_sizes), _CONTOURS[z_shape](z, half, z_sizes)

    def notch_ratios(self, values: Array, length: Array, fractions: Array) -> tuple[Array, Array]:
        """Half the web over the radius of the root, (..., members, stations) or broadcastable to that, of the notches
        in the faces across y and across z; zero where there is none. Arguments as in `sizes`."""
        sizes = self._filled(values)
        L, none = length[..., None], np.zeros(1)
        match self.kind:
            case ("notch", shape):
                return none, _notch_ratio(shape, L / 2, sizes)
            case ("round", shape):
                ratio = _notch_ratio(shape, L / 2, sizes)
                return ratio, ratio
            case ("two_axis", *shapes):
                half, x = (L - np.abs(sizes["shift"])) / 2, (fractions - 0.5) * L
                ratios = []
                for shape, prefix, sign in zip(shapes, ("y_", "z_"), (1, -1), strict=True):
                    inside = np.abs(x + sign * sizes["shift"] / 2) <= half * (1 + 1e-9)
                    ratios.append(np.where(inside, _notch_ratio(shape, half, _of_axis(sizes, prefix)), 0.0))
                return ratios[0], ratios[1]
        return none, none

    def between_blocks(self, values: Array, length: Array) -> tuple[Array, Array, Powers] | None:
        """Of circular and elliptical notches, (..., members, 1): radius or depth over web, width over length, and the
        powers of the factors of right-circular ones that they have between blocks (theory eq. F26); None of others.
        Arguments as in `sizes`."""
        sizes, L = self._filled(values), length[..., None]
        match self.kind:
            case ("notch", "circular"):
                upright = L * L / (4 * sizes["radius"] * sizes["radius"])
                return sizes["radius"] / sizes["web"], sizes["width"] / L, Powers(upright * upright, upright, upright)
            case ("notch", "elliptical"):
                steep = 2 * sizes["depth"] / L
                square = steep * steep
                powers = Powers(steep, 2 * steep / (1 + square), 2 * square / (1 + square * square))
                return sizes["depth"] / sizes["web"], sizes["width"] / L, powers
        return None

    def corners(self, values: Array, length: Array) -> Array:
        """Fractions of the length (members, points) at which the thickness of a tabulated notch turns. One design."""
        if "positions" not in self._entry_arrays:
            return np.empty((len(self.index), 0))
        return np.clip(values[self._entry_arrays["positions"]][:, 0] / length[:, None], 0.0, 1.0)

    def table_ends(self, values: Array) -> list[Array]:
        """The last positions (..., members) of tables, m; none of what has none."""
        tables = [entries for name, entries in self._entry_arrays.items() if name.endswith("positions")]
        return [values[..., entries[:, 0, -1]] for entries in tables]

    @property
    def fitting(self) -> list[Index]:
        """Entries of which, beside the length, it depends whether contours fit their members; none where all do."""
        if self.kind[0] != "two_axis" and _FITTING.isdisjoint(self.kind):
            return []
        return [entries.ravel() for name, entries in self._entry_arrays.items() if name.endswith(_FIT_BY)]

    def fits(self, values: Array, length: Array) -> Array:
        """Whether contours fit their members (..., members), as it is checked of a description, for `values` of all
        entries and `length` (..., members) of this group's members."""
        sizes = self._filled(values)
        L = length[..., None]
        match self.kind:
            case ("notch" | "round", shape):
                fit = _fits(shape, L / 2, sizes)
            case ("two_axis", *shapes):
                half = (L - np.abs(sizes["shift"])) / 2
                fit = half > 0
                for shape, prefix in zip(shapes, ("y_", "z_"), strict=True):
                    fit = fit & _fits(shape, half, _of_axis(sizes, prefix))
            case _:
                fit = np.ones(1, dtype=bool)
        return np.broadcast_to(fit, (*np.broadcast_shapes(fit.shape[:-1], L.shape[:-1]), 1))[..., 0]

    def properties(self, values: Array, nu: Array, length: Array, fractions: Array) -> SectionProperties:
        """Section properties (..., members, stations); arguments as in `sizes`, `nu` (..., members)."""
        return family_properties(self.family, self.sizes(values, length, fractions), nu[..., None])


def _of_axis(sizes: Sizes, prefix: str) -> Sizes:
    """Sizes of one contour of a notch in two axes."""
    return {name[2:]: size for name, size in sizes.items() if name.startswith(prefix)}


_FITTING = {"circular", "corner_filleted", "v_shaped", "table"}
"""Contours that fit only some lengths."""

_FIT_BY = ("radius", "angle", "positions", "shift")
"""Ends of the names of the sizes that `fits` looks at."""


def _fits(shape: str, half: Array, sizes: Sizes) -> Any:
    """Whether a contour fits between the ends of a notch (..., 1)."""
    match shape:
        case "circular":
            return sizes["radius"] >= half * (1 - SAME_SIZE)
        case "corner_filleted":
            return sizes["fillet_radius"] <= half * (1 + SAME_SIZE)
        case "v_shaped":
            return sizes["angle"] < np.pi / 2
        case "table":
            ends = sizes["positions"][..., 0], sizes["positions"][..., -1] - 2 * half
            return (np.abs(ends[0]) <= SAME_SIZE * 2 * half) & (np.abs(ends[1]) <= SAME_SIZE * 2 * half)
    return np.ones(1, dtype=bool)


def _notch_ratio(shape: str, half: Array, sizes: Sizes) -> Array:
    """Half the web over the radius of the root, zero for contours without one."""
    if shape not in _ROOTS:
        return np.zeros(1)
    with np.errstate(divide="ignore"):
        return sizes["web"] / 2 / _ROOTS[shape](half, sizes)


def family_properties(family: str, sizes: Sequence[Array], nu: Array) -> SectionProperties:
    """Apply the section formula of a family to its arguments and Poisson's ratio."""
    if family == "constants":
        return SectionProperties(*sizes)
    return _FORMULAS[family](*sizes, nu)


_FORMULAS = {
    "rectangle": rectangle,
    "circle": circle,
    "tube": tube,
    "layered": lambda b, kz, t, nu: rectangle(b, t, nu)._replace(kz=kz),
}
FAMILY_SIZES = {"rectangle": 2, "circle": 1, "tube": 2, "layered": 3, "constants": 6}
"""How many arguments each family's formula takes, Poisson's ratio aside."""


def section_groups(
    members: Sequence[Link | Flexure], mechanism: Mechanism, table: ValueTable, driven: Sequence[bool]
) -> list[tuple[SectionGroup, int, bool]]:
    """Members by kind: groups with their number of elements per member and whether they are integrated as tapered;
    `driven` says whose layers an actuator strains."""
    groups: dict[tuple[tuple[str, ...], tuple[int, ...], int, bool], SectionGroup] = {}
    for position, member in enumerate(members):
        if isinstance(member, Flexure):
            kind, sizes = _profile_sizes(member, mechanism, driven[position])
            is_tapered = (member.integration or ("tapered" if kind == ("tapered",) else "stepped")) == "tapered"
        else:
            section = mechanism.sections[member.section] if isinstance(member.section, str) else member.section
            kind, sizes, is_tapered = (section.shape,), _fields(section), False
        tables = tuple(len(value) for value in sizes.values() if isinstance(value, tuple))
        group = groups.setdefault((kind, tables, member.elements, is_tapered), SectionGroup(kind))
        group.members.append(position)
        for name, value in sizes.items():
            entry = table.add_all(value) if isinstance(value, tuple) else table.add(value)
            group.entries.setdefault(name, []).append(entry)
    for group in groups.values():
        group.freeze()
    return [(group, n, is_tapered) for (_, _, n, is_tapered), group in groups.items()]


def _fields(part: Part) -> dict[str, Any]:
    return {name: getattr(part, name) for name in type(part).model_fields if name not in ("shape", "type")}


def _layer_sizes(member: Flexure, profile: Layered, mechanism: Mechanism) -> dict[str, Any]:
    """The width, and thicknesses, moduli, densities and free strains of the layers, 1/V and 1/K."""
    materials = [mechanism.material(layer.material or member.material) for layer in profile.layers]
    return {
        "width": profile.width,
        "thicknesses": tuple(layer.thickness for layer in profile.layers),
        "E": tuple(m.E for m in materials),
        "nu": tuple(m.nu if m.nu is not None else m.E / (2 * m.G) - 1 for m in materials),  # type: ignore[operator]
        "rho": tuple(m.rho for m in materials),
        "voltage": tuple(layer.free_strain or 0.0 for layer in profile.layers),
        "temperature": tuple(m.expansion or 0.0 for m in materials),
    }


def _profile_sizes(member: Flexure, mechanism: Mechanism, driven: bool) -> tuple[tuple[str, ...], dict[str, Any]]:
    match profile := member.profile:
        case Layered():
            return ("layered", "driven" if driven else "passive"), _layer_sizes(member, profile, mechanism)
        case Leaf(tapers=True):
            return ("tapered",), {name: s if isinstance(s, tuple) else (s, s) for name, s in _fields(profile).items()}
        case Leaf():
            return ("leaf",), _fields(profile)
        case Notch():
            return ("notch", profile.contour.shape), {"width": profile.width, **_fields(profile.contour)}
        case RoundNotch():
            return ("round", profile.contour.shape), _fields(profile.contour)
        case TwoAxisNotch():
            y, z = profile.y_contour, profile.z_contour
            sizes: dict[str, Any] = {"shift": profile.shift}
            sizes |= {f"y_{name}": value for name, value in _fields(y).items()}
            sizes |= {f"z_{name}": value for name, value in _fields(z).items()}
            return ("two_axis", y.shape, z.shape), sizes
