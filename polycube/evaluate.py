"""Evaluate trained denoisers: `python -m polycube.evaluate weights=FOLDER`."""

from polycube.cli import evaluate_command

if __name__ == "__main__":
    evaluate_command()
