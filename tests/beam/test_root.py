"""Elastic roots: against O'Donnell's half plane, plane strain by scikit-fem, and whole solids of another program.

Plane strain holds for a wide leaf in its plane of bending, but for its edges; tolerance 3 %, for the coupling with
stretch 8 %. The table's leaf is 40 times as wide as thick. Joints: blocks 8 mm long and 10 mm wide of aluminium, one
held at its far face, with a leaf between them, by curved tetrahedra of order 3, of the first two of order 4 (NGSolve);
converged to 0.5 %.
"""

import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad, condense, solve
from skfem.helpers import ddot, sym_grad, trace

import flexura as fx
from flexura.beam import COUPLED_FLEXIBILITY_BASIS, fillet_shares, root_coefficients, root_flexibility
from flexura.duals import Dual
from flexura.full_order import assemble
from flexura.structure import Design

NAMES = ("u_u", "rx_rx", "v_v", "v_rz", "rz_rz", "w_w", "w_ry", "ry_ry", "u_w", "u_ry", "v_rx", "rx_rz")


def root(E=1.0, nu=0.3, b=40.0, t=1.0, L=20.0, up=2.0, down=2.0):
    return dict(zip(NAMES, root_flexibility(E, nu, b, t, L, up, down), strict=True))


def test_a_half_plane_turns_as_odonnell_says():
    """16.67 M/(pi E' t^2) for a linear distribution of the stress over the root; the true one is stiffer."""
    for nu in (0.2, 0.3, 0.4):
        closed = 16.67 / np.pi * (1 - nu**2)
        assert 40 * root(nu=nu, up=11.5, down=11.5)["ry_ry"] == pytest.approx(closed, rel=0.1)


def grade(length, first):
    points = [0.0]
    while points[-1] < length:
        points.append(points[-1] + first)
        first *= 1.5
    return np.array(points) * length / points[-1]


def plane_strain(up, down, nu=0.3, leaf=6.0, block=None):
    """Flexibility (3, 3), in u, w and ry, of the root of a leaf in plane strain, E = t = 1, per width."""
    block = block or 1.5 * (1 + up + down)
    x = np.concatenate([-grade(block, 0.04)[::-1], grade(leaf / 2, 0.04)[1:], leaf - grade(leaf / 2, 0.04)[-2::-1]])
    half = grade(0.5, 0.04)
    z = np.concatenate([-0.5 + half, 0.5 - half[-2::-1]])
    z = np.concatenate([-0.5 - grade(down, 0.04)[:0:-1], z, 0.5 + grade(up, 0.04)[1:]])
    lame, mu = nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))

    @BilinearForm
    def stiffness(u, v, _):
        return 2 * mu * ddot(sym_grad(u), sym_grad(v)) + lame * trace(sym_grad(u)) * trace(sym_grad(v))

    def flexibility(kept, held, face, centre):
        mesh = MeshQuad.init_tensor(x, z)
        middle = mesh.p[:, mesh.t].mean(axis=1)
        mesh = mesh.restrict(np.flatnonzero(kept(middle[0], middle[1])))
        basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=5)
        K = stiffness.assemble(basis)
        at = basis.doflocs
        on = [
            (np.abs(at[0] - place) < 1e-9) & ((np.abs(at[1]) < 0.5 + 1e-9) | ~narrow) for place, narrow in (held, face)
        ]
        # at every place the freedoms of u and w follow each other
        order = np.flatnonzero(on[1])
        is_w = np.array([component_of(basis, dof) for dof in order])
        energy = np.zeros((3, 3))
        motions = []
        for kind in range(3):
            u = np.zeros(K.shape[0])
            if kind == 0:
                u[order[~is_w]] = 1.0
            elif kind == 1:
                u[order[is_w]] = 1.0
            else:  # +ry lowers w along +x and moves u with z
                u[order[~is_w]] = at[1, order[~is_w]] - centre[1]
                u[order[is_w]] = -(at[0, order[is_w]] - centre[0])
            motions.append(solve(*condense(K, x=u, D=np.flatnonzero(on[0] | on[1]))))
        for a in range(3):
            for b in range(3):
                energy[a, b] = motions[a] @ (K @ motions[b])
        return np.linalg.inv(energy)

    end, start = (leaf, True), (-block, False)
    in_leaf = lambda x, z: (x > 0) & (np.abs(z) < 0.5)  # noqa: E731
    tip, middle = (leaf, 0.0), (0.0, (up - down) / 2)
    whole = flexibility(lambda x, z: (x < 0) | in_leaf(x, z), start, end, tip)
    alone = flexibility(in_leaf, (0.0, True), end, tip)
    block_alone = flexibility(lambda x, z: x < 0, start, (0.0, False), middle)

    def arm(x, z):
        """From u, w and ry at a point to those at x, z from it."""
        return np.array([[1, 0, z], [0, 1, -x], [0, 0, 1]])

    D = arm(leaf, -middle[1])
    inverse = np.linalg.inv(arm(leaf, 0.0))
    return inverse @ (whole - alone - D @ block_alone @ D.T) @ inverse.T


