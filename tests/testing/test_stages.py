"""Every violated requirement of a stage is reported."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.registry import build
from polycube.structure.lattice import boundary, lattice
from polycube.testing import check
from polycube.testing.solids import PLACE, SIDES, solid
from polycube.types import Labels, RoughMap
from tests.testing.broken import assert_refused, broken, voxels


def test_structure() -> None:
    def proposes(change: Callable) -> Callable:
        return lambda surface, candidates: [change(solid().candidate)]

    hole = solid("hole_z").candidate.polycube
    assert_refused("structure", proposes(lambda c: replace(c, polycube=hole)), "genus 0; got 1")
    assert_refused("structure", proposes(lambda c: replace(c, key="")), "has a key")
    assert_refused("structure", proposes(lambda c: replace(c, cost=np.inf)), "cost is finite")

    def mirrored(c):
        return replace(c, rough_map=replace(c.rough_map, positions=-c.rough_map.positions))

    assert_refused("structure", proposes(mirrored), "keeps orientation")
    assert_refused("structure", lambda surface, candidates: [], "something is proposed")

    def refuses(surface, candidates):
        raise InputError("never")

    assert_refused("structure", refuses, "something is proposed")


def test_structure_of_touching_edges() -> None:
    pits = voxels((0, 0, 0), (0, 0, 1), (1, 1, 1), (1, 1, 2))  # they meet along an edge
    touching = lattice((1, 1, 1), ("it",), {"it": pits})
    candidate = replace(solid().candidate, polycube=touching)
    assert_refused("structure", lambda surface, candidates: [candidate], "manifold boundary")


def test_ranking() -> None:
    ranking = build("ranking", {"plugin": "registration", "rounds": 2})
    check("ranking", ranking)
    assert_refused("ranking", lambda surface, found: ranking(surface, found)[::-1], "ranks first")


def test_acceptance() -> None:
    acceptance = build("acceptance", {"plugin": "standard"})
    check("acceptance", acceptance)
    assert_refused("acceptance", lambda hexes, surface: None, "is a Verdict")
    always = replace(acceptance(solid().hexes, solid().surface), failures=())
    assert_refused("acceptance", lambda hexes, surface: always, "is not valid")

    def missing(shortfall):
        return lambda hexes, surface: replace(acceptance(hexes, surface), shortfall=shortfall)

    assert_refused("acceptance", missing({}), "farther from the goal than the block; got \\[\\]")
    assert_refused("acceptance", missing({"features": 0.0}), "each shortfall is positive")
    assert_refused("acceptance", missing({"validity": 9.0}), "farther from the goal")


def test_segment() -> None:
    own = build("meshing/segment", {"plugin": "nearest"})

    def changed(change: Callable) -> Callable:
        return lambda *given: change(own(*given))

    assert_refused("meshing/segment", changed(lambda found: found.axis), "Labels; got ndarray")
    assert_refused(
        "meshing/segment",
        changed(lambda found: Labels(found.axis[1:], found.patch[1:])),
        "faces have a label",
    )
    assert_refused(
        "meshing/segment", changed(lambda f: Labels(f.axis, f.patch + 99)), "polycube face"
    )

    def first(surface, polycube, parametrization):
        faces, n = boundary(polycube), len(surface.faces)
        return Labels(np.full(n, faces.axis[0]), np.full(n, faces.patch[0]))

    assert_refused("meshing/segment", first, "axis of its normal")


def test_map() -> None:
    assert_refused("meshing/map", lambda *given: None, "is a RoughMap; got NoneType")
    assert_refused("meshing/map", lambda *given: given[-1], "units and placement")

    def wide_hole(surface, polycube, labels, parametrization, rough_map):
        lines = [np.where((k > 0) & (k < 1), 0.5 + 1.5 * (k - 0.5), k) for k in polycube.knots]
        places = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
        return RoughMap(*polycube.knots, PLACE + places * SIDES)

    assert_refused("meshing/map", wide_hole, "boundary is on the surface")


def subdivides(change: Callable) -> Callable:
    def plugin(surface, polycube, rough_map, blocks):
        name = "cube" if polycube.occupancy.size == 1 else "hole_z"
        return change(solid(name).hexes)

    return plugin


def test_subdivide() -> None:
    check("meshing/subdivide", broken(subdivides(lambda h: h)))
    assert_refused("meshing/subdivide", subdivides(lambda h: h.vertices), "HexMesh; got ndarray")
    assert_refused("meshing/subdivide", lambda *_: solid("hole_z").hexes, "genus 0; got 1")
    noise = iter(np.linspace(0, 1, 9))
    assert_refused(
        "meshing/subdivide",
        subdivides(lambda h: replace(h, vertices=h.vertices + next(noise))),
        "equal input gives equal hexes",
    )
    assert_refused(
        "meshing/subdivide", subdivides(lambda h: replace(h, cell=h.cell + 1)), "grid cell"
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda h: replace(h, hexes=h.hexes[1:], cell=h.cell[1:]),
            "meet in whole faces; got: quads are not",
        ),
        (lambda h: replace(h, hexes=h.hexes[:, [4, 5, 6, 7, 0, 1, 2, 3]]), "no hex is inverted"),
        (lambda h: replace(h, vertices=h.vertices / 25.4), "keeps units and placement"),
        (lambda h: replace(h, vertices=h.vertices - PLACE), "keeps units and placement"),
        (lambda h: replace(h, vertices=PLACE + 1.1 * (h.vertices - PLACE)), "keeps units"),
        (lambda h: replace(h, patch=h.patch + 50), "patches are those of the polycube"),
        (lambda h: replace(h, vertices=np.where(SIDES < 0, 0, np.nan) + h.vertices), "finite"),
    ],
)
@pytest.mark.parametrize("kind", ["meshing/subdivide", "meshing/pillow"])
def test_hexes(kind: str, change: Callable, message: str) -> None:
    plugin = subdivides(change) if kind.endswith("subdivide") else lambda s, h: change(h)
    assert_refused(kind, plugin, message)


def test_smooth_must_come_to_the_surface_and_keep_the_hexes() -> None:
    assert_refused("meshing/smooth", lambda surface, hexes: hexes, "keeps units and placement")

    def finer(surface, hexes):
        return solid("hole_z" if len(hexes.quads) > 200 else "cube", 12.0).hexes

    assert_refused("meshing/smooth", finer, "genus|leaves the hexes")


def test_optimize_must_not_spoil_a_good_mesh() -> None:
    def shaken(surface, hexes):
        move = np.random.default_rng(0).uniform(-3.3, 3.3, hexes.vertices.shape)
        move[hexes.quads] = 0
        return replace(hexes, vertices=hexes.vertices + move)

    assert_refused("meshing/optimize", shaken, "stays good")
    check("meshing/optimize", broken(lambda surface, hexes: hexes))


@pytest.mark.slow
def test_spline() -> None:
    own = build("spline", {"plugin": "h2s"})

    def changed(**changes: Callable) -> Callable:
        def plugin(surface, hexes):
            spline = own(surface, hexes)
            return replace(spline, **{k: change(spline) for k, change in changes.items()})

        return plugin

    assert_refused("spline", lambda surface, hexes: hexes, "Spline; got HexMesh")
    assert_refused("spline", changed(extraction=lambda s: 0.9 * s.extraction), "partition of unity")
    assert_refused("spline", changed(nodes=lambda s: s.nodes + 10**7), "nodes number")
    assert_refused(
        "spline", changed(element_hex=lambda s: 0 * s.element_hex), "every hex has an element"
    )
    assert_refused("spline", changed(patch=lambda s: 0 * s.patch), "patches of the mesh")
    assert_refused("spline", changed(control=lambda s: s.control / 2), "sides of the mesh")
    assert_refused("spline", changed(nodes=lambda s: s.nodes[:, ::-1]), "right-handed")


@pytest.mark.slow
def test_analysis() -> None:
    own = build("analysis", {"plugin": "modal", "modes": 8})

    def changed(**changes: Callable) -> Callable:
        def plugin(spline):
            modes = own(spline)
            return replace(modes, **{k: change(modes) for k, change in changes.items()})

        return plugin

    assert_refused("analysis", lambda spline: 0, "Modes, Deformation or Potential; got int")
    assert_refused(
        "analysis", changed(shapes=lambda m: m.shapes[:, 1:]), "shapes has shape|shapes have"
    )
    assert_refused("analysis", changed(eigenvalues=lambda m: m.eigenvalues[::-1]), "ascend")
    assert_refused("analysis", changed(mass=lambda m: -1.0), "mass is positive")
    assert_refused(
        "analysis",
        changed(eigenvalues=lambda m: m.eigenvalues[:6], shapes=lambda m: m.shapes[:6]),
        "modes beyond the rigid ones",
    )
    assert_refused(
        "analysis", changed(eigenvalues=lambda m: m.eigenvalues + 1e12), "6 motions are rigid"
    )


@pytest.mark.slow
def test_analysis_at_rest_and_of_potentials() -> None:
    def changed(name: str, **changes: Callable) -> Callable:
        own = build("analysis", {"plugin": name})

        def plugin(spline):
            found = own(spline)
            return replace(found, **{k: change(found) for k, change in changes.items()})

        return plugin

    nodal = ("displacement", "stress", "von_mises")
    cut = {name: lambda d, name=name: getattr(d, name)[1:] for name in nodal}
    assert_refused("analysis", changed("static", **cut), "displacement")
    assert_refused(
        "analysis",
        changed("static", reactions=lambda d: 2 * d.reactions),
        "supports balance the loads",
    )
    assert_refused("analysis", changed("static", mass=lambda d: 0.0), "mass is positive")
    assert_refused("analysis", changed("poisson", values=lambda p: p.values[1:]), "the values")
    assert_refused("analysis", changed("poisson", flux=lambda p: p.flux[1:]), "the flux")
    assert_refused(
        "analysis", changed("poisson", flows=lambda p: p.flows + 1), "supports balance the loads"
    )
    assert_refused("analysis", changed("poisson", supports=lambda p: ()), "there is a support")


def test_export() -> None:
    own = build("export", {"plugin": "medit"})

    def other_order(hexes, path: Path) -> Path:
        return own(replace(hexes, hexes=hexes.hexes[:, [0, 3, 2, 1, 4, 7, 6, 5]]), path)

    def metres(hexes, path: Path) -> Path:
        return own(replace(hexes, vertices=hexes.vertices / 1000), path)

    def elsewhere(hexes, path: Path) -> Path:
        (path.parent / "sub").mkdir(exist_ok=True)
        return own(hexes, path.parent / "sub" / "hex")

    def litter(hexes, path: Path) -> Path:
        (path.parent / "log.txt").write_text("")
        return own(hexes, path)

    count = iter(range(9))

    def dated(hexes, path: Path) -> Path:
        path = path.with_suffix(".dated")
        path.write_text(str(next(count)))
        return path

    assert_refused("export", lambda hexes, path: path, "the path written is returned")
    assert_refused("export", elsewhere, "is in the given folder")
    assert_refused(
        "export", lambda hexes, path: own(hexes, path.with_name("x")), "has the given name"
    )
    assert_refused("export", litter, "no other file")
    assert_refused("export", dated, "equal input, equal bytes")
    pytest.importorskip("meshio")
    assert_refused("export", metres, "points are read back")
    assert_refused("export", other_order, "VTK's order of nodes")
