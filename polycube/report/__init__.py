"""The report of a run: numbers, pictures, page."""
