"""The commands: Hydra and Lightning live here and nowhere else."""

from polycube.app.blas import on_one_thread
from polycube.app.pipe import to_a_reader

on_one_thread()


def train_command() -> None:
    """`polycube-train`, `python train.py`."""
    from polycube.app.train import main

    with to_a_reader():
        main()


def infer_command() -> None:
    """`polycube-infer`, `python infer.py`."""
    from polycube.app.infer import main

    with to_a_reader():
        main()


def evaluate_command() -> None:
    """`polycube-evaluate`, `python -m polycube.evaluate`."""
    from polycube.app.evaluate import main

    with to_a_reader():
        main()
