"""The program from Python."""

from types import SimpleNamespace

import numpy as np
import pytest

import polycube
from polycube.errors import InputError, MeshingError
from polycube.examples.parts import example
from polycube.hexmesh.quality import scaled_jacobian
from polycube.io.hex_meshes import read_hexes

FAST = ["meshing.size=12%", "structure=slices"]


def test_five_lines_from_an_array_to_modes(capfd):
    given = example("dice")
    surface = SimpleNamespace(vertices=given.vertices + 100.0, faces=given.faces)
    part = polycube.mesh(surface, "analysis.modes=8", *FAST)
    np.testing.assert_array_equal(part.surface.vertices, surface.vertices)
    worst = scaled_jacobian(part.hexes.vertices, part.hexes.hexes).min()
    assert worst == pytest.approx(part.report["hex"]["min_scaled_jacobian"])
    assert len(part.spline.nodes) >= len(part.hexes.hexes)
    assert len(part.modes.frequency) == 8 and part.modes.frequency[7] > 0
    assert part.polycube.context == tuple(part.report["polycube"]["context"])
    assert capfd.readouterr().err == ""


def test_what_is_not_asked_for_is_none_and_files_are_kept_on_request(tmp_path):
    part = polycube.mesh("example:dice", "order=[meshing]", *FAST, output_dir=tmp_path)
    assert part.spline is None and part.modes is None
    kept, _ = read_hexes(str(tmp_path / "hex.vtu"))
    assert len(kept.hexes) == len(part.hexes.hexes)
    again = polycube.mesh(tmp_path / "hex.vtu", "order=[meshing]")  # a hex mesh is improved
    assert again.polycube is None
    before, after = (p.report["hex"]["min_scaled_jacobian"] for p in (part, again))
    assert after > before - 0.05


@pytest.mark.parametrize(
    ("source", "override", "sentence"),
    [
        ("none.stl", "seed=1", "none.stl: can not be read"),
        ("example:dice", "seed=-1", "seed must be a whole number"),
        ("example:dice", "nothing=1", "nothing"),
        ("example:dice", "structure=magic", "magic"),
    ],
)
def test_refusals_are_one_line(source, override, sentence):
    with pytest.raises(InputError, match=sentence) as refused:
        polycube.mesh(source, override)
    assert "\n" not in str(refused.value)


def test_no_valid_result_is_an_error(monkeypatch):
    def fails(self):
        raise MeshingError("stage meshing/smooth failed")

    monkeypatch.setattr("polycube.pipeline.run.Run.mesh", fails)
    with pytest.raises(MeshingError, match="stage meshing/smooth failed"):
        polycube.mesh("example:dice", *FAST)


def test_other_names_are_missing():
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        polycube.nonsense  # noqa: B018
