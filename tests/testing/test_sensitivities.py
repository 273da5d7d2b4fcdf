"""Sensitivities of frequencies, shapes and responses against closed forms, high-precision differences and differences
of other solvers."""

import mpmath
import numpy as np
import pytest

import flexura as fx
from flexura.derivatives.families import FullOrderFamily, LowOrderFamily
from flexura.linalg import lowest
from helpers import samples

RPR = "examples/rpr/rpr.yaml"


def beam_frequencies(length, thickness, width, tip_mass, modulus, elements=3):
    """Lowest two frequencies, Hz, of bending across the thickness: Hermite elements (Przemieniecki 1968), 40 digits."""
    L, EI = length / elements, modulus * width * thickness**3 / 12
    line = mpmath.mpf(2700) * width * thickness
    k = [[12, 6 * L, -12, 6 * L], [6 * L, 4 * L**2, -6 * L, 2 * L**2]]
    k += [[-12, -6 * L, 12, -6 * L], [6 * L, 2 * L**2, -6 * L, 4 * L**2]]
    m = [[156, 22 * L, 54, -13 * L], [22 * L, 4 * L**2, 13 * L, -3 * L**2]]
    m += [[54, 13 * L, 156, -22 * L], [-13 * L, -3 * L**2, -22 * L, 4 * L**2]]
    n = 2 * (elements + 1)
    K, M = mpmath.zeros(n), mpmath.zeros(n)
    for e in range(elements):
        for i in range(4):
            for j in range(4):
                K[2 * e + i, 2 * e + j] += k[i][j] * EI / L**3
                M[2 * e + i, 2 * e + j] += m[i][j] * line * L / 420
    M[n - 2, n - 2] += tip_mass
    values = mpmath.eig(K[2:, 2:] ** -1 * M[2:, 2:], left=False, right=False)
    return sorted(1 / mpmath.sqrt(mpmath.re(v)) / (2 * mpmath.pi) for v in values)[:2]


@pytest.mark.parametrize("name", ["length", "thickness", "tip_mass", "modulus", "width"])
def test_frequencies_of_a_cantilever_against_high_precision(name):
    at = {k: str(v) for k, v in (("length", 0.08), ("thickness", 1e-3), ("width", 6e-3), ("tip_mass", 0.02))}
    with mpmath.workdps(40):
        at = {k: mpmath.mpf(v) for k, v in {**at, "modulus": "70e9"}.items()}
        h = at[name] * mpmath.mpf(10) ** -15
        up, down = (beam_frequencies(**{**at, name: at[name] + s * h}) for s in (1, -1))
        expected = [float((a - b) / (2 * h)) for a, b in zip(up, down, strict=True)]
        values = [float(f) for f in beam_frequencies(**at)]
    mechanism = samples.beam()
    found = fx.models.mode_sensitivities(mechanism, free=[name], n=8)
    for f, slope in zip(values, expected, strict=True):
        k = int(np.argmin(abs(found.frequency_hz - f)))
        assert found.frequency_hz[k] == pytest.approx(f, rel=1e-8)
        assert found.derivative[k, 0] == pytest.approx(slope, rel=1e-6)


def test_kept_modes_mean_the_same_away_from_the_start():
    """A beam that is flat at the start and upright at the design: its kept modes come in another order."""
    plan = fx.Plan(samples.beam())
    family = LowOrderFamily(plan, {"thickness": 1e-3, "width": 6e-3}, 4)
    at = {"thickness": 3.5e-3, "width": 2.2e-3}
    model = family.model(at)
    pairs = lowest(model.K, model.M, 4)
    KX, MX, _ = family.products(at, pairs.vectors)
    assert np.abs(KX - MX * pairs.values).max() < 1e-9 * np.abs(KX).max()
    for name, change in zip(at, family.changes(at, list(at), pairs.vectors), strict=True):
        slopes = np.einsum("ik,ik->k", pairs.vectors, change.K - pairs.values * change.M)
        h = 1e-4 * at[name]
        up, down = (fx.reduce(plan, {**at, name: at[name] + s * h}, keep=4) for s in (1, -1))
        expected = [(a - b) / (2 * h) for a, b in zip(*(lowest(m.K, m.M, 4).values for m in (up, down)), strict=True)]
        assert (np.abs(slopes - expected) < 1e-5 * pairs.values / at[name]).all()


