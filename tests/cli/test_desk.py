"""The command line of the desk: what it refuses."""

import socket

import pytest

from polycube.cli.desk import HOST, free_port, main
from polycube.errors import InputError


def test_any_free_port_is_taken_unless_one_is_named() -> None:
    port = free_port(0)
    assert port > 0 and free_port(port) == port


def test_a_port_in_use_is_refused() -> None:
    with socket.socket() as other:
        other.bind((HOST, 0))
        port = other.getsockname()[1]
        other.listen()
        with pytest.raises(InputError, match=f"--port {port}: it cannot be used"):
            free_port(port)
    with pytest.raises(InputError, match="cannot be used"):
        free_port(70000)


def test_a_part_that_does_not_exist_is_refused(tmp_path, capsys) -> None:
    pytest.importorskip("nicegui")
    with pytest.raises(SystemExit) as end:
        main([str(tmp_path / "none.step")])
    assert end.value.code == 2 and "there is no such file or folder" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
