"""The spectral element method: exact beams at complex frequencies, and time response by FFT (Doyle 1997; Lee 2009).

Every chain is two spectral elements with a node between them, so that its own resonances with held ends are seen. For
the time response force and motion are multiplied by exp(-sigma t): the response of an undamped mechanism then decays
within the period of the FFT and does not wrap around (numerical Laplace transform; theory eqs. W4-W6).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Index
from flexura.beam import rigid_arm
from flexura.errors import OptionError
from flexura.linalg import scaled, unit_scale
from flexura.methods.chain_equations import ChainEquations
from flexura.methods.exact_chains import ExactChains
from flexura.methods.roots import natural_frequencies
from flexura.methods.solution import Solution
from flexura.structure import FullOrderModel

Array = NDArray[Any]

DECAY = 1e-6
"""To this part of its size a motion decays within the period, by exp(-sigma t)."""


class SpectralElements(ChainEquations):
    """Two spectral elements for every chain; its own unknowns are the twist of the node between them."""

    pieces = 5

    def own_poles(self, chains: ExactChains, lam: float) -> int:
        """Frequencies at which an element with held ends vibrates."""
        return sum(int(element.J0.sum()) for element in chains.split(lam))

    def add_chains(
        self, local: Array, chains: ExactChains, first: Index, last: Index, own: Index, lam: complex
    ) -> None:
        """The dynamic stiffness of both elements over their end twists (theory eq. W4)."""
        back = rigid_arm(-chains.arms[:, -1])
        elements = chains.split(lam)
        step = np.block([[np.eye(6), np.zeros((6, 6))], [-np.eye(6), np.eye(6)]])
        for k in range(len(own)):
            arm = np.eye(12)
            arm[6:, 6:] = back[k]
            a, m, e = first[k], own[k], last[k]
            for element, dofs, reach in ((elements[0], [*a, *m], np.eye(12)), (elements[1], [*m, *e], arm)):
                T = step @ reach
                local[np.ix_(dofs, dofs)] += T.T @ element.K[k] @ T


def spectral_element(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies as the points where the spectral matrix is singular.

    Raises OptionError when nothing can move, SolverError when the contours do not separate the frequencies.
    """
    equations = SpectralElements(model)
    hz = natural_frequencies(equations.matrix, model, count, equations.poles)
    return Solution("spectral element", None, hz, note="two elements for every chain")


def spectral_response(
    model: FullOrderModel,
    force: Callable[[NDArray[Any]], ArrayLike],
    at: tuple[str, ArrayLike],
    sensors: Sequence[str],
    *,
    duration: float,
    steps: int = 512,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Displacements of nodes after a force that starts at time zero from rest, without a time-stepping error.

    `force(t)` is the history, N or N m, at times t (steps,); `at` names a node and the direction (6,) of the force in
    its freedoms tx ... rz, global frame; `sensors` name nodes. Nodes are those that substructures keep. Returns times
    (steps,), s, up to `duration`, and displacements (steps, sensors, 6), m and rad. The spectrum ends at the Nyquist
    frequency: a force with jumps rings there. Raises OptionError for unknown nodes and impossible options.
    """
    if steps < 8 or not (np.isfinite(duration) and duration > 0):
        raise OptionError("a time response needs a positive duration and at least 8 steps")
    equations = SpectralElements(model)
    plan, assembler = model.plan, equations.exact.assembler
    physical = np.full(plan.topology.n_dof, -1)
    physical[plan.topology.dof.ravel()[assembler.physical]] = np.arange(equations.physical)
    rows = model.design.node_rows(plan.topology.numbers([at[0], *sensors])).toarray()
    if (rows[:, physical < 0] != 0).any():
        raise OptionError("force and sensors act at nodes that the substructures keep; make these an interface")
    B = np.zeros((len(rows), equations.physical))
    B[:, physical[physical >= 0]] = rows[:, physical >= 0]
    load = np.asarray(at[1], dtype=float) @ B[:6]
    # twice the duration: what the period of the FFT repeats has died out by then
    period, n = 2 * duration, 2 * steps
    t = np.arange(n) * period / n
    sigma = -np.log(DECAY) / period
    history = np.broadcast_to(np.asarray(force(t), dtype=float), t.shape)
    spectrum = np.fft.rfft(history * np.exp(-sigma * t))
    omega = 2 * np.pi * np.fft.rfftfreq(n, period / n) - 1j * sigma
    found = np.empty((len(omega), len(rows) - 6), dtype=complex)
    for k, w in enumerate(omega):
        A = equations.matrix(complex(w))
        f = np.zeros(len(A), dtype=complex)
        f[: equations.physical] = load * spectrum[k]
        d = unit_scale(A)
        found[k] = B[6:] @ (d * np.linalg.solve(scaled(A, d), d * f))[: equations.physical]
    u = np.fft.irfft(found, n, axis=0) * np.exp(sigma * t)[:, None]
    return t[:steps], u[:steps].reshape(steps, len(sensors), 6)
