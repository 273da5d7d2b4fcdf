"""Modes of the full order where many branches are equal, from the small problems that it splits into."""

from __future__ import annotations

from flexura.analysis.natural_modes.evidence import Evidence, mass_evidence
from flexura.analysis.natural_modes.proven_modes import Modes, certified_mode, unproven, with_mesh_errors
from flexura.analysis.strain.motion import motions
from flexura.reduction import TOLERANCE, SplitModel, state_of


def split_modes(split: SplitModel, n: int, parameters: dict[str, float]) -> Modes:
    """The `n` lowest modes of a full-order model that is split by its equal branches."""
    full = split.model
    proof, pairs = split.certificate(n), split.lowest(n)
    u = full.node_displacements(pairs.vectors)
    found = tuple(  # a model is split only where its stiffness is definite: nothing is rigid
        certified_mode(k, (proof, 0, TOLERANCE), (float(proof.frequency_hz[k]), 0.0, 1.0), motion)
        for k, motion in enumerate(motions(full, u))
    )
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
        is_counted=proof.is_counted,
    )
    names = tuple(full.plan.topology.node_names)
    name = full.plan.mechanism.name
    steps = (split.summary, *state_of(full.design))
    told, meshes = with_mesh_errors(full, found, u)
    said = (*unproven(told, proof, TOLERANCE), *meshes)
    return Modes(
        name, full.order, full.order, told, evidence, u, names, parameters, full, proof, steps, TOLERANCE, said
    )  # fmt: skip
