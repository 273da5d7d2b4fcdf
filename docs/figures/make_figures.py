"""Draw the figures of the pages: python docs/figures/make_figures.py."""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import flexura as fx
from flexura.beam import notch

HERE = Path(__file__).parent
HEAD = """\
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 880 345" width="880" font-family="sans-serif" font-size="15">
<rect width="880" height="345" fill="white"/>
<style>polygon {fill: #8fa8c8; stroke: #22344e} text {text-anchor: middle; fill: #222}</style>"""


def contours() -> None:
    """Profiles of all contours over the length of a notch."""
    a, b, t = 5.0, 3.0, 1.0
    x = np.linspace(-a, a, 65)
    shapes = {
        "circular, R = a": notch.circular(x, a, t),
        "elliptical": notch.elliptical(x, a, b, t),
        "parabolic": notch.parabolic(x, a, b, t),
        "hyperbolic": notch.hyperbolic(x, a, b, t),
        "corner_filleted": notch.corner_filleted(x, a, 1.5, t),
        "v_shaped": notch.v_shaped(x, np.radians(35), 1.0, t),
        "table": notch.tabulated(x + a, np.array([0.0, 3, 6, 10]), np.array([5.0, 1.5, 1, 4])),
        "straight": t + 0 * x,
    }
    lines = [HEAD]
    for k, (name, h) in enumerate(shapes.items()):
        left, top = 110 + 220 * (k % 4), 100 + 170 * (k // 4)
        upper = [f"{left + 14 * u:.1f},{top - 7 * v:.1f}" for u, v in zip(x, h, strict=True)]
        lower = [f"{left + 14 * u:.1f},{top + 7 * v:.1f}" for u, v in zip(x, h, strict=True)]
        lines.append(f'<polygon points="{" ".join(upper + lower[::-1])}"/>')
        lines.append(f'<text x="{left}" y="{top - 82}">{name}</text>')
    (HERE / "contours.svg").write_text("\n".join([*lines, "</svg>"]) + "\n", encoding="utf-8")


def pivot() -> None:
    """The first mode of the tutorial's pivot."""
    page = (HERE.parent / "tutorial.md").read_text(encoding="utf-8")
    block = re.search(r"```yaml\n(# file: pivot.yaml\n.*?)```", page, re.DOTALL)
    result = fx.modes(fx.loads(block[1]), n=1)
    mode = result.modes[0]
    title = f"mode 1: {mode.frequency_hz:.4g} Hz"
    figure = fx.view.draw_mode(result.model, result.shapes[:, :, 0], title=title, subtitle=mode.motion.summary)
    figure.savefig(HERE / "pivot_mode_01.png", dpi=100)


def rpr() -> None:
    """The RPR mechanism and its first six modes, as on the front page."""
    result = fx.modes(fx.load(HERE.parents[1] / "examples" / "rpr" / "rpr.yaml"), n=6)
    with TemporaryDirectory() as folder:
        fx.view.save_modes(result, folder)
        for name in ("mechanism", "modes"):
            shutil.copy(Path(folder) / f"{name}.png", HERE / f"rpr_{name}.png")


def rpr_response() -> None:
    """All frequency responses of the platform of the RPR mechanism, damping ratios of 1 % assumed."""
    mechanism = fx.load(HERE.parents[1] / "examples" / "rpr" / "rpr.yaml")
    result = fx.frequency_response(mechanism, band=(3, 60), damping=0.01)
    fx.view.draw_response_matrix(result).savefig(HERE / "rpr_response.png", dpi=100)


def rpr_solid() -> None:
    """The second mode of the RPR mechanism as corrected beams and as a solid."""
    result = fx.verify(fx.load(HERE.parents[1] / "examples" / "rpr" / "rpr.yaml"))
    fx.view.draw_mode_pair(result, 2).savefig(HERE / "rpr_solid.png", dpi=100)


def two_claims() -> None:
    """The paper's two claims about the RPR mechanism, by the example itself."""
    script = HERE.parents[1] / "examples" / "rpr" / "two_claims.py"
    subprocess.run([sys.executable, script, HERE], check=True)


def rpr_test() -> None:
    """The virtual test of the RPR mechanism beside the measured frequencies."""
    folder = HERE.parents[1] / "examples" / "rpr"
    result = fx.virtual_test(fx.load(folder / "rpr_test.yaml"))
    fx.view.draw_virtual_test(result, fx.testing.read_frequencies(folder / "table5.csv")).savefig(
        HERE / "rpr_test.png", dpi=100
    )


def stroke_guide() -> None:
    """The guide over its stroke."""
    guide = fx.load(HERE.parents[1] / "examples" / "guide" / "guide.yaml")
    path = fx.stroke(guide, move={"carriage.x": (-0.012, 0.012)}, steps=49, n=4)
    fx.view.draw_stroke(path).savefig(HERE / "stroke_guide.png", dpi=80)
    fx.view.draw_poses(path).savefig(HERE / "poses_guide.png", dpi=100)


def poses_pivot() -> None:
    """The cross-spring pivot over its stroke."""
    pivot = fx.load(HERE.parents[1] / "examples" / "pivot" / "pivot.yaml")
    turn = np.radians(20)
    fx.view.draw_poses(fx.stroke(pivot, move={"arm.ry": (-turn, turn)}, steps=9)).savefig(
        HERE / "poses_pivot.png", dpi=100
    )


def poses_rpr() -> None:
    """The platform of the RPR mechanism over two rotations and a translation."""
    rpr = fx.load(HERE.parents[1] / "examples" / "rpr" / "rpr.yaml")
    turn = np.radians(1.5)
    move = {"platform.rx": (-turn, turn), "platform.ry": (-turn, turn), "platform.z": (-3e-4, 3e-4)}
    fx.view.draw_poses(fx.stroke(rpr, move=move, steps=9), elev=6, azim=-56).savefig(HERE / "poses_rpr.png", dpi=100)


def rpr_moving() -> None:
    """A mode of the platform with its stacks in motion."""
    result = fx.modes(fx.load(HERE.parents[1] / "examples" / "rpr" / "rpr_piezo.yaml"), n=4)
    mode = result.modes[3]
    title = f"mode 4: {mode.frequency_text}"
    moving = fx.view.animate_mode(result.model, result.shapes[:, :, 3], title=title, subtitle=mode.motion.summary)
    fx.view.save_animation(moving, HERE / "rpr_moving.webp")


def pivot_stroke() -> None:
    """The pivot of the front page over its stroke, to scale."""
    page = (HERE.parents[1] / "README.md").read_text(encoding="utf-8")
    block = re.search(r"```yaml\n(# file: pivot.yaml\n.*?)```", page, re.DOTALL)
    path = fx.stroke(fx.loads(block[1]), steps=25, n=1)
    fx.view.save_animation(fx.view.animate_stroke(path), HERE / "pivot_stroke.webp")


def closed_loop() -> None:
    """Loops and steps of the platform under control, by the example itself."""
    script = HERE.parents[1] / "examples" / "rpr" / "closed_loop.py"
    subprocess.run([sys.executable, script, HERE], check=True)


def first() -> None:
    """The steps of the first mechanism, from the files on its page."""
    page = (HERE.parent / "start" / "first.md").read_text(encoding="utf-8")
    files = dict(re.findall(r"```yaml\n# file: (\S+)\n(.*?)```", page, re.DOTALL))
    for name in ("step1", "step2"):
        model = fx.assemble(fx.loads(files[f"{name}.yaml"]))
        fx.view.draw_mechanism(model, dpi=80, elev=18, azim=-55).savefig(HERE / f"first_{name}.png")
    found = fx.stroke(fx.loads(files["guide.yaml"]), move={"stage.x": (0.0, 4e-3)}, steps=3, n=1)
    fx.view.draw_stroke(found).savefig(HERE / "first_stroke.png", dpi=80)


def studies() -> None:
    """A sweep, a sensitivity, tolerances and an optimum of the guide."""
    guide = fx.load(HERE.parents[1] / "examples" / "guide" / "guide.yaml")
    vary = {"thickness": (0.3e-3, 0.7e-3, 17), "length": (40e-3, 80e-3, 17)}
    table = fx.sweep(guide, vary=vary, ask="f1, mass", workers=1)
    fx.view.draw_sweep(table).savefig(HERE / "studies_sweep.png", dpi=80)
    influence = fx.sensitivity(guide, ask="f1, stiffness(carriage.x), mass, stress(leaf1) at x = 2 mm")
    fx.view.draw_sensitivity(influence).savefig(HERE / "studies_sensitivity.png", dpi=80)
    scattered = fx.tolerance(
        guide, vary=["thickness=± 0.02 mm", "length=normal 0.05 mm"], ask="f1", require="f1 >= 54 Hz", samples=1536
    )
    fx.view.draw_tolerance(scattered).savefig(HERE / "studies_tolerance.png", dpi=80)
    ranges = {"thickness": (0.2e-3, 0.6e-3), "length": (40e-3, 100e-3)}
    limits = ["f1 >= 40 Hz", "f2 <= 600 Hz"]
    best = fx.optimize(guide, vary=ranges, minimise="mass", subject_to=limits)
    fx.view.draw_optimum(best).savefig(HERE / "studies_optimum.png", dpi=80)


if __name__ == "__main__":
    contours()
    pivot()
    rpr()
    rpr_moving()
    pivot_stroke()
    rpr_response()
    rpr_solid()
    two_claims()
    rpr_test()
    closed_loop()
    stroke_guide()
    poses_pivot()
    poses_rpr()
    studies()
    first()
