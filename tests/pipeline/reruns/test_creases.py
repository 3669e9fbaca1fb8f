"""A mesh nearer to sharp edges, on a block whose edges bulge and are cut short by few parts."""

import logging
from dataclasses import dataclass, replace

import numpy as np
import pytest

from polycube.hexmesh.inspection import inspect
from polycube.pipeline.reruns.creases import check_creases, creases_missed, meet_creases
from polycube.stages import Stage
from polycube.state import RunState
from polycube.pipeline.variants import Variants
from polycube.registry import build
from polycube.types import HexMesh, TriMesh
from tests.fixtures import hexmeshes
from tests.fixtures.hexmeshes import surface_of


def barrel(parts: int) -> HexMesh:
    """So many hexes along z."""
    return hexmeshes.barrel((4, 4, parts), 0.2)


@pytest.fixture(scope="module")
def surface() -> TriMesh:
    return surface_of(barrel(48))


@dataclass(frozen=True)
class Cut:
    """Stands for the subdivision: `more` parts along the creases, sheared where `turn` says so."""

    parts: int = 4
    more: int = 7
    turn: float = 0.0
    level: int | None = None
    creases: str | None = None
    features: str = "soft"

    def __call__(self, surface: TriMesh, polycube: None, rough_map: None, blocks: None) -> HexMesh:
        if self.features == "exact":
            return barrel(2 * self.parts)
        if self.creases is None:
            return barrel(self.parts)
        found = barrel(self.more)
        x = found.vertices.copy()
        inner = np.setdiff1d(np.arange(len(x)), found.quads)
        x[inner, 0] += self.turn
        return replace(found, vertices=x)

    def crease_options(self, distance: float) -> dict[str, object] | None:
        """As the template's."""
        return None if self.level is not None else {"creases": f"{100 * distance}%"}


def found_by(surface: TriMesh, **options: object) -> Variants:
    acceptance = build("acceptance", {"plugin": "standard", "least_jacobian": 0.0})
    stages = [Stage("meshing/subdivide", Cut(**options))]
    found = Variants(stages, [{}], RunState(surface), acceptance)
    found.run(0)
    return found


def hexes_of(found: Variants) -> int:
    return len(found.finish()[0].hexes.hexes)


def off(found: Variants) -> float:
    return inspect(found.finish()[0].hexes, found.start.surface).creases


@pytest.mark.parametrize("creases", ["auto", "0.1%", 0.003])
def test_more_parts_along_the_creases_are_taken(surface, creases):
    found = found_by(surface)
    before = off(found)
    meet_creases(found, creases)
    assert hexes_of(found) == 16 * 7
    assert off(found) < 0.5 * before  # (4 / 7)^2
    assert found.preferred == (1, False)


@pytest.mark.parametrize(
    ("creases", "options"),
    [
        (None, {}),  # nothing is requested
        ("5%", {}),  # it is met
        ("0.1%", {"level": 2}),  # the number of parts is requested for
    ],
)
def test_nothing_is_run_again(surface, creases, options):
    found = found_by(surface, **options)
    meet_creases(found, creases)
    assert list(found.attempts) == [(0, False)]


@pytest.mark.parametrize(
    "options",
    [
        {"turn": 0.3},  # worse hexes
        {"more": 9},  # more than twice the hexes
        {"more": 4},  # no nearer
    ],
)
def test_a_mesh_that_is_not_better_is_not_taken(surface, options, caplog):
    found = found_by(surface, **options)
    caplog.set_level(logging.INFO)
    meet_creases(found, "0.1%")
    assert hexes_of(found) == 16 * 4
    assert len(found.attempts) == 2 and "sharp edges: within" in caplog.text


def test_exact_features_where_they_are_automatic_and_more_is_lost(surface):
    found = found_by(surface, features="auto", more=4)
    assert off(found) > 0.003
    meet_creases(found, "auto")
    assert hexes_of(found) == 16 * 8


def test_the_edges_of_cad_faces_have_limits_of_their_own(surface):
    region = np.ones(len(surface.faces), int)
    found = found_by(TriMesh(surface.vertices, surface.faces, region=region))
    meet_creases(found, "auto")
    assert list(found.attempts) == [(0, False)]


def test_what_was_asked_for_and_is_missed_is_said(surface):
    coarse, fine = barrel(4), barrel(48)
    [sentence] = creases_missed(coarse, surface, "0.1%")
    assert "not within 0.10%" in sentence
    assert not list(creases_missed(fine, surface, "0.1%"))
    assert not list(creases_missed(coarse, surface, "auto"))
    assert not list(creases_missed(coarse, surface, None))


@pytest.mark.parametrize("value", ["near", 0, "-1%", [1]])
def test_what_is_no_distance_is_refused(value):
    with pytest.raises(ValueError, match="creases must be a positive number"):
        check_creases(value)
