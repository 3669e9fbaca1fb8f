"""Example parts, as implicit solids and their triangulations."""
