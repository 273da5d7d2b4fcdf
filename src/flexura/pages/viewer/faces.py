"""The scene of a part from CAD: its faces, each with what chooses it in a file."""

from __future__ import annotations

import numpy as np

from flexura.fem import Drawing, PartFace
from flexura.pages.viewer.motions import triple
from flexura.pages.viewer.scene import Buffer, Fact, Scene, ShownKind, ShownPart
from flexura.pages.viewer.scenes import picture_of
from flexura.tables import in_mm, quantity
from flexura.view import draw_faces

COLOURS = {"plane": "#a9c4e0", "cylinder": "#f0b989", "other": "#b8d8b0"}
"""Of faces that have none in the file, by kind."""


def scene_of_faces(drawing: Drawing) -> Scene:
    """The faces of a part, apart by kind and by colour in the file."""
    corners = [np.unique(face.triangles.reshape(-1, 3), axis=0, return_inverse=True) for face in drawing.faces]
    first = np.cumsum([0, *(len(points) for points, _ in corners)])
    triangles = [index.reshape(-1, 3) + start for (_, index), start in zip(corners, first, strict=False)]
    begins = np.cumsum([0, *map(len, triangles)]).tolist()
    kinds = {_kind(face).key: _kind(face) for face in drawing.faces}
    counts: dict[str, int] = {}
    for face in drawing.faces:
        for text, choice in face.choices.items():
            if text not in counts:
                counts[text] = len(drawing.chosen(choice))
    return Scene(
        name=drawing.name,
        size=float(np.ptp(drawing.box, axis=0).max()),
        bounds=(triple(drawing.box[0]), triple(drawing.box[1])),
        kinds=tuple(kinds[key] for key in sorted(kinds)),
        parts=tuple(
            ShownPart(
                f"face {face.number}",
                _kind(face).key,
                _facts(face),
                (begins[k], len(triangles[k])),
                choices=tuple((text, _told(counts[text])) for text in face.choices),
            )
            for k, face in enumerate(drawing.faces)
        ),
        points=Buffer.floats(np.concatenate([points for points, _ in corners])),
        triangles=Buffer.numbers(np.concatenate(triangles)),
        lines=Buffer.numbers(np.zeros((0, 2))),
        dots=Buffer.numbers(np.zeros(0)),
        picture=picture_of(draw_faces(drawing)),
        notes=drawing.notes,
    )


def _kind(face: PartFace) -> ShownKind:
    label = f"{face.kind} {face.colour}".strip()
    return ShownKind(label, label, face.colour or COLOURS[face.kind], 1.0, "faces")


def _told(count: int) -> str:
    return "this face" if count == 1 else f"{count} faces"


def _facts(face: PartFace) -> tuple[Fact, ...]:
    told = {
        "kind": face.form,
        "name": face.name,
        "solid": face.solid,
        "area": quantity(face.area, "m^2", 4),
        "middle": f"{in_mm(face.centre)} mm",
    }
    return tuple((name, text) for name, text in told.items() if text)
