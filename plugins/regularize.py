"""A regular polycube from noisy points."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from polycube.geometry.projection import project
from polycube.registry import register
from polycube.types import Candidate

logger = logging.getLogger(__name__)


@register("regularize", "project")
@dataclass(frozen=True)
class Project:
    """Move every point to the nearest point of the candidate's polycube."""

    def __call__(self, candidate: Candidate, points: np.ndarray) -> np.ndarray:
        """(N, 3) points of the boundary for (N, 3) denoised points, cell edge 1."""
        regular, _ = project(candidate.polycube, points)
        moved = np.linalg.norm(regular - points, axis=1)
        logger.info(
            "regularize: %d points moved %.3f cells on average, %.3f at most",
            len(points),
            moved.mean(),
            moved.max(),
        )
        return regular
