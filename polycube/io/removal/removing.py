"""Remove features of a CAD solid, in the worker process of gmsh."""

import re
from collections.abc import Sequence
from types import ModuleType

import numpy as np

from polycube.io.removal.features import Feature, Solid, faces_of
from polycube.io.step.faces import Named
from polycube.names import plain
from polycube.types import Json


def numbers_of(face: int | str, named: Named) -> set[int]:
    """Numbers of the CAD faces with a number or a name; raises LookupError if there is none."""
    text, last = str(face), len(named.faces)
    if number := re.fullmatch(r"(?:cad_face_)?(\d+)", text):
        found = {int(number[1])} & {*range(1, last + 1)}
    else:
        wanted = {plain(text), plain(text.removeprefix("cad_"))} - {""}
        found = {n for n, name in enumerate(named.faces, start=1) if plain(name) in wanted}
        found.update(*(own for name, own in named.groups.items() if plain(name) in wanted))
    if not found:
        known = dict.fromkeys(filter(None, (*named.faces, *named.groups)))
        have = ", ".join((f"cad_face_1 to cad_face_{last}", *known))
        raise LookupError(f"cad.remove.faces: there is no CAD face {face!r}; the solid has {have}")
    return found


class Removal:
    """A solid without some of its features, whose faces keep their numbers.

    Open CASCADE does not say what becomes of a face. A new face is a part of the given face whose
    points are on it; where it unites several faces, of that with most points.

    solid : given solid; its faces are numbered from 1 in ascending order of their tags
    wanted : `holes`, `fillets` and `faces`, see `options.Remove.in_unit`
    named : names of the faces
    """

    def __init__(self, gmsh: ModuleType, solid: Solid, wanted: Json, named: Named) -> None:
        self.gmsh, self.tag, self.near, self.named = gmsh, solid.tag, solid.near, named
        self.number = {face: number for number, face in enumerate(solid.kind, start=1)}
        self.points = dict(zip(self.number.values(), solid.points.values(), strict=True))
        self.middle = {number: points.mean(axis=0) for number, points in self.points.items()}
        found = solid.features(wanted["holes"], wanted["fillets"])
        asked = set().union(*(numbers_of(face, named) for face in wanted["faces"]))
        tags = [tag for tag, number in self.number.items() if number in asked]
        found += [Feature("detail", 0.0, own) for own in solid.groups(tags)]
        self.features = [f._replace(faces={self.number[tag] for tag in f.faces}) for f in found]
        self.kept = self._remove(self.features)

    def record(self, factor: float) -> Json:
        """What was removed, as in `TriMesh.removed`; lengths are divided by a factor."""
        rows = [
            {
                "kind": each.kind,
                "size": each.size / factor,
                "faces": sorted(each.faces),
                "names": sorted({self.named.faces[n - 1] for n in each.faces} - {""}),
                "place": np.mean([self.middle[n] / factor for n in each.faces], axis=0).tolist(),
                "removed": each not in self.kept,
            }
            for each in self.features
        ]
        gone = set().union(*(each["faces"] for each in rows if each["removed"]))
        merged = sorted(self.points.keys() - gone - {*self.number.values()})
        volume = self.gmsh.model.occ.getMass(3, self.tag) / factor**3
        return {"features": rows, "merged": merged, "volume_after": volume}

    def _remove(self, features: Sequence[Feature]) -> list[Feature]:
        """Remove features together, else in two halves; those that remain are returned."""
        occ, gone = self.gmsh.model.occ, set().union(*(each.faces for each in features))
        tags = [tag for tag, number in self.number.items() if number in gone]
        if not tags:
            return []
        try:
            made = occ.defeature([self.tag], tags, removeVolume=False)
        except Exception:  # gmsh raises no other class
            made = []
        made = [each for each in made if each[1] != self.tag]  # the same if nothing was removed
        occ.synchronize()
        number = {f: self._origin(f) for _, tag in made for f in faces_of(self.gmsh, tag)}
        is_done = len(made) == 1 and (gone | {0}).isdisjoint(number.values())
        occ.remove([(3, self.tag)] if is_done else made, recursive=True)
        occ.synchronize()
        if is_done:
            self.tag, self.number = made[0][1], number
            return []
        half = len(features) // 2
        parts = features[:half], features[half:]
        return [each for part in parts for each in self._remove(part)] if half else [*features]

    def _origin(self, face: int) -> int:
        """Number of the given face of which a face is a part; 0 if there is none."""
        model = self.gmsh.model
        low, high = np.reshape(model.getBoundingBox(2, face), (2, 3))
        count = {0: 0}
        for number, points in self.points.items():
            near = points[((points > low - self.near) & (points < high + self.near)).all(axis=1)]
            if len(near):
                places = model.getParametrization(2, face, near.ravel())
                off = np.reshape(model.getValue(2, face, places), (-1, 3)) - near
                own = np.reshape(places, (-1, 2))[np.linalg.norm(off, axis=1) < self.near]
                count[number] = sum(model.isInside(2, face, p, parametric=True) for p in own)
        return max(count, key=lambda number: count[number])
