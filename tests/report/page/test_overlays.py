"""The input surface and the results in the 3D view."""

import numpy as np
import pytest

from polycube.registry import build
from polycube.report.page.views.overlays import MOST_VALUES, results, simplified
from polycube.surface import measures
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.splines import BAR


@pytest.fixture(scope="module")
def points():
    return hex_box((4, 1, 1), BAR).vertices


def test_displacement_and_stress_of_a_pulled_bar(bar, points, pulled):
    moved, stress = results(bar, pulled, points, "mm")
    exact = points * [0.01, -0.003, -0.003]
    largest = np.linalg.norm(exact, axis=1).max()
    np.testing.assert_allclose(moved.values, np.linalg.norm(exact, axis=1), atol=1e-9)
    np.testing.assert_allclose(moved.shift, exact / largest, atol=1e-6)
    assert moved.ends == (0, pytest.approx(largest)) and moved.unit == "mm"
    assert moved.labels[1] == f"{largest:.4g} mm"
    times = 0.08 * np.linalg.norm(BAR) / largest  # the largest is 8 % of the diagonal
    assert moved.drawn == stress.drawn == f"displacement drawn {times:.3g} times as large"
    np.testing.assert_allclose(stress.values, 2100, rtol=1e-6)
    assert stress.labels[1] == "2100 MPa and more" and stress.shift is moved.shift


def test_values_come_in_steps_of_the_colour_bar(bar, points, pulled):
    steps, shift = results(bar, pulled, points, "mm")[0].arrays()
    assert (steps.dtype, shift.dtype) == ("<u2", "<i2")
    exact = np.linalg.norm(points * [0.01, -0.003, -0.003], axis=1)
    np.testing.assert_allclose(steps / 65534 * exact.max(), exact, atol=exact.max() / 65534)
    assert np.linalg.norm(shift / 32767, axis=1).max() == pytest.approx(1, abs=1e-4)


def test_modes_and_potentials(bar, points):
    modes = build("analysis", {"plugin": "modal", "modes": 9})(bar)
    found = results(bar, modes, points, "mm")
    assert [each.title.split(":")[0] for each in found] == ["mode 7", "mode 8", "mode 9"]
    assert all(each.values.max() == pytest.approx(1) for each in found)
    ends = [{"at": "x_min", "value": 10.0}, {"at": "x_max", "value": 30.0}]
    [warm] = results(bar, build("analysis", {"plugin": "poisson", "fixed": ends})(bar), points, "")
    np.testing.assert_allclose(warm.values, 10 + 5 * points[:, 0], atol=1e-8)
    assert warm.labels == ("10 K", "30 K") and warm.shift is None and len(warm.arrays()) == 1


def test_the_number_of_results_is_bounded(bar, points, pulled):
    assert MOST_VALUES >= 2 * len(points)
    many = np.tile(points, (MOST_VALUES // len(points) + 1, 1))
    assert [each.title for each in results(bar, pulled, many, "mm")] == ["displacement"]


def test_a_fine_surface_is_simplified_within_the_cells_of_its_grid():
    surface = surface_of(hex_box((30, 20, 10), (3, 2, 1)))
    same, all_faces = simplified(surface)
    assert same is surface.vertices and all_faces is surface.faces
    vertices, faces = simplified(surface, 500)
    assert 100 < len(faces) <= 500
    np.testing.assert_allclose(vertices.min(0), [0, 0, 0], atol=0.3)
    np.testing.assert_allclose(vertices.max(0), [3, 2, 1], atol=0.3)
    corners = vertices[faces]
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(measures.volume(surface), rel=0.25)