@pytest.mark.parametrize(
    "how", [{}, pytest.param({"order": "low"}, marks=pytest.mark.slow), {"order": "low", "keep": 2}]
)
def test_mechanism_of_closed_loops_against_differences(how):
    """Frequencies and shapes, relative to f/p and to the largest displacement.

    Eigenvalues of the full-order K have lost digits to its stiffest entries; Rayleigh quotients of its vectors with
    strain energies have not, their error being the square of that of the vectors.
    """
    plan = fx.Plan(fx.load(RPR))
    names = ["plate", "u_web", "platform_thickness"]
    found = fx.models.mode_sensitivities(plan, free=names, **how)
    for p, (name, value) in enumerate(zip(names, found.values, strict=True)):
        table, shapes = [], []
        for step in (0.02 * value, 0.01 * value, 0.005 * value):
            up, down = (
                fx.models.mode_sensitivities(plan, free=[name], parameters={name: value + s * step}, **how)
                for s in (1, -1)
            )
            hz = [
                refined(plan, s, {name: value + side * step}) if not how else s.frequency_hz
                for s, side in ((up, 1), (down, -1))
            ]
            table.append((hz[0] - hz[1]) / (2 * step))
            sign = [np.sign((s.shapes * found.shapes).sum(axis=0)) for s in (up, down)]
            shapes.append((up.shapes * sign[0] - down.shapes * sign[1]) / (2 * step))
        scale = found.frequency_hz / value
        assert abs(found.derivative[:, p] - richardson(table)).max() <= 1e-6 * scale.max()
        sign = np.sign((found.branch_shapes[p] * found.shapes).sum(axis=0))
        own, expected = found.shape_derivative[p] * sign, richardson(shapes)
        assert abs(own - expected).max() <= 1e-5 * abs(found.shapes).max() / value


def refined(plan, result, parameters):
    """Frequencies, Hz, of shapes by their Rayleigh quotients."""
    K, M, _ = FullOrderFamily(plan).products(parameters, result.shapes)
    quotient = (result.shapes * K).sum(axis=0) / (result.shapes * M).sum(axis=0)
    return np.sqrt(quotient) / (2 * np.pi)


def richardson(table):
    """Limit of three differences at steps h, h/2, h/4."""
    a, b = (4 * table[1] - table[0]) / 3, (4 * table[2] - table[1]) / 3
    return (16 * b - a) / 15


def test_square_beam_parts_into_its_two_branches():
    """At equal sides f is repeated; across the thickness f ~ thickness, across the width it does not move with it."""
    mechanism = samples.beam(thickness=2e-3, width=2e-3, tip_mass=1e-3).model_copy(update={"masses": {}})
    found = fx.models.mode_sensitivities(mechanism, free=["thickness", "length"], n=2)
    f, t, L = found.frequency_hz[0], 2e-3, 0.08
    assert found.frequency_hz[1] == pytest.approx(f, rel=1e-9)
    assert found.derivative[:, 0] == pytest.approx([0.0, f / t], abs=1e-7 * f / t)
    assert found.derivative[:, 1] == pytest.approx([-2 * f / L] * 2, rel=1e-7)
    # M-normalised shapes go with one over the root of the mass, which goes with the thickness
    branch, slope = found.branch_shapes[0], found.shape_derivative[0]
    assert abs(slope + branch / (2 * t)).max() <= 1e-6 * abs(branch).max() / t


def test_vectors_of_a_repeated_frequency_turn_as_they_must():
    """K = k I + p diag(1, 0) + p^2/q offdiag(1): at p = 0 the vectors turn by 1/q per unit of p (half of atan 2p/q)."""
    text = """
    flexura: 1
    parameters: {k: 100 N/m, p: 0 N/m, q: 1 N/m}
    bodies: {stage: {centre: [0, 0, 0], mass: 1 kg, inertia: [1 kg*m^2, 1 kg*m^2, 1 kg*m^2]}}
    springs:
      plane: {nodes: [stage], matrix: MATRIX}
    """
    rows = [["k + p", "p*p/q", "0 N/m"], ["p*p/q", "k", "0 N/m"], ["0 N/m", "0 N/m", "5000 N/m"]]
    turn = [["0 N"] * 3 + [f"{5000 if i == j else 0} N*m/rad" for j in range(3)] for i in range(3)]
    whole = [row + ["0 N/rad"] * 3 for row in rows] + turn
    matrix = "[" + ", ".join("[" + ", ".join(row) + "]" for row in whole) + "]"
    mechanism = fx.loads(text.replace("MATRIX", matrix))
    found = fx.models.mode_sensitivities(mechanism, free=["p"], n=2)
    w = 10.0
    assert found.derivative[:, 0] == pytest.approx([0.0, 1 / (2 * w) / (2 * np.pi)], abs=1e-9)
    still, moving = found.branch_shapes[0][:2].T
    assert abs(moving) == pytest.approx([1.0, 0.0], abs=1e-9)
    slope = found.shape_derivative[0][:2, 1] * np.sign(moving[0])
    assert slope == pytest.approx([0.0, 1.0], abs=1e-6)
    assert found.shape_derivative[0][:2, 0] * np.sign(still[1]) == pytest.approx([-1.0, 0.0], abs=1e-6)


