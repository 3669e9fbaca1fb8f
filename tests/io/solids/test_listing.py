"""The solids of files that Gmsh wrote: names, units, and which are the same but for a motion."""

from types import SimpleNamespace

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.io.cad import Cad
from polycube.io.solids.listing import names_of, read_solids
from polycube.io.solids.worker import _lie_on
from polycube.io.surfaces import read_surface
from tests.fixtures import assemblies


@pytest.mark.slow
def test_pins_are_one_shape_wherever_they_stand_or_lie(tmp_path):
    path = assemblies.named(assemblies.write("pins", tmp_path), "plate", *["pin"] * 4)
    plate, *pins = read_solids(path)
    assert [plate.name, *(pin.name for pin in pins)] == [
        "plate",
        "pin_2",
        "pin_3",
        "pin_4",
        "pin_5",
    ]
    assert (plate.number, plate.same_as, plate.motion) == (1, 1, None)
    assert plate.volume == pytest.approx(60000)
    assert [pin.same_as for pin in pins] == [2] * 4 and pins[0].motion is None
    for pin, step in zip(pins[1:3], ([0, 30, 0], [70, 0, 0]), strict=True):
        np.testing.assert_allclose(pin.motion.rotation, np.eye(3), atol=1e-9)
        np.testing.assert_allclose(pin.motion.translation, step, atol=1e-7)
    first, lying = (read_surface(path, Cad(solid=number))[0] for number in (2, 5))
    own = lying.vertices[np.argsort(lying.vertices @ [1, 2, 3])[-1]]
    moved = pins[3].motion(first.vertices)
    np.testing.assert_allclose(moved[np.argsort(moved @ [1, 2, 3])[-1]], own, atol=0.05)


def test_look_alikes(tmp_path):
    """A turned box, part, ring and a ball are copies, a mirror image and another radius are not."""
    solids = read_solids(assemblies.write("look_alikes", tmp_path))
    assert [solid.same_as for solid in solids] == [1, 1, 3, 4, 3, 6, 6, 8, 8, 10, 11]


@pytest.mark.slow
def test_motions_are_in_the_unit_of_the_file(tmp_path):
    path = assemblies.write("cubes", tmp_path)
    path.write_text(path.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    solids = read_solids(path)
    assert [solid.volume for solid in solids] == pytest.approx([1000, 1000, 125, 56])
    np.testing.assert_allclose(solids[1].motion.translation, [10, 0, 0], atol=1e-9)


def test_points_off_a_face_refute_a_motion():
    """A ball of radius 2 in place of Gmsh."""

    def closest(dimension, tag, points):
        points = np.reshape(points, (-1, 3))
        return (2 * points / np.linalg.norm(points, axis=1)[:, None]).ravel(), None

    ball = SimpleNamespace(model=SimpleNamespace(getClosestPoint=closest))
    points = np.array([[2.0, 0, 0], [0, 0, -2]])
    assert _lie_on(ball, points, 1, 1e-9) and _lie_on(ball, points[:0], 1, 1e-9)
    assert not _lie_on(ball, points * [1, 1, 1.001], 1, 1e-3)


@pytest.mark.parametrize(
    ("given", "names"),
    [
        (["plate", "Pin"], ["plate", "Pin"]),
        (["pin", "PIN", "bolt M6x1.5/a"], ["pin_1", "PIN_2", "bolt_M6x1_5_a"]),
        (["", "Größe", "面; a", "\u00e9"], ["solid_1", "Grosse", "u9762_a", "e"]),
        (["pin", "pin", "pin_2"], ["pin_1", "pin_2_", "pin_2"]),
    ],
)
def test_names_are_letters_and_digits_and_no_two_are_equal(given, names):
    assert names_of(given) == names


def test_what_is_no_cad_file_is_refused_in_a_sentence(tmp_path):
    path = tmp_path / "part.step"
    path.write_text("good morning")
    with pytest.raises(
        InputError, match=r"part\.step: (not a readable \.step file|the file holds)"
    ):
        read_solids(path)
    with pytest.raises(InputError, match="there is no such file"):
        read_solids(tmp_path / "nowhere.step")
