"""End a run with the best mesh so far after Ctrl-C or SIGTERM.

A signal raises an exception in the main thread. Compiled code may convert it to a SystemError,
which a stage reports as its failure, so the signal is also stored and checked by the deadline.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

INTERRUPTED = 130  # exit code, as in shells


@contextmanager
def terminable() -> Iterator[threading.Event]:
    """In the context, SIGTERM acts like Ctrl-C: KeyboardInterrupt for each signal.

    Yields the event that a signal sets. If Ctrl-C was ignored before, as in the background of a
    shell script, it stays ignored.
    """
    interrupted = threading.Event()

    def stop(*_: object) -> None:
        interrupted.set()
        raise KeyboardInterrupt

    on_interrupt = signal.SIG_IGN if signal.getsignal(signal.SIGINT) is signal.SIG_IGN else stop
    with _handled(signal.SIGTERM, stop), _handled(signal.SIGINT, on_interrupt):
        try:
            yield interrupted
        except SystemError as error:
            if interrupted.is_set():
                raise KeyboardInterrupt from error
            raise


@contextmanager
def _handled(number: int, handler: Callable[..., None] | signal.Handlers) -> Iterator[None]:
    """Install a handler of a signal in the context; nothing is done outside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(number, handler)
    try:
        yield
    finally:
        signal.signal(number, before)
