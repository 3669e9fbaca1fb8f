"""Divide every hex into eight, with new vertices at the centres of edges, faces and hexes."""

from dataclasses import replace

import numpy as np

from polycube.hexmesh.connectivity import PLACES, label_of, unique_rows
from polycube.surface.measures import half_edges
from polycube.types import HexMesh

_GRID = np.stack(np.meshgrid(*[range(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)  # (27, 3)
# the corners whose mean is each of the 27 points; the same point may have several numbers
_PARENTS = [np.flatnonzero(((place == 1) | (2 * PLACES == place)).all(axis=1)) for place in _GRID]
_CHILDREN = (PLACES[:, None] + PLACES) @ [9, 3, 1]  # (8, 8) points of the corners of each child


def split(mesh: HexMesh) -> HexMesh:
    """Divide every hex into eight; the existing vertices keep their numbers.

    The children of hex h are 8 h to 8 h + 7, those of quad q are 4 q to 4 q + 3.
    """
    number = np.zeros((len(mesh.hexes), 27), np.int64)
    vertices = [mesh.vertices]
    middles = {}
    for size in (1, 2, 4, 8):
        here = [k for k, parents in enumerate(_PARENTS) if len(parents) == size]
        corners = np.stack([mesh.hexes[:, _PARENTS[k]] for k in here], axis=1)  # (H, K, size)
        if size == 1:
            number[:, here] = corners[..., 0]
            continue
        rows, inverse, _ = unique_rows(np.sort(corners.reshape(-1, size), axis=1))
        start = sum(map(len, vertices))
        number[:, here] = start + inverse.reshape(corners.shape[:2])
        vertices.append(mesh.vertices[rows].mean(axis=1))
        middles[size] = rows, start
    hexes = number[:, _CHILDREN].reshape(-1, 8)
    return replace(
        mesh,
        vertices=np.vstack(vertices),
        hexes=hexes,
        quads=_split_quads(mesh.quads, middles),
        patch=np.repeat(mesh.patch, 4),
        cell=np.repeat(mesh.cell, 8),
    )


def _split_quads(quads: np.ndarray, middles: dict[int, tuple[np.ndarray, int]]) -> np.ndarray:
    """(4 Q, 4) children of the boundary quads, with the same orientation."""
    middle = _number_of(half_edges(quads), *middles[2]).reshape(-1, 4)
    centre = np.repeat(_number_of(quads, *middles[4])[:, None], 4, axis=1)
    return np.stack([quads, middle, centre, np.roll(middle, 1, axis=1)], axis=-1).reshape(-1, 4)


def _number_of(rows: np.ndarray, known: np.ndarray, start: int) -> np.ndarray:
    """Vertex at the centre of each row of corners; `known` are the distinct rows."""
    return start + label_of(rows, known, np.arange(len(known)))
