"""Chords of circles, of lines and of polygons, whose distances are known."""

from functools import partial

import numpy as np
import pytest

from polycube.fitting.creases.chord_counts import chord_error, chords_needed
from polycube.surface.curves.features import Crease

LOOP, OPEN = (-1, -1), (0, 1)


def crease(points, ends):
    arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return Crease(np.asarray(points, float), arc, np.ones(len(points) - 1), ends)


def circle(sides, radius=1.0):
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    return crease(radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), LOOP)


def sagitta(number, radius=1.0):
    return radius * (1 - np.cos(np.pi / number))


@pytest.mark.parametrize("number", [3, 8, 16])
@pytest.mark.parametrize("radius", [1.0, 7.0])
def test_a_circle_is_off_by_about_the_sagitta(number, radius):
    off = chord_error(circle(4000, radius), number)
    # 95 % of a parabola's length lies below 1 - .05^2 of its height; the largest sample counts
    assert 0.98 * sagitta(number, radius) < off <= sagitta(number, radius)


def test_the_chords_of_a_line_and_of_a_polygon_through_its_corners_are_on_it():
    line = crease([[0, 0, 0], [1, 0, 0], [3, 0, 0]], OPEN)
    assert chord_error(line, 1) < 1e-15 and chord_error(line, 5) < 1e-15
    assert chord_error(circle(12), 12) < 1e-12
    assert chord_error(circle(12), 24) < 1e-12
    assert chord_error(circle(12), 11) > 0.5 * sagitta(12)


def test_the_error_of_an_arc_falls_with_the_square_of_the_number():
    angle = np.linspace(0, 2, 3000)
    arc = crease(np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), OPEN)
    assert chord_error(arc, 4) / chord_error(arc, 8) == pytest.approx(4, rel=0.02)


def test_the_smallest_number_that_is_near_enough():
    fine = circle(4000)
    error = partial(chord_error, fine)
    found = chords_needed(error, 0.01, 3, 60)
    assert chord_error(fine, found) <= 0.01 < chord_error(fine, found - 1)
    assert found == pytest.approx(np.pi / np.sqrt(2 * 0.01), abs=1)
    assert chords_needed(error, 0.01, 40, 60) == 40  # there are as many already


def test_the_best_number_where_none_is_near_enough():
    assert chords_needed(partial(chord_error, circle(4000)), 1e-9, 4, 9) == 9
    assert chords_needed(partial(chord_error, circle(12)), 1e-15, 9, 13) == 12
