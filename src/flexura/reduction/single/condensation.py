"""The last step to very few coordinates: Guyan, IRS, SEREP and modal condensation of a low-order model.

Every physical displacement stays recoverable, and static response exact at the static nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
import scipy.linalg as la

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.linalg import lowest, scaled, unit_scale
from flexura.reduction.single.model import LowOrderModel, SubstructureBasis
from flexura.sizes import within

Condensation = Literal["guyan", "irs", "iterated_irs", "serep", "modal"]

DEPENDENT = 1e-7
"""Relative size of the last pivot below which coordinates do not tell the modes apart."""

ROUNDS = 30
"""Most rounds of iterated IRS."""

SETTLED = 1e-12
"""Relative change of the squared frequencies at which iterated IRS ends."""


@verb
def condense(
    low: LowOrderModel,
    to: int | Sequence[str],
    *,
    method: Condensation = "serep",
    modes: Sequence[int] | None = None,
) -> LowOrderModel:
    """Condense a low-order model to very few of its coordinates (theory eqs. R7-R10).

    `to` names coordinates (`platform.tz`) or nodes with all six (`platform`), or is the number of coordinates, which
    are then chosen among those of rigid bodies, or where these do not suffice among all displacements. Methods: `guyan`
    (1965), `irs` (O'Callahan 1989), `iterated_irs` (Friswell, Garvey and Penny 1995), `serep` (O'Callahan, Avitabile
    and Riemer 1989), which has the lowest frequencies of the model exactly, and `modal`, the same in coordinates of
    the modes. These two have the lowest modes, or those numbered in `modes`, from 1, as many as coordinates. Raises
    OptionError for coordinates that are not there or do not tell the modes apart, and for modes that are not there.
    """
    if method not in get_args(Condensation):
        raise OptionError(f"method is one of {', '.join(get_args(Condensation))}, not {method!r}")
    K, M = low.K, low.M
    if isinstance(to, int | np.integer):
        masters, m = None, int(to)
    else:
        masters = _named(low, to)
        m = len(masters)
    if not 1 <= m <= low.order:
        raise OptionError(
            f"a model of order {low.order} is condensed to between 1 and {low.order} coordinates, not {m}"
        )
    numbers = np.arange(m) if modes is None else _numbered(modes, m, low.order, method)
    weight = np.sqrt(M.diagonal())
    if masters is None or method in ("serep", "modal"):
        pairs = lowest(K, M, int(numbers[-1]) + 1)
        if not np.isfinite(pairs.values).all():
            raise OptionError(f"the model has only {np.isfinite(pairs.values).sum()} modes; ask for fewer coordinates")
        vectors = pairs.vectors[:, numbers]
        if method == "modal":
            return low.projected(vectors, [f"mode {k + 1}" for k in numbers], f"{m} modal coordinates")
        masters = _chosen(low, vectors, weight) if masters is None else masters
        if method == "serep":
            return low.projected(_serep(vectors, masters, weight), *_said(low, masters, method))
    within("dense_entries", low.order**2, f"{method.replace('_', ' ')} of a model of order {low.order}")
    K, M = (np.asarray(A.toarray() if hasattr(A, "toarray") else A) for A in (K, M))
    return low.projected(_reduced_system(K, M, masters, method), *_said(low, masters, method))


def _said(low: LowOrderModel, masters: Index, method: str) -> tuple[list[str], str]:
    """Names of the coordinates, and the step in words."""
    step = f"{method.replace('_', ' ')} to {len(masters)} coordinates"
    return [low.coordinate_names[k] for k in masters], step


def _numbered(modes: Sequence[int], count: int, order: int, method: str) -> Index:
    """Positions of modes that are numbered from 1."""
    if method not in ("serep", "modal"):
        raise OptionError(f"modes are chosen for serep and modal; {method} finds its own")
    numbers = sorted(set(modes))
    if len(numbers) != len(modes) or len(numbers) != count:
        raise OptionError(f"{count} coordinates have {count} different modes, not {', '.join(map(str, modes))}")
    if not all(isinstance(k, int | np.integer) and 1 <= k <= order for k in numbers):
        raise OptionError(f"modes are numbered from 1 to {order}, not {', '.join(map(str, modes))}")
    return np.array(numbers, dtype=np.intp) - 1


def _serep(modes: Array, masters: Index, weight: Array) -> Array:
    at = modes[masters] * weight[masters, None]
    pivots = np.abs(np.diagonal(la.qr(at, pivoting=True)[1]))
    if pivots[-1] < DEPENDENT * pivots[0]:
        raise OptionError(
            "these coordinates do not distinguish the lowest modes; name others, or give only their number"
        )
    return modes @ np.linalg.solve(at, np.diag(weight[masters]))


def _reduced_system(K: Array, M: Array, masters: Index, method: str) -> Array:
    """T (n, m) of Guyan and of the improved reduced system."""
    n, m = len(K), len(masters)
    slaves = np.setdiff1d(np.arange(n), masters)
    T = np.zeros((n, m))
    T[masters, np.arange(m)] = 1.0
    if not len(slaves):
        return T
    K_ss = K[np.ix_(slaves, slaves)]
    d = unit_scale(K_ss)
    try:
        factor = la.cho_factor(scaled(K_ss, d))
    except la.LinAlgError:
        raise OptionError("with these coordinates held something can still move freely; name more of them") from None

    def flexible(forces: Array) -> Array:
        return d[:, None] * la.cho_solve(factor, d[:, None] * forces)

    guyan = -flexible(K[np.ix_(slaves, masters)])
    T[slaves] = guyan
    if method == "guyan":
        return T
    before = np.zeros(m)
    for _ in range(ROUNDS if method == "iterated_irs" else 1):
        K_r, M_r = T.T @ K @ T, T.T @ M @ T
        T[slaves] = guyan + flexible((M @ T)[slaves] @ np.linalg.solve(M_r, K_r))
        values = lowest(T.T @ K @ T, T.T @ M @ T, m).values
        if np.abs(values - before).max() <= SETTLED * values.max():
            break
        before = values
    return T


def _named(low: LowOrderModel, names: Sequence[str]) -> Index:
    known = {name: k for k, name in enumerate(low.coordinate_names)}
    found: list[int] = []
    for name in [names] if isinstance(names, str) else names:
        own = [known[name]] if name in known else [k for text, k in known.items() if text.rpartition(".")[0] == name]
        if not own:
            raise OptionError(f"the model has no coordinate of {name!r}; `coordinate_names` lists those it has")
        found += own
    if not found or len(set(found)) < len(found):
        raise OptionError("name at least one coordinate, and each only once")
    return np.array(found, dtype=np.intp)


def _chosen(low: LowOrderModel, modes: Array, weight: Array) -> Index:
    """As many coordinates as modes (n, m) that tell them apart best: pivoted QR of the modes there, bodies first."""
    count = modes.shape[1]
    weighted = modes * weight[:, None]
    plan, names = low.plan, low.coordinate_names
    bodies = {
        ".".join((*path, key))
        for name, part in plan.parts.items()
        for path in plan.topology.copies[name].paths
        for key in part.bodies
    }
    of_bodies = np.array([k for k, name in enumerate(names) if name.rpartition(".")[0] in bodies], dtype=np.intp)
    n = len(low.basis.assembler.physical) if isinstance(low.basis, SubstructureBasis) else low.order
    for candidates in (of_bodies, np.arange(n), np.arange(low.order)):
        if len(candidates) >= count:
            _, R, order = la.qr(weighted[candidates].T, mode="economic", pivoting=True)
            pivots = np.abs(np.diagonal(R))
            if pivots[count - 1] > DEPENDENT * pivots[0]:
                return np.sort(candidates[order[:count]])
    raise OptionError(f"no {count} coordinates distinguish the lowest modes; use method modal")
