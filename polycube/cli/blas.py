"""Number of threads for the dense products of numpy and scipy.

The OpenBLAS in each of their wheels reads the environment when it is loaded. Its threads wait for
each other in busy loops: on two busy cores, the fit of a spline took four times as long with two
threads as with one, and a Cholesky factor three to eight times as long.
"""

from __future__ import annotations

import os

NAME = "OPENBLAS_NUM_THREADS"


def on_one_thread() -> None:
    """Limit the libraries loaded from now on to one thread, unless the environment sets a number.

    Sums then do not depend on the number of cores.
    """
    os.environ.setdefault(NAME, "1")
