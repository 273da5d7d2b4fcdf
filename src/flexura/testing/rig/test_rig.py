"""A mechanism on its test rig: hammer points, and accelerometers with their mass, on the full-order model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.errors import OptionError, SolverError
from flexura.linalg import count_below
from flexura.mechanism import Damping, Mechanism, ModalTest
from flexura.structure import FullOrderModel, Plan, assemble, one_design, plan_of
from flexura.systems import InputPort, ModalSystem, OutputPort, System, system
from flexura.testing.rig.test_points import TestPoint, TestPoints


@dataclass(frozen=True)
class TrueModes:
    """What a test should find: undamped frequencies (n,), damping ratios (n,) and shapes (p, n) at all accelerometers
    of the test, unit modal mass. `placement` is the one whose sensors are on the mechanism, None for no sensors.
    """

    placement: str | None
    frequency_hz: Array
    damping_ratio: Array
    shapes: Array


class ModalTestRig:
    """A mechanism ready for the test that it describes, or for `test`.

    Raises OptionError without a test and for test points that cannot move, ModelError for a description that cannot be
    used.
    """

    def __init__(
        self,
        mechanism: Mechanism | Plan,
        parameters: Mapping[str, ArrayLike] | None = None,
        test: ModalTest | None = None,
        damping: Damping | float | Mapping[str, Any] | None = None,
    ) -> None:
        plan = plan_of(mechanism, parameters)
        plan.refuse_pose("virtual tests")
        described = test or plan.mechanism.test
        if described is None:
            raise OptionError(f"{plan.mechanism.name} describes no test: add the key test to its file")
        single = one_design(parameters)
        if test is not None:
            plan = plan_of(plan.mechanism.model_copy(update={"test": test}))
        self.model: FullOrderModel = assemble(plan, single)
        self._points = TestPoints(self.model.design)
        self.test: ModalTest = self._points.test
        self._built = system(self.model, inputs=[], outputs=[], damping=damping)
        self.hammer: list[TestPoint] = list(self._points.hammer.values())
        self.accelerometers: dict[str, TestPoint] = self._points.accelerometers
        for point in [*self.hammer, *self.accelerometers.values()]:
            if not point.row.any():
                raise OptionError(f"test: {point.channel.name} is at {point.channel.node}, which is held there")

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.model.plan.mechanism.name

    @cached_property
    def placements(self) -> dict[str, tuple[TestPoint, ...]]:
        """Accelerometers in every placement."""
        return {k: tuple(self.accelerometers[name] for name in own) for k, own in self.test.placed().items()}

    def system(self, placement: str | None) -> System:
        """Forces of the hammer to readings of all accelerometers, with the mass of those of one placement, or of none.

        theory eq. H15.
        """
        added = self._points.added([] if placement is None else [placement])
        M = sp.csc_matrix(self.model.M + added.on())
        built, sensors = self._built, list(self.accelerometers.values())
        p, m = len(sensors), len(self.hammer)
        return replace(
            built,
            M=M,
            C=built.C + built.law.alpha * (M - self.model.M),
            B=np.stack([h.row for h in self.hammer], axis=1),
            rows=np.stack([a.row for a in sensors]),
            derivative=np.full(p, 2, dtype=np.intp),
            D=np.zeros((p, m)),
            residual=np.zeros((p, m)),
            inputs=tuple(h.channel for h in self.hammer),
            outputs=tuple(a.channel for a in sensors),
            limits=((-np.inf, np.inf),) * m,
            input_ports=tuple(InputPort(h.channel, h.row, h.row) for h in self.hammer),
            output_ports=tuple(OutputPort(a.channel, a.row, 2, a.rigid) for a in sensors),
        )

    def modes(self, placement: str | None) -> ModalSystem:
        """The system in its modes up to half the sample rate. Raises SolverError when there are none."""
        built = self.system(placement)
        nyquist = float(self.test.sample_rate) / 2  # type: ignore[arg-type]
        if not count_below(built.K, built.M, (2 * np.pi * nyquist) ** 2):
            raise SolverError(f"there is no mode up to {nyquist:g} Hz, half the sample rate of the test")
        return built.modal(up_to=nyquist)
