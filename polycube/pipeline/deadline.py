"""End meshing early, with the best valid mesh so far: when time is up, or when a user says so.

Nothing here touches the process: the deadline is looked at after each stage and at each step of a
descent, on whatever thread the run is.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.numerics.lbfgs import watched
from polycube.pipeline.state import RunState

logger = logging.getLogger(__name__)

N_COMPARED = 5  # meshes of the largest scaled Jacobians, which then are judged


class TimeIsUp(BaseException):
    """The time for meshing is over, and there is a valid mesh."""


@dataclass
class Deadline:
    """When meshing ends, and every valid mesh until then.

    Parameters
    ----------
    seconds : for meshing; None for no limit
    interrupt : set by another thread or by a signal handler to end the run
    """

    seconds: float | None = None
    interrupt: threading.Event = field(default_factory=threading.Event)
    _end: float = float("inf")
    _valid: list[tuple[bool, float, RunState]] = field(default_factory=list)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Count the seconds, and look at the deadline at each step of a descent inside."""
        if self.seconds is not None:
            self._end = time.monotonic() + self.seconds
        try:
            with watched(self.check):
                yield
        finally:
            self._end = float("inf")

    def note(self, state: RunState, is_fitted: bool = True) -> None:
        """Keep a state whose hexes are valid.

        Parameters
        ----------
        is_fitted : the hexes lie on the surface; such a mesh is better than any other
        """
        if state.hexes is None:
            return
        worst = float(scaled_jacobian(state.hexes.vertices, state.hexes.hexes).min())
        if worst > 0:
            self._valid.append((is_fitted, worst, state))
            best = max(self._valid, key=lambda each: each[:2])[1]
            logger.debug("best scaled Jacobian so far: %.3f", best, extra={"best": best})

    def check(self) -> None:
        """Raise KeyboardInterrupt where a user ended the run, TimeIsUp where time is up.

        Time is not up before there is a valid mesh.
        """
        if self.interrupt.is_set():
            raise KeyboardInterrupt
        if self._valid and time.monotonic() >= self._end:
            raise TimeIsUp

    def best(self, key: Callable[[RunState], tuple[float, ...]]) -> RunState | None:
        """The best valid state, by a key of the few with the largest scaled Jacobians."""
        first = sorted(self._valid, key=lambda each: each[:2], reverse=True)[:N_COMPARED]
        return max((state for *_, state in first), key=key, default=None)
