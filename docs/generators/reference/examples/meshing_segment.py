from dataclasses import dataclass

import numpy as np

from polycube.registry import register
from polycube.types import Labels, Parametrization, Polycube, TriMesh


@register("meshing/segment", "by_normal")
@dataclass(frozen=True)
class ByNormal:
    """Label each triangle with the polycube face of the nearest normal and place."""

    def __call__(
        self, surface: TriMesh, polycube: Polycube, parametrization: Parametrization
    ) -> Labels:
        from polycube.structure.lattice import boundary
        from polycube.surface.measures import face_normals

        faces = boundary(polycube)
        normals = np.eye(3)[faces.axis // 2] * (1 - 2 * (faces.axis % 2))[:, None]
        middle = faces.vertices[faces.quads].mean(axis=1)
        place = parametrization.positions[surface.faces].mean(axis=1)
        near = np.linalg.norm(place[:, None] - middle, axis=2)
        turned = 1 - face_normals(surface) @ normals.T
        face = (near + 10 * turned).argmin(axis=1)
        return Labels(faces.axis[face], faces.patch[face])