def component_of(basis, dof):
    """Whether a freedom is that across."""
    if not hasattr(basis, "_is_second"):
        second = np.zeros(basis.N, dtype=bool)
        for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
            if len(dofs):
                second[dofs[1::2].ravel()] = True
        basis._is_second = second
    return bool(basis._is_second[dof])


@pytest.mark.parametrize(("up", "down"), [(2.0, 2.0), (4.0, 0.7), (9.0, 0.2)])
def test_wide_leaves_are_in_plane_strain(up, down):
    """As wide as the widest of the table, and beyond."""
    C = plane_strain(up, down)
    for b in (40.0, 120.0):
        own = {name: b * value for name, value in root(b=b, up=up, down=down).items()}
        assert own["ry_ry"] == pytest.approx(C[2, 2], rel=0.03)
        if down < 0.5:  # small beside the rotation elsewhere
            assert own["u_ry"] == pytest.approx(C[0, 2], rel=0.08)


JOINTS = {  # length, thickness and width of the leaf, thickness of the blocks, offset, Poisson's ratio: Hz
    (3, 0.5, 10, 3, 0, 0.33): (1544.2, 9048.6, 15301, 18144),
    (3, 0.5, 10, 3, 1.25, 0.33): (1464.1, 7530.6, 14970, 15191),
    (6, 0.5, 10, 3, 0.75, 0.33): (894.7, 4251.7, 9630.9, 11077),
    (10, 0.5, 10, 3, 1.25, 0.33): (534.1, 2457.8, 5270.1, 7786.3),
    (6, 0.3, 10, 6, 1.425, 0.2): (284.6, 1285.7, 2984.0, 7512.0),
    (2, 0.3, 10, 6, 2.85, 0.4): (601.7, 3617.3, 8453.8, 13468.7),
    (6, 1, 10, 6, 2.5, 0.33): (1577.9, 5101.1, 11711.3, 12406.3),
    (4, 0.5, 6, 3, 0, 0.33): (973.5, 3871.4, 8482.9, 12214.7),
    (4, 0.5, 4, 3, 1.25, 0.33): (759.2, 2287.7, 5107.6, 8665.8),
    (8, 0.8, 5, 5, 1.05, 0.25): (725.4, 2537.2, 4218.7, 7352.1),
    (5, 1, 3, 4, 0.75, 0.33): (1324.9, 3219.7, 4005.7, 13884.0),
}


