"""Which corrections members get, how their ends are held, and that every form of an element has the same ones."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flexura as fx
from flexura.beam import element_mass, element_stiffness, rectangle
from flexura.linalg import lowest
from flexura.structure.assembly import block_diagonal
from flexura.structure.segments import segments

LEAF = fx.describe.Leaf(width=10e-3, thickness=0.5e-3)
ARC = fx.describe.CircularContour(radius=5e-3, web=0.4e-3)


def flexure(a="a", b="b", profile=LEAF, **more):
    return fx.describe.Flexure(nodes=(a, b), material="Al-7075-T6", reference="z", profile=profile, **more)


WITHOUT_ROOT = ("plate", "warping", "shear", "notch")
"""Corrections under which ends are held by what is bulkier (theory eq. F20); roots have them flat, and give instead."""


def chain(flexures, ground=("a",), **more):
    """Describe nodes a, b, c, d 10 mm apart along x, and e across b."""
    nodes = {name: (10e-3 * k, 0, 0) for k, name in enumerate("abcd")} | {"e": (10e-3, 10e-3, 0)}
    ends = {end for member in [*flexures.values(), *more.get("links", {}).values()] for end in member.nodes}
    used = {name: at for name, at in nodes.items() if name in ends}
    return fx.Mechanism(nodes=used, flexures=flexures, ground=dict.fromkeys(ground, "clamped"), **more)


def ends(mechanism):
    """Return how the ends of every member are held, to a percent: c, f or p for partly."""
    plan = fx.Plan(mechanism)
    part = plan.parts[""]
    clamped = part.table.corrections.clamped.round(2)
    return {
        name: "".join({0.0: "f", 1.0: "c"}.get(float(end), "p") for end in pair)
        for name, pair in zip(part.members, clamped, strict=True)
    }


def test_end_at_a_support_is_clamped_and_one_in_the_air_is_free():
    assert ends(chain({"leaf": flexure()})) == {"leaf": "cf"}


def test_one_leaf_described_as_two_goes_on():
    assert ends(chain({"one": flexure(), "two": flexure("b", "c")}, ground=("a", "c"))) == {"one": "cf", "two": "fc"}


def test_one_leaf_described_as_two_is_as_stiff():
    whole = chain({"leaf": flexure("a", "c", elements=8)}, ground=("a",), bodies={"tip": tip("c")})
    halves = {"one": flexure(elements=4), "two": flexure("b", "c", elements=4)}
    parts = chain(halves, ground=("a",), bodies={"tip": tip("c")})
    one, two = (fx.modes(m, n=4, order="full").frequency_hz for m in (whole, parts))
    assert_allclose(two, one, rtol=1e-7)
    plain = fx.modes(whole.model_copy(update={"corrections": "none"}), n=4, order="full").frequency_hz
    assert (np.abs(one / plain - 1) > 1e-3).any()


def tip(*carries):
    return fx.describe.RigidBody(centre=(25e-3, 0, 0), mass=0.01, inertia=(1e-6, 2e-6, 3e-6), carries=carries)


def held(mechanism):
    """Return how far the end of the member `leaf` is clamped that meets others."""
    part = fx.Plan(mechanism).parts[""]
    return float(part.table.corrections.clamped[list(part.members).index("leaf"), 1])


def bulk(thickness):
    """Return the torsion constant of a leaf 10 mm wide over that of LEAF."""
    one, other = (rectangle(10e-3, t, 0.33).J for t in (thickness, LEAF.thickness))
    return float(one / other)


@pytest.mark.parametrize("thickness", [0.1e-3, 0.4e-3, 0.5e-3, 0.6e-3, 3e-3])
def test_bulkier_members_in_line_hold_the_end(thickness):
    """As bars that warp alike at the joint, their bimoments in balance: (r - 1)/(r + 1)."""
    other = flexure("b", "c", fx.describe.Leaf(width=10e-3, thickness=thickness))
    r = bulk(thickness)
    assert_allclose(
        held(chain({"leaf": flexure(), "other": other}, corrections=WITHOUT_ROOT)),
        max(0.0, (r - 1) / (r + 1)),
        rtol=1e-12,
    )


@pytest.mark.parametrize("thickness", [0.1e-3, 0.2e-3, 0.5e-3, 3e-3])
def test_members_across_hold_the_end_unless_slim(thickness):
    across = flexure("b", "e", fx.describe.Leaf(width=10e-3, thickness=thickness))
    r = bulk(thickness)
    assert_allclose(
        held(chain({"leaf": flexure(), "across": across}, corrections=WITHOUT_ROOT)),
        min(1.0, 2 * r / (1 + r)),
        rtol=1e-12,
    )


def test_arms_hold_the_end_by_their_length():
    for arm, expected in ((0.0, 0.0), (1e-12, 0.0), (0.1e-3, 0.4), (0.25e-3, 1.0), (5e-3, 1.0)):
        on_arm = flexure(end_offset=(0, 0, arm))
        assert_allclose(held(chain({"leaf": on_arm})), expected, atol=1e-8)


def test_an_end_held_partly_is_said():
    other = flexure("b", "c", fx.describe.Leaf(width=10e-3, thickness=0.8e-3))
    assert fx.check(chain({"leaf": flexure(), "other": other}, corrections=WITHOUT_ROOT)).ends["leaf"] == (
        "clamped",
        "60 % clamped",
    )


def twist(width, thickness, length, **more):
    """Return the torsional stiffness of a leaf between rigid faces over G Ip/L."""
    own = {
        "profile": fx.describe.Leaf(width=width, thickness=thickness),
        "ends": ("clamped", "clamped"),
        "root": "rigid",
        **more,
    }
    m = fx.Mechanism(
        nodes={"a": (0, 0, 0), "b": (length, 0, 0)}, flexures={"leaf": flexure(**own)}, ground={"a": "clamped"}
    )
    metal = m.material("Al-7075-T6")
    m = fx.with_solid_parts(m, size=0.5)
    GIp = metal.E / 2 / (1 + metal.nu) * width * thickness * (width**2 + thickness**2) / 12
    return length / GIp / fx.compliance(m, nodes=["b"])[3, 3]


@pytest.mark.parametrize(("width", "length"), [(1, 0.4), (3, 1), (8, 1), (8, 2)])
def test_stubby_leaves_twist_as_solids_do(width, length):
    """Solids have rigid end faces as well; these meshes are some 1 % too stiff."""
    beam, solid = (twist(width * 1e-3, 1e-3, length * 1e-3, **more) for more in ({}, {"fidelity": "solid"}))
    assert abs(beam / solid - 1) < 0.05
    assert beam < 1


def test_nothing_twists_less_than_its_faces_let_it():
    """G Ip/L is an upper bound and, for members that are short, the stiffness."""
    lengths = np.geomspace(1e-2, 20, 12) * 1e-3
    for width in (1e-3, 2e-3, 5e-3, 20e-3):
        share = [twist(width, 1e-3, float(length)) for length in lengths]
        assert (np.diff(share) < 0).all()
        assert 0.995 < share[0] < 1


def test_bodies_arms_interfaces_and_joints_hold_the_end():
    assert ends(chain({"leaf": flexure()}, bodies={"tip": tip("b")})) == {"leaf": "cc"}
    on_arm = flexure(end_offset=(0, 0, 1e-3))
    assert ends(chain({"leaf": on_arm, "more": flexure("b", "c")}))["leaf"] == "cc"
    assert ends(chain({"leaf": flexure()}, interface=("b",))) == {"leaf": "cc"}
    inner = fx.describe.Substructure(
        nodes={"n": (0, 0, 0), "m": (1e-2, 0, 0)}, flexures={"f": flexure("n", "m")}, interface=("n",)
    )
    joined = chain(
        {"leaf": flexure()},
        substructures={"inner": inner},
        instances={"i": fx.describe.Instance(of="inner", at=(1e-2, 0, 0))},
        joints=(("b", "i.n"),),
    )
    assert ends(joined) == {"leaf": "cc"}
    assert fx.Plan(joined).parts["inner"].table.corrections.clamped.tolist() == [[True, False]]


def test_notches_hold_their_own_web():
    assert ends(
        chain({"notch": flexure(profile=fx.describe.Notch(width=10e-3, contour=ARC)), "more": flexure("b", "c")})
    ) == {
        "notch": "cc",
        "more": "cf",
    }


def test_members_may_say_how_their_ends_are_held():
    assert ends(chain({"leaf": flexure(ends=("free", "clamped"))})) == {"leaf": "fc"}


def active(mechanism):
    """Return the corrections of the first member."""
    return fx.check(mechanism).corrections


@pytest.mark.parametrize("theory", ["rayleigh", "timoshenko", "euler_bernoulli"])
def test_auto_is_what_a_member_can_have(theory):
    shear = () if theory == "euler_bernoulli" else ("shear",)
    notch = fx.describe.Notch(width=10e-3, contour=ARC)
    bar = {"material": "Al-7075-T6", "elements": 1}
    square = fx.describe.Link(
        nodes=("c", "d"), reference="z", section=fx.describe.Rectangle(width=2e-3, thickness=2e-3), **bar
    )
    rod = fx.describe.Link(nodes=("c", "e"), section=fx.describe.Circle(diameter=1e-3), **bar)
    ground = ("a", "d", "e")
    flexures = {"leaf": flexure(), "notch": flexure("b", "c", notch)}
    m = chain(flexures, ground, links={"square": square, "rod": rod}, theory=theory)
    expected = {
        "leaf": ("plate", "warping", *shear, "root"),
        "notch": ("plate", "warping", *shear, "notch"),
        "square": ("plate", "warping", *shear, "root"),
        "rod": (*shear, "root"),
    }
    assert active(m) == expected


def test_auto_takes_stubby_members_in_and_names_choose():
    block = fx.describe.Leaf(width=10e-3, thickness=6e-3)
    assert active(chain({"leaf": flexure(profile=block)})) == {"leaf": ("plate", "warping", "shear", "root")}
    assert active(chain({"leaf": flexure(profile=block, corrections="plate")})) == {"leaf": ("plate",)}


def test_names_of_the_mechanism_go_to_the_members_they_suit():
    notch = flexure("b", "c", fx.describe.RoundNotch(contour=ARC))
    m = chain(
        {"leaf": flexure(), "notch": notch, "plain": flexure("c", "d", corrections="none")},
        corrections=("plate", "notch"),
    )
    assert active(m) == {"leaf": ("plate",), "notch": ("notch",)}


@pytest.mark.parametrize(
    ("profile", "theory", "name", "text"),
    [
        (fx.describe.RoundNotch(contour=ARC), None, "plate", "only a strip"),
        (fx.describe.TwoAxisNotch(y_contour=ARC, z_contour=ARC), None, "warping", "rectangle"),
        (LEAF, None, "notch", "contour"),
        (LEAF, "euler_bernoulli", "shear", "timoshenko"),
    ],
)
def test_corrections_without_meaning_are_errors(profile, theory, name, text):
    with pytest.raises(fx.ModelError, match=text) as raised:
        fx.Plan(chain({"leaf": flexure(profile=profile, theory=theory, corrections=(name,))}))
    assert raised.value.problems[0].path == ("flexures", "leaf", "corrections")
    assert "possible here" in raised.value.problems[0].hint


def all_kinds(**more):
    """Describe a leaf, a stepped and a tapered notch, a two-axis and a round one, one behind the other."""
    two = fx.describe.TwoAxisNotch(y_contour=ARC, z_contour=ARC, shift=1e-3)
    profiles = [LEAF, fx.describe.Notch(width=10e-3, contour=ARC), two, fx.describe.RoundNotch(contour=ARC)]
    nodes = {f"n{k}": (8e-3 * k, 0, 0) for k in range(6)}
    flexures = {f"f{k}": flexure(f"n{k}", f"n{k + 1}", profile, elements=4) for k, profile in enumerate(profiles)}
    flexures["f4"] = flexure("n4", "n5", profiles[1], elements=4, integration="tapered")
    body = fx.describe.RigidBody(centre=(42e-3, 1e-3, 2e-3), mass=0.02, inertia=(1e-6, 2e-6, 3e-6), carries=("n5",))
    return fx.Mechanism(nodes=nodes, flexures=flexures, bodies={"tip": body}, ground={"n0": "clamped"}, **more)


def test_mass_is_that_of_the_sections():
    without_root = ("plate", "warping", "notch")
    plain, own = (fx.assemble(all_kinds(corrections=c, theory="euler_bernoulli")) for c in ("none", without_root))
    uniform = slice(0, 4 * 6)  # the leaf's elements: the mass of tapered ones follows their deflection
    assert_allclose(own.M[uniform, uniform].toarray(), plain.M[uniform, uniform].toarray(), rtol=1e-12, atol=1e-18)
    rigid = own.rigid_body_motions()
    assert_allclose(rigid.T @ own.M @ rigid, rigid.T @ plain.M @ rigid, rtol=1e-10, atol=1e-12)
    assert abs(own.K - plain.K).max() > 0.01 * abs(plain.K).max()


@pytest.mark.parametrize(("pieces", "tapered", "tolerance"), [(1, 1, 0.05), (2, 30, 2e-4)])
def test_segments_are_the_corrected_elements(pieces, tapered, tolerance):
    model = fx.assemble(all_kinds())
    cut = segments(model, pieces, tapered)
    beam, T = cut.beam.take(cut.kind), block_diagonal(cut.X)
    K, M = (cut.scatter().sparse([np.swapaxes(T, 1, 2) @ f(beam) @ T]) for f in (element_stiffness, element_mass))
    own = lowest(model.K, model.M, 4).values
    assert_allclose(lowest(K + cut.K, M + cut.M, 4).values, own, rtol=2 * tolerance)
    plain = fx.assemble(all_kinds(corrections="none"))
    assert (np.abs(lowest(plain.K, plain.M, 4).values / own - 1) > 0.02).all()


def test_design_axis():
    """Sizes, lengths and Poisson's ratio as arrays give what single designs give."""
    t, L = fx.describe.parameter("t"), fx.describe.parameter("L")
    arc = fx.describe.CircularContour(radius=L / 2, web=t)
    m = fx.Mechanism(
        parameters={
            "t": fx.describe.Parameter(value=0.4e-3),
            "L": fx.describe.Parameter(value=8e-3),
            "nu": fx.describe.Parameter(value=0.3),
        },
        materials={"own": fx.describe.Material(E=70e9, nu=fx.describe.parameter("nu"), rho=2700.0)},
        nodes={"a": (0, 0, 0), "b": (L, 0, 0), "c": (2 * L, 0, 0)},
        flexures={
            "notch": flexure("a", "b", fx.describe.Notch(width=8e-3, contour=arc)).model_copy(
                update={"material": "own"}
            ),
            "leaf": flexure("b", "c", fx.describe.Leaf(width=6e-3, thickness=t)).model_copy(update={"material": "own"}),
        },
        bodies={
            "tip": fx.describe.RigidBody(centre=(2 * L, 0, 0), mass=0.02, inertia=(1e-6, 2e-6, 3e-6), carries=("c",))
        },
        ground={"a": "clamped"},
    )
    plan = fx.Plan(m)
    sweep = {
        "t": np.array([0.3, 0.4, 0.5, 0.4]) * 1e-3,
        "L": np.array([8.0, 8.0, 9.0, 8.0]) * 1e-3,
        "nu": np.array([0.3, 0.2, 0.0, 0.45]),
    }
    together = fx.unproven_frequencies(plan, sweep, n=4)
    for k, row in enumerate(together):
        single = {name: float(values[k]) for name, values in sweep.items()}
        assert_allclose(fx.unproven_frequencies(plan, single, n=4), row, rtol=1e-7)
    fixed = fx.unproven_frequencies(plan, {"t": sweep["t"]}, n=4)
    for k, size in enumerate(sweep["t"]):
        assert_allclose(fx.unproven_frequencies(plan, {"t": float(size)}, n=4), fixed[k], rtol=1e-7)


