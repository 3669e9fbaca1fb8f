"""Open a desk for the parts of a folder: `python -m polycube.desk part.step`."""

from polycube.cli import desk_command

if __name__ == "__main__":
    desk_command()
