"""Frequency response by the exact dynamic stiffness: every mode of every member, no mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.beam import rigid_arm
from flexura.errors import OptionError
from flexura.linalg import scaled, unit_scale
from flexura.methods.dynamic_stiffness import DynamicStiffness
from flexura.structure import FullOrderModel, full_order
from flexura.systems import DampingLaw, InputPort, OutputPort, uniform_loss


class ExactResponse:
    """Displacements of the kept nodes per unit input, with damping that is the same everywhere and dashpots.

    Rayleigh damping and one loss factor eta turn K(omega) into s K0(mu) with s = 1 + i eta + i beta omega and
    mu^2 = omega^2 (1 - i alpha/omega)/s, K0 being the undamped dynamic stiffness (theory eq. T12). Raises OptionError
    for modal damping ratios, loss factors that differ, and inputs and outputs at nodes that a substructure does not
    keep.
    """

    def __init__(
        self,
        model: FullOrderModel,
        law: DampingLaw,
        inputs: Sequence[InputPort],
        outputs: Sequence[OutputPort],
        direct: Array,
    ) -> None:
        model.plan.refuse_loads("the exact dynamic stiffness", model.values)
        if law.is_modal:
            hint = "give Rayleigh damping, a loss factor or dashpots"
            raise OptionError(f"the exact dynamic stiffness has no modes to which damping ratios could belong; {hint}")
        self.stiffness: DynamicStiffness = DynamicStiffness(model)
        self.model = model
        self.law = law
        self.direct = direct
        plan = model.plan
        C, H = full_order(plan).dissipation(model.design, law.loss_factor)
        loss = uniform_loss(H, model.K)
        if loss is None:
            hint = "use the full-order model with method direct"
            raise OptionError(f"the exact dynamic stiffness takes one loss factor for everything elastic; {hint}")
        self.loss_factor = loss
        self.kept: Index = plan.topology.dof.ravel()[self.stiffness.assembler.physical]
        self.C = self._over_kept(C.toarray(), "a dashpot")[self.kept] if C.nnz else None
        self.derivative: Index = np.array([o.derivative for o in outputs], dtype=np.intp)
        self.rows: Array = np.stack([self._over_kept(o.row[None], o.channel.name)[0] for o in outputs])
        self.loads: Array = np.stack([self._over_kept(i.load[None], i.channel.name)[0] for i in inputs], axis=1)
        self.base: list[Array | None] = [i.base for i in inputs]

    def _over_kept(self, rows: Array, name: str) -> Array:
        """Rows over the kept DOFs. Raises OptionError where they reach others."""
        other = np.ones(rows.shape[1], dtype=bool)
        other[self.kept] = False
        if np.abs(rows[:, other]).max(initial=0.0) > 0:
            hint = "make its node an interface of its substructure"
            raise OptionError(f"{name} is at a node that the exact dynamic stiffness eliminates; {hint}")
        return rows[:, self.kept]

    def at(self, omega: float) -> Complex:
        """H (p, m) at an angular frequency, rad/s, above zero."""
        law = self.law
        s = 1 + 1j * (self.loss_factor + law.beta * omega)
        mu = omega * np.sqrt((1 - 1j * law.alpha / omega) / s)
        K, _, _ = self.stiffness.at(mu if mu.imag else omega)
        Z = s * K
        if self.C is not None:
            Z = Z + 1j * omega * self.C
        loads = self.loads.astype(complex)
        if any(base is not None for base in self.base):
            F = s * self._rigid_load(mu) / (omega**2 - 1j * law.alpha * omega)
            for k, base in enumerate(self.base):
                if base is not None:
                    loads[:, k] = F @ base
        d = unit_scale(Z)
        q = d[:, None] * np.linalg.solve(scaled(Z, d), d[:, None] * loads)
        H = (self.rows @ q) * ((1j * omega) ** self.derivative)[:, None]
        return H + self.direct

    def _rigid_load(self, mu: complex) -> Complex:
        """Load (n, 6) on the kept DOFs when everything is carried along in rigid motions of and about the origin.

        Springs to ground ride along and are left out (theory eq. T13).
        """
        plan, assembler = self.model.plan, self.stiffness.assembler
        transforms = assembler.transforms(self.model.design)
        found = np.zeros((len(self.kept) + 1, 6), dtype=complex)
        for name, part in self.stiffness.parts.items():
            own = part.at(mu**2).K.astype(complex)
            boundary = assembler.reducers[name].part.boundary
            position = {int(node): k for k, node in enumerate(boundary)}
            for discrete in part.discrete_elements:
                if discrete.K is not None and len(discrete.nodes) == 1:
                    at = 6 * position[discrete.nodes[0]] + np.arange(6)
                    own[np.ix_(at, at)] -= discrete.K
            T = transforms[name]
            number = np.array(plan.topology.copies[name].offset)[:, None] + boundary
            root = plan.topology.root[number]
            rigid = rigid_arm(self.model.geometry.positions[root]).reshape(len(T), -1, 6)
            force = np.swapaxes(T, -1, -2) @ (own @ (T @ rigid))
            np.add.at(found, assembler.coordinates(name, 0, 0), force)
        return found[:-1]
