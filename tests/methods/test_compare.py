"""Methods side by side: which mode is compared with which, rows of methods that cannot answer, and what a row says."""

import json
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.deadline import checkpoint
from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.mechanism import with_rigid_bodies, with_rigid_roots
from flexura.methods import Comparison, Solution, compare
from flexura.methods.discrete_models import finite_elements
from flexura.methods.solution import pair
from flexura.modal.mode_pairing import in_order
from flexura.structure import Plan

ROOT = Path(__file__).parents[2]
MODULE = import_module("flexura.methods.compare")
LABELS = (
    "dynamic stiffness",
    "transfer matrix",
    "spectral element",
    "reverberation-ray",
    "finite elements 1x",
    "finite elements 2x",
    "finite elements 4x",
    "constraint modes alone",
    "certified reduction",
    "pseudo-rigid-body",
    "lumped parameter",
)


def load(name):
    return with_rigid_bodies(fx.load(ROOT / "examples" / name / f"{name}.yaml"))


def rows(result: Comparison) -> dict:
    return {row.method: row for row in result.rows}


@pytest.fixture
def stubs(monkeypatch: pytest.MonkeyPatch):
    """Replace the methods by functions of a task, the first of them exact."""

    def install(**solve):
        methods = tuple(MODULE.Method(key, key, function) for key, function in solve.items())
        monkeypatch.setattr(MODULE, "METHODS", methods)
        monkeypatch.setattr(MODULE, "EXACT", methods[0])
        monkeypatch.setattr(MODULE, "FINEST", methods[-1])

    return install


def numbers(*hz, order=None):
    """A method without shapes that always gives these frequencies."""
    return lambda task: Solution("stub", order, np.array(hz[: task.n], dtype=float))


def refuses(task):
    raise fx.OptionError("not for loops")


class TestPairing:
    def test_a_missed_mode_shifts_nothing(self) -> None:
        assert in_order(np.array([100.0, 150, 200, 300]), np.array([100.0, 200, 300, 400])) == [0, 2, 3, -1]

    def test_close_modes_are_told_apart_by_those_beyond(self) -> None:
        close = np.array([100.0, 105, 110, 115.5, 121])
        assert in_order(close, np.array([100.0, 110, 115.5])) == [0, 2, 3]

    def test_one_of_a_repeated_pair_may_be_missed(self) -> None:
        found = in_order(np.array([100.0, 100.0000001, 200, 300]), np.array([100.0, 200, 300]))
        assert found[1:] == [2, 3] and found[0] in (0, 1)

    def test_a_mode_too_many_shifts_nothing(self) -> None:
        assert in_order(np.array([100.0, 200, 300]), np.array([100.0, 140, 200, 300])) == [0, -1, 1, 2]

    def test_inaccurate_frequencies_are_still_paired(self) -> None:
        assert in_order(np.array([100.0, 200, 300]), np.array([110.0, 215, 280])) == [0, 1, 2]

    def test_rigid_motions(self) -> None:
        assert in_order(np.array([0.0, 0, 0, 50, 60]), np.array([0.0, 0, 0, 50.1, 60.2])) == [0, 1, 2, 3, 4]

    def test_nothing_at_all(self) -> None:
        assert in_order(np.empty(0), np.array([1.0])) == [-1]
        assert in_order(np.array([1.0]), np.empty(0)) == []

    def test_shapes_tell_modes_apart_whatever_their_frequencies(self) -> None:
        model = assemble(load("guide"))
        exact = finite_elements(model, 8)
        kept = np.array([3, 0, 6])
        other = replace(exact, frequency_hz=exact.frequency_hz[kept] * [0.5, 2.0, 1.0], shapes=exact.shapes[..., kept])
        assert pair(model, exact, other) == [3, 0, 6]

    def test_repeated_modes_are_a_space(self) -> None:
        """Two modes of the stage are equal; turned by 45 degrees they are still the same two."""
        model = assemble(load("xy_stage"))
        exact = finite_elements(model, 4)
        first = int(np.argmin(np.diff(exact.frequency_hz)))
        turned, equal = exact.shapes.copy(), slice(first, first + 2)
        turned[..., equal] = turned[..., equal] @ np.array([[1, -1], [1, 1]]) / np.sqrt(2)
        assert pair(model, exact, replace(exact, shapes=turned)) == [0, 1, 2, 3]

    def test_a_shape_like_no_other_has_no_counterpart(self) -> None:
        model = assemble(load("guide"))
        exact = finite_elements(model, 8)
        blind = replace(exact, frequency_hz=exact.frequency_hz[:3], shapes=exact.shapes[..., :3])
        assert pair(model, blind, exact)[3:] == [-1] * 5


