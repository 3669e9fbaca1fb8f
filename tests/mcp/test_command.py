"""The command line of the server: what it refuses."""

import pytest

from polycube.mcp import __main__ as command


def test_a_folder_that_does_not_exist_is_refused(tmp_path, capsys) -> None:
    pytest.importorskip("mcp")
    with pytest.raises(SystemExit) as end:
        command.main([str(tmp_path / "none")])
    assert end.value.code == 2 and "none: there is no such folder" in capsys.readouterr().err


def test_a_missing_package_is_named(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(command, "find_spec", lambda name: None)
    with pytest.raises(SystemExit) as end:
        command.main([str(tmp_path)])
    sentence = "error: the package mcp is not installed; pip install 'polycube[mcp]'\n"
    assert end.value.code == 2 and capsys.readouterr().err == sentence
