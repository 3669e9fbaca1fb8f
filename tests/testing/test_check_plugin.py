"""Every plugin keeps the promises of its kind, and every broken promise is noticed."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.geometry.lattice import boundary
from polycube.kinds import KINDS
from polycube.registry import build, names
from polycube.testing import CHECKS, check, check_plugin
from polycube.testing.solids import PLACE, SIDES, solid
from polycube.types import Labels

NEEDED = {"given": {"context": ["cube"]}}  # options without a default


def broken(function: Callable) -> object:
    """A plugin that calls the function."""
    cls = type("Broken", (), {"__call__": staticmethod(function)})
    return dataclass(frozen=True)(cls)()


def test_every_kind_has_a_check() -> None:
    assert set(CHECKS) == set(KINDS)


@pytest.mark.parametrize(("kind", "name"), [(k, n) for k in KINDS for n in names(k)])
def test_our_own_plugins_conform(kind: str, name: str) -> None:
    check_plugin(kind, {"plugin": name, **NEEDED.get(name, {})})


def test_unknown_kind() -> None:
    with pytest.raises(LookupError, match="no plugin kind 'scheduler'; kinds are primitive"):
        check("scheduler", broken(lambda: None))


def test_a_plugin_is_a_frozen_dataclass_with_call() -> None:
    class Plain:
        def __call__(self) -> np.ndarray:
            return np.array([1.0, 0.5])

    with pytest.raises(AssertionError, match="frozen dataclass"):
        check("schedule", Plain())
    with pytest.raises(AssertionError, match="frozen dataclass"):
        check("schedule", dataclass(Plain)())
    with pytest.raises(AssertionError, match="has __call__"):
        check("schedule", dataclass(frozen=True)(type("Silent", (), {}))())


def says(kind: str, function: Callable, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check(kind, broken(function))


@pytest.mark.parametrize(
    ("alpha_bar", "message"),
    [
        ([1.0, 0.5], "numpy array; got list"),
        (np.ones((2, 2)), r"shape \(any\); got \(2, 2\)"),
        (np.array([1.0, np.nan]), "finite"),
        (np.array([1.0]), "T . 1 >= 2 entries; got 1"),
        (np.array([0.9, 0.5]), "starts at 1; got 0.9"),
        (np.array([1.0, 0.5, 0.0]), "stays above 0"),
        (np.array([1.0, 0.5, 0.5]), r"falls at every step; got no fall at \[1\]"),
    ],
)
def test_schedule(alpha_bar, message: str) -> None:
    says("schedule", lambda: alpha_bar, message)


def test_schedule_has_as_many_entries_as_steps() -> None:
    @dataclass(frozen=True)
    class Short:
        steps: int = 5

        def __call__(self) -> np.ndarray:
            return np.array([1.0, 0.5])

    with pytest.raises(AssertionError, match=r"steps \+ 1 entries; got 2"):
        check("schedule", Short())


def voxels(*empty: tuple[int, int, int]) -> np.ndarray:
    full = np.ones((3, 3, 3), bool)
    for place in empty:
        full[place] = False
    return full


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (np.ones((3, 3), bool), "shape"),
        (np.ones((3, 3, 3)), "bool; got float64"),
        (np.zeros((3, 3, 3), bool), "one solid"),
        (voxels(*[(1, j, k) for j in range(3) for k in range(3)]), "one solid"),
        (voxels((1, 1, 1)), "no voids"),
        (voxels(*[(i, j, k) for k in range(3) for i, j in ((0, 0), (1, 1))]), "manifold"),
    ],
)
def test_primitive(shape: np.ndarray, message: str) -> None:
    says("primitive", lambda: shape, message)


def test_primitive_that_changes() -> None:
    shapes = iter([voxels(), voxels((0, 0, 0))])
    says("primitive", lambda: next(shapes), "the same every time")


def test_model() -> None:
    torch = pytest.importorskip("torch")

    class Network(torch.nn.Module):
        def __init__(self, channels: int, context_length: int) -> None:
            super().__init__()
            self.mix = torch.nn.Conv2d(channels, 3, 1)
            self.bend = torch.nn.Linear(context_length, 3)

        def forward(self, x, t, context):
            side = self.bend(context) + t[:, None]
            return self.mix(x) + side[..., None, None]

    class Wide(Network):
        def forward(self, x, t, context):
            return super().forward(x, t, context)[:, :2]

    class Infinite(Network):
        def forward(self, x, t, context):
            return super().forward(x, t, context) / 0

    class Idle(Network):
        def forward(self, x, t, context):
            return self.mix(x) + t[:, None, None, None]

    class Blind(Network):
        def forward(self, x, t, context):
            seen = super().forward(torch.zeros_like(x), t, context)
            return seen + 0 * x[:, :3]

    class Random(Network):
        def forward(self, x, t, context):
            return super().forward(x, t, context) + torch.rand(())

    class Timeless(Network):
        def forward(self, x, t, context):
            return super().forward(x, 0 * t, context)

    def plugin(network: type) -> object:
        return broken(lambda channels, context_length, image: network(channels, context_length))

    check("model", plugin(Network))
    for network, message in [
        (Wide, r"shape \(4, 3, 32, 32\); got \(4, 2, 32, 32\)"),
        (Infinite, "output is finite"),
        (Idle, "every parameter; got none at bend.weight"),
        (Blind, "depends on the image"),
        (Random, "same input gives the same output"),
        (Timeless, "depends on t"),
    ]:
        with pytest.raises(AssertionError, match=message):
            check("model", plugin(network))


def test_sampler() -> None:
    torch = pytest.importorskip("torch")

    def jump(predict, x_T, process, generator):
        x_0 = predict(x_T, process.steps)
        return x_0, torch.stack([x_T, x_0])

    check("sampler", broken(jump))
    says("sampler", lambda p, x, *_: (x[:1], torch.stack([x, x])), r"x_0 has shape")
    says("sampler", lambda p, x, *_: (x, x), "states have shape")
    says("sampler", lambda p, x, *_: (p(x, 1), torch.stack([p(x, 1)] * 2)), "first state is x_T")
    says("sampler", lambda p, x, *_: (p(x, 1), torch.stack([x, x])), "last state is x_0")
    says("sampler", lambda p, x, *_: (x, torch.stack([x, x])), "predicts x_0 exactly")

    def careless(predict, x_T, process, generator):
        x_0 = predict(x_T, 1) + 1e-9 * torch.rand(x_T.shape)
        return x_0, torch.stack([x_T, x_0])

    says("sampler", careless, "same generator")


@dataclass(frozen=True)
class Pair:
    geometry: np.ndarray
    polycube: np.ndarray
    context: tuple


def test_data() -> None:
    def stream(polycube=(8, 3), context=("cube", None), seeded=True, lucky=False):
        def start(grid, primitives, seed):
            state = np.random.default_rng(seed)

            def pair(index: int) -> Pair:
                rng = state if lucky else np.random.default_rng([seed * seeded, index])
                return Pair(rng.normal(size=(8, 3)), np.zeros(polycube), context)

            return pair

        return start

    check("data", broken(stream()))
    says("data", stream(polycube=(7, 3)), r"polycube has shape \(8, 3\); got \(7, 3\)")
    says("data", stream(context=("cube",)), "names every cell")
    says("data", stream(context=("cube", "ball")), "known primitives")
    says("data", stream(seeded=False), "another seed")
    says("data", stream(lucky=True), "depends on i and seed")


def test_structure() -> None:
    def proposes(change: Callable) -> Callable:
        return lambda surface, candidates: [change(solid().candidate)]

    hole = solid("hole_z").candidate.polycube
    says("structure", proposes(lambda c: replace(c, polycube=hole)), "genus 0; got 1")
    says("structure", proposes(lambda c: replace(c, key="")), "has a key")
    says("structure", proposes(lambda c: replace(c, cost=np.inf)), "cost is finite")

    def mirrored(c):
        return replace(c, rough_map=replace(c.rough_map, positions=-c.rough_map.positions))

    says("structure", proposes(mirrored), "keeps orientation")
    says("structure", lambda surface, candidates: [], "something is proposed")

    def refuses(surface, candidates):
        raise InputError("never")

    says("structure", refuses, "something is proposed")


def test_structure_of_touching_edges() -> None:
    from polycube.geometry.lattice import lattice

    pits = voxels((0, 0, 0), (0, 0, 1), (1, 1, 1), (1, 1, 2))  # they meet along an edge
    touching = lattice((1, 1, 1), ("it",), {"it": pits})
    candidate = replace(solid().candidate, polycube=touching)
    says("structure", lambda surface, candidates: [candidate], "manifold boundary")


def test_regularize() -> None:
    def snapped(candidate, points):
        middle = points - 0.5
        return 0.5 + middle / np.abs(middle).max(1, keepdims=True) / 2

    check("regularize", broken(snapped))
    says("regularize", lambda c, p: p[:10], r"shape \(500, 3\)")
    says("regularize", lambda c, p: p, "lie on the polycube")
    says("regularize", lambda c, p: 1 - snapped(c, p), "stay where they belong")


def test_segment() -> None:
    own = build("meshing/segment", {"plugin": "nearest"})

    def changed(change: Callable) -> Callable:
        return lambda *given: change(own(*given))

    says("meshing/segment", changed(lambda found: found.axis), "Labels; got ndarray")
    says(
        "meshing/segment",
        changed(lambda found: Labels(found.axis[1:], found.patch[1:])),
        "faces have a label",
    )
    says("meshing/segment", changed(lambda f: Labels(f.axis, f.patch + 99)), "polycube face")

    def first(surface, polycube, parametrization):
        faces, n = boundary(polycube), len(surface.faces)
        return Labels(np.full(n, faces.axis[0]), np.full(n, faces.patch[0]))

    says("meshing/segment", first, "axis of its normal")


def subdivides(change: Callable) -> Callable:
    def plugin(surface, polycube, rough_map):
        name = "cube" if polycube.occupancy.size == 1 else "hole_z"
        return change(solid(name).hexes)

    return plugin


def test_subdivide() -> None:
    check("meshing/subdivide", broken(subdivides(lambda h: h)))
    says("meshing/subdivide", subdivides(lambda h: h.vertices), "HexMesh; got ndarray")
    says("meshing/subdivide", lambda *_: solid("hole_z").hexes, "genus 0; got 1")
    noise = iter(np.linspace(0, 1, 9))
    says(
        "meshing/subdivide",
        subdivides(lambda h: replace(h, vertices=h.vertices + next(noise))),
        "equal input gives equal hexes",
    )
    says("meshing/subdivide", subdivides(lambda h: replace(h, cell=h.cell + 1)), "grid cell")


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
    says(kind, plugin, message)


def test_smooth_must_come_to_the_surface_and_keep_the_hexes() -> None:
    says("meshing/smooth", lambda surface, hexes: hexes, "keeps units and placement")

    def finer(surface, hexes):
        return solid("hole_z" if len(hexes.quads) > 200 else "cube", 12.0).hexes

    says("meshing/smooth", finer, "genus|leaves the hexes")


def test_optimize_must_not_spoil_a_good_mesh() -> None:
    def shaken(surface, hexes):
        move = np.random.default_rng(0).uniform(-3.3, 3.3, hexes.vertices.shape)
        move[hexes.quads] = 0
        return replace(hexes, vertices=hexes.vertices + move)

    says("meshing/optimize", shaken, "stays good")
    check("meshing/optimize", broken(lambda surface, hexes: hexes))


def test_spline() -> None:
    own = build("spline", {"plugin": "h2s"})

    def changed(**changes: Callable) -> Callable:
        def plugin(hexes):
            spline = own(hexes)
            return replace(spline, **{k: change(spline) for k, change in changes.items()})

        return plugin

    says("spline", lambda hexes: hexes, "Spline; got HexMesh")
    says("spline", changed(extraction=lambda s: 0.9 * s.extraction), "partition of unity")
    says("spline", changed(control=lambda s: s.control[1:]), "the extraction is")
    says("spline", changed(nodes=lambda s: s.nodes + 10**7), "nodes number")
    says("spline", changed(element_hex=lambda s: 0 * s.element_hex), "every hex has an element")
    says("spline", changed(control=lambda s: s.control / 2), "sides of the mesh")
    says("spline", changed(nodes=lambda s: s.nodes[:, ::-1]), "right-handed")


def test_analysis() -> None:
    own = build("analysis", {"plugin": "modal", "modes": 8})

    def changed(**changes: Callable) -> Callable:
        def plugin(spline):
            modes = own(spline)
            return replace(modes, **{k: change(modes) for k, change in changes.items()})

        return plugin

    says("analysis", lambda spline: 0, "Modes; got int")
    says("analysis", changed(shapes=lambda m: m.shapes[:, 1:]), "shapes has shape|shapes have")
    says("analysis", changed(eigenvalues=lambda m: m.eigenvalues[::-1]), "ascend")
    says("analysis", changed(mass=lambda m: -1.0), "mass is positive")
    says(
        "analysis",
        changed(eigenvalues=lambda m: m.eigenvalues[:6], shapes=lambda m: m.shapes[:6]),
        "modes beyond the six rigid ones",
    )
    says("analysis", changed(eigenvalues=lambda m: m.eigenvalues + 1e12), "six rigid motions")


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

    says("export", lambda hexes, path: path, "the path written is returned")
    says("export", elsewhere, "lies in the folder asked for")
    says("export", lambda hexes, path: own(hexes, path.with_name("x")), "name is kept")
    says("export", litter, "nothing else is left")
    says("export", dated, "equal input, equal bytes")
    pytest.importorskip("meshio")
    says("export", metres, "points come back")
    says("export", other_order, "VTK's order of nodes")
