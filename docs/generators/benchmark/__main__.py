"""A page that compares the results of a folder of CAD parts with published and earlier ones:

    python -m docs.generators.benchmark outputs/bench/NEW outputs/bench/OLD --parts PARTS

meshes the parts as a batch (`batch`), except those with results, then writes `benchmark.html` to
the first folder. The second folder, of an earlier batch, is optional; without `--parts` the page
has the existing results.
"""

from __future__ import annotations

import argparse
import io
import logging
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from docs.generators.benchmark.numbers import ROW, results
from docs.generators.benchmark.page import benchmark_page
from polycube.cli import infer
from polycube.cli.batch import check_names
from polycube.cli.command import quote, refused
from polycube.cli.signals import INTERRUPTED
from polycube.errors import InputError
from polycube.io import manifest
from polycube.io.cad import SUFFIXES
from polycube.io.surfaces import is_cad
from polycube.pipeline.resume.results import has_stage, load_stage
from polycube.report.pictures import scenes
from polycube.report.pictures.colours import LOST, SURFACE, rgb
from polycube.report.pictures.features import lines, lost_segments
from polycube.report.pictures.pictures import draw
from polycube.report.pictures.render import Layer, Scene, view
from polycube.surface.measures import diagonal
from polycube.types import HexMesh, TriMesh

PAGE, PICTURE = "benchmark.html", "benchmark.png"  # of the batch, and of each part
TILE = (560, 420)  # largest size of a picture in pixels
SHADES = 64  # colours of a picture; limits its size to about 50 kilobytes

logger = logging.getLogger(__name__)


def benchmark(folder: Path, before: Path | None = None) -> Path:
    """Write `benchmark.html` of a batch, complete or not, and return its path.

    Parameters
    ----------
    folder : folder of the batch, with a folder per part
    before : folder of another batch for comparison

    Raises
    ------
    InputError
        If a folder is not a batch, or if the page would overwrite a file of the user.
    """
    for batch in filter(None, (folder, before)):
        check_batch(batch)
    parts = results(folder)
    earlier = None if before is None else {part.name: part for part in results(before)}
    manifest.check(folder, [PAGE])
    found = {part.name: picture(folder / part.name) for part in parts}
    drawn = {name: image for name, image in found.items() if image is not None}
    name = "" if before is None else before.resolve().name
    text = benchmark_page(folder.resolve().name, parts, drawn, earlier, name)
    with manifest.writing(folder) as scratch:
        (scratch / PAGE).write_text(text, encoding="utf-8")
    return folder / PAGE


def check_batch(folder: Path) -> None:
    """Raise InputError if no part of the folder is finished."""
    if not any(folder.glob(f"*/{ROW}")):
        raise InputError(f"{folder} contains no batch: no folder in it has a {ROW}")


def picture(run: Path) -> bytes | None:
    """PNG of a part with the lost features in red; None if it cannot be drawn.

    It is cached in the folder of the part until the part is run again.
    """
    path = run / PICTURE
    if path.is_file() and path.stat().st_mtime >= (run / ROW).stat().st_mtime:
        return path.read_bytes()
    if not has_stage(run, "read"):  # the file was refused
        return None
    try:
        drawn = draw({"part": pictured(run)})
    except Exception as error:  # a failed picture must not prevent the page
        logger.warning("no picture of %s: %s", run.name, error)
        return None
    if "part" not in drawn:
        return None
    small = _small(drawn["part"])
    with manifest.writing(run) as scratch:
        (scratch / PICTURE).write_bytes(small)
    return small


def pictured(run: Path) -> Scene:
    """The picture of a part: its hex mesh, or its surface if there is no mesh."""
    surface = load_stage(run, "read")[0]
    for stage in ("meshing/refine", "meshing/cure", "meshing/optimize"):
        if has_stage(run, stage):
            return lost_on_mesh(load_stage(run, stage), surface)
    return scenes.input_surface(surface)


def lost_on_mesh(mesh: HexMesh, surface: TriMesh) -> Scene:
    """The boundary of the hex mesh, with the lost features of the model in red in front of it."""
    scene = [Layer(mesh.vertices, mesh.quads, rgb((SURFACE,) * len(mesh.quads)), outlined=True)]
    segments = lost_segments(mesh, surface)
    if len(segments):
        before = diagonal(surface) * view()[2]  # closer to the eye than the mesh
        scene.append(lines(list(segments + before), LOST))
    return scene


def _small(image: bytes) -> bytes:
    from PIL import Image

    tile = Image.open(io.BytesIO(image)).convert("RGBA")
    tile.thumbnail(TILE)
    file = io.BytesIO()
    tile.quantize(SHADES, Image.Quantize.FASTOCTREE).save(file, "PNG", optimize=True)
    return file.getvalue()


def parts_of(folder: Path, subset: int | None = None) -> list[str]:
    """CAD files of a folder and its subfolders, by name.

    Parameters
    ----------
    subset : number of parts to select, evenly spaced; the selection is always the same

    Raises
    ------
    InputError
        If there are none, if two have the same name, or if the number is below one.
    """
    if subset is not None and subset < 1:
        raise InputError(f"a subset must have at least one part; got {subset}")
    files = [path for path in folder.rglob("*") if is_cad(path)]
    found = [str(path) for path in sorted(files, key=lambda path: (path.stem, path))]
    if not found:
        raise InputError(f"{folder}: the folder contains no CAD part ({', '.join(SUFFIXES)})")
    check_names(found)
    count = min(subset or len(found), len(found))
    return [found[i * len(found) // count] for i in range(count)]


def mesh_all(
    parts: Sequence[str],
    folder: Path,
    settings: Sequence[str] = (),
    command: Callable[[], None] = infer.main,
) -> None:
    """Mesh parts as a batch into `folder`; existing results are kept.

    Parameters
    ----------
    command : the program that meshes them, whose arguments are in `sys.argv`

    Raises
    ------
    SystemExit
        If the batch was interrupted.
    """
    meshes = f"mesh={','.join(map(quote, parts))}"
    sys.argv[1:] = ["-m", meshes, f"output_dir={folder}", "order=[meshing]", *settings]
    try:
        command()
    except SystemExit as ended:
        if ended.code == INTERRUPTED:
            raise


def main(command: Callable[[], None] = infer.main) -> None:
    """Command line: exit code 2 and one sentence for an invalid argument."""
    parser = argparse.ArgumentParser(prog="python -m docs.generators.benchmark")
    parser.add_argument(
        "folder", type=Path, help="folder of the batch, in which the page is written"
    )
    parser.add_argument("before", type=Path, nargs="?", help="folder of an earlier batch")
    parser.add_argument("--parts", type=Path, help="folder of CAD parts, meshed first")
    parser.add_argument("--subset", type=int, help="number of parts, selected evenly")
    parser.add_argument("--settings", nargs="*", default=(), help="further settings of infer.py")
    arguments = parser.parse_args()
    try:
        if arguments.before is not None:  # before the parts are meshed, which may take hours
            check_batch(arguments.before)
        if arguments.parts is not None:
            parts = parts_of(arguments.parts, arguments.subset)
            mesh_all(parts, arguments.folder, arguments.settings, command)
        sys.stdout.write(f"The page is {benchmark(arguments.folder, arguments.before)}\n")
    except InputError as error:
        sys.exit(refused(error))


if __name__ == "__main__":
    main()
