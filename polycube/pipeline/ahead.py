"""Results made before they are asked for, on threads beside the one that decides.

The thread that decides takes the same steps in the same order wherever it runs: what another has
made already, or is making, it finds in the memo instead of making it.  So nothing that is decided
depends on the number of cores or on who was faster.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Hashable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext, suppress
from contextvars import ContextVar
from threading import Event, Lock

from polycube.numerics.lbfgs import Stopped, stoppable
from polycube.numerics.threads import busy, cores

SWITCH = 5e-4  # seconds after which a thread that holds Python's lock gives it to one that waits

Records = list[logging.LogRecord]
_HELD: ContextVar[Records | None] = ContextVar("held", default=None)


class Memo:
    """Results by key: each is made once, by the first thread that asks; others wait for it.

    With each comes what was logged meanwhile, where that was held back.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._made: dict[Hashable, Future] = {}

    def get(self, key: Hashable, make: Callable[[], object]) -> tuple[object, Records]:
        """What `make` returned to the first who asked; made again where that one was stopped."""
        while True:
            with self._lock:
                is_mine = key not in self._made
                future = self._made.setdefault(key, Future())
            if is_mine:
                return self._fill(key, future, make)
            try:
                return future.result()
            except Stopped:
                continue

    def _fill(
        self, key: Hashable, future: Future, make: Callable[[], object]
    ) -> tuple[object, Records]:
        try:
            with nullcontext([]) if _HELD.get() is None else held() as records:
                made = make(), records
        except BaseException as error:
            with self._lock:
                del self._made[key]
            future.set_exception(error)
            raise
        future.set_result(made)
        return made


class Ahead:
    """Threads for jobs that fill a memo; none where the process may use one core only.

    Leaving the context stops them.
    """

    def __init__(self) -> None:
        number = cores() - 1
        self._workers = ThreadPoolExecutor(number) if number else None
        self._stop = Event()
        self._before = sys.getswitchinterval()

    def __enter__(self) -> Ahead:
        sys.setswitchinterval(min(SWITCH, self._before))
        return self

    def __exit__(self, *_: object) -> None:
        sys.setswitchinterval(self._before)
        self.drop()
        if self._workers is not None:
            self._workers.shutdown(wait=False, cancel_futures=True)

    def begin(self, jobs: Iterable[Callable[[], object]]) -> None:
        """Do these jobs in order, after those begun before; what they log is held back.

        Where there are no threads the jobs are not even looked at.
        """
        if self._workers is not None:
            for job in jobs:
                self._workers.submit(self._do, job, self._stop)

    def drop(self) -> None:
        """Forget the jobs that wait and stop those that run, at their next step of descent."""
        self._stop.set()
        self._stop = Event()

    @staticmethod
    def _do(job: Callable[[], object], stop: Event) -> None:
        if not stop.is_set():
            with busy(), stoppable(stop), held(), suppress(Stopped):
                job()


@contextmanager
def held() -> Iterator[Records]:
    """Keep back what this thread logs, for `replay`; inside another, the inner one keeps it."""
    records: Records = []
    token = _HELD.set(records)
    try:
        yield records
    finally:
        _HELD.reset(token)


@contextmanager
def holding() -> Iterator[None]:
    """Let `held` work on the handlers of the log."""
    handlers = {*logging.getLogger().handlers, *logging.getLogger("polycube").handlers}
    for handler in handlers:
        handler.addFilter(_passes)
    try:
        yield
    finally:
        for handler in handlers:
            handler.removeFilter(_passes)


def replay(records: Records) -> None:
    """Log what was kept back."""
    for record in records:
        logging.getLogger(record.name).handle(record)


def _passes(record: logging.LogRecord) -> bool:
    kept = _HELD.get()
    if kept is None:
        return True
    if not kept or kept[-1] is not record:  # each handler asks
        kept.append(record)
    return False
