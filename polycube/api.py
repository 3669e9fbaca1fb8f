"""The program from Python, for scripts and notebooks: `polycube.mesh("part.step")`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from hydra import compose, initialize_config_dir
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

import polycube.cli.search_path  # noqa: F401  (lets Hydra see the conf of installed plugin packages)
from polycube import HOME
from polycube.cli.infer import finish
from polycube.errors import InputError, MeshingError
from polycube.types import HexMesh, Modes, Polycube, Solution, Spline, TriMesh

HEX = (".vtu", ".vtk", ".mesh", ".msh", ".inp")  # files of hex meshes, to be improved


@dataclass(frozen=True, eq=False)
class Part:
    """What a run made; what it was not asked for, or did not reach, is None."""

    surface: TriMesh
    polycube: Polycube | None
    hexes: HexMesh | None
    spline: Spline | None
    solution: Solution | None
    report: dict[str, object]  # as in report.json

    @property
    def modes(self) -> Modes | None:
        """The solution, where it is modes."""
        return self.solution if isinstance(self.solution, Modes) else None


def mesh(source: object, *overrides: str, output_dir: str | Path | None = None) -> Part:
    """Take a part all the way, as `infer.py mesh=source overrides...` does.

    source : path of a surface or hex mesh, `example:rod`, or anything with `vertices` (V, 3) and
        triangles `faces` (F, 3), such as a TriMesh or trimesh.Trimesh
    overrides : of the configuration, such as "meshing.size=4%", "analysis.material=aluminium"
    output_dir : keep the files of the run there; None: nothing is written
    Raises InputError for what must be refused, MeshingError where there is no valid result.
    """
    with TemporaryDirectory() as scratch:
        path = _written(source, Path(scratch))
        key = "hex" if path.lower().endswith(HEX) else "mesh"
        cfg = _composed(["quiet=true", *overrides], {key: path})
        if output_dir is None:
            cfg["order"] = [half for half in cfg["order"] if half != "report"]
        cfg["output_dir"] = str(output_dir or Path(scratch) / "run")
        state, report = finish(cfg)
    if report.get("interrupted"):
        raise KeyboardInterrupt
    if not report["valid"]:
        raise MeshingError(report["failure"])
    names = ("surface", "polycube", "hexes", "spline", "solution")
    return Part(**{name: state.get(name) for name in names}, report=report)


def _written(source: object, folder: Path) -> str:
    """The path given, or that of a file of the surface given, exact to the last bit."""
    if isinstance(source, str | Path):
        return str(source)
    path = folder / "part.obj"
    corners = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(source.vertices).tolist())
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c in (np.asarray(source.faces) + 1).tolist())
    path.write_text(corners + faces)
    return str(path)


def _composed(overrides: list[str], settings: dict[str, str]) -> dict[str, object]:
    try:
        with initialize_config_dir(str(HOME / "conf"), version_base="1.3"):
            cfg = compose("infer", overrides)
        filled = OmegaConf.to_container(cfg, resolve=True, throw_on_missing=False)
    except (HydraException, OmegaConfBaseException) as error:
        raise InputError(" ".join(str(error).split())) from None
    return {**filled, **settings}
