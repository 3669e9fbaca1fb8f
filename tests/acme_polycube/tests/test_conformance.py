"""Our plugins keep the promises of their kinds."""

from polycube.testing import check_plugin


def test_quadratic() -> None:
    check_plugin("schedule", {"plugin": "quadratic", "steps": 50})


def test_notch() -> None:
    check_plugin("primitive", {"plugin": "notch"})
    check_plugin("primitive", {"plugin": "notch", "depth": 2})
