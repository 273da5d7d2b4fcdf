"""`check` and `modes` of whatever sizes end in an answer or a word; warnings of arithmetic are errors here."""

import warnings
from pathlib import Path

import pytest

import flexura as fx

ROOT = Path(__file__).parents[2]
FILES = [*sorted((ROOT / "src/flexura/gallery").glob("*.yaml")), *sorted((ROOT / "examples").glob("*/*.yaml"))]

STAGE = """\
parameters: {side: 8 mm, width: 3 mm}
materials: {steel: spring-steel}
nodes: {foot: [-10 mm, 0, 0], head: [0, 0, 0]}
flexures:
  leaf: {nodes: [foot, head], material: steel, reference: z, profile: {type: leaf, width: width, thickness: 0.3 mm}}
bodies:
  column:
    centre: [0, 0, 10 mm]
    carries: [head]
    solid: {shape: SHAPE, material: Al-6061-T6}
ground: {foot: clamped}
"""


@pytest.fixture(autouse=True)
def arithmetic_warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        yield


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_what_is_described_here(file):
    fx.check(fx.load(file))


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ("cylinder, diameter: 0.1 um, length: 44 mm", "too slender"),
        ("box, size: [0.1 um, 20 km, 20 mm]", "too slender"),
        ("box, size: [0.1 um, 0.1 um, 0.1 um]", ""),
    ],
)
def test_a_body_of_which_round_off_hides_how_it_gives(shape, said):
    model = fx.loads(STAGE.replace("SHAPE", shape))
    report, found = fx.check(model), fx.modes(model, n=3)
    assert len(found.frequency_hz) == 3
    told = " ".join(map(str, (*report.warnings, *report.minor)))
    assert said in told


def test_leaves_far_wider_than_long():
    """Stiffness so uneven that nothing can be solved is a word, not a division by zero."""
    try:
        report = fx.check(fx.loads(STAGE.replace("SHAPE", "box, size: [8 mm, 8 mm, 8 mm]").replace("3 mm", "10 km")))
    except fx.FlexuraError:
        return
    assert report.warnings
