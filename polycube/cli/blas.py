"""How many threads the dense products of numpy and scipy run on.

The OpenBLAS in each of their wheels asks the environment when it is loaded.  Its threads wait for
each other in loops: on two busy cores, the fit of a spline took four times as long on two threads
as on one, and a Cholesky factor three to eight times.
"""

from __future__ import annotations

import os

NAME = "OPENBLAS_NUM_THREADS"


def on_one_thread() -> None:
    """Let what is loaded from now on have one thread, unless the environment says otherwise.

    Sums then do not depend on the number of cores.
    """
    os.environ.setdefault(NAME, "1")
