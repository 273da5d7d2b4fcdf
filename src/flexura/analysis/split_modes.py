"""Modes of the full order where many branches are equal, from the small problems that it splits into."""

from __future__ import annotations

import numpy as np

from flexura.analysis.evidence import Evidence, mass_evidence
from flexura.analysis.modes import Mode, Modes, with_mesh_errors
from flexura.analysis.motion import motions
from flexura.reduction.equal_branches import SplitModel
from flexura.reduction.model import STATE

HERTZ = 2 * np.pi


def split_modes(split: SplitModel, n: int, parameters: dict[str, float]) -> Modes:
    """The `n` lowest modes of a full-order model that is split by its equal branches."""
    full = split.model
    proof, pairs = split.certificate(n), split.lowest(n)
    u = full.node_displacements(pairs.vectors)
    found = []
    for k, motion in enumerate(motions(full, u)):
        hz = float(proof.frequency_hz[k])
        lower, upper = (float(b[k]) if np.isfinite(b[k]) else None for b in (proof.lower_hz, proof.upper_hz))
        found.append(Mode(k + 1, hz, HERTZ * hz, hz, 0.0, 1.0, (lower, upper), bool(proof.is_indexed[k]), motion))
    evidence = Evidence(
        **mass_evidence(full),
        rigid_body_modes=0,
        full_residual=split.residual(n),
        low_residual=None,
        sturm_below_hz=proof.below_hz,
        sturm_count=proof.count,
        reported_below=proof.found,
        missed=(),
        more_missed=proof.missing,
    )
    names = tuple(full.plan.topology.node_names)
    name = full.plan.mechanism.name
    steps = (split.summary, STATE) if full.plan.is_loaded else (split.summary,)
    told, said = with_mesh_errors(full, tuple(found), u)
    order = full.order
    return Modes(name, order, order, told, evidence, u, names, parameters, full, proof, steps, warnings=said)
