"""Requirements for spline, analysis and export plugins."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from polycube.registry import build
from polycube.testing.solids import SIDES, claim, claim_array, solid
from polycube.types import Deformation, HexMesh, Modes, Solution, Spline


def check_spline(plugin: Callable) -> None:
    """A partition of unity whose solid is the block, with positive orientation."""
    part = solid("hole_z", 20.0)
    spline = plugin(part.surface, part.hexes)
    claim(isinstance(spline, Spline), "the result is a Spline", type(spline).__name__)
    shape = (spline.extraction.shape[0], len(spline.control))
    claim(spline.extraction.shape == shape, f"the extraction is {shape}", spline.extraction.shape)
    off = np.abs(np.asarray(spline.extraction.sum(1)) - 1).max()
    claim(off < 1e-10, "the functions are a partition of unity", f"{off:.2g} off")
    inside = 0 <= spline.nodes.min() and spline.nodes.max() < shape[0]
    claim(inside, f"nodes number the {shape[0]} Bezier nodes")
    hexes = set(spline.element_hex.tolist())
    claim(hexes == set(range(len(part.hexes.hexes))), "every hex has an element")
    patches = set(part.hexes.patch.tolist())
    claim(set(spline.patch.tolist()) == patches, "its sides have the patches of the mesh")
    points = spline.extraction @ spline.control
    size = np.ptp(points, axis=0)
    off = np.abs(size / SIDES - 1).max()
    claim(off < 0.2, "the solid has the sides of the mesh", f"sides {size.round(3).tolist()}")
    corners = points[spline.nodes[:, [0, 3, 12, 48]]]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1])
    claim((volumes > 0).all(), "the elements are right-handed")


def check_analysis(plugin: Callable) -> None:
    """A solution on the block: modes, or a deformation or potential in equilibrium."""
    part = solid(size=25.0)
    spline = build("spline", {"plugin": "h2s"})(part.surface, part.hexes)
    found = plugin(spline)
    name = type(found).__name__
    claim(isinstance(found, Solution), "the result is Modes, Deformation or Potential", name)
    if isinstance(found, Modes):
        _check_modes(found, spline)
    elif isinstance(found, Deformation):
        claim_array(found.displacement, (spline.extraction.shape[0], 3), "the displacement")
        claim_array(found.stress, (spline.extraction.shape[0], 6), "the stress")
        claim(found.mass > 0, "the mass is positive", found.mass)
        _check_balance(found.reactions.sum(axis=0) + found.load, found.load, found.supports)
    else:
        claim_array(found.values, (len(spline.control),), "the values")
        claim_array(found.flux, (spline.extraction.shape[0], 3), "the flux")
        _check_balance(found.flows.sum() + found.supplied, found.flows, found.supports)


def _check_modes(modes: Modes, spline: Spline) -> None:
    """Ascending frequencies: rigid motions, then modes that deform the block."""
    values = modes.eigenvalues
    claim_array(values, (None,), "the eigenvalues")
    claim_array(modes.shapes, (len(values), len(spline.control), 3), "the shapes")
    claim((np.diff(values) >= 0).all(), "eigenvalues ascend")
    claim(modes.mass > 0, "the mass is positive", modes.mass)
    claim(len(values) > modes.rigid, "there are modes beyond the rigid ones", len(values))
    rigid = int((np.abs(values) < 1e-6 * values[-1]).sum())
    claim(rigid == modes.rigid, f"{modes.rigid} motions are rigid", rigid)


def _check_balance(rest: np.ndarray, given: np.ndarray, supports: tuple[str, ...]) -> None:
    claim(len(supports) > 0, "there is a support")
    off = np.abs(rest).max() / max(np.abs(given).max(), 1e-300)
    claim(off < 1e-6, "the supports balance the loads", f"{off:.2g} of it")


def check_export(plugin: Callable) -> None:
    """One file with reproducible content, equal to the input if meshio can read it."""
    part = solid("hole_z")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = plugin(part.hexes, folder / "hex")
        claim(isinstance(path, Path) and path.is_file(), "the path written is returned", path)
        claim(path.parent == folder, "the file is in the given folder", path.parent)
        is_named = path.stem == "hex" and path.suffix != ""
        claim(is_named, "the file has the given name and a suffix", path.name)
        claim([path] == list(folder.iterdir()), "there is no other file in the folder")
        first = path.read_bytes()
        claim(plugin(part.hexes, folder / "hex").read_bytes() == first, "equal input, equal bytes")
        _check_read_back(path, part.hexes)


def _check_read_back(path: Path, hexes: HexMesh) -> None:
    import meshio

    if path.suffix not in meshio.extension_to_filetypes:
        return
    try:
        found = meshio.read(path)
    except ModuleNotFoundError:  # a package that meshio needs, such as for Exodus
        return
    off = np.abs(found.points - hexes.vertices).max() / np.linalg.norm(SIDES)
    claim(off < 1e-6, "the points are read back", f"{off:.2g} of the diagonal off")
    same = np.array_equal(found.cells_dict["hexahedron"], hexes.hexes)
    claim(same, "the hexes are read back in VTK's order of nodes")
