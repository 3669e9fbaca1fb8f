"""Only regular files are read, by every reader."""

import os
import socket
from pathlib import Path

import pytest

from polycube.errors import InputError
from polycube.io.cad import Cad
from polycube.io.hex_meshes import FORMATS, read_hexes
from polycube.io.preflight import preflight
from polycube.io.solids.listing import read_solids
from polycube.io.surfaces import KNOWN, read_surface

READERS = [*((read_surface, s) for s in KNOWN), *((read_hexes, s) for s in FORMATS)]
READERS += [(read_solids, ".step"), (lambda path: preflight(str(path), Cad(), "off"), ".stl")]


def pipe(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def named_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))


def hole(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(2 << 30)


@pytest.mark.parametrize(("read", "suffix"), READERS)
@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (pipe, "give a regular file"),
        (device, "give a regular file"),
        (named_socket, "give a regular file"),
        (hole, "of its 2147483648 bytes are on the disk"),
        (Path.mkdir, "this is a folder; give one file"),
    ],
)
def test_what_is_not_a_file_is_refused(read, suffix, make, sentence, here):
    path = Path(f"part{suffix}")
    make(path)
    with pytest.raises(InputError, match=sentence) as refused:
        read(path)
    assert str(refused.value).startswith(f"{path}: ")


def test_a_link_to_a_file_is_read(tmp_path):
    (tmp_path / "part.xyz").write_text("words")
    (tmp_path / "link.xyz").symlink_to(tmp_path / "part.xyz")
    with pytest.raises(InputError, match="not a readable XYZ"):
        read_surface(tmp_path / "link.xyz")
