"""Make training pairs of meshed parts: `python -m polycube.make_pairs "parts=[cad/*.step]"`."""

from polycube.cli import make_pairs_command

if __name__ == "__main__":
    make_pairs_command()
