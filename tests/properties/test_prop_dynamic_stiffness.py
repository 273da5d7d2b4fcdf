"""What exact dynamic stiffness must keep for every mechanism: frequencies that independent counts confirm, finite
elements above them, and the shapes of resonance."""

import numpy as np
from hypothesis import given
from scipy.sparse.linalg import splu

from flexura.full_order import assemble
from flexura.linalg import scaled
from flexura.methods.discrete_models import finite_elements
from flexura.methods.dynamic_stiffness import dynamic_stiffness
from flexura.structure.segments import segments
from helpers.nodal_stiffness import NodalStiffness
from helpers.random_mechanisms import FEW, mechanisms

COUNT = 10


@FEW
@given(mechanisms())
def test_counts_over_all_nodes_confirm_every_frequency(mechanism):
    """Between any two that are not all but equal, at a sparse matrix with other members eliminated."""
    model = assemble(mechanism)
    f = dynamic_stiffness(model, COUNT).frequency_hz
    direct = NodalStiffness(segments(model))
    gaps = np.flatnonzero(f[1:] > 1.002 * f[:-1])
    assert direct.count_below(0.999 * f[0]) == 0
    for k in gaps[[0, len(gaps) // 2, -1]]:
        assert direct.count_below(0.39 * f[k] + 0.61 * f[k + 1]) == k + 1


@FEW
@given(mechanisms())
def test_finite_elements_are_above(mechanism):
    model = assemble(mechanism)
    exact = dynamic_stiffness(model, COUNT).frequency_hz
    coarse, fine = (finite_elements(model, COUNT, pieces).frequency_hz for pieces in (1, 4))
    k = min(COUNT, len(coarse))
    assert (fine[:k] >= exact[:k] * (1 - 1e-8)).all()
    assert (coarse[:k] >= exact[:k] * (1 - 1e-8)).all()
    assert (fine[:k] - exact[:k] <= (coarse[:k] - exact[:k]) / 3 + 1e-8 * exact[:k]).all()


@FEW
@given(mechanisms(grounded=False))
def test_what_floats_has_six_zero_frequencies(mechanism):
    model = assemble(mechanism)
    f = dynamic_stiffness(model, COUNT).frequency_hz
    assert (f[:6] == 0).all() and f[6] > 1.0
    assert NodalStiffness(segments(model)).count_below(0.6 * f[6]) == 6


@FEW
@given(mechanisms())
def test_shapes_are_those_of_resonance(mechanism):
    """The response of all nodes next to a frequency, to loads that are not distributed like the mode."""
    model = assemble(mechanism)
    solution = dynamic_stiffness(model, 5)
    f = solution.frequency_hz
    direct = NodalStiffness(segments(model))
    nodes, components = np.nonzero(model.plan.topology.dof >= 0)
    for k in range(4):
        if f[k + 1] < 1.05 * f[k] or (k and f[k] < 1.05 * f[k - 1]):
            continue
        K = direct.matrix(2 * np.pi * f[k] * (1 + 1e-7))
        size = np.sqrt(model.M.diagonal())
        x = size * solution.shapes[nodes, components, k]
        load = np.zeros(K.shape[0])
        load[: model.order] = size * x * np.linspace(0.5, 1.0, model.order)
        d = 1 / np.sqrt(np.abs(K.diagonal()))
        y = size * (d * splu(scaled(K, d)).solve(d * load))[: model.order]
        np.testing.assert_allclose(y * (x @ y) / (y @ y), x, atol=1e-3 * np.abs(x).max())
