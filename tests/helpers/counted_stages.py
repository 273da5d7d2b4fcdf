"""Stages on leaves, wires and folded leaves, whose freedoms are counted by hand."""

import numpy as np

import flexura as fx

E, G = 200e9, 77e9
L, B, T = 60e-3, 10e-3, 0.3e-3


def stage(ends, *, wires=False, bodies=None, ground=("g*",), scale=1.0, Q=None, shift=(0, 0, 0), E=E, **more):
    """A body on leaves or wires, by name ((from, to), reference), the nodes of which are `ends` of them; `bodies` are
    the nodes that each carries."""
    Q = np.eye(3) if Q is None else Q
    nodes, flexures = {}, {}
    for name, (a, b, reference) in ends.items():
        for node, x in (a, b):
            nodes[node] = tuple(float(c) for c in scale * (Q @ np.array(x, dtype=float)) + shift)
        web = fx.describe.RoundNotch(contour=fx.describe.StraightContour(web=scale * 0.5e-3))
        own = web if wires else fx.describe.Leaf(width=scale * B, thickness=scale * T)
        side = None if wires else tuple(Q @ reference)
        flexures[name] = fx.describe.Flexure(nodes=(a[0], b[0]), material="m", profile=own, reference=side)
    return fx.Mechanism(
        corrections="none",
        materials={"m": fx.describe.Material(E=E, G=E * G / 200e9, rho=7800.0)},
        nodes=nodes,
        flexures=flexures,
        bodies={
            name: fx.describe.RigidBody(
                centre=tuple(scale * (Q @ (0, 0, 0.03)) + shift), mass=1.0, inertia=(1.0,) * 3, carries=carried
            )
            for name, carried in (bodies or {"stage": ("e*",)}).items()
        },
        ground=dict.fromkeys(ground, "clamped"),
        **more,
    )


def guide(count=2, **how):
    """Parallel leaves 25 mm apart that let the stage go along x."""
    at = [0.025 * k for k in range(count)]
    return stage({f"leaf{k}": ((f"g{k}", (x, 0, 0)), (f"e{k}", (x, 0, L)), (1, 0, 0)) for k, x in enumerate(at)}, **how)


def crossed(**how):
    """Two leaves that cross, one beside the other."""
    h = L / 2
    return stage(
        {
            "left": (("g0", (-h, 0, 0)), ("e0", (h, 0, L)), (1, 0, -1)),
            "right": (("g1", (h, 2 * B, 0)), ("e1", (-h, 2 * B, L)), (1, 0, 1)),
        },
        **how,
    )


def hexapod(count=6, **how):
    """Three bipods of wires, or as many of their wires and one more through the middle."""
    foot, head = np.arange(6) // 2 * 2 * np.pi / 3, (np.arange(6) + 1) // 2 * 2 * np.pi / 3
    ends = {
        f"wire{k}": (
            (f"g{k}", (0.05 * np.cos(foot[k]), 0.05 * np.sin(foot[k]), 0)),
            (f"e{k}", (0.04 * np.cos(head[k] - np.pi / 3), 0.04 * np.sin(head[k] - np.pi / 3), 0.05)),
            None,
        )
        for k in range(min(count, 6))
    }
    if count > 6:
        ends["middle"] = (("g6", (0, 0, 0)), ("e6", (0, 0, 0.05)), None)
    return stage(ends, wires=True, **how)


def folded(count=5, **how):
    """A stage on folded leaves, each of which holds it along its fold alone, as wires would."""
    x, y, z = np.eye(3)
    folds = [(x, y), (x, -y), (y, x), (z, x + y), (z, y - x), (z, -y)]  # directions of the fold, and from the stage
    ends = {}
    for k, (along, out) in enumerate(folds[:count]):
        corner, normal = 0.04 * out, np.cross(along, out) / np.linalg.norm(out)
        ends[f"out{k}"] = ((f"e{k}", 0.5 * corner), (f"f{k}", corner), normal)
        ends[f"across{k}"] = ((f"f{k}", corner), (f"g{k}", corner + 0.03 * normal), out)
    return stage(ends, **how)


def on_a_complex(pitch, **how):
    """Five wires on lines that do no work on a screw about z: r d_t = -pitch d_z of a line at radius r, along d."""
    ends = {}
    for k, (r, outward) in enumerate(zip((0.02, 0.025, 0.03, 0.02, 0.035), (0, 0.1, -0.08, 0.16, 0), strict=True)):
        e = np.array([np.cos(1.2 * k), np.sin(1.2 * k), 0])
        along = outward * e - pitch / r * np.cross((0, 0, 1), e) + (0, 0, 1)
        ends[f"wire{k}"] = ((f"g{k}", r * e), (f"e{k}", r * e + L * along), None)
    return stage(ends, wires=True, **how)
