"""Pages of docs/reference generated from the code: `python -m docs.generators.reference docs`."""
