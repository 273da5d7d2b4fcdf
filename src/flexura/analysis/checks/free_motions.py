"""What moves freely, or all but freely, as far as it can be proven."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.linalg import Eigenpairs, bracket, leading
from flexura.reduction import Certificate, ChainedModel, certificate, chained, lowest_pairs
from flexura.structure import FullOrderModel
from flexura.tables import in_hz

LOOSE = 3e-5
"""Part of the highest frequency looked at below which a motion counts as all but free."""

LOOKED_AT = 8
"""Lowest modes that are looked at, rigid motions of unconnected parts beyond six not counted."""

HINT = "a joint, a support or a stiffness may be missing"


@dataclass(frozen=True)
class FreeMotions:
    """How many independent rigid motions strain nothing, and an interval that is proven to hold the lowest other
    frequency, Hz; None where it is not known, and where there is none."""

    rigid_body_modes: int | None
    lowest_hz: tuple[float, float] | None
    doubts: tuple[Diagnostic, ...] = ()


def free_motions(full: FullOrderModel) -> FreeMotions:
    """The rigid motions of a mechanism, and doubts about motions that are free or all but free, by the DOF that moves
    most; what round-off hides is a doubt as well."""
    if not full.order:
        return FreeMotions(0, None, (Diagnostic.about("held", "every node is held: nothing can move", "mechanism"),))
    own = chained(full)
    n = min(max(LOOKED_AT, own.free_motions + 2), own.pencil.order)
    try:
        pairs = lowest_pairs(own, n)
        return _judged(own, pairs, certificate(own, pairs, n))
    except OptionError:  # no mass, no frequency
        return _massless(own)
    except SolverError as error:
        text = f"whether anything moves freely is not known: {error}"
        return FreeMotions(None, None, (Diagnostic.about("proof", text, "mechanism"),))


def _massless(own: ChainedModel) -> FreeMotions:
    """Without mass the stiffness is all that can be judged."""
    doubts = [Diagnostic.about("mass", "nothing that moves has any mass: there are no modes", "mechanism")]
    pencil = own.pencil
    held = bool((pencil.K.diagonal() > 0).all()) and bracket(pencil, 0.0).most == 0
    if not held:
        doubts.append(Diagnostic.about("mechanism", f"it is not proven that nothing moves freely; {HINT}", "mechanism"))
    return FreeMotions(0 if held else None, None, tuple(doubts))


def _judged(own: ChainedModel, pairs: Eigenpairs, proof: Certificate) -> FreeMotions:
    """Rigid motions, the first frequency beyond them, and the doubts."""
    hz, lower, upper = proof.frequency_hz, proof.lower_hz, proof.upper_hz
    rigid = int(((hz == 0) & (lower == 0) & (np.arange(len(hz)) < own.free_motions)).sum())
    doubts = _rigid(own, pairs, rigid)
    for k in range(rigid, len(hz)):
        if not (lower[k] > 0 and proof.is_indexed[k]):
            text = f"free to move, or held by less than round-off hides (below {in_hz(upper[k], 2)}); {HINT}"
        elif upper[k] < LOOSE * hz[-1]:
            text = f"all but free to move ({in_hz(hz[k], 2)}); {HINT}"
        else:
            break
        doubts.append(Diagnostic.about("mechanism", text, _moving(own, pairs, k)))
    if not proof.is_counted:
        text = f"round-off hides how many modes lie below {in_hz(proof.below_hz)}: {proof.count} at most"
        doubts.append(Diagnostic.about("proof", text, "mechanism"))
    elif not proof.is_complete:
        text = f"{proof.missing} of the {proof.count} modes below {in_hz(proof.below_hz)} were not found"
        doubts.append(Diagnostic.about("proof", text, "mechanism"))
    first = rigid if rigid < len(hz) and proof.is_indexed[rigid] and np.isfinite(upper[rigid]) else None
    return FreeMotions(rigid, None if first is None else (float(lower[first]), float(upper[first])), tuple(doubts))


def _rigid(own: ChainedModel, pairs: Eigenpairs, rigid: int) -> list[Diagnostic]:
    """Doubts about rigid motions that strain nothing: of the whole, where nothing holds it, else each by itself."""
    topology = own.model.plan.topology
    if rigid == 6 and not topology.held.any():
        text = "not held anywhere: six rigid-body modes at zero frequency"
        return [Diagnostic.about("ungrounded", text, "mechanism")]
    text = f"free to move; {HINT}"
    return [Diagnostic.about("mechanism", text, _moving(own, pairs, k)) for k in range(rigid)]


def _moving(own: ChainedModel, pairs: Eigenpairs, k: int) -> str:
    """Name of the DOF that moves most in a mode, by its mass."""
    shape = np.abs(own.recover(pairs.vectors[:, [k]])[:, 0] * np.sqrt(np.abs(own.model.M.diagonal())))
    return own.model.dof_names[int(leading(shape))]
