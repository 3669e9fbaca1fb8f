"""Every violated requirement of an estimate or a policy is reported."""

from collections.abc import Callable, Iterator
from itertools import count

import numpy as np
import pytest

from polycube.kinds import Expected
from polycube.search.moves import MeshStructure
from polycube.testing import check
from tests.testing.broken import assert_refused, broken

NUMBERS = count()


@pytest.mark.parametrize(
    ("estimate", "message"),
    [
        (lambda move, history: (1.0, 1.0), "is an Expected; got tuple"),
        (lambda move, history: Expected(-1.0, 1.0), "is 0 or more; got -1"),
        (lambda move, history: Expected(np.inf, 1.0), "is 0 or more; got inf"),
        (lambda move, history: Expected(1.0, 0.0), "is positive; got 0"),
        (lambda move, history: Expected(0.0, 1.0), "something is expected of a move"),
        (lambda move, history: Expected(1.0, 1.0 + next(NUMBERS)), "the same is expected"),
    ],
)
def test_estimate(estimate: Callable, message: str) -> None:
    assert_refused("estimate", estimate, message)


def test_a_constant_estimate_conforms() -> None:
    check("estimate", broken(lambda move, history: Expected(1.0, 1.0)))


def in_order(history, possible) -> Iterator[tuple[object, Expected]]:
    """The first possible move, until the goal is met."""
    while history.shortfall > 0 and (moves := possible()):
        yield moves[0], Expected(1.0, 1.0)


def test_a_policy_of_one_rule_conforms() -> None:
    check("policy", broken(in_order))


def test_policy() -> None:
    def restless(history, possible):
        while moves := possible():
            yield moves[0], Expected(1.0, 1.0)

    def first_again(history, possible):
        [move] = possible()
        for _ in range(2):
            yield move, Expected(1.0, 1.0)

    def impossible(history, possible):
        yield MeshStructure(3, 0), Expected(1.0, 1.0)

    def hasty(history, possible):
        for move, expected in in_order(history, possible):
            history.moves.append(move)
            yield move, expected

    def bare(history, possible):
        yield from ((move, 1.0) for move, _ in in_order(history, possible))

    def stubborn(history, possible):
        yield from in_order(history, possible)
        if not possible():
            yield MeshStructure(0, 0), Expected(1.0, 1.0)

    assert_refused("policy", restless, "no move follows when the goal is met")
    assert_refused("policy", first_again, "is possible, and was not made before; got Propose")
    assert_refused("policy", impossible, r"is possible, .*; got MeshStructure\(structure=3")
    assert_refused("policy", hasty, "makes no move itself")
    assert_refused("policy", bare, "is an Expected; got float")
    assert_refused("policy", lambda history, possible: iter(()), "the block is meshed")
    assert_refused("policy", stubborn, "no move if none is possible")
