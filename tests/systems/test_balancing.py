"""Balanced truncation: what comes out is stable, lies within the bound that it states, and never keeps round-off."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.systems.reduction import balance
from flexura.systems.state_space import rounded_up

EXAMPLES = Path(__file__).parents[2] / "examples"
CASES = [
    ("tip_tilt/tip_tilt", ["mirror.ty", "mirror.rx"], ["mirror.tx", "mirror.ty", "mirror.rz"]),
    ("tip_tilt/tip_tilt", ["ground.ty"], ["mirror.rz", "mirror.rx"]),
    ("tip_tilt/tip_tilt", ["mirror.rx"], ["mirror.rx", "mirror.ry", "mirror.tz"]),
    ("rpr/rpr_piezo", ["*.piezo"], ["lift", "roll", "pitch"]),
    ("xy_stage/xy_stage", ["table.tx", "table.ty"], ["table.tx", "table.ty", "table.rz"]),
]


def stated(model):
    """The error that the notes of a model allow it."""
    return float(re.search(r"at most ([^ ]+) at", model.notes[-1])[1])


def hertz(model, more=()):
    """Frequencies over nine decades and at all poles."""
    poles = model.poles()
    return np.unique(np.concatenate([[0.0], np.geomspace(1e-3, 1e6, 80), *more, np.abs(poles) / 2 / np.pi]))


def apart(one, other, hz):
    """The largest singular value of the difference over frequencies."""
    return float(np.linalg.norm(one.frequency_response(hz) - other.frequency_response(hz), 2, axis=(1, 2)).max())


@pytest.mark.parametrize(("example", "inputs", "outputs"), CASES)
@pytest.mark.parametrize("keep", [0, 3])
def test_examples(example, inputs, outputs, keep):
    """Directions that inputs reach by round-off alone, and the two numbers of each pair of equal singular values."""
    built = fx.system(fx.load(EXAMPLES / f"{example}.yaml"), inputs=inputs, outputs=outputs, keep=keep, damping=0.01)
    for n in (6, 11):
        full = fx.state_space(built, n=n)
        hz = hertz(full)
        for asked in range(1, 2 * n, 2 if n == 11 else 1):
            small = fx.state_space(built, n=n, balanced=asked)
            assert small.order <= asked and small.poles().real.max(initial=-1.0) < 0
            assert 0 < apart(small, full, hz) <= stated(small)
            assert (small.order < asked) == ("asked for" in small.notes[-1])


def channels(count, quantity):
    """Inputs or outputs."""
    return tuple(fx.types.Channel(f"{quantity}{k}", quantity) for k in range(count))


def random_model(seed):
    """Modes over five decades with ratios from 1e-6 to 2: equal ones, critical ones, coupled ones, unreached ones."""
    rng = np.random.default_rng(seed)
    r, (m, p), kind = int(rng.integers(1, 11)), rng.integers(1, 4, 2), int(rng.integers(0, 6))
    w, zeta = 10 ** rng.uniform(0, 5, r), 10 ** rng.uniform(-6, 0.3, r)
    if kind == 1:
        w[:] = w[0]
    if kind == 2:
        zeta[:] = 1.0
    if kind == 3:
        w = np.repeat(w[: (r + 1) // 2], 2)[:r]
    damping = np.diag(2 * zeta * w)
    if kind == 4:
        v = rng.normal(size=(r, 1)) * np.sqrt(w.min())
        damping = damping + v @ v.T
    A, B, C = np.zeros((2 * r, 2 * r)), np.zeros((2 * r, m)), np.zeros((p, 2 * r))
    A[0::2, 1::2], A[1::2, 0::2], A[1::2, 1::2] = np.eye(r), -np.diag(w**2), -damping
    B[1::2] = rng.normal(size=(r, m)) * 10 ** rng.uniform(-6, 0, (r, 1))
    C[:, 0::2] = rng.normal(size=(p, r)) * 10 ** rng.uniform(-8, 0, (1, r))
    if kind == 5:
        C[:, ::4] = 0
    D, names = rng.normal(size=(p, m)) * (seed % 2), tuple(str(k) for k in range(2 * r))
    return fx.StateSpace(A, B, C, D, channels(m, "force"), channels(p, "displacement"), names)


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@example(7173809, 1)  # what goes directly is 1e14 times what is truncated
@given(st.integers(0, 2**32 - 1), st.integers(1, 20))
def test_stable_within_the_bound_and_with_the_static_gain(seed, asked):
    """Whatever is asked of whatever is stable."""
    model = random_model(seed)
    if la.eigvals(model.A).real.max() >= 0:
        return
    small = balance(model, asked)
    assert small.order <= min(asked, model.order) and len(small.state_names) == small.order
    assert small.poles().real.max(initial=-1.0) < 0
    assert apart(small, model, hertz(model, [np.abs(small.poles()) / 2 / np.pi])) <= stated(small)
    gain = model.static_gain()
    assert np.abs(small.static_gain() - gain).max() <= 1e-9 * np.abs(gain).max() + stated(small)


def test_closed_form_of_one_pole():
    """b c/(s + a) has the single Hankel singular value b c/2a; halved by equal parts, one state of two is round-off."""
    a, b, c = 3.0, 2.0, 5.0
    two = fx.StateSpace(
        -a * np.eye(2), np.full((2, 1), b), np.full((1, 2), c / 2), np.zeros((1, 1)),
        channels(1, "force"), channels(1, "displacement"), ("one", "two"),
    )  # fmt: skip
    small = balance(two, 2)
    assert small.order == 1 and "asked for" in small.notes[-1]
    assert small.poles() == pytest.approx([-a]) and stated(small) < 1e-10
    hz = np.array([0.0, 0.3, 7.0])
    np.testing.assert_allclose(small.frequency_response(hz)[:, 0, 0], b * c / (2j * np.pi * hz + a), rtol=1e-11)


def test_singular_values_are_those_of_python_control():
    """Twice the sum of those left out, and a model within it, of a model with poles far apart."""
    control = pytest.importorskip("control")
    model = random_model(8)
    scale = np.ones(model.order)
    scale[0::2] = np.sqrt(-np.diag(model.A[1::2, 0::2]))
    A, B, C = model.A * scale[:, None] / scale, model.B * scale[:, None], model.C / scale
    P, Q = control.lyap(A, B @ B.T), control.lyap(A.T, C.T @ C)
    sigma = np.sort(np.sqrt(np.abs(la.eigvals(P @ Q))))[::-1]
    for asked in range(1, 5):
        assert stated(balance(model, asked)) == pytest.approx(2 * sigma[asked:].sum(), rel=0.011)


def test_what_no_input_reaches_is_its_static_gain():
    """No state is kept where all Hankel singular values are zero."""
    model = random_model(8)
    still = balance(replace(model, B=0 * model.B), 4)
    assert still.order == 0 and "of 4 states asked for" in still.notes[-1]
    np.testing.assert_array_equal(still.static_gain(), model.D)
    assert (still.frequency_response([0.0, 3.0]) == model.D).all()


@pytest.mark.parametrize("value", [1.2345e-9, 1.0, 9.9999, 3.21, 7e22])
def test_bounds_are_rounded_up(value):
    """To three digits, never down."""
    assert value <= float(rounded_up(value)) <= 1.01 * value


def nasty(kind, damped):
    """Modes that truncation finds hard: 0.03 Hz beside 1 MHz, close pairs, one mode without damping."""
    hz = {"wide": [0.03, 1.0, 400.0, 1e6], "close": [100.0, 100.0 * (1 + 1e-9), 100.001, 5e3]}[kind]
    w, zeta = 2 * np.pi * np.array(hz), np.array([1e-4, 0.01, 0.3, 1e-3])
    zeta[1] *= damped
    A = np.zeros((8, 8))
    A[0::2, 1::2], A[1::2, 0::2], A[1::2, 1::2] = np.eye(4), -np.diag(w**2), -np.diag(2 * zeta * w)
    B, C = np.zeros((8, 2)), np.zeros((2, 8))
    B[1::2] = [[1.0, 0.5], [1.0, -0.5], [2.0, 1.0], [30.0, 1.0]]
    C[:, 0::2] = B[1::2].T
    return fx.StateSpace(
        A, B, C, np.zeros((2, 2)), channels(2, "force"), channels(2, "displacement"), tuple("abcdefgh")
    )


@pytest.mark.parametrize("asked", range(1, 9))
@pytest.mark.parametrize("kind", ["wide", "close"])
def test_soft_beside_stiff_and_close_pairs(kind, asked):
    """Stable, within the bound, static gain kept, seven decades of frequency apart or one part in 1e9."""
    full = nasty(kind, 1.0)
    small = balance(full, asked)
    assert small.order <= asked and small.poles().real.max(initial=-1.0) < 0
    assert apart(small, full, hertz(full, [np.abs(small.poles()) / 2 / np.pi])) <= stated(small)
    gain = full.static_gain()
    assert np.abs(small.static_gain() - gain).max() < 1e-9 * np.abs(gain).max()


def test_one_mode_without_damping_is_refused():
    """Its gramian is infinite: said, not computed."""
    with pytest.raises(fx.OptionError, match="everything is damped"):
        balance(nasty("wide", 0.0), 4)
