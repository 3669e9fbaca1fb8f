"""The loop of a search: make the moves of a policy, until there is none or the time is over."""

import logging
import time
from collections.abc import Iterator
from functools import partial

from polycube.errors import MeshingError, PolycubeError
from polycube.kinds import Expected, Policy
from polycube.numerics.lbfgs import counted
from polycube.search.chain import NOT_FITTED, TimeIsUp
from polycube.search.history import History, Move, Tried
from polycube.search.moves import possible

logger = logging.getLogger(__name__)

SECOND = 4e6  # evaluated coordinates that take about a second on one core


def search(history: History, policy: Policy) -> str | None:
    """Make moves; the best mesh is `history.leader`.

    Returns the reason why the search was ended early: "time", "user" or None.
    """
    try:
        with history.task.chain.deadline.running():
            for move, expected in moves_of(policy, history):
                make(history, move, expected)
    except (TimeIsUp, KeyboardInterrupt) as end:
        take_unfinished(history)
        return "time" if isinstance(end, TimeIsUp) else "user"
    return None


def moves_of(policy: Policy, history: History) -> Iterator[tuple[Move, Expected]]:
    """The moves of a policy; they end with a warning if it raises an exception after a mesh.

    Raises MeshingError if the policy raises an exception before there is a mesh.
    """
    try:
        yield from policy(history, partial(possible, history))
    except PolycubeError:
        raise
    except Exception as bug:
        error = MeshingError(f"policy {type(policy).__name__} failed: {type(bug).__name__}: {bug}")
        if history.leader is None:
            raise error from bug
        logger.warning("warning: %s; the best mesh until then is the result", error)


def make(history: History, move: Move, expected: Expected) -> None:
    """Make a move, log it, and append it to the table."""
    name, before, begin = move.describe(history), history.shortfall, time.perf_counter()
    logger.debug("%s: expected gain %.3f for %.1f", name, *expected)
    history.moves.append(move)
    history.task.chain.latest = None
    with counted() as effort:
        try:
            outcome = move(history)
            mesh = outcome.state.hexes if outcome else None
            hexes = len(mesh.hexes) if mesh else 0
            result = str(outcome.verdict) if outcome else "no mesh"
        except MeshingError as error:
            history.errors.append(error)
            hexes, result = 0, str(error)
    history.task.chain.latest = None  # the move is finished
    gain, work = before - history.shortfall, effort["work"] / SECOND
    row = Tried(name, expected, gain, work, time.perf_counter() - begin, result, hexes)
    history.table.append(row)
    best = {"best": history.leader.jacobian} if history.leader else {}  # for the progress line
    logger.info("%s: %s; gain %.3f for %.1f", name, result, gain, work, extra=best)
    history.task.chain.deadline.check()


def take_unfinished(history: History) -> None:
    """Add the mesh of the move that was ended, as far as it came, to the outcomes."""
    latest = history.task.chain.latest
    if latest is None or latest.hexes is None:
        return
    if latest.unfitted == NOT_FITTED and history.leader is not None:
        return
    history.add(history.moves[-1], latest, {}, {})