@pytest.mark.parametrize("sizes", JOINTS)
def test_a_leaf_between_two_blocks_against_whole_solids(sizes):
    """With rigid joints the second mode of the first two is 16 and 29 % too high."""
    L, t, b, height, offset, nu = sizes
    text = f"""
flexura: 1
materials: {{al: {{E: 71.7 GPa, nu: {nu}, rho: 2810 kg/m^3}}}}
sections: {{block: {{shape: rectangle, width: 10 mm, thickness: {height} mm}}}}
nodes: {{o: [0, 0, 0], a: [8 mm, 0, 0], b: [{8 + L} mm, 0, 0], c: [{16 + L} mm, 0, 0]}}
links:
  fixed: {{nodes: [o, a], material: al, reference: y, elements: 4, root: rigid, section: block}}
  free: {{nodes: [b, c], material: al, reference: y, elements: 4, section: block}}
flexures:
  leaf:
    {{nodes: [a, b], material: al, reference: y, elements: 6, start_offset: [0, {offset} mm, 0],
     end_offset: [0, {offset} mm, 0], profile: {{type: leaf, width: {b} mm, thickness: {t} mm}}}}
ground: {{o: clamped}}
"""
    found = fx.modes(fx.loads(text), n=4, order="full").frequency_hz
    np.testing.assert_allclose(found, JOINTS[sizes], rtol=0.02)


def test_a_block_that_is_no_thicker_has_no_root():
    none, some = (root(up=beyond, down=beyond) for beyond in (0.0, 1.0))
    assert all(abs(none[name]) < 1e-3 * abs(some[name]) for name in ("u_u", "ry_ry", "rx_rx"))


def test_no_load_does_negative_work():
    rng = np.random.default_rng(3)
    n = 4000
    nu, b, up, down = rng.uniform(0, 0.49, n), 10 ** rng.uniform(-1, 2.3, n), *(10 ** rng.uniform(-3, 2, (2, n)) - 1e-3)
    L = 10 ** rng.uniform(-0.5, 2.5, n)
    C = root_flexibility(1.0, nu, b, 1.0, L, up, down)
    whole = (root_coefficients(C, 0.0, 0) @ COUPLED_FLEXIBILITY_BASIS).reshape(n, 6, 6)
    size = np.sqrt(np.maximum(np.einsum("nii->ni", whole), 1e-300))
    assert (np.linalg.eigvalsh(whole / size[:, :, None] / size[:, None, :]) > -1e-9).all()


def test_upside_down_couplings_change_sign():
    one, other = (root_flexibility(1.0, 0.3, 8.0, 1.0, 9.0, *p) for p in ((3.0, 0.5), (0.5, 3.0)))
    np.testing.assert_allclose(other, one * np.array([1] * 8 + [-1] * 4), rtol=1e-9, atol=1e-12)


def test_units_and_slopes():
    sizes = np.array([71e9, 0.33, 8e-3, 0.5e-3, 4e-3, 1.1e-3, 0.4e-3])
    C = root_flexibility(*sizes)
    mm = root_flexibility(sizes[0] * 1e-6, sizes[1], *(1e3 * sizes[2:]))  # N/mm^2 in units of N, mm
    scale = np.array([3, 9, 3, 6, 9, 3, 6, 9, 3, 6, 6, 9]) / 3
    np.testing.assert_allclose(mm, C * 1e6 / 1e3**scale, rtol=1e-10)
    moved = root_flexibility(*(Dual(np.array(x), row) for x, row in zip(sizes, np.eye(7), strict=True)))
    for k in range(7):
        step = 1e-6 * sizes[k] * np.eye(7)[k]
        difference = (root_flexibility(*(sizes + step)) - root_flexibility(*(sizes - step))) / (2e-6 * sizes[k])
        np.testing.assert_allclose(moved.slope[k], difference, rtol=1e-4, atol=1e-9 * np.abs(C).max() / sizes[k])


