"""Show the 3D views of several results side by side: `python -m polycube.view results`."""

from polycube.cli import view_command

if __name__ == "__main__":
    view_command()
