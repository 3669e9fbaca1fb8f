"""The space that an error estimate chooses: thin walls need more than h2s."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from polycube.analysis.recovery import samples
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.named_sets import boundary_sets, sets_of_spline
from polycube.io.hex_meshes import boundary, patches
from polycube.registry import BadOption, build, provide
from polycube.types import HexMesh, Modes, Spline
from tests.fixtures.hexmeshes import hex_box

THICK, RADIUS, LEG = 2.0, 3.0, 8.0  # of a strip: wall, inner radius of its bend, legs
HELD = ["x_min"]


def strip(layers: int, legs: int = 2, bend: int = 2, wide: int = 2) -> HexMesh:
    """Two legs at a right angle with a bend between them, 8 wide, all of one thickness."""
    middle = RADIUS + THICK / 2
    ends = np.cumsum([0, LEG, np.pi / 2 * middle, LEG])
    counts = (legs, bend, legs)
    along = [np.linspace(*ends[i : i + 2], n, endpoint=False) for i, n in enumerate(counts)]
    along = np.append(np.concatenate(along), ends[-1])
    box = hex_box((sum(counts), wide, layers), (sum(counts), 8.0, THICK))
    s = along[box.vertices[:, 0].round().astype(int)]
    y, out = box.vertices[:, 1], RADIUS + THICK - box.vertices[:, 2]
    angle = np.clip((s - LEG) / middle, 0, np.pi / 2)
    x = np.minimum(s, LEG) + out * np.sin(angle)
    z = RADIUS + THICK - out * np.cos(angle) + np.maximum(s - ends[2], 0)
    return hex_mesh(np.stack([x, y, z], axis=1), box.hexes)


def spline_of(mesh: HexMesh, space: str, **options: object) -> Spline:
    """A spline without fit, so that all spaces have the same solid, which is the part itself."""
    mesh = hex_mesh(mesh.vertices, mesh.hexes, mesh.quads, patches(mesh))
    mesh = replace(mesh, sets=boundary_sets(mesh))
    made = build("spline", {"plugin": space, "held": HELD, "fit": {"iterations": 0}, **options})
    spline = made(boundary(mesh), mesh)
    return replace(spline, sets=sets_of_spline(spline, mesh), offset=np.zeros((0, 25)), tilt=[])


def answers(spline: Spline):
    """The largest displacement under a force at the end, and ten frequencies, with their errors."""
    load = {"at": "z_max", "force": [10.0, 0.0, 0.0]}
    static = build("analysis", {"plugin": "static", "fixed": HELD, "loads": [load]})(spline)
    modal = build("analysis", {"plugin": "modal", "fixed": HELD, "modes": 10})(spline)
    moved = samples(spline, static.displacement)
    largest = np.linalg.norm(moved, axis=2).max()
    found = np.array([largest, *modal.frequency])
    return found, np.array([static.displacement_error, *(modal.frequency * modal.errors)])


@pytest.mark.slow
@pytest.mark.parametrize("layers", [1, 2])
def test_bent_strips_are_accurate_with_one_or_two_hexes_through_the_wall(layers):
    mesh = strip(layers)
    exact, _ = answers(spline_of(mesh, "optimal", refine={"levels": 1}))
    plain, (found, error) = spline_of(mesh, "h2s"), answers(spline_of(mesh, "auto"))
    assert abs(found / exact - 1).max() < 0.03
    ratio = error / abs(found - exact)
    assert (ratio > 1).all() and np.median(ratio) < 5
    statics = spline_of(mesh, "auto", solves="static")
    assert len(statics.control) == len(mesh.vertices)
    assert answers(statics)[0][0] == pytest.approx(found[0], rel=1e-3)
    if layers == 1:
        own = build("analysis", {"plugin": "modal", "fixed": HELD, "enrich": False})(plain)
        assert own.frequency[0] > 1.05 * exact[1] and not own.errors
        stiff, doubt = answers(plain)
        ratio = doubt / abs(stiff - exact)
        assert stiff[:2] == pytest.approx(exact[:2], rel=0.03)
        assert (ratio > 1).mean() > 0.9 and np.median(ratio) < 5


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_the_analysis_itself_estimates_the_error_if_it_can(mass):
    mesh, asked = hex_box((2, 2, 2)), []
    modal = build("analysis", {"plugin": "modal", "modes": 8, "mass": mass})

    def chosen(error: float) -> Spline | tuple[Spline, Modes]:
        made = build("spline", {"plugin": "auto", "error": error, "fit": {"iterations": 0}})
        asked.append(0)

        def solve(spline: Spline) -> Modes:
            asked[-1] += 1
            return modal(spline)

        return provide(made, analysis=solve)(boundary(mesh), mesh)

    spline, modes = chosen(0.5)
    assert len(spline.control) == len(mesh.vertices) and len(modes.frequency) == 8
    assert bool(modes.errors) == (mass == "consistent")
    assert len(chosen(1e-4).control) > len(mesh.vertices) and asked == [1, 1]


@pytest.mark.slow
def test_a_compact_free_block_keeps_the_functions_of_its_vertices():
    mesh = hex_box((8, 8, 8))
    assert len(spline_of(mesh, "auto", held=[]).control) == len(mesh.vertices)


def test_heat_conduction_has_the_larger_space():
    mesh = hex_box((4, 4, 4))
    assert len(spline_of(mesh, "auto", held=[], solves="poisson").control) > len(mesh.vertices)


@pytest.mark.slow
def test_the_tolerance_decides():
    mesh = hex_box((4, 4, 4))
    plain, larger = (spline_of(mesh, "auto", error=error) for error in (0.5, 1e-4))
    assert len(plain.control) == len(mesh.vertices) < len(larger.control)
    with pytest.raises(BadOption, match="error must be a number, above 0"):
        build("spline", {"plugin": "auto", "error": 0.0})


def test_too_many_functions_stay_h2s(monkeypatch):
    module = sys.modules[type(build("spline", {"plugin": "auto"})).__module__]
    monkeypatch.setattr(module, "MOST", 40)
    mesh = strip(1)
    assert len(spline_of(mesh, "auto").control) == len(mesh.vertices)
