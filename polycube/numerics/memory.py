"""Estimate the memory of the largest stage, the analysis, before it begins."""

import logging
import re
from contextlib import suppress
from pathlib import Path

logger = logging.getLogger(__name__)

EACH = 70e3  # bytes for each function: 63 to 73 kB for 50,000 to 155,000 functions of the space h2s
# factored as a whole: 89 to 200 kB each for 7,000 to 50,000 functions
FACTORED, POWER = 2550.0, 1.4  # bytes = FACTORED * functions**POWER
MEMINFO = Path("/proc/meminfo")
GROUP = Path("/sys/fs/cgroup")  # limits of a container


def needed(functions: int, is_factored: bool = False) -> float:
    """Bytes that an analysis with this number of functions needs, from measurements.

    is_factored : whether the stiffness is factored as a whole, instead of preconditioned
    """
    return FACTORED * functions**POWER if is_factored else EACH * functions


def available() -> float | None:
    """Bytes that this process can still allocate; None if the system does not say."""
    found = []
    with suppress(OSError):
        if free := re.search(r"MemAvailable:\s+(\d+) kB", MEMINFO.read_text()):
            found.append(1024.0 * int(free[1]))
    with suppress(OSError):
        limit = (GROUP / "memory.max").read_text().strip()
        used = int((GROUP / "memory.current").read_text())
        if limit != "max":
            found.append(float(max(int(limit) - used, 0)))
    return min(found, default=None)


def warn(functions: int, is_factored: bool = False) -> None:
    """Log a warning if the analysis may need more memory than is available; see `needed`."""
    free, wanted = available(), needed(functions, is_factored)
    if free is None or wanted <= free:
        return
    needs = f"about {wanted / 1e9:.2g} GB of memory, and {free / 1e9:.2g} GB are available"
    message = "warning: the analysis of %d functions needs %s; a larger meshing.size needs less"
    logger.warning(message, functions, needs)
