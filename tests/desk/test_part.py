"""The faces that the desk shows."""

import pytest

from tests.fixtures import assemblies

pytest.importorskip("nicegui")

from polycube.desk.part import faces_of
from polycube.surface.measures import volume


@pytest.mark.slow
def test_the_faces_of_an_assembly_have_the_names_of_their_solids(tmp_path) -> None:
    path = assemblies.named(assemblies.write("bars", tmp_path), "first", "second")
    faces, surfaces = faces_of(path, tmp_path)
    names = {f"{solid}_cad_face_{k}" for solid in ("first", "second") for k in range(1, 7)}
    assert set(faces) == names and len({*faces.values()}) == 12
    assert [volume(surface) for surface in surfaces] == pytest.approx([4000, 6000])
    assert all(file.stat().st_size > 84 for file in faces.values())
