"""The chain of stages is checked before anything is computed."""

import pytest

from polycube.errors import InputError
from polycube.kinds import KINDS
from polycube.stages import check_chain

START = ("surface", "candidates")


def test_the_natural_order_of_meshing_is_a_chain() -> None:
    order = [kind for kind in KINDS if kind.startswith("meshing/")] + ["spline", "analysis"]
    check_chain(order, ("surface", "polycube", "parametrization", "rough_map", "blocks"))


def test_a_stage_out_of_order_names_what_to_put_before_it() -> None:
    with pytest.raises(
        InputError, match="'meshing/smooth' needs hexes, which no earlier stage"
    ) as e:
        check_chain(["meshing/smooth", "meshing/subdivide"], ("surface", "polycube", "rough_map"))
    assert str(e.value).endswith("put meshing/subdivide before it")


def test_a_missing_input_that_no_stage_makes_has_no_hint() -> None:
    with pytest.raises(InputError, match=r"needs surface, which no earlier stage makes$"):
        check_chain(["spline"], ("hexes",))


@pytest.mark.parametrize("name", ["meshing/smoth", "schedule"])
def test_what_is_no_stage_is_refused_with_the_stages(name: str) -> None:
    with pytest.raises(
        InputError, match=f"'{name}' is not a stage; the stages are meshing/segment, "
    ):
        check_chain([name], START)


def test_every_stage_kind_takes_and_gives() -> None:
    for name, kind in KINDS.items():
        assert bool(kind.takes) == bool(kind.gives), name


def test_a_stage_whose_output_nobody_takes_is_refused() -> None:
    have = ("surface", "polycube", "parametrization", "rough_map", "blocks")
    order = ["meshing/segment", "meshing/subdivide", "spline"]
    with pytest.raises(InputError, match="'meshing/segment' makes labels, which no later stage"):
        check_chain(order, have)
    check_chain(["meshing/segment", "meshing/map", "meshing/subdivide", "spline"], have)


def test_a_kind_says_in_one_line_what_it_is() -> None:
    for name, kind in KINDS.items():
        does = (kind.protocol.__doc__ or "").partition("\n")[0]
        assert does.rstrip(".") and does.endswith("."), name
