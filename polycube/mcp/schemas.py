"""Types of the arguments of tools; those of plugins are made from their dataclasses."""

from typing import Annotated, Any, Literal, Union, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, GetPydanticSchema, create_model

from polycube.cli.help import documented
from polycube.hexmesh.settings import MeshingSettings
from polycube.registry import classes, default, options

Part = Annotated[str, Field(description="a file in the folder, or an example such as example:rod")]
Run = Annotated[str, Field(description="folder of a run, such as outputs/part/TIME")]
Begin = Annotated[
    Literal["spline", "analysis"],
    Field("spline", description="first stage; analysis needs a spline with the same supports"),
]
Settings = Annotated[
    dict[str, Any],
    Field({}, description='other settings, such as {"export": ["abaqus"]}; `options` lists all'),
]


def model(kind: str, cls: type, **more: Any) -> type[BaseModel]:
    """The options of a class of a kind, and `more` fields; others are refused."""
    texts, types = documented(cls), get_type_hints(cls)
    for name, option in options(kind, cls).items():
        more[name] = types[name], Field(default(option), description=texts.get(name))
    about, config = (cls.__doc__ or "").partition("\n")[0], ConfigDict(extra="forbid")
    return create_model(cls.__name__, __config__=config, __doc__=about, **more)


def analyses() -> Any:
    """The options of any analysis plugin, whose name is `plugin`."""
    known = [(name, cls) for (kind, name), cls in classes().items() if kind == "analysis"]
    found = tuple(model("analysis", cls, plugin=(Literal[name], ...)) for name, cls in known)
    return Annotated[Union[found], Field(discriminator="plugin")]  # noqa: UP007


def chosen(group: str, given: BaseModel | None) -> dict[str, Any]:
    """The settings for the options of a group that are given."""
    values = given.model_dump(mode="json", exclude_unset=True) if given else {}
    return {group if name == "plugin" else f"{group}.{name}": values[name] for name in values}


_analyses = GetPydanticSchema(lambda _, make: make.generate_schema(analyses()))
_meshing = GetPydanticSchema(
    lambda _, make: make.generate_schema(model("meshing", MeshingSettings))
)
Analysis = Annotated[BaseModel, _analyses]
Meshing = Annotated[BaseModel, _meshing]
