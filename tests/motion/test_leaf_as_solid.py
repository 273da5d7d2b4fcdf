"""A leaf 100 x 30 x 0.5 mm between parallel ends, moved sideways, as a solid by CalculiX with NLGEOM.

C3D20R, finer towards both clamps: meshes of two layers, and of 30 x 10 cells with one more ring of half their size,
differ from this one by less than 1.5e-3. Skipped where `ccx` (Debian package calculix-ccx) is not installed.
What is left between solid and beams is theirs: along a leaf that is bent, sections of a solid give across.
"""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.fem.geometry import SolidMaterial
from flexura.solid.interchange.calculix import run_calculix, write_calculix
from helpers.solid_boxes import grid, mesh_of

LENGTH, THICKNESS, WIDTH, PUSH = 0.1, 0.0005, 0.03, 10.0
LEAF = """
flexura: 1
name: leaf
corrections: {corrections}
materials: {{m: {{E: 210 GPa, nu: 0.3, rho: 7800 kg/m^3}}}}
nodes: {{a: [0, 0, 0], b: [100 mm, 0, 0]}}
flexures:
  leaf:
    {{nodes: [a, b], material: m, reference: y, elements: 20, ends: [clamped, clamped], root: rigid,
     profile: {{type: leaf, width: 30 mm, thickness: 0.5 mm}}}}
ground: {{a: clamped, b: {{fixed: [rx, ry, rz]}}}}
"""


def deck(folder: Path, stroke: float) -> Path:
    """The far face moves in one piece: by `stroke` along y, then N along z, then along x; then frequencies."""
    ring = THICKNESS / 2 * 2.0 ** np.arange(4)
    x = np.concatenate([[0], ring[:-1], np.linspace(ring[-1], LENGTH - ring[-1], 21), LENGTH - ring[-2::-1], [LENGTH]])
    points, cells = grid("hexahedron20", [x, np.linspace(0, THICKNESS, 2), np.linspace(0, WIDTH, 7)])
    sets = {"x0": np.flatnonzero(points[:, 0] < 1e-9), "x1": np.flatnonzero(points[:, 0] > LENGTH - 1e-9)}
    mesh = mesh_of("hexahedron20", points, cells, sets, SolidMaterial("steel", 210e9, 0.3, 7800.0))
    path = write_calculix(mesh, folder / "leaf.inp", fixed=["x0"])
    first, *others = (mesh.point_sets["x1"] + 1).tolist()
    lines = [f"*EQUATION\n2\n{n},{k},1.,{first},{k},-1." for n in others for k in (1, 2, 3)]
    lines += ["*NSET,NSET=TIP", str(first)]
    for times, along, across in (("0.1,1.,1e-5,0.25", 0, 0), ("1.,1.", 0, PUSH), ("1.,1.", PUSH, 0), ("1.,1.", 0, 0)):
        lines += ["*STEP,NLGEOM,INC=1000", "*STATIC", times, "*BOUNDARY", f"TIP,2,2,{stroke!r}"]
        lines += ["*CLOAD", f"TIP,1,{along!r}", f"TIP,3,{across!r}", "*NODE PRINT,NSET=TIP,FREQUENCY=1000", "U"]
        lines += ["*NODE PRINT,NSET=HELD1,TOTALS=ONLY,FREQUENCY=1000", "RF", "*END STEP"]
    lines += ["*STEP,PERTURBATION", "*FREQUENCY", "5", "*END STEP", ""]
    text = path.read_text().replace("TYPE=C3D20", "TYPE=C3D20R")
    path.write_text(text[: text.index("*STEP")] + "\n".join(lines))
    return path


def solid(folder: Path, stroke: float) -> np.ndarray:
    """Drive force, N, displacement along x, m, stiffness along x and z, N/m, and five frequencies, Hz, drive held."""
    path = deck(folder, stroke)
    run_calculix(path)
    text = path.with_suffix(".dat").read_text()
    three = r"\s+(\S+E\S+)" * 3
    u = np.array(re.findall(r"displacements.*\n\n\s+\d+" + three, text), dtype=float)
    held = np.array(re.findall(r"total force.*\n\n" + three, text), dtype=float)
    rows = [line.split() for line in text[text.index("E I G E N V") :].splitlines()]
    hertz = [float(row[3]) for row in rows if len(row) == 5 and row[0].isdigit()][:5]
    return np.array([-held[0, 1], u[0, 0], PUSH / (u[2, 0] - u[0, 0]), PUSH / (u[1, 2] - u[0, 2]), *hertz])


def beams(corrections: str, stroke: float) -> np.ndarray:
    """The same."""
    (pose,) = fx.stroke(fx.loads(LEAF.format(corrections=corrections)), move={"b.y": stroke}, n=5).poses
    along, across = pose.support_stiffness[0], pose.support_stiffness[2]
    return np.array([pose.reaction["b.y"], pose.displacement["b"][0], along, across, *pose.frequency_hz_held])


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed (calculix-ccx)")
@pytest.mark.parametrize(
    ("stroke", "close"),
    [
        (1e-4, (0.002, 0.002, 0.01, 0.01, 0.01, 0.006, 0.012, 0.014, 0.016)),
        (1e-2, (0.007, 0.002, 0.03, 0.008, 0.003, 0.012, 0.003, 0.006, 0.03)),
    ],
)
def test_a_leaf_over_its_stroke_against_a_solid(tmp_path, stroke, close):
    reference = solid(tmp_path, stroke)
    apart = np.abs(beams("auto", stroke) / reference - 1)
    assert (apart < close).all(), apart
    plain = np.abs(beams("none", stroke) / reference - 1)
    assert plain[0] > 0.04 and plain[3] > 0.2, "plain beams are further off"
