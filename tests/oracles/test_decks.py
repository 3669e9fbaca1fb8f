"""Exported decks, read by programs for these formats."""

import numpy as np
import pytest

from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build, provide
from tests.fixtures.exports import export
from tests.fixtures.hexmeshes import hex_box

pytestmark = pytest.mark.oracles

BOX = hex_box((4, 2, 2), (4.0, 2.0, 2.0))
PULL = {
    "plugin": "static",
    "units": "mm",
    "fixed": ["x_min"],
    "loads": [{"at": "x_max", "force": [8, 0, 0]}, {"at": "z_max", "pressure": 2e6}],
    "gravity": [0, 0, -9.81],
}


@pytest.fixture
def read_bdf(monkeypatch):
    """The reader of pyNastran, whose version 1.4 needs a function that NumPy 2.4 lacks."""
    monkeypatch.setattr(np, "in1d", np.isin, raising=False)
    bdf = pytest.importorskip("pyNastran.bdf.bdf")
    return lambda path: bdf.read_bdf(str(path), xref=True, debug=None)


@pytest.mark.parametrize(
    "analysis",
    [PULL, {"plugin": "modal", "modes": 7}, {"plugin": "poisson", "source": 2.0}],
    ids=lambda analysis: analysis["plugin"],
)
def test_pynastran_cross_references_every_deck(read_bdf, analysis, tmp_path) -> None:
    plugin = provide(
        build("export", {"plugin": "nastran"}), problem=build("analysis", analysis).problem
    )
    model = read_bdf(plugin(BOX, tmp_path / "hex"))
    assert model.sol == {"static": 101, "modal": 103, "poisson": 153}[analysis["plugin"]]
    points = np.array([model.nodes[n + 1].get_position() for n in range(len(BOX.vertices))])
    np.testing.assert_allclose(points, BOX.vertices, rtol=1e-9)
    hexes = [model.elements[n + 1].node_ids for n in range(len(BOX.hexes))]
    np.testing.assert_array_equal(hexes, BOX.hexes + 1)
    sets = boundary_sets(BOX)
    for number, quads in enumerate(sets.values(), start=1):
        assert sorted(model.sets[number].ids) == (np.unique(BOX.quads[quads]) + 1).tolist()
    if analysis is PULL:
        assert model.elements[1].Mass() == pytest.approx(7.85e-9)
        [case] = model.subcases.values()
        from pyNastran.bdf.mesh_utils.loads import sum_forces_moments

        force, moment = sum_forces_moments(model, np.zeros(3), case.params["LOAD"][0])
        assert force == pytest.approx([8, 0, -16])
        assert moment == pytest.approx([-16, 8 + 32, -8])


def test_a_reader_of_ls_dyna_finds_nodes_and_hexes(tmp_path) -> None:
    reader = pytest.importorskip("lsdyna_mesh_reader")
    deck = reader.Deck(str(export(BOX, tmp_path, "lsdyna")))
    [nodes], [solids] = deck.node_sections, deck.element_solid_sections
    np.testing.assert_allclose(nodes.coordinates, BOX.vertices)
    np.testing.assert_array_equal(np.reshape(solids.node_ids, (-1, 8)), BOX.hexes + 1)
    np.testing.assert_array_equal(solids.pid, BOX.cell + 1)


def test_a_reader_of_febio_finds_mesh_and_sets(tmp_path) -> None:
    reader = pytest.importorskip("febio_python.feb")
    problem = build("analysis", PULL).problem
    plugin = provide(build("export", {"plugin": "febio"}), problem=problem)
    model = reader.Feb(filepath=str(plugin(BOX, tmp_path / "hex")))
    np.testing.assert_allclose(model.get_nodes()[0].coordinates, BOX.vertices)
    np.testing.assert_array_equal(model.get_volume_elements()[0].connectivity, BOX.hexes)
    sets = {each.name: np.sort(each.ids) for each in model.get_nodesets()}
    for name, quads in boundary_sets(BOX).items():
        np.testing.assert_array_equal(sets[name], np.unique(BOX.quads[quads]))
    assert float(model.get_materials()[0].parameters["E"]) == 210000