def test_long_narrow_members_are_plain_beams():
    ratios = []
    for length in (0.02, 0.2, 2.0):
        leaf = flexure(profile=fx.describe.Leaf(width=5e-3, thickness=0.5e-3), elements=3)
        m = fx.Mechanism(
            nodes={"a": (0, 0, 0), "b": (length, 0, 0)},
            flexures={"leaf": leaf},
            bodies={
                "tip": fx.describe.RigidBody(
                    centre=(length, 0, 0), mass=0.1, inertia=(1e-5, 1e-5, 1e-5), carries=("b",)
                )
            },
            ground={"a": "clamped"},
        )
        auto, none = (
            fx.modes(m.model_copy(update={"corrections": c}), n=4, order="full").frequency_hz for c in ("auto", "none")
        )
        ratios.append(np.abs(auto / none - 1).max())
    assert ratios[0] > 5 * ratios[1] > 25 * ratios[2]
    assert ratios[2] < 2e-3


def test_without_lateral_contraction_a_leaf_bends_as_a_beam():
    cork = {"materials": {"cork": fx.describe.Material(E=70e9, nu=0.0, rho=2700.0)}}
    leaf = flexure().model_copy(update={"material": "cork"})
    plate, none = (fx.assemble(chain({"leaf": leaf}, corrections=c, **cork)).K for c in (("plate",), "none"))
    assert abs(plate - none).max() <= 1e-14 * abs(none).max()


