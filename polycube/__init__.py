"""DDPM-Polycube: from a CAD surface to a polycube, a hex mesh and a volumetric spline."""

import atexit
import os
import shutil
import sys
import tempfile
from difflib import get_close_matches
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

__version__ = "0.1.0"
__all__ = ["InputError", "MeshingError", "Result", "citation", "mesh"]

_PACKAGE = Path(__file__).parent

# In a checkout, `plugins/` and `conf/` are next to this package; in a wheel, they are inside.
HOME = _PACKAGE if (_PACKAGE / "plugins").is_dir() else _PACKAGE.parent


def _mount(folder: Path, name: str) -> None:
    """Import `folder` as the package `name`, so that both layouts have `polycube.plugins`."""
    spec = spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"no package in {folder}")
    sys.modules[name] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])


def __getattr__(name: str) -> object:
    """The functions and classes of `polycube.api`, imported at first use."""
    if name in __all__:
        return getattr(import_module("polycube.api"), name)
    near = get_close_matches(name, __all__, 1)
    hint = f"; did you mean {near[0]}" if near else ""
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


def _provide_cache() -> None:
    """Keep compiled code in a temporary folder if numba can write to none of its own."""
    own = os.path.abspath(os.path.expanduser(os.environ.get("XDG_CACHE_HOME") or "~/.cache"))
    while not os.path.exists(own):
        own = os.path.dirname(own)
    if "NUMBA_CACHE_DIR" in os.environ or any(os.access(f, os.W_OK) for f in (_PACKAGE, own)):
        return
    folder = tempfile.mkdtemp(prefix="polycube-")
    os.environ["NUMBA_CACHE_DIR"] = folder
    atexit.register(shutil.rmtree, folder, ignore_errors=True)


_provide_cache()
if HOME != _PACKAGE:
    _mount(HOME / "plugins", "polycube.plugins")
