"""Stop a run early, by Ctrl-C, SIGTERM or when its time is up, with the best valid mesh so far.

A signal raises where the main thread is.  Compiled code may turn that into a SystemError, which a
stage reports as its failure; so what was asked is remembered, and looked at after each stage.
"""

from __future__ import annotations

import logging
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from polycube.hexmesh.quality import scaled_jacobian
from polycube.kinds import KINDS
from polycube.pipeline.stages import Clock, Made, State
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

INTERRUPTED = 130  # exit code, as shells say it
FIRST = "meshing/subdivide"  # its hexes are good, and not yet on the surface
N_COMPARED = 5  # meshes of the largest scaled Jacobians, which then are scored


class TimeIsUp(KeyboardInterrupt):
    """The time for meshing is over, and there is a valid mesh."""


@dataclass
class Watch(Clock):
    """A clock that keeps every valid mesh it sees, in the state that it belongs to.

    state : what the stages start from; see `on`
    kept : of each valid mesh, of all that share this list: whether it is fitted to the surface,
        its smallest scaled Jacobian, its state
    """

    state: State = field(default_factory=dict)
    kept: list[tuple[bool, float, State]] = field(default_factory=list)
    end: list[float] = field(default_factory=list)  # monotonic time when time is up, if ever
    asked: threading.Event = field(default_factory=threading.Event)  # to stop, see `terminable`

    def on(self, state: State) -> Watch:
        """The same clock, for stages that start from this state."""
        return replace(self, state=dict(state))

    def take(self, name: str, made: Made, waited: float) -> object:
        """As a clock does; raises KeyboardInterrupt instead where it is time to stop."""
        try:
            value = super().take(name, made, waited)
            if name in KINDS and KINDS[name].gives:
                self.state[KINDS[name].gives] = value
            if isinstance(value, HexMesh):
                self.keep(value, name != FIRST)
        finally:
            self.check()
        return value

    def keep(self, mesh: HexMesh, is_fitted: bool = True) -> None:
        """Note a mesh that belongs to the state, if it is valid."""
        worst = float(scaled_jacobian(mesh.vertices, mesh.hexes).min())
        if worst > 0:
            self.kept.append((is_fitted, worst, dict(self.state)))
            best = max(self.kept, key=lambda each: each[:2])[1]
            logger.debug("best scaled Jacobian so far: %.3f", best, extra={"best": best})

    def check(self) -> None:
        """Raise KeyboardInterrupt where that was asked, TimeIsUp where a valid mesh is there."""
        if self.asked.is_set():
            raise KeyboardInterrupt
        if self.kept and any(time.monotonic() >= end for end in self.end):
            raise TimeIsUp

    def best(self, score: Callable[[State], float]) -> State | None:
        """State with the best valid mesh so far; None where there is none."""
        first = sorted(self.kept, key=lambda each: each[:2], reverse=True)[:N_COMPARED]
        return max((state for *_, state in first), key=score, default=None)

    @contextmanager
    def limited(self, seconds: float | None) -> Iterator[None]:
        """Raise TimeIsUp inside after so many seconds, or when the first valid mesh is there.

        On the main thread even in the middle of a stage, on others between stages.
        """
        if seconds is not None:
            self.end.append(time.monotonic() + seconds)
        with _handled(signal.SIGALRM, lambda *_: self.check()) as can_wake:
            if can_wake:
                signal.setitimer(signal.ITIMER_REAL, seconds or 0)
            try:
                yield
            except SystemError:
                self.check()
                raise
            finally:
                self.end.clear()
                if can_wake:
                    signal.setitimer(signal.ITIMER_REAL, 0)


@contextmanager
def terminable() -> Iterator[threading.Event]:
    """SIGTERM is like Ctrl-C inside: KeyboardInterrupt, and again for each further signal.

    Yields what is set when there was one.  Where Ctrl-C was ignored before, as in the background of
    a shell script, it stays so.
    """
    asked = threading.Event()

    def stop(*_: object) -> None:
        asked.set()
        raise KeyboardInterrupt

    is_heard = signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
    with (
        _handled(signal.SIGTERM, stop),
        _handled(signal.SIGINT, stop if is_heard else signal.SIG_IGN),
    ):
        try:
            yield asked
        except SystemError as error:
            if asked.is_set():
                raise KeyboardInterrupt from error
            raise


@contextmanager
def _handled(number: int, handler: Callable) -> Iterator[bool]:
    """A signal is handled so inside; yields False, and does nothing, beside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield False
        return
    before = signal.signal(number, handler)
    try:
        yield True
    finally:
        signal.signal(number, before)
