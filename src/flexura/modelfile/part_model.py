"""A part from CAD as a whole mechanism, in a few words: of what it is made, where it is held, where others meet it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.mechanism import CATALOGUE, Mechanism
from flexura.modelfile.materials import material_of
from flexura.modelfile.reader import described

Words = str | Sequence[str]

CATALOGUE_METAL = "Al-7075-T6"
"""What stands for the material until that is read."""

SYNTAX = "NAME, 12, plane x = 0 mm, radius 3 mm, normal +z, colour #ff0000, near 1, 2, 3 mm; and joins them"
"""How faces are chosen in words."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_PLANE = re.compile(r"(?:plane\s+)?([xyz])\s*=\s*(.+)")
_NEAR = re.compile(rf"near\s*\(?\s*({_NUMBER})\s*,\s*({_NUMBER})\s*,\s*({_NUMBER})\s*\)?\s*(\S+)")
_FACES = re.compile(r"(?:faces?\s+)?(\d+(?:\s*[,+]\s*\d+)*)")
_WORD = re.compile(r"(radius|normal|colou?r|face)\s+(.+)")


def chosen_faces(text: str) -> dict[str, Any]:
    """What an interface says, of faces that are chosen in words. Raises OptionError for words that say nothing."""
    found: dict[str, Any] = {}
    for clause in re.split(r"\s+and\s+", text.strip()):
        if plane := _PLANE.fullmatch(clause):
            found[plane[1]] = plane[2].strip()
        elif near := _NEAR.fullmatch(clause):
            found["near"] = [f"{near[k]} {near[4]}" for k in (1, 2, 3)]
        elif numbers := _FACES.fullmatch(clause):
            listed = [int(number) for number in re.findall(r"\d+", numbers[1])]
            found["face"] = listed[0] if len(listed) == 1 else listed
        elif word := _WORD.fullmatch(clause):
            found["colour" if word[1].startswith("col") else word[1]] = (
                _direction(word[2]) if word[1] == "normal" else word[2]
            )
        elif clause and not re.search(r"[=,]", clause):
            found["face"] = clause
        else:
            raise OptionError(f"{text!r} does not say which faces are meant: {SYNTAX}")
    return found


def _direction(text: str) -> Any:
    """An axis such as +x, or three numbers."""
    numbers = re.findall(_NUMBER, text)
    return [float(number) for number in numbers] if len(numbers) == 3 else text.strip()


def named_choice(text: str, taken: Iterable[str], otherwise: str) -> tuple[str, dict[str, Any]]:
    """The name of an interface and what it says: that before a colon, the name of the face, else `otherwise`."""
    name, colon, rest = text.partition(":")
    if colon and re.fullmatch(r"\s*[A-Za-z_]\w*\s*", name):
        choice, wanted = chosen_faces(rest), name.strip()
    else:
        choice = chosen_faces(text)
        face = choice.get("face")
        wanted = face if isinstance(face, str) and re.fullmatch(r"[A-Za-z_]\w*", face) else otherwise
    used = set(taken)
    name, k = wanted, 1
    while name in used:
        k += 1
        name = f"{wanted}{k}"
    return name, choice


@verb
def part_model(
    path: str | PathLike[str],
    *,
    material: str,
    hold: Words = (),
    interface: Words = (),
    tolerance: float | None = None,
    up_to: float | None = None,
    mesh_tolerance: float | str | None = None,
    thickness: float | None = None,
    offset: float = 0.0,
    unit: str | None = None,
    name: str | None = None,
) -> Mechanism:
    """A part of a STEP file, a DXF or SVG drawing or a mesh as a mechanism, held at some faces, with a node at others.

    `material` is one of the catalogue, or `E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3`. `hold` and `interface` choose
    faces in words, one or several: by name, number, plane, radius, normal, colour or nearest point, after a name of
    their own where they are to have one, as in `tip: plane x = 60 mm`. `tolerance` is that of the reduction, `up_to`
    the frequency, with a unit or in Hz, up to which modes are to be right, `mesh_tolerance` what the mesh may make
    these wrong by, 0.005 or `0.5 %`. A drawing has a `thickness`, m, and an `offset`, m, of its outline, a mesh a
    `unit` of length, mm, um, cm, m or in. Nothing is read of the file yet. Raises ModelError and OptionError for what
    cannot be.
    """
    file = Path(path)
    if not file.is_file():
        raise OptionError(f"{file}: the file does not exist")
    key = re.sub(r"\W+", "_", file.stem).strip("_") or "part"
    key = key if key[0].isalpha() else f"part_{key}"
    interfaces: dict[str, dict[str, Any]] = {}
    held = []
    for texts, otherwise in ((hold, "base"), (interface, "interface")):
        for text in [texts] if isinstance(texts, str) else texts:
            own, choice = named_choice(text, interfaces, otherwise)
            interfaces[own] = choice
            if texts is hold:
                held.append(own)
    if not interfaces:
        rule = "a part needs a face that is held, or one at which others meet it"
        raise OptionError(f"{rule}: hold='plane x = 0 mm', interface='table' (--hold, --interface)")
    part: dict[str, Any] = {"material": CATALOGUE_METAL, "interfaces": interfaces}
    part["mesh" if unit is not None else "step" if thickness is None else "drawing"] = str(file.absolute())
    if unit is not None:
        part["unit"] = unit
    if thickness is not None:
        part |= {"thickness": f"{thickness!r} m", "offset": f"{offset!r} m"}
    data: dict[str, Any] = {"name": name or file.stem, "parts": {key: part}}
    if up_to is not None:
        part["up_to"] = f"{up_to:.12g} Hz"
    if mesh_tolerance is not None:
        part["mesh_tolerance"] = _share(mesh_tolerance)
    if held:
        data["ground"] = {f"{key}.{own}": "clamped" for own in held}
    if tolerance is not None:
        data["reduction"] = {"tolerance": tolerance}
    mechanism = described(data, str(file))
    if material in CATALOGUE:
        return mechanism.replaced({"parts": {key: mechanism.parts[key].replaced({"material": material})}})
    metal = {"materials": {"metal": material_of(material)}}
    return mechanism.replaced({**metal, "parts": {key: mechanism.parts[key].replaced({"material": "metal"})}})


def _share(value: float | str) -> float:
    """A share, also in per cent."""
    text = str(value).strip()
    try:
        return float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except ValueError:
        raise OptionError(f"{value!r} is no share, such as 0.005 or 0.5 %") from None
