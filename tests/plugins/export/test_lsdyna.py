"""LS-DYNA keywords, read by columns."""

import re

import numpy as np

from tests.fixtures.exports import export, fields, nodes_of


def test_lsdyna_columns(mesh, tmp_path):
    """Read by the widths of the manual: 8 for numbers, 16 for coordinates, 10 in a set."""
    text = export(mesh, tmp_path, "lsdyna").read_text()
    blocks = re.split(r"^\*(\w+)\n", text, flags=re.MULTILINE)
    found = list(zip(blocks[1::2], blocks[2::2], strict=True))

    def columns(block: str, *widths: int) -> np.ndarray:
        return np.array([list(map(float, fields(line, *widths))) for line in block.splitlines()])

    nodes = columns(dict(found)["NODE"], 8, 16, 16, 16)
    np.testing.assert_allclose(nodes[:, 1:], mesh.vertices, rtol=1e-9)
    elements = columns(dict(found)["ELEMENT_SOLID"], *10 * [8])
    np.testing.assert_array_equal(elements[:, 2:], mesh.hexes + 1)
    np.testing.assert_array_equal(elements[:, 1], mesh.cell + 1)
    sets: dict[tuple[str, str], str] = {}
    for keyword, block in found:
        if keyword.startswith("SET_"):
            title, number, rows = block.split("\n", 2)
            assert len(number) == 10 and int(number) > 0
            sets[keyword, title] = rows
    for name, quads in mesh.sets.items():
        segments = columns(sets["SET_SEGMENT_TITLE", name], *4 * [10]) - 1
        np.testing.assert_array_equal(segments, mesh.quads[quads])
        own = [int(n) - 1 for n in sets["SET_NODE_LIST_TITLE", name].split()]
        assert own == nodes_of(mesh, name)
    for cell, name in enumerate(mesh.primitives):
        assert sets["SET_PART_LIST_TITLE", f"primitive_{name}"].split() == [str(cell + 1)]
        assert f"$ part {cell + 1}: cell_{cell}_{name}\n" in text
    assert text.startswith("*KEYWORD\n") and text.endswith("*END\n")
    assert max(map(len, text.splitlines())) <= 80
