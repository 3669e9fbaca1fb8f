"""Numbers of a hex mesh for a report: measures, certificate, deviation, the worst hexes."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from polycube.hexmesh import quality
from polycube.hexmesh.certificate import certify
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.metrics import metrics, worst
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.report.numbers import features, sets
from polycube.surface import closest
from polycube.surface import measures as topology
from polycube.surface.fit_target import target
from polycube.types import Goal, HexMesh, Json, TriMesh

N_WORST = 5  # number of the worst hexes by scaled Jacobian, and one by each other measure
# columns of the table of the worst hexes
SHOWN = ("scaled_jacobian", "edge_ratio", "skew", "condition")
BINS = 40
SAMPLES = 40_000  # points of the surface whose distances from the mesh are measured
WAYS = ("spline_to_surface", "surface_to_spline")
# largest distance between spline and surface without a warning: of the diagonal, for 99 % of the
# points in both directions
SPLINE_LIMIT = 0.015
DETJ_LIMIT = 0.05  # smallest det J without a warning, relative to its mean in the element
_ENDS = ("_max", "_mean", "_p95", "_p99")  # suffixes of the names of distances
# ranges of the histograms; the last bar includes larger values, so that runs can be compared
RANGES = dict.fromkeys(("scaled_jacobian", "skew", "shape"), (0.0, 1.0))
RANGES |= {"edge_ratio": (1.0, 9.0), "max_edge_ratio": (1.0, 9.0), "condition": (1.0, 5.0)}


@lru_cache(maxsize=2)
def measured(mesh: HexMesh) -> dict[str, np.ndarray]:
    """(H,) values of each measure; cached for numbers and page."""
    return metrics(mesh.vertices, mesh.hexes)


def short(mesh: HexMesh, surface: TriMesh) -> dict[str, object]:
    """The main numbers, as fractions of the diagonal of the bounding box of the surface."""
    jacobian = scaled_jacobian(mesh.vertices, mesh.hexes)
    deviation = quality.deviation(mesh, surface, SAMPLES)
    worst_hex = int(jacobian.argmin())
    return {
        "hexes": len(mesh.hexes),
        "vertices": len(mesh.vertices),
        "min_scaled_jacobian": float(jacobian.min()),
        "mean_scaled_jacobian": float(jacobian.mean()),
        "inverted": int((jacobian <= 0).sum()),
        "worst_hex": worst_hex,
        "worst_hex_center": mesh.vertices[mesh.hexes[worst_hex]].mean(0).tolist(),
        "vertex_off_surface_max": deviation.vertices,
        **distances("mesh_to_surface", deviation.to_surface),
        **distances("surface_to_mesh", deviation.to_mesh),
        "creases_to_edges_p95": quality.creases_to_edges(mesh, surface),
        "volume": quality.volume(mesh),
        "volume_error": abs(quality.volume(mesh) / topology.volume(surface) - 1),
    }


def full(
    mesh: HexMesh, surface: TriMesh, context: Sequence[str | None] = (), goal: Goal | None = None
) -> dict[str, object]:
    """The numbers of a hex mesh in `report.json`.

    context : primitive per grid cell; empty if it is unknown
    goal : limits of features; None: the default ones
    """
    numbers: Json = short(mesh, surface)
    found = measured(mesh)
    diagonal = topology.diagonal(surface)
    worst_quad = mesh.quads[quad_deviation(mesh, surface).argmax()]
    return {
        **numbers,
        "deviation": {
            "unit": surface.unit or "model units",
            "diagonal": diagonal,
            **{name: numbers[name] * diagonal for name in numbers if name.endswith(_ENDS)},
            "mesh_to_surface_max_at": mesh.vertices[worst_quad].mean(axis=0).tolist(),
            "surface_to_mesh_max_at": farthest(mesh, surface).tolist(),
        },
        "quality": {
            name: {"min": float(v.min()), "mean": float(v.mean()), "max": float(v.max())}
            for name, v in found.items()
        },
        "histograms": {name: histogram(name, values) for name, values in found.items()},
        "worst": worst_hexes(mesh, context),
        "certificate": certificate(mesh),
        "features": features.numbers(mesh, surface, goal),
        "sets": sets.numbers(mesh, surface),
        "node_sets": {name: len(nodes) for name, nodes in mesh.node_sets.items()},
        "faces_without_quads": list(inspect(mesh, surface).lost_faces),
    }


def spline_warnings(numbers: object) -> list[str]:
    """Warnings about the spline, one sentence each.

    numbers : numbers of the spline in `report.json`; empty if there is none
    """
    if not isinstance(numbers, Mapping):
        return []
    found = []
    if not numbers["is_positive"]:
        found.append("the spline may fold over itself: its det J is not positive everywhere")
    elif numbers["min_scaled_detj"] < DETJ_LIMIT:
        place = ", ".join(f"{x:.5g}" for x in numbers["min_scaled_detj_at"])
        found.append(
            f"det J of the spline is {numbers['min_scaled_detj']:.3f} of its mean in the element "
            f"at ({place}), less than {DETJ_LIMIT:g}, and the fit could not raise it: the hex has "
            f"a scaled Jacobian of {numbers['min_scaled_detj_hex']:.2f}, and "
            f"{numbers['min_scaled_detj_edges']} extraordinary edges meet there"
        )
    distance = max(numbers[f"{way}_p99"] for way in WAYS)
    if distance >= SPLINE_LIMIT:
        far = f"for 99 % of the points, more than {SPLINE_LIMIT:.1%}"
        found.append(f"spline and surface are up to {distance:.1%} of the diagonal apart {far}")
    return found


def distances(name: str, distances: quality.Distances) -> dict[str, float]:
    values = {"max": distances.largest, "mean": distances.mean, "p99": distances.p99}
    return {f"{name}_{end}": value for end, value in values.items()}


def histogram(name: str, values: np.ndarray) -> dict[str, list]:
    """Counts (BINS,) between edges (BINS + 1,); the outer bars include values outside."""
    low, high = RANGES[name]
    if name == "scaled_jacobian" and values.min() < 0:
        low = -1.0
    count, edges = np.histogram(np.clip(values, low, high), bins=BINS, range=(low, high))
    return {"edges": edges.tolist(), "counts": count.tolist()}


def worst_hexes(mesh: HexMesh, context: Sequence[str | None] = ()) -> list[dict[str, object]]:
    """The worst hexes by scaled Jacobian and by each other measure, with their places."""
    found, rows = measured(mesh), []
    for measure in SHOWN:
        for hexa in worst(measure, found[measure], N_WORST if measure == SHOWN[0] else 1):
            corners = mesh.hexes[hexa]
            sides = np.isin(mesh.quads, corners).all(axis=1)
            cell = int(mesh.cell[hexa])
            row = {"worst_by": measure, "hex": int(hexa)}
            row |= {name: float(found[name][hexa]) for name in SHOWN}
            row |= {"center": mesh.vertices[corners].mean(axis=0).tolist(), "cell": cell}
            if context:
                row["primitive"] = context[cell]
            row["patches"] = np.unique(mesh.patch[sides]).tolist()  # empty: inside
            rows.append(row)
    return rows


def off_surface(mesh: HexMesh, surface: TriMesh) -> np.ndarray:
    """(V,) distance of the boundary vertices from the surface in model units; 0 inside."""
    goal, outer = target(surface), np.unique(mesh.quads)
    found = np.zeros(len(mesh.vertices))
    found[outer] = goal.scale * closest.distance(goal.tree, goal.to_unit(mesh.vertices[outer]))
    return found


@lru_cache(maxsize=2)
def quad_deviation(mesh: HexMesh, surface: TriMesh) -> np.ndarray:
    """(Q,) largest distance of 13 points of each boundary quad from the surface, model units."""
    away = quality.boundary_samples(mesh, surface).distance
    return target(surface).scale * away.reshape(len(mesh.quads), -1).max(axis=1)


def farthest(mesh: HexMesh, surface: TriMesh) -> np.ndarray:
    """(3,) point of the surface, a vertex or a sample, with the largest distance from the mesh."""
    found = quality.surface_samples(mesh, surface, SAMPLES)
    return target(surface).to_model(found.points[found.distance.argmax()])


def certificate(mesh: HexMesh) -> dict[str, object]:
    """Number of hexes whose Jacobian is certified positive."""
    found = certify(mesh.vertices, mesh.hexes)
    least = int(found.bound.argmin())
    return {
        "positive_at_corners": bool((scaled_jacobian(mesh.vertices, mesh.hexes) > 0).all()),
        "positive_everywhere": bool(found.positive.all()),
        "not_positive": int(found.refuted.sum()),
        "undecided": int((~found.positive & ~found.refuted).sum()),
        "not_certified": np.flatnonzero(~found.positive)[:100].tolist(),
        "least_bound": float(found.bound[least]),  # of det J, relative to its mean in the hex
        "least_bound_hex": least,
    }
