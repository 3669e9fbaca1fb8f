"""Mesh and analyse a part, from surface or CAD file to report: `infer.py mesh=part.stl`."""

from polycube.cli import infer_command

if __name__ == "__main__":
    infer_command()
