"""The denoising in pictures: every state, true names, one view, small files."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from polycube.report.pictures.pictures import made, makers
from polycube.report.pictures.trajectory import SIZE, WIDTH, Camera, Trajectory


@pytest.fixture(scope="module")
def trajectory(run) -> Trajectory:
    return Trajectory(run.polycube, run.trajectory, run.steps)


@pytest.fixture(scope="module")
def camera(trajectory) -> Camera:
    return Camera(trajectory)


def test_states_have_the_names_of_the_papers_figure(trajectory) -> None:
    names = ["$x_{T}$", "$x_{499}$", "$x_{479}$", "$x_{19}$", "$x_{0}$", "regular"]
    assert trajectory.names == names


def test_states_of_unknown_steps_are_numbered(run) -> None:
    unknown = Trajectory(run.polycube, run.trajectory)
    assert unknown.names[1:4] == ["$x_{(1/4)}$", "$x_{(2/4)}$", "$x_{(3/4)}$"]
    assert unknown.names[0] == "$x_{T}$" and unknown.names[4:] == ["$x_{0}$", "regular"]


@pytest.mark.slow
def test_strip_has_a_panel_per_state_and_one_for_the_regular_points(drawn) -> None:
    strip = Image.open(io.BytesIO(drawn["denoising"]))
    image = np.asarray(strip.convert("L")).astype(int)
    assert image.shape[1] == 6 * WIDTH
    panels = image.reshape(len(image), 6, WIDTH).swapaxes(0, 1)
    assert all((panel != 255).any() for panel in panels)
    noisy, calm = np.abs(panels[0] - panels[4]).mean(), np.abs(panels[3] - panels[4]).mean()
    assert noisy > calm > 0


def test_all_pictures_have_one_view_and_scale(camera, trajectory) -> None:
    """The outline, drawn without points, is the same however far the points of a state spread."""
    bare = np.asarray(camera(np.full_like(trajectory.regular, 1e6)))
    near = np.asarray(camera(trajectory.regular))
    assert bare.shape == near.shape
    dark = bare.max(axis=2) < 90
    assert dark.sum() > 300
    assert (near.min(axis=2) < 255)[dark].mean() > 0.98  # a point may be white where it shines


def test_a_point_is_where_it_belongs_and_is_not_larger_than_it_should_be(
    camera, trajectory
) -> None:
    """A single point, in the middle of the others: a disc about the middle of the picture."""
    far = np.full_like(trajectory.regular, 1e6)
    far[0] = trajectory.regular.mean(axis=0)
    seen = np.asarray(camera(far)).astype(int)
    bare = np.asarray(camera(np.full_like(far, 1e6))).astype(int)
    rows, columns = np.nonzero((seen != bare).any(axis=2))
    assert np.ptp(rows) == pytest.approx(np.ptp(columns), abs=2)
    assert np.ptp(rows) == pytest.approx(SIZE * WIDTH / np.sqrt(len(far)), abs=3)


def test_a_point_keeps_its_colour_and_points_at_both_ends_differ(camera, trajectory) -> None:
    ends = trajectory.regular[:, 0].argsort()[[0, -1]]
    red, violet = camera.colours[ends]
    assert red.argmax() == 0 and violet.argmax() == 2


def test_no_denoising_no_picture(run) -> None:
    assert "denoising" not in makers(replace(run, trajectory=None, steps=()))


def test_what_cannot_be_drawn_is_a_warning(run, caplog) -> None:
    found = made(replace(run, trajectory=run.trajectory[..., :2]))
    assert "hex" in found and "denoising" not in found
    assert "no picture of denoising" in caplog.text