@pytest.mark.parametrize("wider", [0.0, 0.3, 5.0])
@pytest.mark.parametrize("size", ["b", "up", "nu"])
def test_roots_have_no_corners(size, wider):
    """Slopes of flexibilities over sizes, on a scale of logarithms, change by little in little steps."""
    least, most = {"b": (0.4, 70), "up": (0.02, 40), "nu": (0.15, 0.45)}[size]
    x = np.exp(np.linspace(np.log(least), np.log(most), 40_001))
    sizes = {"nu": 0.3, "b": 5.0, "L": 9.0, "up": 1.7, "down": 0.6} | {size: Dual(x, x[None])}
    nu, b, L, up, down = sizes.values()
    C = root_flexibility(1.0, nu, b, 1.0, L, up, down, wider)
    scale = np.abs(C.value).max(axis=0)
    steps = np.abs(np.diff(C.slope[0], axis=0)) / scale
    assert (steps[:, scale > 1e-9] < 0.02).all()


FILLETS = {  # fillets of a leaf of NGSolve's plane strain, E = t = 1, nu = 0.3: block up, down, radius: flexibility ry
    (2, 2, 0.25): 2.758,
    (2, 2, 0.5): 0.841,
    (2, 2, 1.0): -3.304,
    (2, 2, 2.0): -11.949,
    (5, 5, 1.0): -3.095,
    (4, 0, 0.5): 3.730,
    (4, 0, 2.0): -7.660,
    (1, 1, 1.0): -3.691,
}


@pytest.mark.parametrize("case", FILLETS)
def test_fillets_against_plane_strain(case):
    """Beyond a leaf without fillets; beside a leaf eight thicknesses long, 0.5 %."""
    up, down, r = case
    radii = min(r, up), min(r, down)
    _, thick = fillet_shares(np.array(radii, dtype=float), 1.0, 8)
    leaf = 12 * (1 - 0.3**2)
    found = 40 * root_flexibility(1.0, 0.3, 40.0, 1.0, 100.0, up, down, 0.0, radii)[7] - leaf * (1 - thick).sum()
    assert leaf * 8 + found == pytest.approx(leaf * 8 + FILLETS[case], rel=5e-3)


LEAF = """
flexura: 1
parameters: {{r: {{value: 0.4 mm}}, t: {{value: 0.5 mm}}, off: {{value: 0.3 mm}}, height: {{value: 3 mm}}}}
materials: {{al: {{E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3}}}}
sections: {{block: {{shape: rectangle, width: 10 mm, thickness: height}}}}
nodes: {{o: [0, 0, 0], a: [8 mm, 0, 0], b: [14 mm, 0, 0], c: [22 mm, 0, 0]}}
links:
  fixed: {{nodes: [o, a], material: al, reference: y, root: rigid, section: block}}
  free: {{nodes: [b, c], material: al, reference: y, section: block}}
flexures:
  leaf:
    {{nodes: [a, b], material: al, reference: y, elements: 6, start_offset: [0, off, 0], end_offset: [0, off, 0],
     {more}}}
ground: {{o: clamped}}
"""
PROFILE = "profile: {type: leaf, width: 10 mm, thickness: t}"


def test_derivatives_through_roots_and_fillets():
    plan = fx.Plan(fx.loads(LEAF.format(more=f"fillet: r, {PROFILE}")))
    names = ("r", "t", "off", "height")
    default = {"r": 0.4e-3, "t": 0.5e-3, "off": 0.3e-3, "height": 3e-3}
    own = Design.with_slopes(plan, {}, names).elements.K
    for k, name in enumerate(names):
        step = 1e-5 * default[name]
        two = (Design.of(plan, {name: default[name] + sign * step}).elements.K for sign in (1, -1))
        difference = np.subtract(*two) / (2 * step)
        np.testing.assert_allclose(own.slope[k], difference, atol=1e-6 * np.abs(difference).max())


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (f"fillet: 4 mm, {PROFILE}", "no longer than half the member, 3 mm"),
        (f"fillet: [0 mm, 0.5 mm], root: rigid, {PROFILE}", "an end with a rigid root has no fillet"),
        (f"fillet: [1 mm, 2 mm, 3 mm], {PROFILE}", "for both ends or as a pair"),
        ("fillet: 0.5 mm, profile: {type: round, contour: {shape: circular, radius: 3 mm, web: 1 mm}}", "leaves"),
        (f"fillet: -0.5 mm, {PROFILE}", "must be non-negative"),
    ],
)
def test_fillets_that_make_no_sense_are_told(more, said):
    with pytest.raises(fx.ModelError, match=said) as told:
        fx.loads(LEAF.format(more=more))
    assert "flexures.leaf.fillet" in str(told.value) and "(found " in str(told.value)


