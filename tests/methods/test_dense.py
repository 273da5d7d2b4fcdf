"""Dense equations that are too many are refused, not begun."""

import pytest

import flexura as fx
from flexura.full_order import assemble
from flexura.methods import compare, exact_condensation
from flexura.methods.chain_equations import spectral_element, transfer_matrix
from flexura.methods.dynamic_stiffness import DynamicStiffness, count_below, dynamic_stiffness


def comb(teeth):
    """Bars from node to node along a line, a tooth at each."""
    bar = {"material": "Al-7075-T6", "section": fx.describe.Rectangle(width=2e-3, thickness=1e-3), "elements": 1}
    nodes = {f"n{k}": (0.01 * k, 0, 0) for k in range(teeth + 1)} | {
        f"t{k}": (0.01 * k, 0.01, 0) for k in range(1, teeth + 1)
    }
    links = {f"b{k}": fx.describe.Link(nodes=(f"n{k - 1}", f"n{k}"), reference="z", **bar) for k in range(1, teeth + 1)}
    links |= {f"l{k}": fx.describe.Link(nodes=(f"n{k}", f"t{k}"), reference="z", **bar) for k in range(1, teeth + 1)}
    return fx.Mechanism(nodes=nodes, links=links, ground={"n0": "clamped"})


@pytest.mark.parametrize("method", [dynamic_stiffness, transfer_matrix, spectral_element])
def test_too_many_are_refused_before_they_are_written(method, monkeypatch) -> None:
    def never(*_, **__):
        raise AssertionError("a matrix was begun")

    model = assemble(comb(400))
    monkeypatch.setattr("flexura.structure.assembly.Scatter.dense", never)
    with pytest.raises(fx.SolverError, match=r"4800 equations over the nodes .* more than the 2000"):
        method(model, 3)
    with pytest.raises(fx.SolverError, match="4800 equations"):
        DynamicStiffness(model)
    with pytest.raises(fx.SolverError, match="4800 equations"):
        count_below(model, 10.0)


@pytest.mark.parametrize("limit", [59, 70])
def test_modes_and_chains_count(limit, monkeypatch) -> None:
    """Ten nodes: 60 equations, and more for the chains between them."""
    model = assemble(comb(5))
    monkeypatch.setattr(exact_condensation, "LARGEST", limit)
    with pytest.raises(fx.SolverError, match="equations over"):
        transfer_matrix(model, 3)


def test_finite_elements_take_their_place(monkeypatch) -> None:
    monkeypatch.setattr(exact_condensation, "LARGEST", 50)
    result = compare(comb(5), n=2, methods=["finite_elements"], budget=None)
    assert result.reference == "finite elements 4x"
    assert "60 equations" in result.rows[0].failure
    assert len(result.rows[-1].frequency_hz) == 2
