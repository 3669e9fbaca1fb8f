"""Ctrl-C and SIGTERM end a run with the best mesh so far.

A signal raises where the main thread is.  Compiled code may turn that into a SystemError, which a
stage reports as its failure; so the signal is also remembered, for the deadline to look at.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

INTERRUPTED = 130  # exit code, as shells say it


@contextmanager
def terminable() -> Iterator[threading.Event]:
    """SIGTERM is like Ctrl-C inside: KeyboardInterrupt, and again for each further signal.

    Yields the event that a signal sets.  Where Ctrl-C was ignored before, as in the background of
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
def _handled(number: int, handler: Callable[..., None] | signal.Handlers) -> Iterator[None]:
    """A signal is handled so inside; nothing is done beside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(number, handler)
    try:
        yield
    finally:
        signal.signal(number, before)
