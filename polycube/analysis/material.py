"""Isotropic elastic materials by name."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material in SI units."""

    young: float  # Pa
    poisson: float
    density: float  # kg/m^3

    def __post_init__(self) -> None:
        if not (self.young > 0 and self.density > 0 and -1 < self.poisson < 0.5):
            raise ValueError(
                f"material needs young > 0, density > 0 and -1 < poisson < 0.5; got "
                f"young={self.young:g}, poisson={self.poisson:g}, density={self.density:g}"
            )


MATERIALS = {
    "steel": Material(210e9, 0.30, 7850),
    "aluminium": Material(70e9, 0.33, 2700),
    "titanium": Material(114e9, 0.34, 4430),
    "brass": Material(105e9, 0.34, 8500),
    "abs": Material(2.3e9, 0.35, 1050),
}


def material(value: str | Mapping[str, float]) -> Material:
    """A material by its name or its values {young, poisson, density}; raises ValueError."""
    if value in list(MATERIALS):
        return MATERIALS[value]
    if isinstance(value, str) or set(value) != {"young", "poisson", "density"}:
        raise ValueError(
            f"material must be one of {', '.join(MATERIALS)} or "
            f"{{young, poisson, density}}; got {value!r}"
        )
    return Material(**value)
