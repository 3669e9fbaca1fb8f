"""Formats of the result files: the settings `files.*` of `conf/infer.yaml`."""

from dataclasses import dataclass

from polycube.errors import InputError

LARGE = 1500  # number of elements from which `auto` selects the smaller files
CHOICES = {
    "bext": ("auto", "1", "2", "both"),
    "cells": ("auto", "lagrange", "corners"),
    "precision": ("single", "double"),
}


@dataclass(frozen=True)
class Files:
    """Contents of the files of the spline and the solution.

    Raises
    ------
    InputError
        If a value is not one of `CHOICES`.
    """

    bext: str | int = "auto"  # versions of BEXT
    cells: str = "auto"  # cells in the files of the solution
    precision: str = "single"  # precision of the fields in these files

    def __post_init__(self) -> None:
        for name, choices in CHOICES.items():
            value = getattr(self, name)
            if isinstance(value, bool) or str(value) not in choices:
                allowed = ", ".join(choices)
                raise InputError(f"files.{name} must be one of {allowed}; got {value!r}")

    def bext_versions(self, elements: int) -> tuple[int, ...]:
        """Versions of BEXT in which a spline with a number of elements is written, ascending."""
        if self.bext == "auto":
            return (2,) if elements > LARGE else (1, 2)
        return (1, 2) if self.bext == "both" else (int(self.bext),)

    def has_curved_cells(self, elements: int) -> bool:
        """Whether the files of a solution have curved cells, or hexahedra of eight nodes."""
        return self.cells == "lagrange" or (self.cells == "auto" and elements <= LARGE)
