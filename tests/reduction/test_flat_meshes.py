"""Mechanisms described node by node, without substructures: modes of the full order in place of constraint modes.

The reference is ARPACK's shift-invert search on the assembled matrices, straight from SciPy.
"""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
import scipy.sparse.linalg as spla

import flexura as fx
from flexura.errors import OptionError
from flexura.modelfile import loads


def mesh(rows: int, columns: int, extra: str = "ground: {CORNERS}\n") -> str:
    """A net of steel bars between neighbouring nodes, 50 mm apart, in a file; no two sides are alike."""
    nodes = [(i, j) for i in range(rows) for j in range(columns)]
    lines = ["flexura: 1", "materials: {steel: {E: 210 GPa, nu: 0.3, rho: 7850 kg/m^3}}"]
    lines += ["sections: {bar: {shape: rectangle, width: 10 mm, thickness: 6 mm}}", "nodes:"]
    lines += [f"  n{i}_{j}: [{50 * j} mm, {53 * i} mm, 0]" for i, j in nodes]
    lines.append("links:")
    for i, j in nodes:
        for a, b in ((i, j + 1), (i + 1, j)):
            if a < rows and b < columns:
                ends = f"nodes: [n{i}_{j}, n{a}_{b}]"
                lines.append(f"  l{i}_{j}_{a}_{b}: {{{ends}, material: steel, section: bar, reference: z}}")
    held = ", ".join(f"n{i}_{j}: clamped" for i in (0, rows - 1) for j in (0, columns - 1))
    return "\n".join(lines) + "\n" + extra.replace("CORNERS", held)


def straight_from_scipy(mechanism: fx.Mechanism, count: int) -> np.ndarray:
    """The lowest frequencies, Hz, of the assembled matrices."""
    model = fx.assemble(mechanism)
    values = spla.eigsh(model.K, k=count, M=model.M, sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(values)) / (2 * np.pi)


@pytest.fixture(scope="module")
def net() -> fx.Mechanism:
    """A net with more freedoms at its nodes than constraint modes are made for."""
    return loads(mesh(13, 13))


def test_a_flat_mesh_is_reduced_to_proven_modes(net):
    low = fx.reduce(net, tolerance=1e-3, n=5)
    proof = low.certificate
    assert low.order == 5 and proof.is_complete
    assert "169 of its" in low.steps[0]
    reference = straight_from_scipy(net, 5)
    assert np.allclose(np.sqrt(np.diagonal(low.K)) / (2 * np.pi), reference, rtol=1e-7)
    assert (proof.lower_hz <= reference * (1 + 1e-7)).all() and (reference <= proof.upper_hz * (1 + 1e-7)).all()
    model = fx.assemble(net)
    T = low.recover(np.eye(5))
    assert np.allclose(T.T @ (model.M @ T), np.eye(5), atol=1e-8)
    assert np.allclose(T.T @ (model.K @ T), low.K, rtol=1e-6, atol=1e-6 * low.K.max())


def test_all_modes_up_to_a_frequency_are_found(net):
    reference = straight_from_scipy(net, 9)
    limit = (reference[6] + reference[7]) / 2
    low = fx.reduce(net, tolerance=1e-3, up_to=float(limit))
    assert low.order == 7
    assert np.allclose(low.certificate.frequency_hz, reference[:7], rtol=1e-7)
    with pytest.raises(OptionError, match="no natural frequency lies below"):
        fx.reduce(net, tolerance=1e-3, up_to=float(reference[0] / 2))


def test_static_response_stays_exact(net):
    """Whatever modes are kept."""
    low = fx.reduce(net, tolerance=1e-3, n=3, coordinates="physical")
    node = "n5_7"
    assert low.order == 3 and all("." in name for name in low.coordinate_names)
    model = fx.assemble(net)
    rows = model.design.node_rows(model.plan.topology.numbers([node]))
    exact = rows @ spla.spsolve(model.K, rows.T.toarray())
    assert np.allclose(low.compliance([node]), exact, rtol=1e-6, atol=1e-9 * abs(exact).max())


def test_the_modes_agree_with_constraint_modes_and_the_full_order(net, monkeypatch):
    result = fx.modes(net, n=4)
    assert not result.warnings and result.evidence.complete and result.order == 4
    full = fx.modes(net, n=4, order="full")
    assert np.allclose(result.frequency_hz, full.frequency_hz, rtol=1e-7)
    monkeypatch.setattr(
        import_module("flexura.analysis.natural_modes.solved"), "LARGEST", 10
    )  # nothing to stand beside: only what is proven
    alone = fx.modes(net, n=4)
    assert np.allclose(alone.frequency_hz, full.frequency_hz, rtol=1e-7)
    assert all(mode.full_frequency_hz is None for mode in alone.modes)


def test_what_floats_keeps_its_rigid_motions():
    floating = loads(mesh(13, 13, ""))
    result = fx.modes(floating, n=8)
    assert [mode.is_rigid for mode in result.modes] == [True] * 6 + [False] * 2
    assert np.allclose(result.frequency_hz[6:], fx.modes(floating, n=8, order="full").frequency_hz[6:], rtol=1e-6)


def test_constraint_modes_are_still_there_for_who_asks(net):
    """Coordinates of substructures are constraint modes, and have the same frequencies."""
    small = loads(mesh(4, 4))
    assert fx.reduce(small, tolerance=1e-3, n=3).steps[0].startswith("constraint modes")
    by_modes = fx.reduce(net, tolerance=1e-3, n=3)
    low = fx.reduce(net, tolerance=1e-3, n=3, coordinates="substructures")
    assert low.order > 900
    assert np.allclose(low.certificate.frequency_hz, by_modes.certificate.frequency_hz, rtol=1e-3)


@pytest.mark.slow
def test_five_thousand_nodes_are_reduced_and_checked():
    """5000 nodes and 9850 links: more than the full order is solved beside."""
    large = loads(mesh(50, 100))
    result = fx.modes(large)
    assert result.full_order == 148_176 and result.order == 6 and not result.warnings
    assert np.allclose(result.frequency_hz, straight_from_scipy(large, 6), rtol=1e-6)
    report = fx.check(large)
    assert report.lowest_hz is not None and report.rigid_body_modes == 0
    assert report.lowest_hz[0] <= result.frequency_hz[0] * (1 + 1e-6) and result.frequency_hz[0] <= report.lowest_hz[
        1
    ] * (1 + 1e-6)
