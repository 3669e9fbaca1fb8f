"""The commands: Hydra and Lightning live here and nowhere else."""

from polycube.app.blas import on_one_thread

on_one_thread()


def train_command() -> None:
    """`polycube-train`, `python train.py`."""
    from polycube.app.train import main

    main()


def infer_command() -> None:
    """`polycube-infer`, `python infer.py`."""
    from polycube.app.infer import main

    main()


def evaluate_command() -> None:
    """`polycube-evaluate`, `python -m polycube.evaluate`."""
    from polycube.app.evaluate import main

    main()