def test_response_of_an_oscillator():
    """H = 1/(k - m w^2 + 2 i zeta w sqrt(k m)) and its derivatives."""
    k, m, zeta, w = 4e3, 0.4, 0.02, 2 * np.pi * np.array([3.0, 15.0, 15.9, 40.0])
    found = fx.models.response_sensitivities(
        samples.body(),
        frequency_hz=w / (2 * np.pi),
        inputs=["stage.tx"],
        outputs=["stage.tx"],
        free=["kx", "mass"],
        damping=zeta,
    )
    H = 1 / (k - m * w**2 + 2j * zeta * w * np.sqrt(k * m))
    dk = -(H**2) * (1 + 1j * zeta * w * np.sqrt(m / k))
    dm = -(H**2) * (-(w**2) + 1j * zeta * w * np.sqrt(k / m))
    assert found.response[:, 0, 0] == pytest.approx(H, rel=1e-9)
    assert found.derivative[0, :, 0, 0] == pytest.approx(dk, rel=1e-7)
    assert found.derivative[1, :, 0, 0] == pytest.approx(dm, rel=1e-7)


def test_responses_with_few_modes_keep_their_static_part():
    """The cantilever with three modes against differences of the full modal sum with the same static correction."""
    hz, ins, outs = [5.0, 60.0, 200.0], ["tip.tz"], ["tip.tz", "tip.ry"]
    mechanism = samples.beam()
    found = fx.models.response_sensitivities(
        mechanism, frequency_hz=hz, inputs=ins, outputs=outs, free=["thickness", "length"], damping=0.03, n=18
    )

    def whole(name, value):
        return fx.frequency_response(
            mechanism, frequency_hz=hz, inputs=ins, outputs=outs, order="full", damping=0.03, parameters={name: value}
        ).response

    for p, (name, value) in enumerate(zip(found.free, found.values, strict=True)):
        table = [(whole(name, value + h) - whole(name, value - h)) / (2 * h) for h in value * 0.01 / 2 ** np.arange(3)]
        expected = richardson(table)
        assert abs(found.derivative[p] - expected).max() <= 1e-5 * abs(expected).max()
    few = fx.models.response_sensitivities(
        mechanism, frequency_hz=[5.0], inputs=ins, outputs=outs, free=["thickness"], damping=0.03, n=2
    )
    assert few.response == pytest.approx(found.response[:1], rel=1e-3)
    assert few.derivative[0] == pytest.approx(found.derivative[0, :1], rel=1e-3)


def test_what_can_be_wrong_is_named():
    with pytest.raises(fx.OptionError, match="not a parameter; known"):
        fx.models.mode_sensitivities(samples.beam(), free=["depth"])
    with pytest.raises(fx.OptionError, match="follows from"):
        fx.models.mode_sensitivities(fx.load(RPR), free=["height"])
    with pytest.raises(fx.OptionError, match="named twice"):
        fx.models.mode_sensitivities(samples.beam(), free=["width", "width"])
    with pytest.raises(fx.OptionError, match="keep belongs to order low"):
        fx.models.mode_sensitivities(samples.beam(), free=["width"], keep=2)


def test_a_parameter_at_its_bound_has_a_derivative():
    mechanism = samples.beam(thickness=4e-3)
    found = fx.models.mode_sensitivities(mechanism, free=["thickness"], n=1)
    assert 1 < found.relative[0, 0] < 1.5, "1 without the tip mass, 3/2 without mass of the beam"
    assert found.to_dict()["free"] == ["thickness"]
