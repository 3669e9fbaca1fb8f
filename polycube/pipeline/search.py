"""Search: mesh the best structures in a few variants, and return the best mesh.

The first variant of the best structure is run in full. If its mesh is not good, every variant has a
short run (with the options of `trial`), and the best short run is repeated in full; the second best
too if that mesh has a deficiency. Another structure is continued only if the short run of its first
variant is better than every earlier mesh. If no mesh is acceptable in the end, all variants of
every structure have a short run. A short run that is better than a first structure without short
runs is repeated in full. `Acceptance` decides which meshes are good and which are better.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from polycube.pipeline.variants import WORST, Variants

REPEATED = 2  # largest number of short runs that are repeated in full


def search(
    starts: Iterable[Variants],
    is_settled: Callable[[Variants], bool],
    has_rival: bool = False,
    improve: Callable[[Variants], object] = lambda first: None,
) -> Variants:
    """Find the structure with the best mesh.

    Parameters
    ----------
    starts : one for each structure, the most promising first
    is_settled : whether the mesh of a structure makes others unnecessary
    has_rival : compare the second structure before the other variants of the first
    improve : called after the first run; it may run more

    Raises
    ------
    MeshingError
        The error of the first run, if all have failed.
    """
    tried: list[Variants] = []
    for start in starts:
        reached = max((each.best for each in tried), default=WORST)
        if not tried:
            start.run(0)
            improve(start)
        elif start.run(0, short=True) is None or start.best <= reached:
            tried.append(start)
            if is_settled(_leader(tried)):
                break
            continue
        tried.append(start)
        if len(tried) > 1 or not has_rival:
            start.run_others()
        if is_settled(start):
            break
    leader = _leader(tried)
    leader.run_others()
    if leader.reaches < leader.acceptance.acceptable:
        for start in tried:
            start.run_others()
    short = leader.best_short()
    beats_full = not tried[0].trial and short is not None and short[0] == leader.best
    required = np.inf if beats_full else leader.acceptance.good
    lost_limit = np.inf  # features that a short run may lose to be repeated in full
    for _ in range(REPEATED):
        shorts = [(best, start) for start in tried if (best := start.best_short())]
        if not shorts or _leader(tried).reaches >= required:
            break
        (_, number), start = max(shorts, key=lambda each: each[0][0])
        if start.attempts[number, True].verdict.lost > lost_limit:
            break
        start.run(number)
        required = -np.finfo(float).max  # another one only if there is a deficiency
        lost_limit = _leader(tried).taken().verdict.lost
    found = _leader(tried)
    return found if found.attempts else tried[0]


def compare(found: Variants, other: Variants) -> Variants:
    """Of the best structure so far and another one, the one with the better mesh.

    All variants of the other structure are tried if the mesh so far is not excellent.
    """
    other.run(0)
    if found.reaches < found.acceptance.excellent:
        other.run_others()
    return _leader([found, other])


def _leader(tried: Sequence[Variants]) -> Variants:
    return max(tried, key=lambda each: each.best)
