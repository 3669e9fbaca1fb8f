"""The benchmark: which parts, in which order, their shares, comparison and pictures."""

import io
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from docs.generators.benchmark import __main__ as benchmark
from docs.generators.benchmark.numbers import changes, results, totals
from polycube.errors import InputError
from polycube.hexmesh.face_groups import facing, measure
from polycube.pipeline.resume.results import save_stage
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.html import Outline

BLOCK = {"point": 8, "curve": 12, "face": 6}


def part(
    folder: Path, least: float = 0.5, lost: int = 0, number=BLOCK, p99: float = 0.1, hexes: int = 10
) -> None:
    """A part of a batch with a valid mesh that loses so many features of every kind."""
    folder.mkdir(parents=True)
    row = {"result": "valid", "exit": 0, "part": folder.name, "says": "", "seconds": 2.0}
    row |= {"hexes": hexes, "min_scaled_jacobian": least, "mean_scaled_jacobian": 0.9}
    row |= {"mesh_to_surface_p99_percent": p99, "surface_to_mesh_p99_percent": 0.0}
    features = {f"{kind}s": {"all": n, "lost": min(n, lost)} for kind, n in number.items()}
    report = {"hex": {"features": features or None}}
    (folder / "row.json").write_text(json.dumps(row))
    (folder / "report.json").write_text(json.dumps(report))


def failed(folder: Path, says: str = "no layout for <this>") -> None:
    folder.mkdir(parents=True)
    row = {"result": "no valid result", "exit": 3, "part": folder.name, "says": says}
    (folder / "row.json").write_text(json.dumps(row))


@pytest.fixture
def batch(tmp_path: Path) -> Path:
    """Six parts: one fails, two lose features, a ball has no points, a scan is no CAD model."""
    folder = tmp_path / "new"
    part(folder / "a_good", 0.9)
    part(folder / "b_poor", 0.25, hexes=40)
    failed(folder / "z_failed")
    part(folder / "c_loses", 0.6, lost=3, p99=0.4)
    part(folder / "d_ball", 0.7, number={"point": 0, "curve": 0, "face": 1})
    part(folder / "e_scan", 0.8, number={})
    (folder / "not_yet").mkdir()
    return folder


def test_the_worst_come_first(batch: Path) -> None:
    names = ["z_failed", "c_loses", "b_poor", "d_ball", "e_scan", "a_good"]
    assert [each.name for each in results(batch)] == names


def test_a_failed_part_keeps_nothing_and_a_ball_has_no_points(batch: Path) -> None:
    found = totals(results(batch))
    assert found["parts"] == 6 and found["valid hex meshes"] == 5
    assert found["everything kept"] == 3  # unknown for a part that is no CAD model
    # the mean of two whole blocks, one that loses three, one that failed, and the ball
    assert found["points kept, %"] == pytest.approx(100 * (1 + 1 + 5 / 8 + 0) / 4)
    assert found["curves kept, %"] == pytest.approx(100 * (1 + 1 + 9 / 12 + 0) / 4)
    assert found["faces kept, %"] == pytest.approx(100 * (1 + 1 + 3 / 6 + 0 + 1) / 5)
    least = [found[f"least scaled Jacobian {bound} or more"] for bound in (0.2, 0.3, 0.5)]
    assert least == [5, 4, 4]
    assert found["99 % of points within 0.3 %"] == 4
    assert found["hexes, median"] == 10 and found["seconds, median"] == 2


def test_totals_of_failures_alone_are_zero_or_unknown(tmp_path: Path) -> None:
    failed(tmp_path / "x")
    found = totals(results(tmp_path))
    assert found["points kept, %"] == 0 and found["hexes, median"] is None


def test_changes_since_an_earlier_batch(batch: Path, tmp_path: Path) -> None:
    old = tmp_path / "old"
    part(old / "a_good", 0.95, lost=1)
    part(old / "z_failed")
    failed(old / "b_poor")
    failed(old / "other")
    before = {each.name: each for each in results(old)}
    now = {each.name: each for each in results(batch)}
    assert changes(now["a_good"], before["a_good"]) == ("-0.050", "-3")
    assert changes(now["z_failed"], before["z_failed"]) == ("valid before", None)
    assert changes(now["b_poor"], before["b_poor"]) == ("valid now", None)
    assert changes(now["d_ball"], None) == (None, None)
    assert changes(before["b_poor"], before["b_poor"]) == (None, None)


def drawn(batch: Path) -> None:
    """Store a picture of each part, as if it was drawn."""
    image = pytest.importorskip("PIL.Image")
    for row in batch.glob("*/row.json"):
        image.new("RGB", (560, 420), "red").save(row.with_name(benchmark.PICTURE))


def test_the_page_has_totals_failures_parts_and_pictures(batch: Path, tmp_path: Path) -> None:
    drawn(batch)
    part(tmp_path / "old" / "a_good", 0.95)
    text = benchmark.benchmark(batch, tmp_path / "old").read_text()
    outline = Outline(text)
    assert outline.sections == ["totals", "failures", "parts", "pictures"]
    words = " ".join(outline.text)
    for expected in ("5 of 6 parts have", "70.9", "48.5", "34.6", "no layout for <this>"):
        assert expected in words
    assert "3 of 8" in words and "-0.050" in words and "parts of both, before" in words
    assert "c_loses: loses 3 points, 3 curves, 3 faces, least SJ 0.60." in words
    assert "a_good: keeps everything, least SJ 0.90." in words and "e_scan: least SJ" in words
    captions = [word for word in outline.text if "least SJ 0" in word or ": no valid" in word]
    assert [caption[0] for caption in captions] == ["z", "c", "b", "d", "e", "a"]
    assert text.count("data:image/png") == 6
    assert benchmark.benchmark(batch).read_text().count("published") == 1


