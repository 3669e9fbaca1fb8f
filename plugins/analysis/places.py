"""Places of an analysis, and checks of conditions there, see `polycube.analysis.supports`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

from polycube.analysis.loads import check_expression
from polycube.analysis.problem import Cyclic
from polycube.analysis.supports import AXES, is_number, split
from polycube.kinds import Analysis
from polycube.registry import BY_RUN
from polycube.types import Json
from polycube.types.checks import options_of
from polycube.types.options import Options, limits
from polycube.units import AUTO, checked_unit


@dataclass(frozen=True)
class OfProblem(Options, Analysis):
    """An analysis that describes its problem.

    Parameters
    ----------
    units : length unit of the part: auto (that of the file, or mm if it states none), m, cm, mm,
        um, in, ft, dm, km, nm, mil, yd, mi
    gauss : Gauss points per direction and element; at least 4 for the continuous functions of
        elasticity
    cyclic : {sectors: 6, axis: [0, 0, 1], point: [0, 0, 0]}; the part is one of 6 equal sectors,
        and the result has the symmetry of the whole
    """

    references: ClassVar[tuple[str, ...]] = ("hughes2005iga",)

    units: str = field(default=AUTO, kw_only=True)
    gauss: Annotated[int, limits(2)] = field(default=4, kw_only=True)
    cyclic: Cyclic | None = field(default=None, kw_only=True)
    # Material with values (E,), or conductivities (E,), of the elements of an assembly
    of_elements: Any = field(default=None, kw_only=True, metadata=BY_RUN)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "units", checked_unit(self.units))
        if self.cyclic is not None:
            object.__setattr__(self, "cyclic", options_of("cyclic", Cyclic, self.cyclic))


def check_items(
    name: str, items: object, keys: set[str], needed: int = 0
) -> list[tuple[object, Json]]:
    """Place of each item and the values prescribed there.

    Raises ValueError unless every item has a place and at least `needed` of the keys.
    """
    from polycube.analysis.boundary_sets import check_place, is_edge

    if isinstance(items, str | Mapping) or not isinstance(items, Sequence):
        raise ValueError(f"{name} must be a list such as [x_min]; got {items!r}")
    for item in items:
        place, settings = split(item)
        check_place(place)
        if is_edge(place) and name != "fixed":
            raise ValueError(f"{name} act on faces, an edge can only be fixed; got {item!r}")
        if not set(settings) <= keys or len(settings) < needed:
            what = f"entries of {name} are {{at: place, {', '.join(sorted(keys))}}}; got {item!r}"
            raise ValueError(what)
    return list(map(split, items))


def check_supports(name: str, items: object, keys: set[str]) -> None:
    """Raise ValueError unless the items are supports of a displacement."""
    for _, settings in check_items(name, items, keys):
        components = settings.get("components", AXES)
        if not components or not set(components) <= set(AXES):
            raise ValueError(f"{name}: components must be some of x, y, z; got {components!r}")
        value = settings.get("value", 0.0)
        if not is_number(value):
            check_vector(f"{name}: value", value, len(components))


def check_vector(name: str, value: object, length: int = 3, is_field: bool = False) -> None:
    """Raise ValueError unless the value is a list of `length` numbers, or of fields."""
    numbers = value if isinstance(value, Sequence) and not isinstance(value, str) else ()
    for each in numbers if is_field else ():
        check_expression(name, each)
    if len(numbers) != length or not (is_field or all(map(is_number, numbers))):
        raise ValueError(f"{name} must be {length} numbers; got {value!r}")
