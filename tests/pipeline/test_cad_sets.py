"""A STEP file through a run: each named set is its CAD face."""

import pytest

from tests.fixtures import cad_parts
from tests.fixtures.runs import run


@pytest.mark.slow
def test_the_sets_of_a_bracket_have_the_areas_of_its_faces(tmp_path):
    """Two holes, whose walls are polygons, and a fillet; x_min and z_min are one leg each."""
    path = cad_parts.write("bracket", tmp_path)
    order = "order=[meshing]"
    report = run(f"mesh={path}", f"output_dir={tmp_path / 'run'}", order, "meshing.features=exact")
    sets = report["hex"]["sets"]
    faces = {name: own for name, own in sets.items() if "model_area" in own}
    assert len(faces) == 11
    area = {name: own["area"] for name, own in faces.items()}
    assert area == pytest.approx({n: own["model_area"] for n, own in faces.items()}, rel=0.02)
    assert sets["x_min"]["area"] == pytest.approx(60 * 40, rel=1e-3)
    assert sets["x_min"]["normal"] == pytest.approx([-1, 0, 0], abs=1e-2)
    assert sets["z_min"]["normal"] == pytest.approx([0, 0, -1], abs=1e-2)
    assert [name for name in sets if name.startswith("hole")] == ["hole_1", "hole_2"]
    assert report["hex"]["features"]["lost"] == []
