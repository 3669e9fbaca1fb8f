"""The commands of the program, with Hydra and Lightning."""

import atexit
import gc
import os
import sys
from functools import partial
from importlib import import_module

from polycube.cli.terminal import ending_with_reader

# The OpenBLAS in the wheels of numpy and scipy reads this when it is loaded.  Its threads wait for
# each other in busy loops: on two busy cores, the fit of a spline took four times as long with two
# threads as with one.  With one, sums do not depend on the number of cores either.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def desk_command() -> None:
    """`polycube-desk`, `python -m polycube.desk`."""
    from polycube.cli.desk import main

    with ending_with_reader():
        main()


def _run(name: str) -> None:
    """Show the help of a program, or import the program and run it."""
    # Imports and the configuration make many objects and little garbage, and the collector would
    # search them repeatedly. `command.run_hydra` turns it on for the work itself.
    gc.disable()
    atexit.register(gc.freeze)
    from polycube.cli import help
    from polycube.cli.command import refusing

    with ending_with_reader(), refusing():
        if not help.shown(name, sys.argv[1:]):
            import_module(f"polycube.cli.{name}").main()


train_command = partial(_run, "train")  # `polycube-train`, `python train.py`
infer_command = partial(_run, "infer")  # `polycube-infer`, `python infer.py`
evaluate_command = partial(_run, "evaluate")  # `polycube-evaluate`, `python -m polycube.evaluate`
