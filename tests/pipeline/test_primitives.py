"""Primitives are built by name, and looked at before anything is done with them."""

import numpy as np
import pytest

from polycube import registry
from polycube.errors import InputError
from polycube.pipeline.primitives import voxels


def test_the_primitives_of_the_paper():
    made = voxels(["cube", "hole_x"])
    assert list(made) == ["cube", "hole_x"]
    assert made["cube"].all() and not made["hole_x"][:, 1, 1].any()


@pytest.mark.parametrize("made", [np.ones((4, 4, 4), bool), np.ones((3, 3, 3)), [True]])
def test_other_voxels_are_refused(made, monkeypatch):
    monkeypatch.setattr(registry, "build", lambda kind, config: lambda: made)
    with pytest.raises(InputError, match=r"primitive mine must be 3 x 3 x 3 voxels"):
        voxels(["mine"])
