"""STEP files of parts for tests, written by OpenCASCADE."""

from pathlib import Path
from typing import Any

METAL = "Al-7075-T6"


def written(shape: Any, path: Path, **names: tuple[str, float]) -> Path:
    """A shape as a STEP file; `names` are those of faces whose middles have a coordinate, as in base=("x", 0.0), mm."""
    for name, (axis, at) in names.items():
        for face in shape.faces:
            if abs(getattr(face.center, axis) - at) < 1e-6:
                face.name = name
    shape.WriteStep(str(path))
    return path


def bar(path: Path, length: float = 60.0) -> Path:
    """A bar 6 x 4 mm along x from the origin, its ends called base and tip."""
    from netgen import occ

    return written(occ.Box((0, 0, 0), (length, 6, 4)), path, base=("x", 0.0), tip=("x", length))


def leaf_guide(path: Path) -> Path:
    """Two blocks and two leaves in one piece: monolith B of the tests."""
    from netgen import occ

    blocks = occ.Box((0, 0, 0), (8, 30, 12)) + occ.Box((28, 0, 0), (36, 30, 12))
    leaves = occ.Box((8, 2, 0), (28, 2.5, 12)) + occ.Box((8, 27.5, 0), (28, 28, 12))
    return written(blocks + leaves, path, base=("x", 0.0), table=("x", 36.0))


def notch_guide(path: Path) -> Path:
    """A frame with four right-circular notches in one piece: monolith A of the tests."""
    from netgen import occ

    shape = occ.Box((0, 0, 0), (60, 40, 10)) - occ.Box((10, 6.3, -1), (50, 33.7, 11))
    for y in (0.0, 6.3, 33.7, 40.0):
        for x in (16, 44):
            shape = shape - occ.Cylinder(occ.Pnt(x, y, -1), occ.Z, 3, 12)
    return written(shape, path, base=("x", 0.0), table=("x", 60.0))
