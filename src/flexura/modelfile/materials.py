"""Materials as text: a name of the catalogue, or constants as a model file has them."""

from __future__ import annotations

from flexura.errors import ModelError, OptionError, did_you_mean
from flexura.mechanism import CATALOGUE, Material
from flexura.modelfile.reader import loads

LONGEST = 1000
"""Characters of a material."""


def material_of(text: str) -> Material:
    """The material of a text: a name of the catalogue, or constants such as 'E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3'.

    Raises OptionError for anything else.
    """
    name = text.strip()
    if name in CATALOGUE:
        return CATALOGUE[name]
    if ":" not in name:
        hint = did_you_mean(name, CATALOGUE, f"materials: {', '.join(CATALOGUE)}")
        raise OptionError(f"there is no material {name[:LONGEST]!r}: {hint}, or 'E: ..., nu: ..., rho: ...'")
    if len(name) > LONGEST or any(sign in name for sign in "{}\n\r&*!"):
        raise OptionError("a material is its constants, as in 'E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3'")
    body = "nodes: {a: [0, 0, 0]}\nbodies: {b: {carries: [a], mass: 1 kg, inertia: [1 kg*m^2, 1 kg*m^2, 1 kg*m^2]}}"
    try:
        mechanism = loads(f"flexura: 1\nmaterials: {{metal: {{{name}}}}}\n{body}\n")
    except ModelError as error:
        reasons = [
            f"{'.'.join(map(str, own.path[2:])) or 'material'}: {own.rule}"
            + (f" (found {own.value})" if own.value else "")
            for own in error.problems
        ]
        raise OptionError(f"material {name!r}: {'; '.join(reasons)}") from None
    return mechanism.material("metal")
