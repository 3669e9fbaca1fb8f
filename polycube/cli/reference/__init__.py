"""Pages of docs/reference generated from the code: `python -m polycube.cli.reference docs`."""
