"""Pictures are drawn, and never end a run."""

import logging
import sys
from io import BytesIO

import numpy as np
import pytest

from polycube.report.pictures import scenes
from polycube.report.pictures.pictures import draw, made
from polycube.report.pictures.render import Layer
from polycube.state import RunState
from polycube.types import Modes


def pixels(png: bytes) -> np.ndarray:
    from matplotlib.image import imread

    return imread(BytesIO(png), format="png")


@pytest.mark.slow
def test_every_part_of_a_finished_run_is_drawn(drawn) -> None:
    names = {"input", "polycube", "labels", "hex", "cut", "worst", "cells", "deviation", "sets"}
    assert set(drawn) == names | {"spline", "mode_6", "mode_7", "denoising"}


@pytest.mark.slow
def test_pictures_are_cropped_and_transparent_around(drawn) -> None:
    for name, png in drawn.items():
        if name.startswith(("mode", "denoising")):
            continue
        alpha = pixels(png)[..., 3]
        assert alpha.min() == 0 and alpha.max() == 1, name
        assert all(side.any() for side in (alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1])), name


@pytest.mark.slow
def test_modes_swing_about_the_body_at_rest(drawn) -> None:
    from PIL import Image

    film = Image.open(BytesIO(drawn["mode_6"]))
    assert film.format == "GIF" and film.n_frames == 16 and film.info["loop"] == 0
    frames = []
    for number in range(film.n_frames):
        film.seek(number)
        frames.append(np.asarray(film.convert("RGB")).astype(int))
    assert np.array_equal(frames[0], frames[8])  # through the middle, twice
    assert abs(frames[4] - frames[12]).max() > 100  # the two ends
    assert np.array_equal(frames[3], frames[5])


@pytest.mark.slow
def test_hues_of_the_axes_are_seen(run) -> None:
    """From the eye +x, -y and +z faces are seen: red, pale green and blue."""
    pytest.importorskip("pyvista")
    image = pixels(draw({"polycube": scenes.polycube_faces(run.polycube)})["polycube"])
    hue = image[..., :3][image[..., 3] == 1].argmax(1)
    assert set(np.unique(hue)) == {0, 1, 2}


def test_half_a_run_is_drawn_as_far_as_it_went(run) -> None:
    assert set(made(RunState(run.surface, polycube=run.polycube))) == {"input", "polycube"}


def test_a_machine_that_cannot_draw_gives_a_warning_and_no_picture(
    run, monkeypatch, caplog
) -> None:
    scene = {"polycube": scenes.polycube_faces(run.polycube)}
    for program in ("/bin/false", "/no/such/program"):
        monkeypatch.setattr(sys, "executable", program)
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            assert draw(scene) == {}
        assert "no picture of polycube" in caplog.text


@pytest.mark.slow
def test_a_scene_that_cannot_be_drawn_is_named(run, caplog) -> None:
    pytest.importorskip("pyvista")
    empty = np.zeros((0, 3))
    nothing = [Layer(empty, empty.astype(int), empty.astype(np.uint8))]
    good = scenes.polycube_faces(run.polycube)
    with caplog.at_level(logging.WARNING):
        drawn = draw({"good": good, "nothing": nothing})
    assert set(drawn) == {"good"}
    assert "no picture of nothing" in caplog.text


def test_a_state_that_makes_no_scene_costs_that_picture_only(run, caplog) -> None:
    spline = run.spline
    other = Modes(run.solution.eigenvalues, run.solution.shapes[:, :-1], 1.0)  # of another spline
    with caplog.at_level(logging.WARNING):
        drawn = made(RunState(run.surface, spline=spline, solution=other))
    assert set(drawn) == {"input", "spline"}
    assert "no picture of mode_6" in caplog.text
