"""Our plugins keep the promises of their kinds."""

from polycube.testing import check_plugin


def test_sigmoid() -> None:
    check_plugin("schedule", {"plugin": "sigmoid", "steps": 50, "slope": 4.0})


def test_notch() -> None:
    check_plugin("primitive", {"plugin": "notch"})
    check_plugin("primitive", {"plugin": "notch", "depth": 2})
