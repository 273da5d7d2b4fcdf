"""Exact dynamic stiffness of beams and mechanisms: other formulations, closed forms, counts, digits."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import flexura as fx
from flexura.beam.dynamic import BeamSeries, dynamic_beam
from flexura.beam.element import UniformBeam
from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.mechanism import with_rigid_bodies
from flexura.methods.discrete_models import finite_elements
from flexura.methods.dynamic_stiffness import DynamicStiffness, count_below, dynamic_stiffness
from flexura.methods.exact_condensation import ExactCondensation
from flexura.methods.exact_response import inside_member
from flexura.structure.segments import segments
from helpers.nodal_stiffness import NodalStiffness, end_stiffness
from helpers.stages import E, G, guide

method = sys.modules[dynamic_stiffness.__module__]

ROOT = Path(__file__).parents[2]
RHO, L, B, H = 2700.0, 0.2, 4e-3, 3e-3
A, IY, IZ, J = B * H, B * H**3 / 12, H * B**3 / 12, 2e-11
SECTION = fx.describe.SectionConstants(A=A, Iy=IY, Iz=IZ, J=J, ky=5 / 6, kz=5 / 6)
METAL = fx.describe.Material(E=E, G=G, rho=RHO)
FREE_END, HELD_END = np.array([2, 3]), np.array([0, 1])
ENDS = {"free": FREE_END, "clamped": HELD_END, "pinned": np.array([0, 3])}
"""What is zero at an end, of deflection, slope, shear force and moment."""
GROUND = {"clamped": "clamped", "pinned": {"fixed": ("ty", "tz", "tx", "rx")}, "free": None}


def load(name):
    return assemble(with_rigid_bodies(fx.load(ROOT / "examples" / name / f"{name}.yaml")))


def beam(length=L, theory="euler_bernoulli"):
    """The beam of the sizes above, as an array of one."""
    slide = 6 / 5 / (G * A) if theory == "timoshenko" else 0.0
    turn = 0.0 if theory == "euler_bernoulli" else RHO
    fields = (E * A, G * J, E * IY, E * IZ, slide, slide, RHO * A, RHO * (IY + IZ), turn * IY, turn * IZ, length)
    return UniformBeam(*(np.array([f]) for f in fields))


def bar(ends=("clamped", "free"), elements=1, theory="euler_bernoulli", **more):
    """The same beam as a mechanism along x."""
    ground = {node: GROUND[end] for node, end in zip("ab", ends, strict=True) if end != "free"}
    return fx.Mechanism(
        theory=theory,
        corrections="none",
        materials={"metal": METAL},
        nodes={"a": (0, 0, 0), "b": (L, 0, 0)},
        links={
            "bar": fx.describe.Link(
                nodes=("a", "b"), material="metal", section=SECTION, reference="z", elements=elements
            )
        },
        ground=ground,
        **more,
    )


def by_exponential(own, omega):
    """Dynamic stiffness (12, 12) of one beam from the exponential of its equations of motion, written out anew."""
    b = UniformBeam(*(complex(f[0]) for f in own))
    lam, x = omega**2, b.length
    K = np.zeros((12, 12), dtype=complex)

    def place(freedoms, signs, system):
        n = len(freedoms)
        phi = expm(np.array(system) * x)
        uu, uq, qu, qq = phi[:n, :n], phi[:n, n:], phi[n:, :n], phi[n:, n:]
        inverse = np.linalg.inv(uq)
        own = np.block([[inverse @ uu, -inverse], [qu - qq @ inverse @ uu, qq @ inverse]])
        at = np.array([*freedoms, *(f + 6 for f in freedoms)])
        s = np.array([*signs, *signs])
        K[np.ix_(at, at)] = own * s[:, None] * s

    # internal forces act on the far end; at the near one they are the reaction's opposite
    place([0], [1], [[0, 1 / b.EA], [-lam * b.mass, 0]])
    place([3], [1], [[0, 1 / b.GJ], [-lam * b.polar, 0]])
    for freedoms, signs, EI, s, r in (
        ([1, 5], [1, 1], b.EIz, b.shear_y, b.rotary_z),
        ([2, 4], [1, -1], b.EIy, b.shear_z, b.rotary_y),
    ):
        place(
            freedoms,
            signs,
            [[0, 1, s, 0], [0, 0, 0, 1 / EI], [-lam * b.mass, 0, 0, 0], [0, -lam * r, -1, 0]],
        )
    return K


def frequency_equation(ends, x):
    """Determinant of the Euler-Bernoulli beam of ends of two kinds, kL = x, from its four wave functions."""
    rows = []
    for end, z in zip(ends, (0.0, x), strict=True):
        c, s, down, up = np.cos(z), np.sin(z), np.exp(-z), np.exp(z - x)
        derivatives = np.array([[c, s, down, up], [-s, c, -down, up], [s, -c, -down, up], [-c, -s, down, up]])
        rows.append(derivatives[ENDS[end]])
    return np.linalg.det(np.concatenate(rows))


def bending_roots(ends, count):
    """The first nonzero roots kL."""
    grid = np.arange(0.4, 4 * (count + 2), 0.05)
    values = [frequency_equation(ends, x) for x in grid]
    found = [
        brentq(lambda x: frequency_equation(ends, x), a, b, xtol=1e-13)
        for a, b, f, g in zip(grid, grid[1:], values, values[1:], strict=False)
        if f * g < 0
    ]
    return np.array(found[:count])


def closed_form(ends, count):
    """The lowest frequencies, Hz, of the beam: bending in two planes, torsion and extension."""
    k = bending_roots(ends, count) / L
    bending = [k**2 * np.sqrt(E * own / (RHO * A)) for own in (IY, IZ)]
    n = np.arange(count)
    quarter = {0: n + 1.0, 1: n + 0.5, 2: n + 1.0}[sum(end == "free" for end in ends)] * np.pi / L
    waves = [quarter * np.sqrt(G * J / (RHO * (IY + IZ))), quarter * np.sqrt(E / RHO)]
    return np.sort(np.concatenate([*bending, *waves]))[:count] / (2 * np.pi)


class TestBeams:
    @pytest.mark.parametrize("theory", ["euler_bernoulli", "rayleigh", "timoshenko"])
    @pytest.mark.parametrize("hz", [30.0, 400.0, 500 + 90j])
    def test_stiffness_is_that_of_the_equations_of_motion(self, theory, hz) -> None:
        found = end_stiffness(beam(theory=theory), 2 * np.pi * hz)[0]
        expected = by_exponential(beam(theory=theory), 2 * np.pi * hz)
        d = 1 / np.sqrt(np.abs(np.diagonal(expected)))
        np.testing.assert_allclose(found * d[:, None] * d, expected * d[:, None] * d, atol=1e-9)

    @pytest.mark.parametrize("theory", ["euler_bernoulli", "rayleigh", "timoshenko"])
    def test_series_of_stiffness_are_the_stiffness(self, theory) -> None:
        limit = (2 * np.pi * 3000.0) ** 2
        lam = limit * np.array([1e-9, 0.013, 0.37, 1.0])
        own = BeamSeries(beam(0.13, theory), limit)(lam)
        for k, value in enumerate(lam):
            direct = dynamic_beam(beam(0.13, theory), value)
            for name in ("K", "slope"):
                a, b = getattr(own, name)[0, k], getattr(direct, name)[0]
                d = 1 / np.sqrt(np.abs(np.diagonal(b)))
                np.testing.assert_allclose(a * d[:, None] * d, b * d[:, None] * d, atol=2e-12)
            assert own.J0[0, k] == direct.J0[0]

    def test_slope_is_the_derivative(self) -> None:
        lam, step = (2 * np.pi * 1500.0) ** 2, 1e-30
        direct = dynamic_beam(beam(theory="timoshenko"), lam).slope[0]
        complex_step = dynamic_beam(beam(theory="timoshenko"), lam * (1 + 1j * step)).K[0].imag / (lam * step)
        d = 1 / np.sqrt(np.abs(np.diagonal(direct)))
        np.testing.assert_allclose(direct * d[:, None] * d, complex_step * d[:, None] * d, atol=1e-10)

    def test_counts_frequencies_with_both_ends_held(self) -> None:
        k = bending_roots(("clamped", "clamped"), 9) / L
        n = np.arange(1, 9) * np.pi / L
        held = np.sort(
            np.concatenate(
                [
                    *(k**2 * np.sqrt(E * own / (RHO * A)) for own in (IY, IZ)),
                    n * np.sqrt(G * J / (RHO * (IY + IZ))),
                    n * np.sqrt(E / RHO),
                ]
            )
        )[:12]
        for number, omega in enumerate(held):
            below, above = (dynamic_beam(beam(), (omega * (1 + e)) ** 2).J0[0] for e in (-1e-5, 1e-5))
            assert (below, above) == (number, number + 1)

    def test_short_stiff_beams_keep_the_digits_of_their_inertia(self) -> None:
        """kL = 0.005: in the usual matrix inertia is 1e-12 of the stiffness, in [t, e] it is apart from it."""
        length, lam = 1e-3, (2 * np.pi * 3.0) ** 2
        inertia = -dynamic_beam(beam(length), lam).K[0, :6, :6] / lam
        m = RHO * A * length
        rigid = np.diag([m, m, m, RHO * (IY + IZ) * length, m * length**2 / 3, m * length**2 / 3])
        rigid[1, 5] = rigid[5, 1] = m * length / 2
        rigid[2, 4] = rigid[4, 2] = -m * length / 2
        np.testing.assert_allclose(inertia, rigid, rtol=1e-9, atol=0)


class TestClosedForms:
    @pytest.mark.parametrize(
        "ends",
        [("clamped", "free"), ("clamped", "clamped"), ("free", "free"), ("clamped", "pinned")],
    )
    def test_one_member_has_the_frequencies_of_a_beam(self, ends) -> None:
        found = dynamic_stiffness(assemble(bar(ends)), 20).frequency_hz
        zero = 6 * (ends == ("free", "free"))
        assert (found[:zero] == 0).all()
        np.testing.assert_allclose(found[zero:], closed_form(ends, 20)[: 20 - zero], rtol=1e-10)

    def test_supports_that_let_the_beam_turn(self) -> None:
        """Held at both ends but for bending rotations: n pi."""
        found = dynamic_stiffness(assemble(bar(("pinned", "pinned"))), 12).frequency_hz
        n = np.arange(1, 13) * np.pi / L
        waves = [n * np.sqrt(G * J / (RHO * (IY + IZ))), n * np.sqrt(E / RHO)]
        bending = [n**2 * np.sqrt(E * own / (RHO * A)) for own in (IY, IZ)]
        expected = np.sort(np.concatenate([*waves, *bending]))[:12] / (2 * np.pi)
        np.testing.assert_allclose(found, expected, rtol=1e-10)

    def test_mass_on_springs_without_members(self) -> None:
        """A point mass has no rotary inertia: three frequencies, and rotations that are held but have no mass."""
        stiff = {"tx": 1e4, "ty": 2e4, "tz": 5e4, "rx": 1.0, "ry": 1.0, "rz": 1.0}
        own = fx.Mechanism(
            nodes={"a": (0, 0, 0), "b": (0.01, 0, 0)},
            springs={"s": fx.describe.Spring(nodes=("a", "b"), stiffness=fx.describe.DiagonalStiffness(**stiff))},
            masses={"m": fx.describe.PointMass(node="b", mass=0.02)},
            ground={"a": "clamped"},
        )
        found = dynamic_stiffness(assemble(own), 6)
        expected = np.sqrt(np.linalg.eigvalsh(_mass_on_springs(stiff, 0.01)) / 0.02) / (2 * np.pi)
        np.testing.assert_allclose(found.frequency_hz, expected, rtol=1e-10)

    def test_leaves_without_weight(self) -> None:
        """Frequencies of leaves lie six decades above those of the stage: each is found with a limit of its own."""
        model = assemble(guide())
        found = dynamic_stiffness(model, 8).frequency_hz
        assert found[6] > 1e4 * found[5]
        values = lowest(model.K, model.M, 6).values
        np.testing.assert_allclose(found[:6], np.sqrt(values) / (2 * np.pi), rtol=1e-8)

    @pytest.mark.parametrize(("theory", "freedoms"), [("timoshenko", ("tz", "ry")), ("rayleigh", ("rx",))])
    def test_elements_with_shear_or_torsion_converge_at_second_order(self, theory, freedoms) -> None:
        section = SECTION.model_copy(update={"J": 1e-16} if freedoms == ("rx",) else {"kz": 1e-3})
        own = bar(theory=theory, elements=6)
        own = own.model_copy(update={"links": {"bar": own.links["bar"].model_copy(update={"section": section})}})
        model = assemble(own)
        exact = dynamic_stiffness(model, 1)
        motion = np.abs(exact.shapes[:, :, 0]).max(axis=0)
        assert set(np.array(["tx", "ty", "tz", "rx", "ry", "rz"])[motion > 1e-6 * motion.max()]) == set(freedoms)
        errors = [finite_elements(model, 1, p).frequency_hz[0] / exact.frequency_hz[0] - 1 for p in (1, 2, 4)]
        assert errors[0] > errors[1] > errors[2] > 0
        np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.1)


def _mass_on_springs(stiff, arm):
    """Translational stiffness at b with the rotations, which have no mass, free to follow."""
    # the spring's matrix acts on the motion of b relative to a carried rigidly to the spring's midpoint
    K = np.diag(list(stiff.values()))
    to_middle = np.eye(6)
    to_middle[1, 5], to_middle[2, 4] = -arm / 2, arm / 2
    at_b = to_middle.T @ K @ to_middle
    inner = np.linalg.solve(at_b[3:, 3:], at_b[3:, :3])
    return at_b[:3, :3] - at_b[:3, 3:] @ inner


class TestCondensation:
    @pytest.mark.parametrize("name", ["rpr", "tip_tilt", "pivot"])
    def test_cutting_changes_nothing(self, name) -> None:
        model = load(name)
        lam = (2 * np.pi * dynamic_stiffness(model, 10).frequency_hz) ** 2
        found = []
        for pieces in (1, 2, 3):
            delta, _ = ExactCondensation(model, 1.2 * lam[-1], pieces).pencils(lam).solve()
            found.append(np.diagonal(delta) / (2 * lam))
        np.testing.assert_allclose(found, 0.0, atol=1e-9)

    def test_limit_changes_nothing(self) -> None:
        """Other limits keep other coordinates."""
        model = load("guide")
        lam = (2 * np.pi * dynamic_stiffness(model, 9).frequency_hz) ** 2
        counts = set()
        for reach in (1.1, 3.0, 20.0):
            own = ExactCondensation(model, reach * lam[-1])
            delta, _ = own.pencils(lam).solve()
            np.testing.assert_allclose(np.diagonal(delta) / lam, 0.0, atol=1e-9)
            counts.add(own.count)
        assert len(counts) == 3

    def test_linearised_frequencies_are_upper_bounds(self) -> None:
        model = load("guide")
        exact = (2 * np.pi * dynamic_stiffness(model, 12).frequency_hz) ** 2
        own = ExactCondensation(model, 1.3 * exact[-1])
        lam = np.linspace(0.0, 1.3, 14) * exact[-1]
        delta, _ = own.pencils(lam).solve()
        ahead = (lam[:, None] + delta[:, :12]) / exact - 1
        assert (ahead > -1e-9).all() and ahead.max() > 1e-2

    def test_m_is_minus_the_derivative_of_k(self) -> None:
        model = load("amplifier")
        own = ExactCondensation(model, (2 * np.pi * 4000.0) ** 2)
        lam, h = (2 * np.pi * 1234.0) ** 2, 1e-4
        around = own.pencils(lam * np.array([1 - h, 1, 1 + h]))
        slope = (around.K[0] - around.K[2]) / (2 * h * lam)
        np.testing.assert_allclose(slope, around.M[1], rtol=0, atol=1e-6 * np.abs(around.M[1]).max())

    @pytest.mark.parametrize("name", ["guide", "xy_stage", "tip_tilt"])
    def test_three_formulations_count_alike(self, name) -> None:
        """Condensed coordinates, kept nodes, and all nodes with a sparse factorisation."""
        model = load(name)
        hz = np.unique(dynamic_stiffness(model, 12).frequency_hz.round(6))
        sparse, kept = NodalStiffness(segments(model)), DynamicStiffness(model)
        own = ExactCondensation(model, (2.2 * np.pi * hz[-1]) ** 2)
        probes = [0.5 * hz[0], *(0.31 * hz[:-1] + 0.69 * hz[1:]), 1.001 * hz[-1]]
        counts = own.count_below((2 * np.pi * np.array(probes)) ** 2)
        assert counts[0] == 0 and counts[-1] >= 12 and (np.diff(counts) >= 0).all()
        assert [sparse.count_below(f) for f in probes] == counts.tolist()
        assert [kept.count_below(f) for f in probes] == counts.tolist()
        assert count_below(model, probes[3]) == counts[3]

    @pytest.mark.parametrize("omega", [900.0, 2500 + 60j])
    def test_kept_nodes_have_the_condensed_stiffness_of_all_nodes(self, omega) -> None:
        model = load("amplifier")
        whole = NodalStiffness(segments(model)).matrix(omega).toarray()
        found = DynamicStiffness(model)
        kept = model.plan.topology.dof.ravel()[found.assembler.physical]
        rest = np.setdiff1d(np.arange(len(whole)), kept)
        d = 1 / np.sqrt(np.abs(np.diagonal(whole)[rest]))
        inner = whole[np.ix_(rest, rest)] * d[:, None] * d
        other = d[:, None] * whole[np.ix_(rest, kept)]
        condensed = whole[np.ix_(kept, kept)] - other.T @ np.linalg.solve(inner, other)
        K, _, _ = found.at(omega)
        np.testing.assert_allclose(K, condensed, atol=1e-6 * np.abs(condensed).max())

    def test_wrong_numbers_are_noticed(self) -> None:
        model = load("guide")
        values = (2 * np.pi * dynamic_stiffness(model, 6).frequency_hz) ** 2
        own = ExactCondensation(model, 1.3 * values[-1])
        method._confirm(own, 0, values, method._clusters(values))
        for wrong in (values * [1, 1, 1 + 1e-6, 1, 1, 1], np.delete(values, 2)):
            with pytest.raises(fx.SolverError, match="counts do not confirm"):
                method._confirm(own, 0, wrong, method._clusters(wrong))

    def test_more_frequencies_than_the_mesh_has(self) -> None:
        model = assemble(bar())
        assert model.order == 6
        np.testing.assert_allclose(
            dynamic_stiffness(model, 30).frequency_hz, closed_form(("clamped", "free"), 30), rtol=1e-10
        )

    def test_nothing_that_moves(self) -> None:
        own = fx.Mechanism(
            nodes={"a": (0, 0, 0), "b": (0.01, 0, 0)},
            springs={"s": fx.describe.Spring(nodes=("a", "b"), stiffness=fx.describe.DiagonalStiffness(tx=1.0))},
            ground={"a": "clamped", "b": "clamped"},
        )
        with pytest.raises(fx.OptionError, match="nothing with a mass"):
            dynamic_stiffness(assemble(own), 3)


class TestShapes:
    @pytest.mark.parametrize("theory", ["euler_bernoulli", "timoshenko"])
    def test_inside_a_member_they_are_those_of_nodes_there(self, theory) -> None:
        coarse, fine = (assemble(bar(theory=theory, elements=n)) for n in (1, 8))
        one, many = dynamic_stiffness(coarse, 6), dynamic_stiffness(fine, 6)
        names = fine.plan.topology.node_names
        at = [names.index("a"), *(names.index(f"bar[{k}]") for k in range(1, 8)), names.index("b")]
        inside = inside_member(coarse, one, "bar", np.linspace(0, 1, 9))
        for k in range(6):
            a, b = inside[:, :, k], many.shapes[at, :, k]
            np.testing.assert_allclose(a * np.sign((a * b).sum()), b, atol=1e-9 * np.abs(b).max())

    def test_inside_a_cantilever_they_are_the_closed_form(self) -> None:
        model = assemble(bar())
        solution = dynamic_stiffness(model, 1)
        x = np.linspace(0, 1, 7)
        k = bending_roots(("clamped", "free"), 1)[0]
        share = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
        v = np.cosh(k * x) - np.cos(k * x) - share * (np.sinh(k * x) - np.sin(k * x))
        found = inside_member(model, solution, "bar", x)[:, 2, 0]
        # the mean square of v is one, so that unit modal mass makes it 1/sqrt(rho A L)
        np.testing.assert_allclose(np.abs(found), np.abs(v) / np.sqrt(RHO * A * L), atol=1e-9 * np.abs(found).max())

    def test_inside_tapered_members_of_instances_they_join_their_nodes(self) -> None:
        model = assemble(load("tip_tilt").plan.mechanism.replaced({"corrections": ("shear", "notch")}))
        solution = dynamic_stiffness(model, 4)
        u, topology = solution.shapes, model.plan.topology
        name, placed = next((n, p) for n, p in topology.copies.items() if p.part.members and p.paths[0])
        member = next(k for k, m in placed.part.members.items() if k in model.plan.layout.prototypes[name].flexures)
        k = list(placed.part.members).index(member)
        path = placed.paths[-1]
        ends = placed.offset[-1] + placed.part.ends[k]
        assert not model.geometry.parts[name].offsets[k].any()
        found = inside_member(model, solution, ".".join((*path, member)), [0.0, 0.5 - 1e-9, 0.5, 1.0])
        size = np.abs(u).max(axis=(0, 1))
        np.testing.assert_allclose(found[[0, 3]] / size, u[ends] / size, atol=1e-9)
        np.testing.assert_allclose(found[1] / size, found[2] / size, atol=1e-6)

    def test_shapes_of_a_repeated_frequency_are_independent(self) -> None:
        model = load("rpr")
        solution = dynamic_stiffness(model, 12)
        x = np.empty((model.order, 12))
        nodes, components = np.nonzero(model.plan.topology.dof >= 0)
        x[:] = solution.shapes[nodes, components]
        gram = x.T @ (model.M @ x)
        np.testing.assert_allclose(gram, np.eye(12), atol=2e-3)

    def test_unknown_members_and_places_are_refused(self) -> None:
        model = assemble(bar())
        solution = dynamic_stiffness(model, 1)
        with pytest.raises(fx.OptionError, match="no member 'rod'"):
            inside_member(model, solution, "rod", 0.5)
        with pytest.raises(fx.OptionError, match="between 0 and 1"):
            inside_member(model, solution, "bar", [0.5, 1.1])
