"""Exported decks, read by programs for these formats."""

from pathlib import Path

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


def with_problem(name: str, folder: Path, analysis: dict[str, object]) -> str:
    problem = build("analysis", analysis).problem
    return str(provide(build("export", {"plugin": name}), problem=problem)(BOX, folder / "hex"))


@pytest.fixture
def read_bdf(monkeypatch):
    """The reader of pyNastran, whose version 1.4 needs a function that NumPy 2.4 lacks."""
    monkeypatch.setattr(np, "in1d", np.isin, raising=False)
    bdf = pytest.importorskip("pyNastran.bdf.bdf")
    return lambda path: bdf.read_bdf(path, xref=True, debug=None)


@pytest.mark.parametrize(
    "analysis",
    [PULL, {"plugin": "modal", "modes": 7}, {"plugin": "poisson", "source": 2.0}],
    ids=lambda analysis: analysis["plugin"],
)
def test_pynastran_cross_references_every_deck(read_bdf, analysis, tmp_path) -> None:
    model = read_bdf(with_problem("nastran", tmp_path, analysis))
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


def test_a_reader_of_ls_dyna_finds_sets_material_and_supports(tmp_path) -> None:
    dynakw = pytest.importorskip("dynakw")
    moved = {"at": "x_max", "components": ["x"], "value": 0.25}
    path = with_problem("lsdyna", tmp_path, {**PULL, "fixed": ["x_min", moved]})
    found: dict[str, list] = {}
    with dynakw.DynaKeywordReader(path) as reader:
        for each in reader.keywords():
            found.setdefault(each.type.name, []).append(each.cards)

    def numbers(cards, columns: int) -> np.ndarray:
        return np.column_stack(list(cards["Card 2"].values())[:columns])

    sets = boundary_sets(BOX)
    for cards, faces, quads in zip(
        found["SET_NODE"], found["SET_SEGMENT"], sets.values(), strict=True
    ):
        own = numbers(cards, 8).ravel()
        assert own[own > 0].tolist() == (np.unique(BOX.quads[quads]) + 1).tolist()
        np.testing.assert_array_equal(numbers(faces, 4), BOX.quads[quads] + 1)
    [part], [solid], [elastic] = found["PART"], found["SECTION_SOLID"], found["MAT_ELASTIC"]
    assert [int(part["Card 2"][key][0]) for key in ("PID", "SECID", "MID")] == [1, 1, 1]
    assert int(solid["Card 1"]["SECID"][0]) == int(elastic["Card 1"]["MID"][0]) == 1
    assert [elastic["Card 1"][key][0] for key in ("RO", "E", "PR")] == [7.85e-9, 210000, 0.3]
    [motion] = found["BOUNDARY_PRESCRIBED_MOTION"]
    values = [motion["Card 1"][key][0] for key in ("TYPEID", "DOF", "VAD", "LCID", "SF")]
    assert values == [1 + list(sets).index("x_max"), 1, 2, 1, 0.25]
    [curve] = found["DEFINE_CURVE"]
    assert curve["Card 2"]["O1"].tolist() == curve["Card 2"]["A1"].tolist() == [0, 1]


def test_a_reader_of_febio_finds_mesh_sets_and_loads(tmp_path) -> None:
    reader = pytest.importorskip("febio_python.feb")
    model = reader.Feb(filepath=with_problem("febio", tmp_path, PULL))
    np.testing.assert_allclose(model.get_nodes()[0].coordinates, BOX.vertices)
    np.testing.assert_array_equal(model.get_volume_elements()[0].connectivity, BOX.hexes)
    sets = {each.name: np.sort(each.ids) for each in model.get_nodesets()}
    for name, quads in boundary_sets(BOX).items():
        np.testing.assert_array_equal(sets[name], np.unique(BOX.quads[quads]))
    assert float(model.get_materials()[0].parameters["E"]) == 210000
    [domain] = model.get_mesh_domains()
    assert (domain.name, domain.mat) == ("cell_0", "material")
    held = [(each.node_set, each.dof) for each in model.get_boundary_conditions()]
    free = dict.fromkeys(("x_dof", "y_dof", "z_dof"), "0")
    assert held == [("x_min", free | {f"{axis}_dof": "1"}) for axis in "xyz"]
    [pressure] = model.get_pressure_loads()
    assert (pressure.surface, pressure.multiplier) == ("z_max", 2)
