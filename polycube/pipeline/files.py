"""How the results of a run are written: the settings `files.*` of `conf/infer.yaml`."""

from __future__ import annotations

from dataclasses import dataclass

from polycube.errors import InputError

LARGE = 1500  # elements; from more on, `auto` chooses the smaller files
CHOICES = {
    "bext": ("auto", "1", "2", "both"),
    "cells": ("auto", "lagrange", "corners"),
    "precision": ("single", "double"),
}


@dataclass(frozen=True)
class Files:
    """What the files of the spline and of the solution hold.

    Raises
    ------
    InputError
        For a value that is not among `CHOICES`.
    """

    bext: str | int = "auto"  # versions of BEXT
    cells: str = "auto"  # of the files of the solution
    precision: str = "single"  # of the fields there

    def __post_init__(self) -> None:
        for name, choices in CHOICES.items():
            value = getattr(self, name)
            if isinstance(value, bool) or str(value) not in choices:
                allowed = ", ".join(choices)
                raise InputError(f"files.{name} must be one of {allowed}; got {value!r}")

    def bext_versions(self, elements: int) -> tuple[int, ...]:
        """The versions of BEXT that a spline of so many elements is written in, ascending."""
        if self.bext == "auto":
            return (2,) if elements > LARGE else (1, 2)
        return (1, 2) if self.bext == "both" else (int(self.bext),)

    def has_curved_cells(self, elements: int) -> bool:
        """Whether the files of a solution hold curved cells, or hexahedra of eight nodes."""
        return self.cells == "lagrange" or (self.cells == "auto" and elements <= LARGE)
