"""Loads on boundary faces as tractions at points, for splines and for elements of a deck.

Forces and moments act as by a distributing coupling, with a traction that is linear in the place; a
bearing load is a pressure in proportion to the cosine (docs/theory/analysis.md).
"""

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycube.errors import InputError
from polycube.types.checks import is_number

Vector = Sequence[float]
NOTHING = (0.0, 0.0, 0.0)
FUNCTIONS = "sqrt sin cos tan exp log abs hypot arctan2 minimum maximum where".split()
KNOWN = {"pi": np.pi, **{name: getattr(np, name) for name in FUNCTIONS}}
TERMS = (ast.Expression, ast.BinOp, ast.UnaryOp, ast.Compare, ast.Call, ast.Name, ast.Constant)
TERMS += (ast.operator, ast.unaryop, ast.cmpop, ast.Load)  # type: ignore[assignment]


@dataclass(frozen=True, eq=False)
class Load:
    """Forces on the faces of a place; the contributions are added.

    place : in a form that `polycube.analysis.boundary_sets.faces_of` accepts
    pressure : Pa, positive towards the solid; a number or an expression, see `at_points`
    traction : Pa, components like `pressure`; or a function of points and normals (P, 3)
    force, moment : resultants in N and N m, distributed over the faces
    point : where force and moment act, in the unit of the part; by default the centroid
    bearing : resultant in N of a pressure on the part of the faces that the load pushes against
    """

    place: object
    pressure: float | str = 0.0
    traction: Any = NOTHING
    force: Vector = NOTHING
    moment: Vector = NOTHING
    point: Vector | None = None
    bearing: Vector = NOTHING

    @property
    def is_uniform(self) -> bool:
        """Whether pressure and traction are the same on all faces."""
        fields = self.pressure, *self.traction
        varies = self.point is not None, *(isinstance(each, str) for each in fields)
        return not any((*varies, *self.moment, *self.bearing))

    def traction_at(
        self, points: np.ndarray, normals: np.ndarray, area: np.ndarray, metre: float
    ) -> np.ndarray:
        """(P, 3) traction in Pa at points (P, 3) that represent the areas (P,).

        normals : (P, 3) outward, of length 1
        metre : length unit of the points and areas

        Raises InputError if a bearing load pulls at all of the faces.
        """
        area = metre**2 * area
        centre = area @ points / area.sum()
        if callable(self.traction):
            own = self.traction(points, normals)
        else:
            own = np.stack([at_points(each, points) for each in self.traction], axis=1)
        found = own + np.divide(self.force, area.sum())
        found = found - at_points(self.pressure, points)[:, None] * normals
        lever = np.zeros(3) if self.point is None else metre * (self.point - centre)
        moment = self.moment + np.cross(lever, self.force)
        if moment.any():
            arm = metre * (points - centre)
            inertia = area @ (arm**2).sum(axis=1) * np.eye(3) - (arm.T * area) @ arm
            found = found + np.cross(np.linalg.solve(inertia, moment), arm)
        if any(self.bearing):
            size = np.linalg.norm(self.bearing)
            against = np.maximum(-normals @ self.bearing / size, 0)
            if not against.any():
                raise InputError(f"the bearing load {list(self.bearing)} pulls at all of its faces")
            found = found - (size * against / (area @ against**2))[:, None] * normals
        return found


def at_points(given: float | str, points: np.ndarray) -> np.ndarray:
    """(...) values of a number, or of an expression such as "1e3 * (5 - z)", at points (..., 3).

    Raises InputError where an expression has no finite value.
    """
    if isinstance(given, str):
        places = dict(zip("xyz", np.moveaxis(points, -1, 0), strict=True))
        names = {**KNOWN, **places, "__builtins__": {}}
        with np.errstate(all="ignore"):
            given = eval(compile(given, "expression", "eval"), names)
    found = np.broadcast_to(np.asarray(given, np.float64), points.shape[:-1])
    if not np.isfinite(found).all():
        at = points.reshape(-1, 3)[np.isfinite(found).argmin()]
        raise InputError(f"an expression of the analysis has no finite value at {at}")
    return found


def check_expression(name: str, given: object) -> None:
    """Raise ValueError unless `given` is a number or an expression of x, y, z and `KNOWN`."""
    try:
        text: Any = str(given) if is_number(given) else given
        nodes = list(ast.walk(ast.parse(text, mode="eval")))
        names = {node.id for node in nodes if isinstance(node, ast.Name)}
        valid = all(isinstance(node, TERMS) for node in nodes) and names <= {*KNOWN, *"xyz"}
        valid = valid and at_points(text, np.ones((1, 3))).shape == (1,)
    except (SyntaxError, TypeError, ValueError, ArithmeticError) as error:
        valid = isinstance(error, InputError)  # it may be finite elsewhere
    if not valid:
        what = f"{name} must be a number or an expression of x, y, z, pi, {', '.join(FUNCTIONS)};"
        raise ValueError(f"{what} got {given!r}")
