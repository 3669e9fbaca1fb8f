"""Positions of a labelled surface on a lattice of bricks: fields, their order, knots."""

import logging

import numpy as np

from .charts import Charts, Field, charts, field, stiffness
from .lattice import Bricks, positions, quantized
from .order import Pair, pairs, spaced
from .pieces import Pieces

logger = logging.getLogger(__name__)

NEGLIGIBLE = 0.1  # sum of the distances, in diagonals, below which a pair of charts may be ignored


def placement(
    pieces: Pieces, label: np.ndarray, genus: int, least: float, apart: float
) -> tuple[Bricks, np.ndarray] | None:
    """Bricks for labels (P,) without lost charts, with knots at creases if possible.

    Also returns the positions (V, 3) of the vertices in knot numbers.

    least : smallest distance of charts that face each other, or half of their distance
    apart : closer knots are merged if nothing is lost
    """
    best: tuple[Bricks, np.ndarray] | None = None
    for with_creases in (True, False):
        found = _placed(pieces, charts(pieces, label, with_creases), genus, least, apart)
        if found is not None and (best is None or found[0].hidden < best[0].hidden):
            best = found
        if best is not None and not best[0].hidden:
            break
    return best


def _placed(
    pieces: Pieces, charts: Charts, genus: int, least: float, apart: float
) -> tuple[Bricks, np.ndarray] | None:
    """Bricks for charts; None if the charts cannot keep their order or one is lost."""
    order = pairs(pieces, charts)
    matrix = stiffness(pieces.surface)
    fields: list[Field] = []
    constants: list[np.ndarray] = []
    for axis in range(3):
        if charts.number[axis] < 2:
            return None
        place = pieces.surface.vertices[:, axis]
        fields.append(field(matrix, place, charts.group[axis], charts.number[axis]))
        values = _constants(fields[axis], [pair for pair in order if pair.axis == axis], least)
        if values is None:
            logger.info("labels: no coordinates along %s keep the order of the charts", "xyz"[axis])
            return None
        constants.append(values)
    places = [one.values(values) for one, values in zip(fields, constants, strict=True)]
    bricks = quantized(pieces.surface, charts, places, constants, order, apart, genus)
    if bricks is None or bricks.defect or bricks.lost:
        logger.info("labels: no solid with the genus of the part has all charts")
        return None
    at = [knots[index] for knots, index in zip(bricks.knots, bricks.index, strict=True)]
    along = [one.values(on) for one, on in zip(fields, at, strict=True)]
    axes = zip(along, charts.group, at, bricks.index, strict=True)
    return bricks, np.stack([positions(*axis) for axis in axes], axis=1)


def _constants(field: Field, order: list[Pair], least: float) -> np.ndarray | None:
    """Values of the groups in their order, closest to those of minimum energy; else None.

    If not all pairs can be in order, those with a small weight are ignored.
    """
    for weight in (0.0, NEGLIGIBLE, 5 * NEGLIGIBLE):
        used = [pair for pair in order if pair.weight >= weight]
        low = np.array([pair.low for pair in used], int)
        high = np.array([pair.high for pair in used], int)
        distance = np.minimum(least, np.array([pair.distance for pair in used]) / 2)
        values = spaced(field.form, field.constants, low, high, distance)
        if values is not None:
            return values
    return None
