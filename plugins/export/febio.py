"""FEBio 4."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar
from xml.sax.saxutils import quoteattr

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .format import TextFormat, WithNodes, WithProblem
from .groups import blocks, legend, node_sets, primitive_sets, renamed, side_sets
from .text import count, lines, wrapped

if TYPE_CHECKING:
    from .loads import Loads

NAME = 255  # longest name
CONTROL = """<Control>
<analysis>STATIC</analysis><time_steps>1</time_steps><step_size>1</step_size>
<solver type="solid"><symmetric_stiffness>symmetric</symmetric_stiffness></solver>
</Control>
"""


@register("export", "febio")
@dataclass(frozen=True)
class Febio(WithNodes, WithProblem, TextFormat):
    """FEBio 4 (.feb): mesh, sets, and the statics of `analysis`, ready to run.

    There is a part for each grid cell, and named sets of nodes, faces and hexes. FEBio solves
    neither modes nor heat conduction: for modes the file has material and supports and no step, for
    conduction only mesh and sets.

    Parameters
    ----------
    nodes : number of nodes of a hex: 8 or 20; the additional ones are on the spline if there is one
    step : also write material, supports and loads of `analysis`; false: only mesh and sets
    """

    def __post_init__(self) -> None:
        if self.nodes not in (8, 20):
            raise ValueError(f"nodes must be 8 or 20; got {self.nodes!r}")

    suffix: ClassVar[str] = ".feb"

    def parts(self, hexes: HexMesh) -> list[str]:
        """The text of the file, in parts."""
        own, parts = self.elements(hexes), blocks(hexes)
        loads, named = self.loads(hexes, own), renamed(hexes, NAME, ascii_only=False)
        text = []
        for part, rows in parts.items():
            cells = lines(
                np.column_stack([rows + 1, own.hexes[rows] + 1]), _tag("elem", self.nodes)
            )
            text.append(_named("Elements", part, cells, f' type="hex{self.nodes}"'))
        for name, rows in node_sets(named, own.quads).items():
            text.append(_named("NodeSet", name, _list(rows)))
        for name, rows in primitive_sets(named).items():
            text.append(_named("ElementSet", name, _list(rows)))
        text += [_surface(name, own.quads[quads]) for name, quads in named.sets.items()]
        before = new = after = ""
        if loads is not None and loads.elastic:
            called = dict(zip(side_sets(hexes), named.sets, strict=True))
            before, new, after = _problem(loads, parts, called)
        units = f"{loads.units}\n" if loads else ""
        return [
            '<?xml version="1.0" encoding="UTF-8"?>\n<febio_spec version="4.0">\n',
            f"<!--\n{units}{legend(named).replace('--', '- -')}-->\n",
            f'<Module type="solid"/>\n{before}<Mesh>\n<Nodes name="all">\n',
            lines(count(own.points), '<node id="%d">%.17g,%.17g,%.17g</node>'),
            f"</Nodes>\n{''.join(text)}{new}</Mesh>\n{after}</febio_spec>\n",
        ]


def _problem(loads: Loads, parts: Iterable[str], called: Mapping[str, str]) -> tuple[str, str, str]:
    """The sections before the mesh, new sets of the mesh, and the sections after it.

    The step is one increment, so loads need no curve. FEBio takes body forces with the opposite
    sign.
    """
    from polycube.analysis.problem import Statics

    young, poisson, density = loads.elastic
    values = _leaves(density=density, E=young, v=poisson)
    material = _named("material", "material", values, ' id="1" type="isotropic elastic"')
    solids = "".join(f'<SolidDomain name="{part}" mat="material"/>\n' for part in parts)
    new, held, acting = [], [], []
    for support in loads.supports:
        name, axis = called.get(support.place or "", support.label), "xyz"[support.component]
        if support.place is None:
            new.append(_named("NodeSet", name, _list(support.nodes)))
        kind, content = "zero", _leaves(**{f"{axis}_dof": 1})
        if support.value:
            kind, content = "prescribed", _leaves(dof=axis, value=support.value, relative=0)
        at = f' type="{kind} displacement" node_set={quoteattr(name)}'
        held.append(_named("bc", support.label, content, at))
    for push in loads.pushes:
        name = called.get(push.place or "", push.label)
        if push.place is None:
            new.append(_surface(name, loads.elements.quads[push.quads]))
        at = f" surface={quoteattr(name)}"
        if push.pressure:
            content = _leaves(pressure=push.pressure, linear=1)
            acting.append(_named("surface_load", push.label, content, f' type="pressure"{at}'))
        if push.traction.any():
            content = _leaves(scale=1, traction=push.traction)
            acting.append(_named("surface_load", push.label, content, f' type="traction"{at}'))
    if loads.gravity.any():
        content = _leaves(force=0 - loads.gravity)
        acting.append(_named("body_load", "gravity", content, ' type="body force"'))
    is_run = isinstance(loads.problem, Statics) and loads.has_step
    before = (CONTROL if is_run else "") + f"<Material>\n{material}</Material>\n"
    after = f"<MeshDomains>\n{solids}</MeshDomains>\n"
    for section, rows in (("Boundary", held), ("Loads", acting)):
        after += f"<{section}>\n{''.join(rows)}</{section}>\n" if rows else ""
    return before, "".join(new), after


def _tag(kind: str, nodes: int) -> str:
    return f'<{kind} id="%d">' + ",".join(nodes * ["%d"]) + f"</{kind}>"


def _named(kind: str, name: str, content: str, more: str = "") -> str:
    return f"<{kind} name={quoteattr(name)}{more}>\n{content}</{kind}>\n"


def _leaves(**values: object) -> str:
    """An element for each word, number or vector."""

    def text(value: object) -> str:
        if isinstance(value, str):
            return value
        return ",".join(f"{x:.9g}" for x in np.atleast_1d(np.asarray(value)).tolist())

    return "".join(f"<{tag}>{text(value)}</{tag}>\n" for tag, value in values.items())


def _surface(name: str, quads: np.ndarray) -> str:
    nodes = quads.shape[1]
    return _named("Surface", name, lines(count(quads + 1), _tag(f"quad{nodes}", nodes)))


def _list(rows: np.ndarray) -> str:
    """Numbers, from one, separated by commas."""
    return wrapped(rows + 1, 16, between=",").strip().replace("\n", ",\n") + "\n"
