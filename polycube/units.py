"""Length units by name."""

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
METRES |= {"dm": 0.1, "km": 1e3, "nm": 1e-9, "mil": 2.54e-5, "yd": 0.9144, "mi": 1609.344}
MILLIMETRES = {name: 1000 * metres for name, metres in METRES.items()}
AUTO = "auto"  # the unit of the file, or mm if it states none


def named_unit(millimetres: float) -> str:
    """The unit of a length in millimetres; empty if no unit has this length."""
    sizes = MILLIMETRES.items()
    return next((name for name, size in sizes if abs(size - millimetres) < 1e-5 * size), "")


def resolved(unit: str | None, of_file: str) -> str:
    """The length unit of a part: the given one, else that of its file, else mm."""
    return unit if unit and unit != AUTO else of_file or "mm"


def checked_unit(unit: str) -> str:
    """A length unit without its file; raises ValueError if it is none."""
    if unit not in (AUTO, *METRES):
        raise ValueError(f"units must be one of {', '.join(METRES)} or {AUTO}; got {unit!r}")
    return resolved(unit, "")


def described(unit: str | None, of_file: str) -> str:
    """The length unit of a part, and where it comes from."""
    found = resolved(unit, of_file)
    if found == of_file:
        return f"{found}, by the file"
    why = "assumed" if unit in (None, AUTO) else "by analysis.units"
    return f"{found}, {why}; the file is {f'in {of_file}' if of_file else 'without a unit'}"
