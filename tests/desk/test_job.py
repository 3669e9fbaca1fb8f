"""What is set at the desk is the composed configuration of `infer.py`."""

import shlex

import pytest

from polycube.desk.job import Job
from tests.fixtures.runs import config


def test_everything_that_is_set_arrives_in_the_configuration() -> None:
    job = Job(
        "my part.step",
        size="3%",
        effort="first",
        analysis="static",
        material="titanium",
        faces={
            "cad_face_6": {"held": True},
            "cad_BOLT_1": {"held": True},
            "hole_1": {"around": 16},
            "cad_face_8": {"force": (100.0, 0.0, -2.5), "size": "1%"},
            "z_max": {"pressure": 1e5},
        },
        exports=["abaqus", "gmsh"],
        further="analysis.away=0.05 'files.cells=corners'",
    )
    found = config(*job.settings)
    assert found["mesh"] == "my part.step" and found["effort"] == "first"
    assert found["order"] == ["meshing", "spline", "analysis", "report"]
    meshing, analysis = found["meshing"], found["analysis"]
    assert meshing["size"] == "3%"
    assert meshing["at"] == [{"at": "hole_1", "around": 16}, {"at": "cad_face_8", "size": "1%"}]
    assert analysis["plugin"] == "static" and analysis["material"] == "titanium"
    assert analysis["fixed"] == ["cad_face_6", "cad_BOLT_1"] and analysis["away"] == 0.05
    force = {"at": "cad_face_8", "force": [100, 0, -2.5]}
    assert analysis["loads"] == [force, {"at": "z_max", "pressure": 1e5}]
    assert set(found["export"]) == {"abaqus", "gmsh"} and found["files"]["cells"] == "corners"
    assert shlex.split(job.command) == ["polycube-infer", *job.settings]


def test_what_is_set_for_several_solids_arrives_in_the_configuration() -> None:
    preload = {"point": [0, 0, 9], "axis": [0, 0, 1], "force": 1000}
    job = Job(
        "assembly.step",
        solids=2,
        interfaces="contact",
        materials="BOLT: steel, 2: abs",
        analysis="static",
        preloads="{point: [0, 0, 9], axis: [0, 0, 1], force: 1000}",
        sectors=6,
        faces={"BOLT_z_max": {"held": True}},
    )
    found = config(*job.settings)
    assert found["cad"]["solid"] == "all" and found["cad"]["interfaces"] == "contact"
    assert found["cad"]["materials"] == {"BOLT": "steel", 2: "abs"}
    analysis = found["analysis"]
    assert analysis["preloads"] == [preload] and analysis["fixed"] == ["BOLT_z_max"]
    assert analysis["cyclic"] == {"sectors": 6}


@pytest.mark.parametrize("analysis", ["modal", "none"])
def test_a_run_that_solves_nothing_stops_after_the_mesh(analysis) -> None:
    job = Job(
        "part.stl", analysis=analysis, is_solved=False, modes=6, faces={"x_min": {"held": True}}
    )
    found = config(*job.settings)
    assert found["order"] == ["meshing", "report"]
    if analysis == "modal":  # for the exports
        assert found["analysis"]["modes"] == 6 and found["analysis"]["fixed"] == ["x_min"]


def test_an_open_quotation_is_refused() -> None:
    with pytest.raises(ValueError, match="No closing quotation"):
        _ = Job("part.stl", further="output_dir='a").settings
