"""What is wrong with a description that no single part of it can see."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from flexura.errors import Problem
from flexura.mechanism.checks.assembly import check_assembly
from flexura.mechanism.checks.bodies import check_bodies
from flexura.mechanism.checks.connection import check_connection
from flexura.mechanism.checks.members import check_members
from flexura.mechanism.checks.own_values import check_own_values
from flexura.mechanism.checks.references import check_not_empty, check_references
from flexura.mechanism.checks.studies import check_studies
from flexura.mechanism.checks.survey import Survey
from flexura.mechanism.checks.values import check_values
from flexura.mechanism.positions import Point, node_positions
from flexura.mechanism.substructure import Mechanism


def problems(mechanism: Mechanism, *, ignore_missing: Collection[str] = (), partial: bool = False) -> list[Problem]:
    """Everything wrong with the mechanism as a whole, at the default values of its parameters.

    Names in `ignore_missing` are known to be missing, so that references to them are no news. With `partial`
    some of the description is absent: nothing is said about unused nodes, patterns without a match and
    disconnected parts.
    """
    values, found = check_values(mechanism, ignore_missing)
    found += check_studies(mechanism, values, ignore_missing)
    layout, lost, more = check_assembly(mechanism, ignore_missing)
    found += more
    if layout is None:
        return found
    found += check_own_values(layout, values, ignore_missing)
    layout.evaluate(values)
    survey = Survey(layout, lost, ignore_missing, partial)
    check_references(survey)
    sound = not survey.problems and not any(lost.values()) and not partial
    with np.errstate(all="ignore"):
        survey.positions = node_positions(layout, values)
        survey.size = _size(survey.positions)
        check_members(survey)
        check_bodies(survey)
    if not partial:
        check_not_empty(survey)
    if sound:
        check_connection(survey)
    return list(dict.fromkeys([*found, *survey.problems]))


def _size(positions: dict[str, dict[str, Point]]) -> float:
    """Diagonal of the largest prototype, m."""
    largest = 0.0
    for nodes in positions.values():
        points = np.array([p for p in nodes.values() if all(map(math.isfinite, p))])
        if len(points):
            largest = max(largest, float(np.linalg.norm(np.ptp(points, axis=0))))
    return largest if math.isfinite(largest) else 0.0