@pytest.mark.parametrize(
    "profile",
    [
        LEAF,
        fx.describe.Leaf(width=40e-3, thickness=0.5e-3),
        fx.describe.Notch(width=8e-3, contour=fx.describe.CircularContour(radius=5e-3, web=2e-3)),
        fx.describe.Notch(width=8e-3, contour=fx.describe.CircularContour(radius=5e-3, web=6e-3)),
    ],
)
def test_check_tells_what_is_corrected_and_how_far_off_it_may_be(profile):
    """Short, wide and steep members are no mistakes: assumptions say by how much beams, roots and ground are off."""
    described = chain({"member": flexure(profile=profile)}, bodies={"tip": tip("b")})
    report, plain = (fx.check(described.model_copy(update={"corrections": c})) for c in ("auto", "none"))
    is_leaf = isinstance(profile, fx.describe.Leaf)
    own = ("plate", "warping", "shear", *(() if is_leaf else ("notch",)), "root")
    assert report.corrections == {"member": own} and plain.corrections == {}
    assert report.ends["member"][0] == "clamped"
    for kind, corrected, uncorrected in (
        ("beam", "taken as a corrected beam", "taken as a plain beam"),
        ("root", "taken as a large one", "without the correction for roots"),
        ("ground", "not drawn", "not drawn"),
    ):
        for said, words in ((report, corrected), (plain, uncorrected)):
            texts = [d.text for d in said.warnings if d.kind == kind]
            assert texts and all(words in text for text in texts)
    assert {d.kind for d in (*report.warnings, *plain.warnings)} <= {"beam", "elements", "root", "ground"}
