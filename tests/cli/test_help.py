"""`--help`: every option of every group, with a line that says what it is."""

import re
import sys

import pytest

from polycube import HOME
from polycube.cli import evaluate_command, infer_command, train_command

CONF = HOME / "conf"


def said(main, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(sys, "argv", ["polycube", "--help"])
    try:
        main()
    except SystemExit as end:
        assert not end.code
    return capsys.readouterr().out


def listed(text: str) -> dict[tuple[str, str], str]:
    """(group, option) -> what is said of it."""
    block = text.split("== Choices: group=option ==\n")[1].split("\n== Settings")[0]
    found, group = {}, ""
    for line in block.strip().splitlines():
        if line.startswith("  "):
            option, _, what = line.strip().partition(" ")
            found[group, option] = what.strip()
        else:
            group = line
    return found


def test_both_commands_list_all_there_is(capsys, monkeypatch) -> None:
    texts = [said(main, capsys, monkeypatch) for main in (infer_command, train_command)]
    found = {key: what for text in texts for key, what in listed(text).items()}
    files = [path.relative_to(CONF) for path in CONF.rglob("*/*.yaml")]
    there = {(path.parent.as_posix(), path.stem) for path in files if path.parts[0] != "hydra"}
    assert found.keys() == there
    assert all(len(what) > 5 for what in found.values())
    assert found["schedule", "cosine"] == "Cosine schedule: slower at both ends"
    assert found["primitive", "cube"] == "a full cell"
    for text in texts:
        assert max(map(len, text.split("== Settings")[0].splitlines())) <= 125
        assert "$" not in text


COMMANDS = {"infer": infer_command, "train": train_command, "evaluate": evaluate_command}


@pytest.mark.parametrize(("name", "main"), COMMANDS.items())
def test_settings_stand_with_their_comments(main, name, capsys, monkeypatch) -> None:
    settings = said(main, capsys, monkeypatch).split("== Settings: name=value ==\n")[1]
    lines = (CONF / f"{name}.yaml").read_text().splitlines()
    keys = [line for line in lines if re.match(r"\w+:", line)]
    own = [line for line in keys if line.split(":")[0] not in ("defaults", "hydra")]
    assert len(own) > 4 and all(line in settings for line in own)
    assert "defaults" not in settings and "hydra:" not in settings