class TestRows:
    def test_all_methods_in_order(self) -> None:
        assert tuple(method.label for method in MODULE.METHODS) == LABELS

    def test_errors_are_against_the_counterpart(self, stubs) -> None:
        stubs(exact=numbers(100, 150, 200, 300), rough=numbers(101, 202, 303, order=3))
        row = rows(compare(load("guide"), n=4))["rough"]
        assert row.counterpart == (1, 3, 4)
        assert row.error == pytest.approx((0.01, 0.01, 0.01))
        assert row.missed == (2,)
        assert row.order == 3 and row.worst_error == pytest.approx(0.01)

    def test_the_worst_error_has_its_sign(self, stubs) -> None:
        stubs(exact=numbers(100, 150), rough=numbers(101, 144))
        assert rows(compare(load("guide"), n=2))["rough"].worst_error == pytest.approx(-0.04)

    def test_more_exact_modes_are_sought_for_late_ones(self, stubs) -> None:
        """Asked for two modes, the method answers with the first and the fourth."""
        stubs(exact=numbers(100, 150, 200, 300, 400), blind=numbers(100, 300))
        result = compare(load("guide"), n=2)
        row = rows(result)["blind"]
        assert row.counterpart == (1, 4)
        assert row.missed == (2,)
        assert row.worst_error == 0.0  # of the modes compared
        assert len(rows(result)["exact"].frequency_hz) == 2

    def test_late_modes_of_a_method_are_sought_as_well(self, stubs) -> None:
        """A spurious frequency below the second mode; asked for more, the method has that mode too."""
        stubs(exact=numbers(100, 200, 300), odd=numbers(100, 130, 201, 303))
        row = rows(compare(load("guide"), n=2))["odd"]
        assert row.frequency_hz == (100, 130, 201)
        assert row.counterpart == (1, None, 2)
        assert row.missed == ()

    def test_a_method_that_cannot_answer_says_why(self, stubs) -> None:
        stubs(exact=numbers(100, 150), choosy=refuses, other=numbers(100, 150))
        result = compare(load("guide"), n=2)
        choosy = rows(result)["choosy"]
        assert choosy.failure == "not for loops"
        assert choosy.frequency_hz == () and choosy.seconds is None
        assert rows(result)["other"].worst_error == 0.0

    def test_without_the_exact_answer_the_finest_mesh_takes_its_place(self, stubs) -> None:
        stubs(exact=refuses, rough=numbers(99), finest=numbers(100))
        result = compare(load("guide"), n=1)
        assert result.reference == "finest"
        assert rows(result)["exact"].failure == "not for loops"
        assert rows(result)["rough"].worst_error == pytest.approx(-0.01)

    def test_other_exceptions_are_not_swallowed(self, stubs) -> None:
        def broken(task):
            raise ZeroDivisionError

        stubs(exact=numbers(100), broken=broken)
        with pytest.raises(ZeroDivisionError):
            compare(load("guide"), n=1)

    @pytest.mark.parametrize(
        "error",
        [np.linalg.LinAlgError("singular"), MemoryError(), FloatingPointError("overflow"), fx.SolverError("no")],
    )
    def test_numerical_failures_cost_a_row_and_nothing_else(self, stubs, error) -> None:
        def broken(task):
            raise error

        stubs(exact=numbers(100, 150), broken=broken, other=numbers(100, 150))
        result = compare(load("guide"), n=2)
        assert rows(result)["broken"].failure and rows(result)["broken"].frequency_hz == ()
        assert rows(result)["other"].worst_error == 0.0

    def test_pairing_that_fails_costs_a_row(self, stubs, monkeypatch) -> None:
        def fails(*_):
            raise np.linalg.LinAlgError("SVD did not converge")

        stubs(exact=numbers(100, 150), other=numbers(100, 150))
        monkeypatch.setattr(MODULE, "pair", fails)
        result = compare(load("guide"), n=2)
        assert rows(result)["exact"].frequency_hz == (100, 150)
        assert "SVD did not converge" in rows(result)["other"].failure

    def test_without_any_reference_the_rows_stay(self, stubs) -> None:
        stubs(exact=refuses, other=numbers(100, 150), finest=refuses)
        result = compare(load("guide"), n=2)
        assert result.reference == ""
        row = rows(result)["other"]
        assert row.frequency_hz == (100, 150) and row.counterpart == (1, 2)
        assert row.error == (None, None) and row.worst_error is None and row.missed == ()
        assert rows(result)["finest"].failure == "not for loops"

    def test_late_modes_that_cannot_be_looked_for_are_said(self, stubs) -> None:
        def few(task):
            if task.n > 2:
                raise fx.SolverError("too many")
            return Solution("stub", None, np.array([100.0, 300]))

        stubs(exact=numbers(100, 150, 200, 300, 400), few=few)
        row = rows(compare(load("guide"), n=2))["few"]
        assert row.frequency_hz[0] == 100 and "later modes could not be looked for: too many" in row.note

    def test_a_row_has_one_budget_for_all_that_it_needs(self, stubs, monkeypatch) -> None:
        """Two modes take 15 s, more of them 15 s again, of the 20 s that there are."""
        now = [0.0]
        monkeypatch.setattr(MODULE.time, "monotonic", lambda: now[0])

        def slow(task):
            now[0] += 15.0
            checkpoint()
            return Solution("stub", None, np.array([100.0, 300, 400, 500])[: task.n])

        stubs(exact=numbers(100, 150, 200, 300, 400), slow=slow)
        row = rows(compare(load("guide"), n=2, budget=20.0))["slow"]
        assert row.frequency_hz == (100, 300)
        assert "later modes could not be looked for: stopped after 20 s: option --budget" in row.note

    def test_meshes_in_place_of_the_exact_method_share_one_budget(self, stubs, monkeypatch) -> None:
        now, asked = [0.0], []
        monkeypatch.setattr(MODULE.time, "monotonic", lambda: now[0])

        def endless(task):
            asked.append(now[0])
            now[0] += 100.0
            checkpoint()

        stubs(exact=endless, one=endless, two=endless, four=endless, other=numbers(100))
        meshes = {method.key: method for method in MODULE.METHODS[1:4]}
        monkeypatch.setattr(MODULE, "MESHES", tuple(meshes.values()))
        monkeypatch.setattr(MODULE, "FINEST", meshes["four"])
        result = compare(load("guide"), n=1, methods=["other"], budget=20.0)
        assert asked == [0.0, 100.0]  # the exact method and the finest mesh
        assert rows(result)["exact"].failure.startswith("stopped after 20 s")
        assert rows(result)["other"].frequency_hz == (100,)
        asked.clear()
        compare(load("guide"), n=1, methods=["exact"], budget=20.0)
        assert len(asked) == 1  # nothing is held against a mesh

    def test_zero_frequencies(self, stubs) -> None:
        stubs(exact=numbers(0, 50), other=numbers(0, 50))
        assert rows(compare(load("guide"), n=2))["other"].error == (0.0, 0.0)

    def test_links_alone_leave_the_pseudo_rigid_body_model_without_an_answer(self) -> None:
        bar = fx.describe.Link(
            nodes=("a", "b"), material="steel", reference="z", section=fx.describe.Rectangle(width=5e-3, thickness=3e-3)
        )
        beam = fx.Mechanism(
            nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)},
            materials={"steel": "spring-steel"},
            links={"bar": bar},
            ground={"a": "clamped"},
        )
        found = rows(compare(beam, n=2, methods=["pseudo_rigid_body", "constraint_modes"]))
        assert "describe its compliant members as flexures" in found["pseudo-rigid-body"].failure
        assert not found["constraint modes alone"].failure


