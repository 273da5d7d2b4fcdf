"""The member that is stressed most, and in words what several do that are stressed alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from flexura.analysis import settled
from flexura.duals import Dual, plain
from flexura.errors import SolverError
from flexura.structure import Plan
from flexura.study.questions.catalogue import Quantity
from flexura.study.questions.reading import Members, Reader

UNKNOWN = "no stress is known of sections that are given by constants"

ALIKE = 1e-12
"""Relative difference up to which members are stressed alike."""


def worst(state: Any, asked: Quantity) -> Any:
    """The largest stress, or the margin to yield, of the members asked for, in a state with slopes.

    Raises SolverError where no stress is known; a margin is infinite where no yield stress is.
    """
    members, _ = _asked(state, asked)
    if not members and asked.kind == "margin":
        return np.inf
    if not members:
        raise SolverError(UNKNOWN)
    largest = _largest(state, asked)
    return largest if asked.kind == "stress" else 1 / largest


def by_members(plan: Plan, asked: Quantity) -> list[Quantity]:
    """Of a stress or a margin that of each member it is the worst of; nothing of all else."""
    if asked.kind not in ("stress", "margin"):
        return []
    of, known = next(iter(asked.arguments), None), Reader(plan).yield_stresses
    names = (
        of.members
        if isinstance(of, Members)
        else [name for name, limit in known.items() if asked.kind == "stress" or not np.isnan(limit)]
    )
    _, at, pose = asked.text.partition(" at ")
    return [
        replace(asked, text=f"{asked.kind}({name}){at}{pose}", arguments=(Members(name, (name,)),)) for name in names
    ]


def parting(state: Any, asked: Quantity, names: Sequence[str]) -> str:
    """Why a stress or margin has no derivative by some of the parameters `names`, with those on either side where
    members that are stressed alike part; empty where it has all."""
    largest = _largest(state, asked) if _asked(state, asked)[0] else np.inf
    if not isinstance(largest, Dual) or not np.isnan(largest.slope).any():
        return ""
    members, own = _asked(state, asked, share=1.0)
    tied = np.flatnonzero(plain(own) >= plain(largest) * (1 - ALIKE))
    said = []
    for p in np.flatnonzero(np.isnan(largest.slope)).tolist():
        sides = own.slope[p, tied] / (1 if asked.kind == "stress" else -(plain(largest) ** 2))
        if np.isnan(sides).any():
            said.append(f"sections of {members[tied[0]]} part with {names[p]}, or it is at a kink")
        else:
            ends = sorted((sides.max(), sides.min()), reverse=asked.kind == "stress")
            said.append(f"by {names[p]} it is {ends[0]:.6g} upwards and {ends[1]:.6g} downwards, per SI unit")
    alike = f"{', '.join(members[k] for k in tied[:4])}{' ...' if len(tied) > 4 else ''} are stressed alike: "
    return f"{asked.text}: {alike if len(tied) > 1 else ''}{'; '.join(said)}"


def _largest(state: Any, asked: Quantity) -> Any:
    """The largest stress of the members asked for, for a margin over yield stresses."""
    return settled(lambda share: np.max(_asked(state, asked, share)[1]))


def _asked(state: Any, asked: Quantity, share: float = 0.0) -> tuple[list[str], Any]:
    """Members asked for and their stresses (m,), for a margin over their yield stresses."""
    largest, of = state.stresses_within(share) if share else state.stresses, next(iter(asked.arguments), None)
    chosen = [k for k, name in enumerate(largest.names) if not isinstance(of, Members) or name in of.members]
    if asked.kind == "stress":
        return [largest.names[k] for k in chosen], largest.von_mises[chosen, 0]
    limit = largest.yield_stress
    chosen = [k for k in chosen if not np.isnan(plain(limit)[k])]
    return [largest.names[k] for k in chosen], largest.von_mises[chosen, 0] / limit[chosen]
