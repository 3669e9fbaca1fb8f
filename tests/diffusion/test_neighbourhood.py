"""Features of points from their neighbours."""

import pytest
import torch

from polycube.diffusion.point_network import Neighbourhood, PointNetwork, nearest


def cloud(n: int = 60) -> tuple[torch.Tensor, torch.Tensor]:
    return torch.randn(2, 2, n, 3, generator=torch.Generator().manual_seed(0)).unbind(0)


def test_nearest_points_are_those_of_a_direct_search() -> None:
    points, _ = cloud()
    found = nearest(points, 5)
    for b in range(2):
        for i, place in enumerate(points[b]):
            order = sorted(range(60), key=lambda j: float((points[b, j] - place).norm()))
            assert found[b, i].tolist() == order[1:6]
    assert nearest(points[:, :4], 16).shape == (2, 4, 3)


def test_features_do_not_depend_on_place_size_and_order() -> None:
    torch.manual_seed(0)
    around, (points, normals) = Neighbourhood(8, 6), cloud()
    found = around(points, normals)
    assert torch.allclose(around(3 * points + 1, normals), found, atol=1e-4)
    order = torch.randperm(60)
    assert torch.allclose(around(points[:, order], normals[:, order]), found[:, order], atol=1e-5)


def test_only_the_neighbours_count() -> None:
    """Another normal at a point changes that point and those that have it as a neighbour."""
    torch.manual_seed(0)
    around, (points, normals) = Neighbourhood(8, 6), cloud()
    neighbours = nearest(points, 6)
    other = normals.clone()
    other[:, 7] *= -1
    changed = (around(points, other) != around(points, normals)).any(dim=2)
    affected = (neighbours == 7).any(dim=2)
    affected[:, 7] = True
    assert not (changed & ~affected).any() and changed[:, 7].all()


def test_neighbours_need_places_and_normals() -> None:
    with pytest.raises(ValueError, match=r"model\.neighbours needs places and normals; got 3"):
        PointNetwork(3, 5, 4, neighbours=8)
