"""Parameters set on a command line."""

from __future__ import annotations

import pytest

from flexura.errors import OptionError
from flexura.expressions import parameter
from flexura.mechanism import Link, Mechanism, Parameter, SectionConstants
from flexura.modelfile import loads, parse_override
from helpers.modelfile_samples import AMPLIFIER

MECHANISM = loads(AMPLIFIER)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("t=0.4 mm", ("t", 0.4e-3)),
        (" t = 2*0.2mm ", ("t", 0.4e-3)),
        ("half=3 mm", ("half", 3e-3)),
        ("phi=0.5", ("phi", 0.5)),
        ("phi=90 deg", ("phi", 1.5707963267948966)),
        ("m=0", ("m", 0.0)),
    ],
)
def test_values(text, expected):
    assert parse_override(MECHANISM, text) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t", "NAME=VALUE"),
        ("t=", "NAME=VALUE"),
        ("tt=1 mm", "did you mean 't'"),
        ("zz=1 mm", "parameters: t, m, L"),
        ("t=1", "a value of t carries a unit.*write 1 mm"),
        ("t=1 kg", "in m; this is in kg"),
        ("t=1 mmm", "not a unit"),
        ("t=nan", "not defined"),
        ("t=L/2", "not defined"),
        ("t=1e999 mm", "finite"),
        ("t=1 mm/0", "finite"),
        ("t=(", "too early"),
    ],
)
def test_what_is_refused(text, message):
    with pytest.raises(OptionError, match=message):
        parse_override(MECHANISM, text)


def test_a_parameter_of_python_without_unit_takes_any_dimension():
    section = SectionConstants(A=parameter("w") ** 2, Iy=1e-12, Iz=1e-12, J=1e-12)
    mechanism = Mechanism(
        parameters={"w": Parameter(value=1e-3)},
        nodes={"a": (0, 0, 0), "b": (1, 0, 0)},
        links={"l": Link(nodes=("a", "b"), material="silicon", section=section, reference="z")},
    )
    assert parse_override(mechanism, "w=2 mm") == ("w", 2e-3)
    assert parse_override(mechanism, "w=2e-3") == ("w", 2e-3)
