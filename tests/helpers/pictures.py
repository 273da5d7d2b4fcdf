"""A mechanism to draw, and what every picture must hold to."""

import itertools

from matplotlib.text import Text

from flexura.mechanism import Box, CircularContour, Flexure, Leaf, Link, Mechanism, Notch, Rectangle, RigidBody

AL = "Al-7075-T6"


def guide():
    """A block on two leaf springs, one with a stiff middle."""
    profile = Leaf(width=0.02, thickness=0.0008)
    notch = Notch(width=0.02, contour=CircularContour(radius=0.003, web=0.0006))
    bar = Rectangle(width=0.02, thickness=0.0066)
    return Mechanism(
        name="Guide",
        nodes={
            "a": (0, 0, 0),
            "b": (0, 0, 0.05),
            "c": (0.05, 0, 0),
            "d": (0.05, 0, 0.006),
            "e": (0.05, 0, 0.044),
            "f": (0.05, 0, 0.05),
        },
        flexures={
            "leaf": Flexure(nodes=("a", "b"), material=AL, reference="x", profile=profile),
            "low": Flexure(nodes=("c", "d"), material=AL, reference="x", profile=notch),
            "high": Flexure(nodes=("e", "f"), material=AL, reference="x", profile=notch),
        },
        links={"bar": Link(nodes=("d", "e"), material=AL, reference="x", section=bar)},
        bodies={
            "stage": RigidBody(
                centre=(0.025, 0, 0.055), carries=("b", "f"), solid=Box(size=(0.06, 0.03, 0.01), material=AL)
            )
        },
        ground={"a": "clamped", "c": "clamped"},
    )


def assert_no_overlap(figure):
    figure.canvas.draw()
    texts = [t for t in figure.findobj(Text) if t.get_text().strip() and t.get_visible()]
    boxes = [(t.get_text(), t.get_window_extent()) for t in texts]
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        inner = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(inner) < 2, (one, other)
    for text, b in boxes:
        assert b.x0 >= 0 and b.y0 >= 0, text
        assert b.x1 <= figure.bbox.width and b.y1 <= figure.bbox.height, text