def test_a_tube_has_no_fillet():
    tube = "section: {shape: tube, outer_diameter: 4 mm, inner_diameter: 3 mm}"
    text = LEAF.format(more=PROFILE).replace(
        "root: rigid, section: block}\n  free", f"fillet: 0.5 mm, {tube}}}\n  free"
    )
    with pytest.raises(fx.ModelError) as told:
        fx.loads(text)
    for said in ("links.fixed.fillet", "leaves and rectangles", "found 0.5 mm", "hint: leave it out"):
        assert said in str(told.value)


IN_LINE = """
flexura: 1
materials: {{al: {{E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3}}}}
sections: {{arm: {{shape: rectangle, width: 10 mm, thickness: 4 mm}}}}
nodes: {{o: [0, 0, 0], a: [8 mm, 0, 0], b: [11.6 mm, 0, 0]}}
links: {{fixed: {{nodes: [o, a], material: al, reference: y, root: rigid, section: arm}}}}
flexures: {{own: {{nodes: [a, b], material: al, reference: y, {profile}}}}}
bodies:
  block: {{centre: [19.6 mm, 0, 0], carries: [b], solid: {{shape: box, size: [16 mm, 20 mm, 20 mm], material: al}}}}
ground: {{o: clamped}}
"""
NOTCH = "profile: {type: notch, width: 10 mm, contour: {shape: circular, radius: 1.8 mm, web: 0.4 mm}}"
AS_THICK = "profile: {type: leaf, width: 10 mm, thickness: 4 mm}"


def roots_of(text):
    """Members with an elastic root, at which end, and its flexibility."""
    full = assemble(fx.Plan(fx.loads(text)).at_rest())
    roots = full.plan.roots
    found = roots.of(full.values, full.geometry)
    names = [key for part in full.plan.parts.values() for key in part.members]
    own = [(names[m], end) for m, end in zip(roots.members.tolist(), roots.ends.tolist(), strict=True)]
    return dict(zip(own, found[2], strict=True)) if found else {}


@pytest.mark.parametrize("profile", [NOTCH, AS_THICK])
def test_members_as_thick_as_what_they_run_into_have_no_root_there(profile):
    """A notch of 4 mm at its ends in an arm of 4 mm, and two members in line: what is left is the root in the body."""
    assert set(roots_of(IN_LINE.format(profile=profile))) == {("own", 1)}


def test_a_notch_in_a_body_has_the_root_of_its_end_section():
    """The flanks are its own: a web of 0.4 mm or of 1.7 mm, or a leaf as thick as the end, leave the same root."""
    thicker = NOTCH.replace("radius: 1.8 mm, web: 0.4 mm", "radius: 2 mm, web: 1.7435596 mm")
    notch, other, leaf = (roots_of(IN_LINE.format(profile=own))["own", 1] for own in (NOTCH, thicker, AS_THICK))
    np.testing.assert_allclose(notch, leaf, rtol=1e-6, atol=1e-6 * np.abs(leaf).max())
    np.testing.assert_allclose(other, leaf, rtol=1e-6, atol=1e-6 * np.abs(leaf).max())
    web = roots_of(IN_LINE.format(profile=AS_THICK.replace("thickness: 4 mm", "thickness: 0.4 mm")))["own", 1]
    assert web[7] > 10 * notch[7]
