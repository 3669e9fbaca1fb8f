"""Runs of single tests go without pictures; those of wider fixtures are drawn."""

import pytest


@pytest.fixture(autouse=True)
def undrawn(monkeypatch):
    """Drawing is tests/report's; here one finished run, `rod`, is drawn."""
    monkeypatch.setattr("polycube.report.pictures.pictures.draw", lambda found: {})
