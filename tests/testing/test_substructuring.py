"""Coupling and decoupling by frequency responses: closed forms, the assembly as one mechanism, noise as it scatters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.io import loadmat

import flexura as fx
from flexura.testing import MeasuredChannel, MeasuredFRF
from flexura.testing.substructuring.coupling import Block, Interface, coupled
from flexura.testing.substructuring.parts import Scatter, part_of
from helpers.coupled_parts import DOFS, FRAME_NAMES, HZ, along, arm, frame, given, whole

W = 2 * np.pi * HZ
TIP = [("A.tip", "B.start")]


def off(found, true):
    """The largest difference of each response over its largest value."""
    return float((np.abs(found - true).max(axis=0) / np.abs(true).max(axis=0)).max())


def oscillator(m, k, c):
    """Receptance (f, 1, 1) of a mass on a spring and a dashpot."""
    return (1 / (k - m * W**2 + 1j * W * c))[:, None, None]


@pytest.mark.parametrize("joint", [None, 3e5])
def test_two_masses_and_springs_are_the_system_of_two_degrees_of_freedom(joint):
    a, b = along(["x"], HZ, oscillator(0.2, 4e4, 2.0)), along(["x"], HZ, oscillator(0.3, 0.0, 0.0))
    found = fx.couple({"A": a, "B": b}, joins=[fx.Join("A.x", "B.x", joint, None if joint is None else 5.0)])
    if joint is None:
        true = oscillator(0.5, 4e4, 2.0)
        assert [c.name for c in found.outputs] == ["A.x"]
    else:
        k, c = joint + 5j * W, 4e4 + 2j * W
        Z = np.array([[c + k - 0.2 * W**2, -k], [-k, k - 0.3 * W**2]]).transpose(2, 0, 1)
        true = np.linalg.inv(Z)
        assert [c.name for c in found.outputs] == ["A.x", "B.x"]
    assert off(found.response, true) < 1e-12


def bar(length, E=70e9, rho=2700.0, area=1e-4, loss=0.01):
    """Receptances (f, 2, 2) at both ends of a free bar along its axis (Bishop and Johnson 1960)."""
    modulus = E * (1 + 1j * loss)
    k = W * np.sqrt(rho / modulus)
    scale = -1 / (modulus * area * k * np.sin(k * length))
    same = scale * np.cos(k * length)
    return np.array([[same, scale], [scale, same]]).transpose(2, 0, 1)


def test_two_bars_in_a_row_are_one_bar_and_one_taken_out_leaves_the_other():
    a, b, ab = (along(["left", "right"], HZ, bar(length)) for length in (0.7, 1.6, 2.3))
    found = fx.couple({"A": a, "B": b}, joins=[("A.right", "B.left")])
    ends = ["A.left", "B.right"]
    assert off(found.response[:, [0, 2]][:, :, [0, 2]], ab.response) < 1e-10
    assert [c.name for c in found.outputs] == [ends[0], "A.right", ends[1]]
    middle = np.concatenate([found.response, np.zeros((len(HZ), 0, 3))], axis=1)
    row = along([c.name for c in found.outputs], HZ, middle)
    left = fx.decouple(row, b, joins=[("A.right", "left")], inputs=["A.left"], outputs=["A.left"])
    assert off(left.response, a.response[:, :1, :1]) < 1e-9


def test_a_part_that_is_held_at_ground_is_the_clamped_bar():
    found = fx.couple({"A": along(["left", "right"], HZ, bar(0.7))}, joins=[("A.left", "ground")], outputs=["A.right"])
    modulus = 70e9 * (1 + 0.01j)
    k = W * np.sqrt(2700.0 / modulus)
    assert off(found.of("A.right", "A.right"), np.tan(0.7 * k) / (modulus * 1e-4 * k)) < 1e-10
    assert np.abs(found.of("A.right", "A.left")).max() < 1e-12 * np.abs(found.response).max()


def test_parts_coupled_are_the_assembly_described_as_one_mechanism():
    found = fx.couple({"A": frame(), "B": arm()}, joins=TIP, quantity="accelerance")
    assert [c.name for c in found.outputs] == [*(f"A.{n}" for n in FRAME_NAMES), "B.end.tz", "B.side.tx"]
    assert off(found.response, whole().response) < 1e-9
    assert [c.quantity for c in found.outputs] == [c.quantity for c in whole().outputs]
    assert not found.warnings


def test_a_part_taken_out_of_the_assembly_leaves_the_other():
    left = fx.decouple(whole(), arm(), joins=[("tip", "start")], inputs=FRAME_NAMES, outputs=FRAME_NAMES)
    assert off(left.response, frame().response) < 1e-6


def test_an_extended_interface_takes_a_tolerance_and_then_gives_the_same():
    joins = [("tip", "start"), ("end.tz", "end.tz"), ("side.tx", "side.tx")]
    with pytest.raises(fx.SolverError, match=r"singular at every line, of rank 6 for 8 joined DOFs.*end\.tz"):
        fx.decouple(whole(), arm(), joins=joins)
    left = fx.decouple(whole(), arm(), joins=joins, inputs=FRAME_NAMES, outputs=FRAME_NAMES, tolerance=1e-10)
    assert off(left.response, frame().response) < 1e-6
    assert set(left.rank) == {6}
    assert any("of 8 joined DOFs 6 are told apart" in note for note in left.notes)


def test_joints_are_taken_out_with_the_part():
    stiffness = {dof: 2e6 if dof[0] == "t" else 300.0 for dof in DOFS}
    both = fx.couple({"A": frame(), "B": arm()}, joins=[fx.Join("A.tip", "B.start", stiffness)])
    names = [f"A.{name}" for name in FRAME_NAMES]
    left = fx.decouple(both, arm(), joins=[fx.Join("A.tip", "start", stiffness)], inputs=names, outputs=names)
    assert off(left.response, frame().response) < 1e-8
    rigid = fx.couple({"A": frame(), "B": arm()}, joins=TIP)
    stiff = dict.fromkeys(DOFS, 1e15)
    as_stiff = fx.couple({"A": frame(), "B": arm()}, joins=[fx.Join("A.tip", "B.start", stiff)], outputs=["A.mid.ty"])
    assert off(as_stiff.of("A.mid.ty", "A.tip.tx"), rigid.of("A.mid.ty", "A.tip.tx")) < 1e-6


def test_receptance_mobility_and_accelerance_give_one_assembly():
    parts = {"A": frame(), "B": arm()}
    found = {q: fx.couple(parts, joins=TIP, quantity=q) for q in ("receptance", "mobility", "accelerance")}
    s = 2j * np.pi * HZ[:, None, None]
    assert off(found["mobility"].response, s * found["receptance"].response) < 1e-12
    assert off(found["accelerance"].response, s**2 * found["receptance"].response) < 1e-12
    assert found["mobility"].unit("A.tip.rx", "A.tip.rx") == "(rad/s)/(N*m)"


def test_a_hammer_against_the_axis_of_the_sensor_is_taken_with_its_sign():
    H = oscillator(0.2, 4e4, 2.0)
    sensor = MeasuredChannel("acc", "acceleration", "x", (0.0, 0.0, 1.0), (0.1, 0.0, 0.0))
    hammer = MeasuredChannel("hit", "force", "x", (0.0, 0.0, -1.0), (0.1, 0.0, 0.0))
    measured = MeasuredFRF(HZ, W[:, None, None] ** 2 * H, (hammer,), (sensor,))  # (-w^2) times (-H)
    mass = along(["m"], HZ, oscillator(0.3, 0.0, 0.0))
    found = fx.couple({"A": measured, "B": mass}, joins=[("A.acc", "B.m")], quantity="receptance")
    assert off(-found.response, oscillator(0.5, 4e4, 2.0)) < 1e-12


def test_modes_of_the_coupled_response_are_those_of_the_assembly(tmp_path):
    hz = np.arange(60.0, 1200.0, 1.0)

    def held(m, k):
        return 1 / (k * (1 + 0.01j) - m * (2 * np.pi * hz[:, None, None]) ** 2)

    parts = {"A": along(["x"], hz, held(0.2, 4e5)), "B": along(["x"], hz, held(0.3, 9e5))}
    found = fx.couple(parts, joins=[fx.Join("A.x", "B.x", 2e5)], quantity="accelerance")
    true = np.sqrt(np.linalg.eigvals(np.array([[6e5 / 0.2, -2e5 / 0.2], [-2e5 / 0.3, 11e5 / 0.3]]))) / (2 * np.pi)
    assert np.allclose(fx.identify(found).frequency_hz, np.sort(true), rtol=1e-4)
    pytest.importorskip("pyuff")
    path = tmp_path / "coupled.uff"
    fx.export(found, path)
    assert off(fx.read_measurement(path).frfs[0].response, found.response) < 1e-9


def draws(rng, shape):
    """Complex noise of unit variance."""
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def test_scatter_is_that_of_repeated_noise():
    """4000 draws at one frequency as so many lines have the standard deviation that is told, within 10 %."""
    rng, count = np.random.default_rng(2), 4000
    a, b = part_of("A", frame()), part_of("B", arm())
    line = int(np.searchsorted(HZ, 700.0))
    Y = [np.repeat(part.Y[[line]], count, axis=0) for part in (a, b)]
    sigma = [1e-3 * np.abs(y) for y in Y]
    Bu = np.zeros((6, 15))
    Bu[:, :6], Bu[:, 7:13] = np.eye(6), -np.eye(6)
    interface = Interface(Bu, Bu, np.zeros((count, 6), dtype=complex))
    everything = np.arange(15)
    exact = [Block(y, 1.0, Scatter(s)) for y, s in zip(Y, sigma, strict=True)]
    noisy = [Block(y + s * draws(rng, y.shape), 1.0, None) for y, s in zip(Y, sigma, strict=True)]
    told = coupled(exact, interface, everything, everything)
    found = coupled(noisy, interface, everything, everything)
    assert told.sigma is not None and told.disturbance is not None
    assert 0.01 < told.disturbance[0] < 1 / 3
    spread = np.sqrt((np.abs(found.Y - told.Y) ** 2).mean(axis=0))
    assert np.abs(spread / told.sigma[0] - 1).max() < 0.1


def test_noise_of_one_part_is_amplified_by_its_share_of_the_interface(tmp_path):
    """Of one DOF, Y = Ya Yb / (Ya + Yb): noise of A over its response comes out times Yb / (Ya + Yb)."""
    Ya, Yb = oscillator(0.2, 4e4, 2.0), oscillator(0.3, 9e4, 4.0)
    found = fx.couple({"A": along(["x"], HZ, Ya), "B": along(["x"], HZ, Yb)}, joins=[("A.x", "B.x")], noise={"A": 1e-3})
    ratio = np.abs(Yb / (Ya + Yb))
    assert found.sigma is not None and found.amplification is not None
    sigma = 1e-3 * np.sqrt((np.abs(Ya) ** 2).mean())
    assert np.allclose(found.sigma, ratio**2 * sigma, rtol=1e-9, atol=0)
    assert np.allclose(found.amplification, ratio[:, 0, 0])
    for name in ("x.npz", "x.mat"):
        (path,) = fx.export(found, tmp_path / name)
        held = np.load(path) if name == "x.npz" else {"sigma": loadmat(path)["Sigma"]}
        assert np.allclose(held["sigma"].ravel(), found.sigma.ravel(), rtol=1e-12, atol=0)


def test_coherence_gives_the_scatter_of_averaged_responses():
    """Responses by H1 of 16 averages of forces with noise in the output, 3000 times (Bendat and Piersol 2010)."""
    rng, count, n, H, noise = np.random.default_rng(3), 3000, 16, 2.0 - 1.0j, 0.7
    force = draws(rng, (count, n))
    out = H * force + noise * draws(rng, (count, n))
    estimates = (out * force.conj()).mean(axis=1) / (np.abs(force) ** 2).mean(axis=1)
    coherence = abs(H) ** 2 / (abs(H) ** 2 + noise**2)
    channel = MeasuredChannel("x", "displacement")
    line = np.array([10.0])
    frf = MeasuredFRF(
        *(line, np.full((1, 1, 1), H), (MeasuredChannel("x", "force"),), (channel,)),
        coherence=np.full((1, 1, 1), coherence),
        averages=n,
    )
    scatter = part_of("A", frf).scatter
    assert scatter is not None
    rms = np.sqrt((np.abs(estimates - H) ** 2).mean())
    assert scatter.sigma[0, 0, 0] == pytest.approx(rms, rel=0.06)


def test_noise_beyond_first_order_is_warned_of_and_little_is_not():
    parts = {"A": frame(), "B": arm()}
    quiet = fx.couple(parts, joins=TIP, noise={"A": 1e-7})
    assert quiet.sigma is not None and not quiet.warnings
    assert "taken as without noise: B" in quiet.notes
    loud = fx.couple(parts, joins=TIP, noise={"A": 0.05})
    assert [w.kind for w in loud.warnings] == ["noise"]
    assert fx.couple(parts, joins=TIP).sigma is None


def test_scatter_grows_with_the_noise_and_is_told_in_the_quantity_of_the_result():
    parts = {"A": frame(), "B": arm()}
    one, two = (fx.couple(parts, joins=TIP, noise={"A": level}, quantity="receptance") for level in (1e-7, 2e-7))
    fast = fx.couple(parts, joins=TIP, noise={"A": 1e-7}, quantity="accelerance")
    assert one.sigma is not None and two.sigma is not None and fast.sigma is not None
    assert np.allclose(two.sigma, 2 * one.sigma)
    assert np.allclose(fast.sigma, W[:, None, None] ** 2 * one.sigma)


def test_lines_that_differ_are_refused_or_interpolated_with_what_that_costs():
    fine = np.linspace(20.0, 3000.0, 119)
    other = given(fine, np.ones((119, 1, 1)), arm().inputs[6:7], arm().outputs[6:7])
    a = given(HZ, np.ones((60, 1, 1)), frame().inputs[2:3], frame().outputs[2:3])
    with pytest.raises(fx.OptionError, match="different lines: A: 60 from 20 to 3000 Hz; B: 119 from 20 to 3000 Hz"):
        fx.couple({"A": a, "B": other}, joins=[("A.tip.tz", "B.end.tz")])
    found = fx.couple({"A": a, "B": other}, joins=[("A.tip.tz", "B.end.tz")], interpolate=True)
    assert np.array_equal(found.frequency_hz, HZ) and any("interpolated" in note for note in found.notes)
    sharp = replace(other, response=1 / (1 - (fine[:, None, None] / 500) ** 2 + 0.001j))
    bent = fx.couple({"A": a, "B": sharp}, joins=[("A.tip.tz", "B.end.tz")], interpolate=True)
    assert [w.kind for w in bent.warnings] == ["lines"]
    far = replace(other, frequency_hz=fine + 5000)
    with pytest.raises(fx.OptionError, match="no line in common"):
        fx.couple({"A": a, "B": far}, joins=[("A.tip.tz", "B.end.tz")], interpolate=True)


def test_windows_that_have_added_damping_are_warned_of():
    H = oscillator(0.2, 4e4, 2.0)
    channel = MeasuredChannel("x", "displacement"), MeasuredChannel("x", "force")
    damped = MeasuredFRF(HZ, H, channel[1:], channel[:1], decay=3.0)
    found = fx.couple({"A": damped, "B": along(["x"], HZ, H)}, joins=[("A.x", "B.x")])
    assert [w.kind for w in found.warnings] == ["window"] and found.decay == 3.0


WRONG = [
    (
        [("A.tap", "B.start")],
        "join A.tap = B.start: A has no output 'tap', and no point of this name; did you mean 'tip'",
    ),
    ([("C.tip", "B.start")], "'C.tip' begins with no name of a part"),
    ([("A.tip.tx", "B.start.ty")], "are not on one line"),
    ([("A.tip.tx", "B.start.rx")], "is acceleration, start.rx is rotation: they cannot be one"),
    ([("A.tip", "B.end")], "there is no B.end.tx, B.end.ty, B.end.rx, B.end.ry, B.end.rz"),
    ([("A.tip", "B.end.tz")], "one is a channel, the other a point"),
    ([("A.tip.tx", "A.tip.tx")], "both are one channel"),
    ([], "nothing is joined"),
    ([fx.Join("A.tip", "B.start", 1e6)], "stiffness of several DOFs is given by DOF"),
    ([fx.Join("A.tip", "B.start", {"ux": 1e6})], "stiffness of 'ux', which is not joined"),
    ([fx.Join("A.tip.tx", "B.start.tx", -1.0)], "stiffness is positive and finite, not -1"),
]


@pytest.mark.parametrize(("joins", "text"), WRONG)
def test_joins_that_make_no_sense_are_refused_with_their_place(joins, text):
    with pytest.raises(fx.OptionError) as error:
        fx.couple({"A": frame(), "B": arm()}, joins=joins)
    assert text in str(error.value)


def test_joins_that_say_the_same_are_refused():
    with pytest.raises(fx.SolverError, match=r"rank 6 for 7 joined DOFs.*A\.tip\.tx=B\.start\.tx"):
        fx.couple({"A": frame(), "B": arm()}, joins=[*TIP, ("A.tip.tx", "B.start.tx")])


def test_a_join_needs_a_force_where_it_is_read():
    only_read = replace(arm(), inputs=arm().inputs[1:], response=arm().response[:, :, 1:])
    with pytest.raises(fx.OptionError, match=r"no force acts on start\.tx of B.*inputs: start\.ty"):
        fx.couple({"A": frame(), "B": only_read}, joins=TIP)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"noise": {"C": 0.1}}, "there is no part 'C'"),
        ({"noise": {"A": 2.0}}, "A: noise is a share"),
        ({"quantity": "stiffness"}, "quantity is one of"),
        ({"tolerance": 1.0}, "tolerance is a share"),
        ({"outputs": ["A.nothing"]}, "there is no channel 'A.nothing'"),
        ({"joins": "A.tip"}, "joins"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, text):
    with pytest.raises(fx.OptionError, match=text):
        fx.couple({"A": frame(), "B": arm()}, **{"joins": TIP, **options})


def test_responses_that_are_not_finite_are_refused_with_their_place():
    bad = frame().response.copy()
    bad[4, 1, 2] = np.nan
    with pytest.raises(fx.OptionError, match=r"A: tip\.ty / tip\.tz is not finite at"):
        fx.couple({"A": replace(frame(), response=bad), "B": arm()}, joins=TIP)
