"""The arrays for JAXIGA, evaluated as its function space does."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest

from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build, provide
from tests.fixtures.hexmeshes import hex_box, hex_cylinder
from tests.fixtures.splines import meshed_box, spline_of


def arrays(mesh, folder, spline=None) -> dict[str, np.ndarray]:
    plugin = provide(build("export", {"plugin": "jaxiga"}), spline=spline)
    with np.load(plugin(mesh, folder / "hex")) as file:
        return dict(file)


def evaluated(space, elements: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Points at places (P, 3) of [-1, 1]^3 in elements (P,): N = C B, rational, padded by one."""
    p = int(space["degree"][0])
    t = (at + 1) / 2
    line = [comb(p, i) * t**i * (1 - t) ** (p - i) for i in range(p + 1)]
    b = np.einsum("ip,jp,kp->pkji", *np.moveaxis(line, 2, 0)).reshape(len(at), -1)
    functions = np.einsum("pfm,pm->pf", space["extraction"][elements], b)
    points = np.vstack([space["cpts"], np.full(3, np.pi)])  # the last is reached by padding alone
    weights = np.append(space["wgts"], 1.0)
    dofs = space["elem_dofs"][elements]
    share = functions * weights[dofs]
    np.testing.assert_allclose(share.sum(axis=1), 1, atol=1e-12)
    return np.einsum("pf,pfi->pi", share, points[dofs]) / share.sum(axis=1, keepdims=True)


def on_spline(spline, elements: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The same points by de Casteljau's algorithm on the Bezier points."""
    cube = (spline.extraction @ spline.control)[spline.nodes[elements]].reshape(-1, 4, 4, 4, 3)
    for x in (at[:, ::-1].T + 1) / 2:  # zeta first
        x = x.reshape(-1, *[1] * (cube.ndim - 1))
        for _ in range(3):
            cube = (1 - x) * cube[:, :-1] + x * cube[:, 1:]
        cube = cube[:, 0]
    return cube


@pytest.mark.parametrize("refine", [{}, {"elements": [0, 5]}])
def test_the_arrays_are_the_spline_at_random_points(refine, tmp_path) -> None:
    mesh = hex_cylinder()
    spline = spline_of(mesh, "optimal", refine=refine, fit={"rounds": 0})
    space = arrays(mesh, tmp_path, spline)
    n = len(space["elem_dofs"])
    assert space["extraction"].shape == (n, space["elem_dofs"].shape[1], 64)
    assert space["elem_vertex"].shape == (n, 6) and space["degree"].tolist() == [3, 3, 3]
    absent = space["elem_dofs"] == len(space["cpts"])
    assert absent.any() == bool(refine) and not space["extraction"][absent].any()
    rng = np.random.default_rng(2)
    elements, at = rng.integers(n, size=300), rng.uniform(-1, 1, (300, 3))
    expected = on_spline(spline, elements, at)
    np.testing.assert_allclose(evaluated(space, elements, at), expected, atol=1e-12)


@pytest.mark.parametrize("is_spline", [True, False])
def test_boundary_sets_have_sides_and_their_functions(is_spline, tmp_path) -> None:
    """Sides 2 d and 2 d + 1; a side is unchanged if all other control points are moved."""
    mesh, _ = meshed_box((3, 2, 2), (3.0, 2.0, 2.0))
    space = arrays(mesh, tmp_path, spline_of(mesh) if is_spline else None)
    for name in ("x_min", "x_max", "y_min", "z_max"):
        elements, sides, dofs = (
            space[f"boundaries/{name}/{what}"] for what in ("elems", "sides", "dofs")
        )
        axis, end = "xyz".index(name[0]), int(name.endswith("max"))
        assert len(elements) == {0: 4, 1: 6, 2: 6}[axis]
        at = np.random.default_rng(3).uniform(-1, 1, (len(elements), 3))
        at[np.arange(len(elements)), sides // 2] = 2 * (sides % 2) - 1
        level = end * (3.0, 2.0, 2.0)[axis]
        on_side = evaluated(space, elements, at)
        np.testing.assert_allclose(on_side[:, axis], level, atol=1e-12)
        moved = space["cpts"] + 7.0
        moved[dofs] = space["cpts"][dofs]
        np.testing.assert_allclose(evaluated(space | {"cpts": moved}, elements, at), on_side)


def test_without_a_spline_the_space_is_trilinear(tmp_path) -> None:
    plain = hex_box((2, 2, 1), (2.0, 2.0, 1.0))
    bent = plain.vertices + 0.1 * np.sin(plain.vertices[:, ::-1] * 3)
    mesh = replace(plain, vertices=bent, sets=boundary_sets(plain))
    space = arrays(mesh, tmp_path)
    assert space["degree"].tolist() == [1, 1, 1]
    middle = evaluated(space, np.arange(4), np.zeros((4, 3)))
    np.testing.assert_allclose(middle, bent[mesh.hexes].mean(axis=1))
    corner = evaluated(space, np.arange(4), np.tile([1.0, -1.0, 1.0], (4, 1)))
    np.testing.assert_allclose(corner, bent[mesh.hexes[:, 5]])
