"""Pages of docs/reference that are made from the code: `python -m polycube.cli.reference docs`."""
