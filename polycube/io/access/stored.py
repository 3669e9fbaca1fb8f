"""Read JSON files that the program wrote, which may have been edited since."""

import json
from pathlib import Path

from polycube.errors import InputError, brief
from polycube.types import Json


def read_json(path: Path, remedy: str = "name the folder of a run") -> Json:
    """Names and values of a JSON file.

    Raises
    ------
    InputError : if there is no such file, or if it is damaged
    """
    if not path.is_file():
        raise InputError("there is no such file", str(path), remedy)
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"is damaged ({brief(error)})", str(path), remedy) from None
    if not isinstance(found, dict):
        raise InputError("is damaged: it has no names", str(path), remedy)
    return found
