"""Numbers of things in words."""

import pytest

import flexura as fx
from flexura.tables import counted


@pytest.mark.parametrize(
    ("count", "what", "said"),
    [
        (0, "warning", "0 warnings"),
        (1, "more pair", "1 more pair"),
        (2, "resonance", "2 resonances"),
        (1, "frequency", "1 frequency"),
        (3, "frequency", "3 frequencies"),
        (2, "assay", "2 assays"),
    ],
)
def test_one_is_singular(count, what, said):
    assert counted(count, what) == said


def test_one_frequency_is_told_as_one():
    found = fx.frequency_response(fx.load("examples/guide/guide.yaml"), frequency_hz=[10.0])
    assert "1 frequency from 10 to 10 Hz" in found._repr_html_()
