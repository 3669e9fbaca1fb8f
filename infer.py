"""From a closed surface to hex mesh, spline, modes and report: `infer.py mesh=part.stl`."""

from polycube.cli import infer_command

if __name__ == "__main__":
    infer_command()