class TestMechanisms:
    GUIDE = ("finite_elements", "constraint_modes", "certified_reduction", "pseudo_rigid_body", "lumped_parameter")

    def test_blind_reductions_miss_the_leaves_own_modes(self) -> None:
        """Modes 2, 3, 5 and 6 of the guide are leaves that vibrate by themselves."""
        found = rows(compare(load("guide"), methods=self.GUIDE))
        for method in ("constraint modes alone", "pseudo-rigid-body"):
            assert found[method].counterpart[:2] == (1, 4)
            assert found[method].missed == (2, 3, 5, 6)
            assert abs(found[method].worst_error) < 0.03
        assert found["lumped parameter"].order == 1
        assert found["lumped parameter"].counterpart == (1,)

    def test_modes_that_change_places(self) -> None:
        """Modes 6 and 7 of the amplifier between rigid roots, within half a percent of each other, change places."""
        row = rows(compare(with_rigid_roots(load("amplifier")), methods=["constraint_modes"]))["constraint modes alone"]
        assert row.counterpart == (1, 2, 3, 4, 5, 7, 6)
        assert row.missed == ()

    def test_certified_reduction_keeps_its_promise(self) -> None:
        """Each frequency within 1e-3 of the full-order model's, and six are enough."""
        row = rows(compare(load("guide"), methods=["certified_reduction"]))["certified reduction"]
        full = assemble(load("guide"))
        exact = np.sqrt(lowest(full.K, full.M, 6).values) / (2 * np.pi)
        np.testing.assert_allclose(row.frequency_hz, exact, rtol=1e-3)
        assert row.counterpart == (1, 2, 3, 4, 5, 6)
        assert "proven within" in row.note

    def test_refinement_shows_its_order(self) -> None:
        found = rows(compare(load("guide"), methods=["finite-elements"]))
        assert "observed order of convergence" in found["finite elements 4x"].note
        worst = [abs(found[f"finite elements {p}x"].error[4]) for p in (1, 2)]
        assert worst[0] > 3 * worst[1]

    def test_parameters_and_plans(self) -> None:
        plan = Plan(load("guide"))
        result = compare(plan, {"thickness": 1e-3}, n=1, methods=["lumped_parameter"])
        assert result.parameters == {"thickness": 1e-3}
        thin = compare(plan, n=1, methods=["lumped_parameter"])
        assert result.rows[-1].frequency_hz[0] > 2.5 * thin.rows[-1].frequency_hz[0]

    def test_times_and_plain_data(self) -> None:
        result = compare(load("pivot"), n=3, methods=["constraint_modes", "lumped_parameter"])
        data = json.loads(json.dumps(result.to_dict(), allow_nan=False))
        assert [row["method"] for row in data["rows"]][-2:] == ["constraint modes alone", "lumped parameter"]
        for row in data["rows"][1:]:
            assert 0 < row["seconds"] < 60
            for hz, error, k in zip(row["frequency_hz"], row["error"], row["counterpart"], strict=True):
                assert (error is None) == (k is None)
                assert hz > 0


@pytest.mark.parametrize("n", [0, -1, 1.5])
def test_impossible_numbers_of_modes(n) -> None:
    with pytest.raises(fx.OptionError, match="whole number, at least 1"):
        compare(load("guide"), n=n)


def test_unknown_methods_are_named() -> None:
    with pytest.raises(
        fx.OptionError, match=r"no method 'finite_strips'; there are dynamic_stiffness, .*lumped_parameter"
    ):
        compare(load("guide"), methods=["finite_strips"])
    with pytest.raises(fx.OptionError, match="a list of names"):
        compare(load("guide"), methods="lumped_parameter")


def test_nothing_that_can_move() -> None:
    bar = fx.describe.Link(
        nodes=("a", "b"), material="Al-7075-T6", section=fx.describe.Circle(diameter=1e-3), elements=1
    )
    held = fx.Mechanism(nodes={"a": (0, 0, 0), "b": (1, 0, 0)}, links={"bar": bar}, ground={"*": "clamped"})
    with pytest.raises(fx.OptionError, match="nothing in this mechanism can move"):
        compare(held)
