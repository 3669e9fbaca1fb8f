"""A spline refined somewhere, taken up from an earlier run and solved at rest, as a user does."""

import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.io.vtk import write_hex_vtu
from tests.fixtures.hexmeshes import hex_box, pillowed_cube
from tests.fixtures.runs import run

IDLE = ["improve.order=[]", "order=[meshing,spline,analysis]"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("space", "mesh", "error"),
    [
        ("h2s", pillowed_cube(2), 1e-3),  # levels move the solid
        ("optimal", hex_box((3, 3, 3)), 1e-6),
    ],
    ids=["h2s", "optimal"],
)
def test_a_block_pulled_with_finer_elements_at_a_corner(space, mesh, error, tmp_path):
    """Poisson's ratio 0: the stress is E e everywhere, across levels and extraordinary edges."""
    mesh = hex_mesh(10 * mesh.vertices, mesh.hexes)
    path = write_hex_vtu(tmp_path / "bar.vtu", mesh)
    plain = run(f"hex={path}", f"output_dir={tmp_path / 'plain'}", *IDLE[:1], "order=[meshing]")
    report = run(
        f"resume={tmp_path / 'plain'}",
        "from=spline",
        f"output_dir={tmp_path / 'levels'}",
        *IDLE,
        f"spline={space}",
        "spline.refine.boxes=[{box:[0,0,0,6,6,3],level:1}]",
        "analysis=static",
        "analysis.gravity=[0,0,0]",
        "analysis.fixed=[z_min,{at:z_max,components:[z],value:0.01}]",
        "analysis.material={young:2e11,poisson:0,density:7800}",
    )
    assert report["hex"] == plain["hex"]
    assert report["spline"]["elements"] > report["hex"]["hexes"] and report["spline"]["is_positive"]
    static = report["static"]
    assert static["max_von_mises"] == pytest.approx(2e11 * 1e-3, rel=2 * error)
    assert static["max_displacement"] == pytest.approx(0.01, rel=error)
    assert static["mass"] == pytest.approx(7800 * 1e-6, rel=error)
    assert static["strain_energy"] == pytest.approx(2e11 * 1e-6 / 2 * 1e-6, rel=error)
