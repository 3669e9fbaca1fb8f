"""Bent sheets: unfolded and folded back, and the hexes that fill them."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.connectivity import genus
from polycube.hexmesh.inspection import inspect
from polycube.io.surfaces import read_surface
from polycube.plugins.structure.background.bends.unfolded import unfolded
from polycube.surface import measures
from polycube.types import Candidate, TriMesh
from tests.conftest import first_quick
from tests.fixtures import columns
from tests.fixtures.bent import SQUARE, bent
from tests.fixtures.cad_parts import write
from tests.fixtures.columns import check_fills
from tests.fixtures.surfaces import box

TURN = Rotation.random(random_state=3).as_matrix()
STRIP = SQUARE * (0.5, 10)  # half the thickness, half the width
BENDS = st.tuples(st.floats(3, 9), st.floats(0.7, 4), st.floats(20, 60))


def propose(surface: TriMesh, **options) -> list[Candidate]:
    return columns.propose("sheet", surface, **{"curvature": None, **options})


def placed(surface: TriMesh) -> TriMesh:
    return replace(surface, vertices=surface.vertices @ TURN.T + 5)


@settings(deadline=None, max_examples=30)
@given(st.lists(BENDS, min_size=1, max_size=3))
def test_a_strip_is_as_long_as_its_middle(pieces):
    surface = placed(bent(STRIP, [*pieces, (5, 0, 0)]))
    sheet = unfolded(surface)
    length = 5 + sum(line + radius * np.radians(angle) for line, radius, angle in pieces)
    assert measures.volume(sheet.surface) == pytest.approx(20 * length)
    assert measures.face_areas(sheet.surface)[sheet.side].sum() == pytest.approx(20 * length)


@settings(deadline=None, max_examples=30)
@given(st.lists(BENDS, min_size=1, max_size=3))
def test_an_unfolded_sheet_is_folded_to_itself(pieces):
    surface = placed(bent(STRIP, [*pieces, (5, 0, 0)]))
    sheet = unfolded(surface)
    assert sheet.fold(sheet.surface.vertices) == pytest.approx(surface.vertices, abs=1e-7)


@pytest.mark.parametrize(("around_hole", "wanted"), first_quick(1, [(12, 4), (24, 6), (40, 10)]))
def test_a_bend_of_ninety_degrees_has_four_hexes_or_more(around_hole, wanted):
    surface = bent(SQUARE * (0.5, 5), [(9, 2, 90), (9, 0, 0)])
    [candidate] = propose(surface, size=100.0, around_hole=around_hole, across_wall=2)
    assert len(candidate.blocks.hexes) == 2 * 2 * (2 + wanted + 2)


@pytest.mark.slow
def test_flanges_in_two_directions_with_holes_are_on_their_curves(tmp_path):
    surface, _ = read_surface(write("tray", tmp_path))
    [candidate] = propose(surface, curvature="0.2%")
    mesh = candidate.blocks
    check_fills(mesh, surface, 2e-3, 0.6)
    assert genus(mesh) == 2
    assert max(feature.distance for feature in inspect(mesh, surface).features) < 2e-3
    assert len(mesh.hexes) < 1500


def test_other_parts_are_refused_with_the_reason(caplog):
    with pytest.raises(NoBackgroundError, match="it has no CAD faces"):
        unfolded(box((0, 0, 0), (1, 1, 1)))
    with pytest.raises(NoBackgroundError, match="it has no bend"):
        unfolded(bent(STRIP, [(9, 0, 0)]))
    with pytest.raises(NoBackgroundError, match="it is not a thin sheet"):
        unfolded(bent(SQUARE, [(2, 3, 90)]))
    with pytest.raises(NoBackgroundError, match=r"inner radius of a bend is 0|not a thin sheet"):
        unfolded(bent(STRIP, [(9, 0.5, 90), (9, 0, 0)]))  # from its outer or its inner side
    uneven = bent(STRIP, [(9, 2, 90), (9, 0, 0)])
    end = np.unique(uneven.faces[uneven.region == 2])
    moved = uneven.vertices.copy()
    moved[end[0]] += 0.3 * (moved[end[0]] - moved[end].mean(axis=0))
    caplog.set_level(logging.INFO)
    assert propose(replace(uneven, vertices=moved)) == []
    assert "sheet: nothing is proposed, because its thickness is not constant" in caplog.text


def test_no_other_hexes_are_proposed_beside_good_ones(caplog):
    surface = bent(STRIP, [(9, 2, 90), (9, 0, 0)])
    found = propose(surface)
    caplog.set_level(logging.INFO)
    assert columns.propose("sweep", surface, found) == []
    assert "there are good hexes already" in caplog.text