def test_a_part_that_cannot_be_drawn_is_logged(batch: Path, caplog) -> None:
    """A surface that was read but is no surface, and parts without any feature."""
    save_stage(batch / "a_good", "read", [None])
    text = " ".join(Outline(benchmark.benchmark(batch).read_text()).text)
    assert text.count("No picture.") == 6
    assert caplog.text.count("no picture of") == 1 and "no picture of a_good" in caplog.text


@pytest.mark.parametrize("which", ["folder", "before"])
def test_a_folder_without_a_batch_is_refused(batch: Path, tmp_path: Path, which: str) -> None:
    folders = [tmp_path / "none", batch]
    with pytest.raises(InputError, match="none contains no batch"):
        benchmark.benchmark(*(folders if which == "folder" else reversed(folders)))


def test_a_page_of_the_user_is_not_overwritten(batch: Path) -> None:
    (batch / "benchmark.html").write_text("mine")
    with pytest.raises(InputError, match="would be overwritten"):
        benchmark.benchmark(batch)


@pytest.mark.slow
def test_what_is_lost_is_red_and_drawn_once(tmp_path: Path) -> None:
    """A cube of which the mesh reaches only to 0.9 of the height."""
    pytest.importorskip("pyvista")
    image = pytest.importorskip("PIL.Image")
    run = tmp_path / "cube"
    part(run, lost=4)
    whole = hex_box((4, 4, 4))
    region = facing(measure(whole.vertices[whole.quads]).normal) + 1
    save_stage(run, "read", [surface_of(whole, region), "cube.step", [], None])
    save_stage(run, "meshing/optimize", hex_box((4, 4, 4), (1, 1, 0.9)))
    drawn = benchmark.picture(run)
    pixels = np.asarray(image.open(io.BytesIO(drawn)).convert("RGBA").convert("RGB")).astype(int)
    red = (pixels[..., 0] > 180) & (pixels[..., 1:] < 80).all(-1)
    assert pixels.shape[0] <= benchmark.TILE[1] and red.sum() > 200
    save_stage(run, "meshing/refine", whole)
    assert benchmark.picture(run) == drawn  # the cached one
    later = (run / "benchmark.png").stat().st_mtime + 1
    os.utime(run / "row.json", (later, later))
    assert benchmark.picture(run) != drawn


def test_a_subset_is_fixed_and_spread_evenly(tmp_path: Path) -> None:
    for number in range(12):
        folder = tmp_path / f"sub{number % 3}"
        folder.mkdir(exist_ok=True)
        suffix = (".step", ".STP", ".igs", ".brep")[number % 4]
        (folder / f"part{number:02d}{suffix}").touch()
    (tmp_path / "notes.txt").touch()
    found = [Path(path).stem for path in benchmark.parts_of(tmp_path)]
    assert found == [f"part{number:02d}" for number in range(12)]
    few = benchmark.parts_of(tmp_path, 4)
    assert [Path(path).stem for path in few] == ["part00", "part03", "part06", "part09"]
    assert len(set(benchmark.parts_of(tmp_path, 7))) == 7
    assert benchmark.parts_of(tmp_path, 99) == benchmark.parts_of(tmp_path)


def test_parts_that_cannot_be_told_apart_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="contains no CAD part"):
        benchmark.parts_of(tmp_path)
    (tmp_path / "sub").mkdir()
    for name in ("a.step", "sub/a.stp"):
        (tmp_path / name).touch()
    with pytest.raises(InputError, match="2 parts have the name a"):
        benchmark.parts_of(tmp_path)
    with pytest.raises(InputError, match="a subset must have at least one part; got 0"):
        benchmark.parts_of(tmp_path, 0)


def ended(command: Callable[[], None]) -> object:
    """Exit code of the benchmark with a program that meshes the parts."""
    try:
        benchmark.main(command)
    except SystemExit as end:
        return end.code
    return 0


@pytest.mark.parametrize(("ends", "code"), [(0, 0), (3, 0), (130, 130)])
def test_the_command_meshes_the_parts_then_writes_the_page(
    batch: Path, tmp_path: Path, argv, ends: int, code: int
) -> None:
    """Also where a part fails; not where it was interrupted."""
    drawn(batch)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "it's.step").touch()
    arguments: list[str] = []
    words = ["--parts", tmp_path / "parts", "--settings", "hydra/launcher=joblib"]
    argv("benchmark", batch, *words)
    assert ended(lambda: (arguments.extend(sys.argv[1:]), sys.exit(ends))) == code
    mesh = str(tmp_path / "parts" / "it's.step").replace("'", "\\'")
    assert arguments[:3] == ["-m", f"mesh='{mesh}'", f"output_dir={batch}"]
    assert arguments[3:] == ["order=[meshing]", "hydra/launcher=joblib"]
    assert (batch / "benchmark.html").is_file() == (code == 0)


def test_a_wrong_folder_is_refused_before_anything_is_meshed(
    batch: Path, tmp_path: Path, argv, capsys
) -> None:
    argv("benchmark", batch, tmp_path / "none", "--parts", tmp_path)
    assert ended(lambda: pytest.fail("it began")) == 2
    assert capsys.readouterr().err.startswith("error: ")
