"""Random deformations of a polycube surface into shapes that resemble real parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from polycube.diffusion.pairs.templates import Template


@dataclass(frozen=True)
class Deformation:
    """Strength of the random deformations.

    Values are standard deviations unless they are described as largest values; 0 disables a step.

    Parameters
    ----------
    rounding : largest amount of smoothing, as a share of the strongest, 0 to 1
    warp : standard deviation of the logarithm of the widths of slabs, which moves and scales holes
    disc : largest roundness of sections: 0 for square, 1 for circular
    stretch : standard deviation of the logarithm of the scale along each axis
    profile : standard deviation of the logarithm of the scale of sections along an axis (taper,
        bulge)
    waves : standard deviation of a smooth displacement, as a share of the longest edge
    bend : standard deviation of the curvature multiplied by half the length
    twist : standard deviation of the angle between both ends, in radians
    rotation : standard deviation of the rotation angle about each axis, in radians
    roughness : largest noise of the sample points, in units of the learning frame
    tilt : largest noise of the unit normals at the sample points
    """

    rounding: float = 1.0
    warp: float = 0.5
    disc: float = 1.0
    stretch: float = 0.4
    profile: float = 0.25
    waves: float = 0.06
    bend: float = 0.4
    twist: float = 0.2
    rotation: float = 0.12
    roughness: float = 0.004
    tilt: float = 0.1

    def deform(self, template: Template, rng: np.random.Generator) -> np.ndarray:
        """(V, 3) vertices of the template, deformed."""
        return self.bent(self._warped(self._rounded(template, rng), template, rng), rng)

    def bent(self, x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(V, 3) points after all steps except rounding and warp, which need a template."""
        from scipy.spatial.transform import Rotation

        x = self._disc(x, rng)
        x = (x - (x.max(axis=0) + x.min(axis=0)) / 2) * np.exp(rng.normal(0, self.stretch, 3))
        x = self._profiled(x, rng)
        x = self._waved(x, rng)
        x = self._curved(x, rng)
        return x @ Rotation.from_rotvec(rng.normal(0, self.rotation, 3)).as_matrix().T

    def _rounded(self, template: Template, rng: np.random.Generator) -> np.ndarray:
        """Interpolation between two of the precomputed amounts of smoothing."""
        level = self.rounding * rng.uniform(0, len(template.rounded) - 1)
        lower = min(int(level), len(template.rounded) - 2)
        share = level - lower
        return (1 - share) * template.rounded[lower] + share * template.rounded[lower + 1]

    def _warped(self, x: np.ndarray, template: Template, rng: np.random.Generator) -> np.ndarray:
        """Slabs made wider or narrower smoothly, which resizes holes and the adjacent walls."""
        from scipy.interpolate import PchipInterpolator

        warped = np.empty_like(x)
        for axis, n_cells in enumerate(template.polycube.grid):
            knots = template.polycube.knots[axis] - n_cells / 2
            widths = np.diff(knots) * np.exp(rng.normal(0, self.warp, len(knots) - 1))
            share = np.append(0, np.cumsum(widths)) / widths.sum()
            moved = knots[0] + (knots[-1] - knots[0]) * share
            warped[:, axis] = PchipInterpolator(knots, moved)(x[:, axis])
        return warped

    def _disc(self, x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Sections across a random axis deformed towards discs: (u, v) sqrt(1 - (v, u)^2 / 2)."""
        u = _unit(x)
        across = np.delete(np.arange(3), rng.integers(3))
        share = max(0.0, self.disc * rng.uniform(-1, 1))  # half of the shapes stay unchanged
        other = u[:, across[::-1]]
        x = x - (x.max(axis=0) + x.min(axis=0)) / 2
        x[:, across] *= 1 - share + share * np.sqrt(1 - other**2 / 2)
        return x

    def _profiled(self, x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Sections scaled by exp of a smooth random function along some of the axes."""
        u = _unit(x)
        for axis in np.flatnonzero(rng.random(3) < 0.6):
            a, b, c = rng.normal(0, self.profile, 3)
            wave = np.sin(np.pi * rng.uniform(0.5, 1.5) * u[:, axis])
            scale = np.exp(a * u[:, axis] + b * (u[:, axis] ** 2 - 0.5) + c * wave)
            x[:, np.arange(3) != axis] *= scale[:, None]
        return x

    def _waved(self, x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Six plane waves with random directions, phases and amplitudes."""
        phase = _unit(x) @ rng.normal(0, 2, (3, 6)) + rng.uniform(0, 2 * np.pi, 6)
        amplitude = rng.normal(0, self.waves, (6, 3)) * rng.uniform(0, 1)
        return x + np.ptp(x, axis=0).max() / 2 * np.sin(phase) @ amplitude

    def _curved(self, x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """A parabola across the x axis and a twist about it, each for some shapes."""
        u = _unit(x)[:, 0]
        if rng.random() < 0.4:
            side = rng.integers(1, 3)
            x[:, side] += rng.normal(0, self.bend) * u**2 * np.ptp(x[:, 0]) / 2
        if rng.random() < 0.4:
            angle = rng.normal(0, self.twist) * u
            cos, sin = np.cos(angle), np.sin(angle)
            y, z = x[:, 1].copy(), x[:, 2].copy()
            x[:, 1], x[:, 2] = cos * y - sin * z, sin * y + cos * z
        return x


def _unit(x: np.ndarray) -> np.ndarray:
    """Points with their bounding box scaled to [-1, 1]^3."""
    low, high = x.min(axis=0), x.max(axis=0)
    return 2 * (x - low) / (high - low) - 1
