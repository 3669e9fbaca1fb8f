"""What `files.*` chooses: by the size of the spline, or as it is requested."""

import pytest

from polycube.errors import InputError
from polycube.pipeline.settings import LARGE, Files


@pytest.mark.parametrize(
    ("bext", "small", "large"),
    [("auto", (1, 2), (2,)), ("both", (1, 2), (1, 2)), (1, (1,), (1,)), ("2", (2,), (2,))],
)
def test_versions_of_bext(bext, small, large):
    files = Files(bext=bext)
    assert (files.bext_versions(LARGE), files.bext_versions(LARGE + 1)) == (small, large)


@pytest.mark.parametrize(
    ("cells", "small", "large"),
    [("auto", True, False), ("lagrange", True, True), ("corners", False, False)],
)
def test_cells_of_a_solution(cells, small, large):
    files = Files(cells=cells)
    assert (files.has_curved_cells(LARGE), files.has_curved_cells(LARGE + 1)) == (small, large)


@pytest.mark.parametrize(
    ("name", "value"), [("bext", 3), ("bext", True), ("cells", "hexes"), ("precision", None)]
)
def test_other_values_are_refused(name, value):
    with pytest.raises(InputError, match=rf"files\.{name} must be one of .*; got {value!r}"):
        Files(**{name: value})
