"""What to cite for a run."""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar

import pytest
import yaml

import polycube
from polycube.config import compose
from polycube.registry import classes, register
from polycube.report import citation
from tests.conftest import ROOT

BIB = (Path(citation.__file__).parent / "references.bib").read_text(encoding="utf-8")
KEYS = [found[1] for found in citation.ENTRY.finditer(BIB)]


@cache
def composed(*overrides: str) -> dict:
    return compose("infer", overrides)


def keys(report: dict, *overrides: str) -> list[str]:
    text = citation.bibtex(report, composed(*overrides))
    return re.findall(r"^@\w+\{(\w+),", text, re.MULTILINE)


def proposed(name: str) -> dict:
    return {"polycube": {"candidates": [{"proposal": "slices"}, {"proposal": name}], "chosen": 1}}


def test_every_entry_is_complete_and_used() -> None:
    assert len(KEYS) == BIB.count("@") and len(set(KEYS)) == len(KEYS)
    for entry in citation.ENTRY.finditer(BIB):
        assert entry[0].count("{") == entry[0].count("}")
        assert {"author", "title", "year"} <= set(re.findall(r"^  (\w+) = \{", entry[0], re.M))
    named = {key for cls in classes().values() for key in getattr(cls, "references", ())}
    ours = {key for key in named if not key.startswith("@")}
    assert ours | {citation.PAPER} == set(KEYS)


def test_the_paper_is_that_of_the_citation_file() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    [entry] = [found[0] for found in citation.ENTRY.finditer(BIB) if found[1] == citation.PAPER]
    preferred = cited["preferred-citation"]
    assert preferred["title"] in entry.replace("{DDPM-Polycube}", "DDPM-Polycube")
    names = [f"{a['family-names']}, {a['given-names']}" for a in preferred["authors"]]
    assert " and ".join(names) in entry


@pytest.mark.slow
def test_methods_that_made_the_result_are_cited_and_no_others() -> None:
    always = ["polycube", "yu2025ddpm"]
    mesh = ["garanzha2021foldover", "mitchell1995pillowing", "hu2020wild"]
    assert keys({}) == always
    assert keys({"hex": {}}) == always + mesh
    assert keys(proposed("sweep"))[2:] == ["remacle2013frontal", "geuzaine2009gmsh"]
    assert keys({"hex": {}, **proposed("diffusion")})[2:] == ["ho2020ddpm", *mesh]
    report = {"hex": {}, "spline": {}, "modes": {}}
    assert keys(report)[5:] == [
        "wei2017th",
        "yu2022hexgen",
        "borden2011extraction",
        "hughes2005iga",
    ]
    assert keys(report, "spline=c0")[5:] == ["borden2011extraction", "hughes2005iga"]
    assert "hu2020wild" not in keys({"hex": {}, "given": {}}, "hex=part.vtu")
    assert "floater2003mean" in keys({"hex": {}}, "meshing=parametric")


@pytest.mark.slow
def test_a_plugin_of_another_package_brings_its_own_entry(own_registry) -> None:
    entry = "@article{mine,\n  title = {Mine}\n}"

    @register("structure", "mine")
    @dataclass(frozen=True)
    class Mine:
        references: ClassVar[tuple[str, ...]] = (entry, "ho2020ddpm")

    assert keys(proposed("mine"))[2:] == ["mine", "ho2020ddpm"]


@pytest.mark.slow
def test_a_result_and_its_folder_say_the_same(tmp_path) -> None:
    fast = {"size": "20%", "structure": "slices", "order": "meshing"}
    part = polycube.mesh("example:dice", output_dir=tmp_path, **fast)
    assert polycube.citation(part) == polycube.citation(tmp_path)
    assert "garanzha2021foldover" in polycube.citation(part)
    with pytest.raises(polycube.InputError, match="no such file; name the folder of a run"):
        polycube.citation(tmp_path / "nowhere")
