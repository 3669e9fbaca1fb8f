"""The effect of the distance between spline and part, against other parts and closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.analysis.boundary_sets import faces_of
from polycube.analysis.modal import free_modes
from polycube.analysis.poisson import conduct
from polycube.analysis.problem import Material, Prescribed
from polycube.analysis.shape import NOTCH, SAFETY, distance_error
from polycube.analysis.static import Load, deform
from polycube.analysis.supports import prescribed, supports
from polycube.spline.boundary import distances
from polycube.types import TriMesh
from tests.fixtures.splines import box, meshed_box

SOLID = Material(3.0, 0.0, 2.0)
THICK = 1e-3


def grown(spline, *places, by=THICK):
    """The same spline for a part that is larger at some places."""
    offset = np.zeros((len(spline.sides), 25))
    offset[np.concatenate([faces_of(spline, place) for place in places])] = by
    return replace(spline, offset=offset)


def test_the_volume_is_exact():
    spline = box((2, 3, 1), (2.0, 3.0, 1.0))
    one = np.ones(spline.extraction.shape[0])
    assert distance_error(grown(spline, "z_max"), one) == pytest.approx(SAFETY * 6 * THICK)
    assert distance_error(replace(spline, offset=np.zeros((0, 25)), tilt=np.zeros(0)), one) == 0


def temperatures(fixed):
    return [Prescribed(each["at"], (0,), (each["value"],)) for each in fixed]


def pulled(spline):
    held = [{"at": f"{axis}_min", "components": [axis]} for axis in "xyz"]
    pull = Load(faces_of(spline, "x_max"), force=(1.0, 0.0, 0.0))
    return deform(spline, SOLID, supports(spline, prescribed(held)), [pull], length_unit="m")


def test_a_thicker_bar_moves_less_by_the_estimate():
    """Uniform tension: the area is larger by 2 THICK / 0.5, the displacement smaller by that."""
    bar = box((4, 2, 2), (4.0, 1.0, 0.5))
    found = pulled(grown(bar, "z_min", "z_max"))
    longest = abs(found.displacement).max()
    assert found.displacement_error == pytest.approx(SAFETY * 2 * THICK / 0.5 * longest, rel=1e-6)
    assert pulled(grown(bar, "z_max", by=-THICK)).displacement_error > 0
    assert pulled(bar).displacement_error < 1e-9 * longest


def test_a_thicker_bar_conducts_more_by_the_estimate():
    """Between two temperatures, and with a source, which adds heat in the larger volume."""
    bar = box((4, 2, 2), (4.0, 1.0, 0.5))
    cold, hot = [{"at": "x_min", "value": 300.0}], [{"at": "x_max", "value": 310.0}]
    part = grown(bar, "z_min", "z_max")
    for fixed, source in ((cold + hot, 0.0), (cold, 8.0)):
        found = conduct(part, 2.0, supports(part, temperatures(fixed)), source=source)
        longest = np.ptp(found.values)
        assert found.u_error == pytest.approx(SAFETY * 2 * THICK / 0.5 * longest, rel=1e-6)
        exact = conduct(bar, 2.0, supports(bar, temperatures(fixed)), source=source)
        assert exact.u_error < 1e-9 * longest


def test_a_notch_raises_the_stress_of_the_boundary():
    bar = box((4, 2, 2), (4.0, 1.0, 0.5))
    tilted = pulled(replace(bar, tilt=np.full(len(bar.sides), 0.03)))
    assert tilted.peak.error == pytest.approx(NOTCH * 0.03 * tilted.peak.value, rel=1e-6)


def test_the_frequency_of_a_thicker_beam_is_within_its_estimate():
    """A bending frequency is proportional to the thickness; both beams are computed."""
    thin, thick = (box((8, 2, 2), (8.0, 1.0, t)) for t in (0.5, 0.5 + 2 * THICK))
    modes, other = (free_modes(each, SOLID, 7, "m", enrich=True) for each in (thin, thick))
    change_of_bending = other.frequency[6] / modes.frequency[6] - 1
    apart = free_modes(grown(thin, "z_min", "z_max"), SOLID, 7, "m", enrich=True)
    told = apart.errors[0] - modes.errors[0]
    assert told == pytest.approx(SAFETY * change_of_bending, rel=0.05)


def test_distances_from_a_larger_and_an_inclined_part():
    _, part = meshed_box((3, 2, 2))
    spline = box((3, 2, 2))
    offset, tilt = distances(spline, part)
    assert abs(offset).max() < 1e-12
    assert abs(tilt).max() < 1e-6
    larger = TriMesh(part.vertices * [1, 1, 1.01], part.faces, part.region)
    offset, tilt = distances(spline, larger)
    top = faces_of(spline, "z_max")
    assert offset[top] == pytest.approx(np.full((len(top), 25), 0.01))
    vertices = part.vertices + np.outer(part.vertices[:, 2] * part.vertices[:, 0], [0, 0, 0.02])
    leaning = TriMesh(vertices, part.faces, np.ones(len(part.faces), np.int64))
    assert distances(spline, leaning)[1][top] == pytest.approx(np.full(len(top), 0.02), rel=1e-3)
    assert not distances(spline, TriMesh(vertices, part.faces))[1].any()
