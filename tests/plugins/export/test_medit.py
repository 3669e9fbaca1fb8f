"""Medit: references and their legend."""

import re

import numpy as np

from tests.fixtures.exports import export, read


def test_medit_references_and_their_legend(mesh, tmp_path):
    path = export(mesh, tmp_path, "medit")
    found = read(path)
    references = found.cell_data_dict["medit:ref"]
    np.testing.assert_array_equal(references["hexahedron"], mesh.cell)
    np.testing.assert_array_equal(references["quad"], mesh.patch)
    np.testing.assert_array_equal(found.cells_dict["quad"], mesh.quads)
    legend = path.read_text().split("End\n")[1]
    for name, quads in mesh.sets.items():
        what, *own = re.search(rf"# {name}: quadrilaterals with (.*)\n", legend)[1].split()
        chosen = references["quad"] if what == "references" else 1 + np.arange(len(mesh.quads))
        assert np.flatnonzero(np.isin(chosen, np.array(own, int))).tolist() == sorted(quads)
    assert "# cell_1_cube: hexahedra with reference 1\n" in legend
