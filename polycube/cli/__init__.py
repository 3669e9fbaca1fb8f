"""The commands: Hydra and Lightning live here and nowhere else."""

from polycube.cli.blas import on_one_thread
from polycube.cli.pipe import to_a_reader

on_one_thread()


def train_command() -> None:
    """`polycube-train`, `python train.py`."""
    from polycube.cli.train import main

    with to_a_reader():
        main()


def infer_command() -> None:
    """`polycube-infer`, `python infer.py`."""
    from polycube.cli.infer import main

    with to_a_reader():
        main()


def evaluate_command() -> None:
    """`polycube-evaluate`, `python -m polycube.evaluate`."""
    from polycube.cli.evaluate import main

    with to_a_reader():
        main()
