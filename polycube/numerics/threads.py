"""Compiled kernels that hold no lock, on a few threads at once.

What is computed never depends on how many there are: work is cut by its size alone, and results
come back in its order.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise
from typing import TypeVar

MOST = 4  # threads of the pool

Result = TypeVar("Result")


def side_by_side(calls: Sequence[Callable[[], Result]]) -> list[Result]:
    """Results of the calls, in order; the first runs on this thread, which then takes the last
    ones that no other has begun.

    A call must not use this function itself: it would wait for a thread that waits.
    """
    workers = pool()
    if workers is None or len(calls) == 1:
        return [call() for call in calls]
    others = [workers.submit(call) for call in calls[1:]]
    found = {0: calls[0]()}
    for number in reversed(range(1, len(calls))):
        if others[number - 1].cancel():
            found[number] = calls[number]()
    return [found[k] if k in found else others[k - 1].result() for k in range(len(calls))]


def parts(number: int, least: int) -> list[slice]:
    """Up to `MOST` even slices of so many items, of at least so many each where there are two."""
    count = max(1, min(MOST, number // least))
    ends = [number * k // count for k in range(count + 1)]
    return [slice(a, b) for a, b in pairwise(ends)]


def cores() -> int:
    """Number of cores that are worth using: up to `MOST` of those the process may use."""
    number = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return min(number or 1, MOST)


@lru_cache(maxsize=1)
def pool() -> ThreadPoolExecutor | None:
    """Threads beside the one that asks; none where the process may use one core only."""
    return ThreadPoolExecutor(cores() - 1) if cores() > 1 else None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=pool.cache_clear)  # threads do not survive a fork
