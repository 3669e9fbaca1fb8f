"""Runs of single tests go without pictures; those of wider fixtures are drawn."""

from tests.cli.conftest import undrawn  # noqa: F401
