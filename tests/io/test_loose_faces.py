"""CAD files of loose faces, with small fillets, and with surfaces that gmsh cannot divide."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.io.surfaces import read_surface
from polycube.surface.measures import genus, volume
from tests.conftest import first_quick

HEAD = """
import sys, gmsh
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
{body}
gmsh.write(sys.argv[1])
gmsh.finalize()
"""
LOOSE = """
up = 100 + {gap}
square = [(0, 0), (100, 0), (100, 100), (0, 100)]
faces = [[(x, y, z) for x, y in square] for z in (0, up)]
faces += [[(x, y, 0), (u, v, 0), (u, v, 100), (x, y, 100)]
          for (x, y), (u, v) in zip(square, square[1:] + square[:1])]
for face in faces:
    points = [occ.addPoint(*place) for place in face]
    sides = [occ.addLine(p, q) for p, q in zip(points, points[1:] + points[:1])]
    occ.addPlaneSurface([occ.addCurveLoop(sides)])
occ.synchronize()
"""
FILLETED = """
rod = occ.addCylinder(0, 0, 0, 0, 0, 20, 10)
occ.fillet([rod], [1, 3], [{radius}])
occ.synchronize()
"""
pytest.importorskip("gmsh", exc_type=ImportError)


def written(path: Path, body: str) -> Path:
    subprocess.run([sys.executable, "-c", HEAD.format(body=body), str(path)], check=True)
    return path


@pytest.mark.parametrize("gap", first_quick(1, [0.0004, 0.004, 0.015]))
def test_small_gaps_are_sewn_and_reported(gap, tmp_path):
    surface, notes = read_surface(written(tmp_path / "part.igs", LOOSE.format(gap=gap)))
    assert volume(surface) == pytest.approx(1e6, rel=2e-4) and genus(surface) == 0
    assert len(set(surface.region.tolist())) == 6
    assert notes[0].startswith(f"faces were sewn to a solid over gaps of up to {gap:g} mm")
    assert float(re.findall(r"([\d.]+)\) mm", notes[0])[0]) == pytest.approx(100, abs=0.1)


def test_faces_that_meet_are_sewn_without_a_note(tmp_path):
    surface, notes = read_surface(written(tmp_path / "part.igs", LOOSE.format(gap=0)))
    assert volume(surface) == pytest.approx(1e6, rel=1e-6) and notes == []


@pytest.mark.slow
def test_a_larger_gap_is_named_with_its_place(tmp_path):
    path = written(tmp_path / "part.igs", LOOSE.format(gap=0.5))
    with pytest.raises(
        InputError, match=r"no solid; there are gaps of up to 0\.5 mm .*, 100(\.5)?\) mm"
    ):
        read_surface(path)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [0.5, 0.1])
def test_small_fillets_take_few_triangles(radius, tmp_path):
    surface, notes = read_surface(written(tmp_path / "part.step", FILLETED.format(radius=radius)))
    corner = (1 - np.pi / 4) * radius**2  # its centroid is 0.2234 radii from the sides
    exact = np.pi * 100 * 20 - 2 * corner * 2 * np.pi * (10 - 0.2234 * radius)
    assert notes == [] and len(surface.faces) < 12_000
    assert volume(surface) == pytest.approx(exact, rel=3e-3)


MANY = """
from polycube.io.tessellation.sewing import bounded_segments
rods = [occ.addCylinder(5 * k, 0, 0, 0, 0, {length}, 1) for k in range(2)]
occ.synchronize()
sides = [face for _, face in gmsh.model.getEntities(2)]
print("segments", bounded_segments(gmsh, sides, {segments}, 1.0))
"""


@pytest.mark.parametrize(
    ("length", "segments", "wanted"),
    # the two cylinders have 4 / sqrt(3) area / side^2 triangles: 4.594 length segments^2 / 6.2832
    [(10, 48, 48), (10, 140, 140), (10, 160, 143), (10, 4000, 2000)],
)
def test_many_round_faces_have_fewer_segments(length, segments, wanted, tmp_path):
    code = HEAD.format(body=MANY.format(length=length, segments=segments))
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path / "a.step")], stdout=-1)
    assert f"segments {wanted}\n".encode() in done.stdout


@pytest.mark.slow
def test_a_blade_is_read_with_larger_triangles(testdata):
    surface, [note] = read_surface(testdata / "trial3" / "blade.step")
    assert "no closed surface with cad.segments=48; triangles on curved faces are larger" in note
    assert volume(surface) == pytest.approx(30825.2, rel=0.01)


@pytest.mark.parametrize(("name", "most"), [("cases3/filleted.step", 10_000)])
def test_fillets_of_the_collection(name, most, testdata):
    assert len(read_surface(testdata / name)[0].faces) < most
