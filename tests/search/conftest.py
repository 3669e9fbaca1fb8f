"""The made-up stages note their calls."""

import pytest

from tests.fixtures.stages import CALLS


@pytest.fixture(autouse=True)
def forget() -> None:
    CALLS.clear()
