"""The time limit of a run, and the request of a user to end it.

The state of the process is not changed: the deadline is checked after each stage and at each step
of a descent, on the thread of the run.
"""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from polycube.numerics.lbfgs import interruptible

RESERVE = 0.1  # share of the time that is kept for the files and the report
LEAST_RESERVE = 2.0  # seconds


class TimeIsUp(BaseException):
    """The time of the run is over."""


@dataclass
class Deadline:
    """The end of the time in which a run reads, proposes and meshes.

    Parameters
    ----------
    seconds : time of the whole run, from the creation of this object; None for no limit
    interrupt : set by another thread or by a signal handler to end the run
    """

    seconds: float | None = None
    interrupt: threading.Event = field(default_factory=threading.Event)
    _end: float = field(init=False, default=float("inf"))

    def __post_init__(self) -> None:
        if self.seconds is not None:
            reserve = min(max(RESERVE * self.seconds, LEAST_RESERVE), self.seconds / 2)
            self._end = time.monotonic() + self.seconds - reserve

    @property
    def is_over(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() >= self._end

    @contextmanager
    def running(self) -> Iterator[None]:
        """Check the deadline at each step of a descent in the context."""
        with interruptible(self.check):
            yield

    def check(self) -> None:
        """Raise KeyboardInterrupt if the user ended the run, TimeIsUp at the time limit."""
        if self.interrupt.is_set():
            raise KeyboardInterrupt
        if self.is_over:
            raise TimeIsUp
