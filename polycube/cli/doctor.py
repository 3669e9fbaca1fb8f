"""Check what is usable on this machine: `python -m polycube.cli.doctor`, one line per item.

Each test that may crash is run in a separate process.
"""

import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from ctypes.util import find_library
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from shutil import which

TIMEOUT = 120  # seconds for a test
PACKAGES = ("numpy", "scipy", "numba", "torch", "lightning", "hydra-core", "trimesh", "matplotlib")
LIBRARIES = {  # shared library: Debian package, and what needs it
    "usb-1.0": ("libusb-1.0-0", "FBX files"),
    "EGL": ("libegl1", "pictures"),
    "GL": ("libgl1", "pictures"),
    "X11": ("libx11-6", "pictures"),
}
TORCH = """
import torch
gpus = [torch.cuda.get_device_name(i) for i in range(torch.cuda.device_count())]
print("CUDA " + torch.version.cuda if torch.version.cuda else "CPU build", end="; ")
print(", ".join(gpus) or "no GPU", end=f"; {torch.get_num_threads()} threads")
"""
PICTURE = """
import os
os.environ["PYVISTA_OFF_SCREEN"] = "true"
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Sphere())
colours = len(set(map(tuple, plotter.screenshot(None, return_img=True).reshape(-1, 3).tolist())))
assert colours > 1, "the picture is empty"
print(type(plotter.render_window).__name__, end="")
"""
OPEN3D = "import open3d; print(open3d.__version__, end='')"
GMSH = "import gmsh; print(gmsh.__version__, end='')"
GMSH_REMEDY = (
    "STEP, IGES and BREP files need it: pip install 'polycube[cad]', and on Debian or Ubuntu "
    "apt-get install libglu1-mesa libxrender1 libxcursor1 libxft2 libxinerama1 libxfixes3 "
    "libxext6 libfontconfig1 libgomp1; without it cascadio reads STEP"
)
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")

Item = tuple[str, bool, str]  # what, whether it works, details


def examine() -> Iterator[Item]:
    """Every item, in the order of a report."""
    yield "python", sys.version_info >= (3, 10), f"{platform.python_version()}, needs 3.10 or newer"
    yield from map(_package, PACKAGES)
    yield _probe("torch runs on", TORCH)
    for library, (package, purpose) in LIBRARIES.items():
        found = find_library(library)
        remedy = f"{purpose} need it; on Debian or Ubuntu: apt-get install {package}"
        yield f"lib{library}", found is not None, found or remedy
    yield _probe("open3d (FBX, point clouds)", OPEN3D)
    name, works, more = _probe("gmsh (CAD)", GMSH)
    yield name, works, more if works else f"{more}; {GMSH_REMEDY}"
    yield _probe("picture without a display", PICTURE)
    browser = next(filter(None, map(which, BROWSERS)), None)
    yield "browser", True, browser or "none; only tests of the report page need chromium"
    yield _writable(Path.cwd())
    yield _writable(Path(tempfile.gettempdir()))


def main() -> int:
    """Print the report; 1 if something is missing."""
    complete = True
    for name, works, more in examine():
        sys.stdout.write(f"{'ok     ' if works else 'MISSING'}  {name}: {more}\n")
        sys.stdout.flush()
        complete &= works
    return int(not complete)


def _package(name: str) -> Item:
    try:
        return name, True, version(name)
    except PackageNotFoundError:
        return name, False, f"pip install {name}"


def _probe(name: str, code: str) -> Item:
    """Run code in another process: its output, or the last line of its error."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        return name, False, f"no answer within {TIMEOUT} seconds"
    errors = done.stderr.strip().splitlines() or [f"ended with code {done.returncode}"]
    return name, done.returncode == 0, done.stdout if done.returncode == 0 else errors[-1]


def _writable(folder: Path) -> Item:
    try:
        with tempfile.TemporaryFile(dir=folder):
            return "writing", True, str(folder)
    except OSError as error:
        return "writing", False, f"{folder}: {error.strerror}"


if __name__ == "__main__":
    sys.exit(main())
