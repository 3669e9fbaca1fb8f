"""The CAD parts of the tests: number of faces, genus and volume, as drawn."""

import numpy as np
import pytest

from polycube.io.cad import Cad
from polycube.io.surfaces import read_surface
from polycube.surface.measures import genus, volume
from tests.conftest import first_quick
from tests.fixtures import cad_parts

TURN = 2 * np.pi
KEYWAY = (20 * 8 + np.pi * 16) * (np.sqrt(20**2 - 2**2) - 16)  # between floor and mean height
PARTS = {  # number of CAD faces, genus, volume
    "i_beam": (15, 1, 320 * (2 * 100 * 10 + 100 * 8) - np.pi * 30**2 * 8),
    "shaft": (12, 0, np.pi * (80 * 15**2 + 60 * 20**2) - KEYWAY),
    "flange": (12, 7, np.pi * (12 * 60**2 + 28 * 30**2 - 40 * 20**2 - 6 * 12 * 5**2)),
    "plate": (10, 4, 10 * (200 * 100 - 4 * np.pi * 4**2)),
    "bracket": (11, 2, 40 * (114 * 6 + (1 - np.pi / 4) * 6**2) - 2 * 6 * np.pi * 4.5**2),
    "elbow": (4, 1, np.pi * (20**2 - 15**2) * 60 * TURN / 4),
    "bored_block": (12, 1, 20 * (60 * 40 - np.pi * 10**2)),
}


@pytest.mark.parametrize("name", first_quick(3, PARTS))
def test_a_part_is_as_drawn(tmp_path, name):
    faces, handles, size = PARTS[name]
    surface, warnings = read_surface(cad_parts.write(name, tmp_path), cad=Cad(segments=32))
    assert warnings == [] and genus(surface) == handles
    assert len(np.unique(surface.region)) == faces
    assert volume(surface) == pytest.approx(size, rel=8e-3)


@pytest.mark.parametrize(("name", "faces", "handles"), [("gear", 51, 1), ("tee", 7, 2)])
def test_a_part_without_a_simple_volume_is_whole(tmp_path, name, faces, handles):
    surface, warnings = read_surface(cad_parts.write(name, tmp_path), cad=Cad(segments=32))
    assert warnings == [] and genus(surface) == handles
    assert len(np.unique(surface.region)) == faces
