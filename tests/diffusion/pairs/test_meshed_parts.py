"""Pairs from hex meshes: exact where the part is its polycube, refused where labels do not fit."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.diffusion.pairs.any_structure import Part
from polycube.diffusion.pairs.meshed_parts import NARROWEST, meshed_part, tilted
from polycube.structure.lattice import OUTWARD, boundary, is_manifold
from polycube.structure.projection import project_onto
from polycube.surface.measures import face_normals, volume
from polycube.types import HexMesh, Polycube, TriMesh
from tests.fixtures.meshed import WIDTHS, hexes_of, part_of, true_knots, unit_lattice


def bent(hexes: HexMesh, by: float) -> HexMesh:
    """The mesh twisted round its middle and swollen, as no polycube is."""
    middle = hexes.vertices.mean(axis=0)
    x = (hexes.vertices - middle) / 7
    angle = by * x[:, 2]
    turned = x.copy()
    turned[:, 0] = np.cos(angle) * x[:, 0] - np.sin(angle) * x[:, 1]
    turned[:, 1] = np.sin(angle) * x[:, 0] + np.cos(angle) * x[:, 1]
    return replace(hexes, vertices=middle + 7 * turned * (1 + by * x[:, [1, 2, 0]] ** 2))


def off_own_face(part: Part) -> float:
    """Largest distance of the middle of a triangle's place from the face of its label."""
    surface, outside = part.surface, boundary(part.polycube)
    middles = surface.vertices[surface.faces].mean(axis=1)
    on_plane = np.stack(
        [part.polycube.knots[a // 2][k] for a, k in zip(surface.axis, surface.knot, strict=True)]
    )
    height = outside.vertices[outside.quads[:, 0], outside.axis // 2]
    same = (surface.axis[:, None] == outside.axis) & (on_plane[:, None] == height)
    nearest, _ = project_onto(outside, middles, np.where(same, 0, np.inf))
    return float(np.linalg.norm(nearest - middles, axis=1).max())


@pytest.mark.parametrize("name", WIDTHS)
def test_a_part_that_is_its_polycube_is_left_as_it_is(name: str) -> None:
    """From slabs of width 1 and a turned part: places, widths and labels are the part's own."""
    part = part_of(name)
    assert part.surface.vertices == pytest.approx(part.geometry, abs=1e-12)
    for found, true in zip(part.polycube.knots, true_knots(name), strict=True):
        assert found == pytest.approx(true, abs=1e-12)
    normals = face_normals(TriMesh(part.geometry, part.surface.faces))
    assert normals == pytest.approx(OUTWARD[part.surface.axis], abs=1e-9)
    assert part.genus == (name == "frame") and tilted(part) == 0
    assert off_own_face(part) < 1e-12


@pytest.mark.parametrize("name", WIDTHS)
def test_a_bent_part_lies_on_the_faces_of_its_labels(name: str) -> None:
    part = meshed_part(bent(hexes_of(name), 0.4), unit_lattice(name))
    assert volume(TriMesh(part.geometry, part.surface.faces)) > 0
    assert np.abs(part.geometry).max() == pytest.approx(1)
    assert max(k[-1] for k in part.polycube.knots) == pytest.approx(1)
    assert np.abs(part.surface.vertices - part.geometry).max() > 0.02
    assert is_manifold(part.polycube) and 0 < tilted(part, 5) < 1
    assert off_own_face(part) < 1e-12


def test_an_edge_is_laid_out_by_its_length() -> None:
    """Twice as fine on one half of the part: places are still in proportion to lengths."""
    hexes = hexes_of("box", np.eye(3), parts=4)
    low = hexes.vertices[:, 0].min()
    t = (hexes.vertices[:, 0] - low) / np.ptp(hexes.vertices[:, 0])
    graded = hexes.vertices.copy()
    graded[:, 0] = low + np.ptp(graded[:, 0]) * t**2
    part = meshed_part(replace(hexes, vertices=graded), unit_lattice("box"))
    assert part.surface.vertices == pytest.approx(part.geometry, abs=1e-12)


def test_knots_ascend_where_the_planes_of_a_part_do_not() -> None:
    """The step of an L pressed to nothing is as narrow as a slab may be."""
    hexes = hexes_of("L", np.eye(3))
    x = hexes.vertices.copy()
    low, high = x[:, 0].min(), x[:, 0].max()
    step = low + (0.9 / 2.5) * (high - low)
    x[:, 0] = np.where(x[:, 0] > step, step + 1e-3 * (x[:, 0] - step), x[:, 0])
    part = meshed_part(replace(hexes, vertices=x), unit_lattice("L"))
    assert np.diff(part.polycube.x).min() > 0.9 * NARROWEST * np.ptp(part.polycube.x) / 2


def test_polycubes_with_too_many_slabs_are_refused() -> None:
    many = np.ones((15, 2, 1), bool)
    many[1::2, 1] = False
    x, y, z = (np.arange(n + 1.0) for n in many.shape)
    with pytest.raises(ValueError, match="15 x 2 x 1 slabs, more than 6"):
        meshed_part(hexes_of("box"), Polycube(many, x, y, z, (1, 1, 1), ("it",)))


def test_labels_that_do_not_fit_are_refused() -> None:
    hexes, lattice = hexes_of("L"), unit_lattice("L")
    swapped = hexes.patch.copy()
    first, second = (np.flatnonzero(hexes.patch == n) for n in (0, hexes.patch.max()))
    swapped[first[0]], swapped[second[0]] = hexes.patch[second[0]], hexes.patch[first[0]]
    with pytest.raises(ValueError, match="polycube"):
        meshed_part(replace(hexes, patch=swapped), lattice)
    gone = np.where(hexes.patch == 0, 1, hexes.patch)
    with pytest.raises(ValueError, match=r"not on the mesh|are not arranged as those"):
        meshed_part(replace(hexes, patch=gone), lattice)
