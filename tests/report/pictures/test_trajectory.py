"""The denoising in pictures: every state, true names, one view, small files."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageSequence

from polycube.pipeline.state import RunState
from polycube.report.pictures.pictures import denoising
from polycube.report.pictures.trajectory import FRAME, PANEL, STEP, Camera, Trajectory
from polycube.structure.projection import project


def regular(run: RunState) -> np.ndarray:
    """The last state on the polycube."""
    return project(run.polycube, run.trajectory[-1])[0]


@pytest.fixture(scope="module")
def trajectory(run) -> Trajectory:
    return Trajectory(run.trajectory, regular(run), run.polycube, run.steps)


def test_states_have_the_names_of_the_papers_figure(trajectory) -> None:
    names = ["$x_{T}$", "$x_{499}$", "$x_{479}$", "$x_{19}$", "$x_{0}$", "regular"]
    assert trajectory.names == names


def test_states_of_unknown_steps_are_numbered(run) -> None:
    unknown = Trajectory(run.trajectory, regular(run), run.polycube)
    assert unknown.names[1:4] == ["$x_{(1/4)}$", "$x_{(2/4)}$", "$x_{(3/4)}$"]
    assert unknown.names[0] == "$x_{T}$" and unknown.names[4:] == ["$x_{0}$", "regular"]


def test_strip_has_a_panel_per_state_and_one_for_the_regular_points(moving) -> None:
    strip = Image.open(io.BytesIO(moving["trajectory.png"]))
    image = np.asarray(strip.convert("L")).astype(int)
    assert image.shape[1] == 6 * PANEL
    panels = image.reshape(len(image), 6, PANEL).swapaxes(0, 1)
    assert all((panel != 255).any() for panel in panels)
    noisy, calm = np.abs(panels[0] - panels[4]).mean(), np.abs(panels[3] - panels[4]).mean()
    assert noisy > calm > 0


def test_all_pictures_have_one_view_and_scale(trajectory) -> None:
    """The outline, drawn without points, is the same however far the points of a state spread."""
    far = np.full_like(trajectory.regular, 1e6)
    camera = Camera(trajectory, 200)
    bare = camera(far)
    near = camera(trajectory.regular)
    assert bare.shape == near.shape
    dark = bare.max(axis=2) < 90
    assert dark.sum() > 500
    assert np.asarray(near.min(axis=2) < 255)[dark].all()


def test_a_point_keeps_its_colour_and_points_at_both_ends_differ(trajectory) -> None:
    colours = Camera(trajectory, 100).colours[: len(trajectory.regular)]
    ends = trajectory.regular[:, 0].argsort()[[0, -1]]
    red, violet = colours[ends]
    assert red.argmax() == 0 and violet.argmax() == 2


def test_animation_goes_through_all_states_without_end(moving) -> None:
    gif = moving["trajectory.gif"]
    assert len(gif) < 1_000_000
    image = Image.open(io.BytesIO(gif))
    assert image.width == FRAME and image.info["loop"] == 0
    wait = [frame.info["duration"] for frame in ImageSequence.Iterator(image)]
    assert sum(time > STEP for time in wait) == 6  # a pause at each state and at the end


def test_no_denoising_no_picture(run) -> None:
    assert denoising(replace(run, trajectory=None, steps=())) == {}


def test_what_cannot_be_drawn_is_a_warning(run, caplog) -> None:
    assert denoising(replace(run, trajectory=run.trajectory[..., :2])) == {}
    assert "no picture of the denoising" in caplog.text
