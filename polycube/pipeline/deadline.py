"""End meshing early with the best valid mesh, at a time limit or on request.

The state of the process is not changed: the deadline is checked after each stage and at each step
of a descent, on the thread of the run.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.numerics.lbfgs import interruptible
from polycube.pipeline.state import RunState

logger = logging.getLogger(__name__)

N_COMPARED = 5  # number of meshes with the largest scaled Jacobians that are compared


class TimeIsUp(BaseException):
    """The time for meshing is over, and there is a valid mesh."""


@dataclass
class Deadline:
    """Deadline of meshing, and the valid meshes until then.

    Parameters
    ----------
    seconds : time for meshing; None for no limit
    interrupt : set by another thread or by a signal handler to end the run
    """

    seconds: float | None = None
    interrupt: threading.Event = field(default_factory=threading.Event)
    _end: float = float("inf")
    _valid: list[tuple[bool, float, RunState]] = field(default_factory=list)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Measure the time, and check the deadline at each step of a descent in the context."""
        if self.seconds is not None:
            self._end = time.monotonic() + self.seconds
        try:
            with interruptible(self.check):
                yield
        finally:
            self._end = float("inf")

    def note(self, state: RunState, is_fitted: bool = True) -> None:
        """Store a state with valid hexes.

        Parameters
        ----------
        is_fitted : whether the hexes are fitted to the surface; such a mesh is better than any
            other
        """
        if state.hexes is None:
            return
        worst = float(scaled_jacobian(state.hexes.vertices, state.hexes.hexes).min())
        if worst > 0:
            self._valid.append((is_fitted, worst, state))
            best = max(self._valid, key=lambda each: each[:2])[1]
            logger.debug("best scaled Jacobian so far: %.3f", best, extra={"best": best})

    def check(self) -> None:
        """Raise KeyboardInterrupt if the user ended the run, TimeIsUp at the time limit.

        TimeIsUp is not raised before there is a valid mesh.
        """
        if self.interrupt.is_set():
            raise KeyboardInterrupt
        if self._valid and time.monotonic() >= self._end:
            raise TimeIsUp

    def best(self, key: Callable[[RunState], tuple[float, ...]]) -> RunState | None:
        """The best valid state by a key, among the few with the largest scaled Jacobians."""
        first = sorted(self._valid, key=lambda each: each[:2], reverse=True)[:N_COMPARED]
        return max((state for *_, state in first), key=key, default=None)
