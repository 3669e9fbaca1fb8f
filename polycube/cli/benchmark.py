"""A page that compares what a folder of CAD parts gave with published shares and earlier batches:

    python -m polycube.cli.benchmark outputs/bench/NEW outputs/bench/OLD --parts PARTS --subset 24

meshes the parts as a batch (`batch`), as far as that is not done, then writes `benchmark.html` into
the first folder.  The second folder, of an earlier batch, may be left out; without `--parts` the
page is made of the parts that are there.
"""

from __future__ import annotations

import argparse
import io
import logging
import sys
from collections.abc import Sequence
from pathlib import Path

from polycube.cli import infer
from polycube.cli.arguments import quote
from polycube.cli.batch import check_names
from polycube.cli.command import refused
from polycube.cli.signals import INTERRUPTED
from polycube.errors import InputError
from polycube.io import manifest
from polycube.io.cad import SUFFIXES
from polycube.io.surfaces import is_cad
from polycube.pipeline.resume import has_stage, load_stage
from polycube.report.numbers.benchmark import ROW, results
from polycube.report.page.benchmark import benchmark_page
from polycube.report.pictures import scenes
from polycube.report.pictures.features import lost_on_mesh
from polycube.report.pictures.pictures import draw
from polycube.report.pictures.render import Scene

PAGE, PICTURE = "benchmark.html", "benchmark.png"  # of the batch, of each part
TILE = (560, 420)  # pixels of a picture at most
SHADES = 64  # colours of a picture, which keeps it below some fifty kilobytes

logger = logging.getLogger(__name__)


def benchmark(folder: Path, before: Path | None = None) -> Path:
    """Write `benchmark.html` of a batch, finished or not; returns it.

    Parameters
    ----------
    folder : of the batch, with a folder per part
    before : of another batch, to compare it with

    Raises
    ------
    InputError : a folder holds no batch, or the page would overwrite a file of the user's.
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
    """Raise InputError where no part of the folder has ended."""
    if not any(folder.glob(f"*/{ROW}")):
        raise InputError(f"{folder} contains no batch: no folder in it has a {ROW}")


def picture(run: Path) -> bytes | None:
    """PNG of a part with what its mesh loses in red; None where nothing could be drawn.

    It is kept in the folder of the part, and drawn again where the part was run again.
    """
    path = run / PICTURE
    if path.is_file() and path.stat().st_mtime >= (run / ROW).stat().st_mtime:
        return path.read_bytes()
    if not has_stage(run, "read"):  # the file was refused
        return None
    try:
        drawn = draw({"part": pictured(run)})
    except Exception as error:  # a picture is never worth a page
        logger.warning("no picture of %s: %s", run.name, error)
        return None
    if "part" not in drawn:
        return None
    small = _small(drawn["part"])
    with manifest.writing(run) as scratch:
        (scratch / PICTURE).write_bytes(small)
    return small


def pictured(run: Path) -> Scene:
    """What is drawn of a part: its hex mesh, or its surface where it has none."""
    surface = load_stage(run, "read")[0]
    for stage in ("meshing/refine", "meshing/cure", "meshing/optimize"):
        if has_stage(run, stage):
            return lost_on_mesh(load_stage(run, stage), surface)
    return scenes.input_surface(surface)


def _small(image: bytes) -> bytes:
    from PIL import Image

    tile = Image.open(io.BytesIO(image)).convert("RGBA")
    tile.thumbnail(TILE)
    file = io.BytesIO()
    tile.quantize(SHADES, Image.Quantize.FASTOCTREE).save(file, "PNG", optimize=True)
    return file.getvalue()


def parts_of(folder: Path, subset: int | None = None) -> list[str]:
    """CAD files of a folder and the folders in it, by name.

    Parameters
    ----------
    subset : take so many of them, spread evenly: always the same ones

    Raises
    ------
    InputError : there are none, two have the same name, or the number is below one.
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


def mesh_all(parts: Sequence[str], folder: Path, settings: Sequence[str] = ()) -> None:
    """Mesh parts as a batch into `folder`; those that are done are kept.

    Raises
    ------
    SystemExit : the batch was interrupted.
    """
    meshes = f"mesh={','.join(map(quote, parts))}"
    sys.argv[1:] = ["-m", meshes, f"output_dir={folder}", "order=[meshing]", *settings]
    try:
        infer.main()
    except SystemExit as ended:
        if ended.code == INTERRUPTED:
            raise


def main() -> None:
    """Command line: exit code 2, and one sentence, for what is refused."""
    parser = argparse.ArgumentParser(prog="python -m polycube.cli.benchmark")
    parser.add_argument(
        "folder", type=Path, help="folder of the batch, in which the page is written"
    )
    parser.add_argument("before", type=Path, nargs="?", help="folder of an earlier batch")
    parser.add_argument("--parts", type=Path, help="folder of CAD parts, meshed first")
    parser.add_argument("--subset", type=int, help="number of parts, selected evenly")
    parser.add_argument("--settings", nargs="*", default=(), help="further settings of infer.py")
    asked = parser.parse_args()
    try:
        if asked.before is not None:  # now, not when hours have gone into the parts
            check_batch(asked.before)
        if asked.parts is not None:
            mesh_all(parts_of(asked.parts, asked.subset), asked.folder, asked.settings)
        sys.stdout.write(f"The page is {benchmark(asked.folder, asked.before)}\n")
    except InputError as error:
        sys.exit(refused(error))


if __name__ == "__main__":
    main()
