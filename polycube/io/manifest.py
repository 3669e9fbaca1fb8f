"""Manifest of the files that the program wrote to a folder; no other file is ever overwritten.

`polycube-files.json` in the folder lists each file with its size and SHA-256. A file is replaced or
removed only if it has not changed since it was written; every other file belongs to the user. Files
are written to a scratch folder, added to the manifest, and then moved to their places. If the
program is killed, every file that it wrote is in the manifest, and the next run removes the scratch
folder.
"""

import errno
import hashlib
import json
import os
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile

from polycube.errors import InputError
from polycube.io.access.reading import read_json
from polycube.io.atomic import scratch_folder

NAME = "polycube-files.json"
REMEDY = "choose another output_dir, or move the file away"

ROOM = 1 << 20  # free space that is required in a folder, in bytes
# errors of the file system, not of the program
UNWRITABLE = {
    errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO,
}  # fmt: skip

State = list[object]  # size in bytes, SHA-256
Entries = dict[str, list[State]]  # two states during a replacement; none: a log
LOG = ".log"  # suffix of files that may change


def files(folder: Path) -> list[str]:
    """Names of the existing files in a folder that the program wrote, sorted.

    The names are relative to the folder, with forward slashes. The list is empty if the folder does
    not exist or has no manifest.
    """
    return sorted(name for name in _read(folder) if os.path.lexists(folder / name))


def check(
    folder: Path, names: Iterable[str], inputs: Collection[Path] = (), remedy: str = REMEDY
) -> None:
    """Check that files can be written to a folder, and that none of them belongs to the user.

    Raises InputError if a file would be overwritten, or if the folder is not writable.

    folder : path of the folder, which need not exist and is not created
    names : names of the files to be written, relative to the folder
    inputs : input files of the run, never overwritten, even if the program wrote them
    remedy : advice at the end of the error message
    """
    _check_writable(folder)
    _check_names(folder, names, _read(folder), inputs, remedy)


def remove(folder: Path, names: Iterable[str], inputs: Collection[Path] = ()) -> None:
    """Remove files that the program wrote and that have not changed since.

    Changed files are kept and removed from the manifest: they belong to the user from now on.
    """
    entries, read = _read(folder), _resolved(inputs)
    gone = [name for name in names if entries.get(name) and (folder / name).resolve() not in read]
    if not gone:
        return
    with _writable(folder):
        for name in gone:
            if _is_ours(folder / name, entries[name]):
                (folder / name).unlink()
        _save(folder, {name: states for name, states in entries.items() if name not in gone})


def is_result(folder: Path, name: str) -> bool:
    """Whether a file exists that the program wrote, and that has not changed since."""
    entries = _read(folder)
    return name in entries and _is_ours(folder / name, entries[name])


def append_to(folder: Path, name: str) -> Path:
    """Path of a log file, which is created if it does not exist and is never removed."""
    check(folder, [name])
    with _writable(folder):
        folder.mkdir(parents=True, exist_ok=True)
        _save(folder, {**_read(folder), name: []})
        (folder / name).open("a").close()
    return folder / name


@contextmanager
def writing(folder: Path, remedy: str = REMEDY) -> Iterator[Path]:
    """Yield a scratch folder; its files are moved to `folder` at the end of the block.

    Nothing is moved if the block raises an exception. Raises InputError if a file of the user would
    be overwritten, or if the disk is full or read-only.
    """
    with _writable(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with scratch_folder(folder) as scratch:
            yield scratch
            _publish(scratch, folder, remedy)


@contextmanager
def _writable(folder: Path) -> Iterator[None]:
    """Turn errors of the file system into InputError."""
    try:
        yield
    except OSError as error:
        if error.errno not in UNWRITABLE:
            raise
        what = f"cannot write results to {folder}: {error.strerror}"
        raise InputError(f"{what}; files that were complete are kept") from error


def _publish(scratch: Path, folder: Path, remedy: str) -> None:
    made = {p.relative_to(scratch).as_posix(): p for p in scratch.rglob("*") if p.is_file()}
    entries = _read(folder)
    _check_names(folder, made, entries, (), remedy)
    for name, path in made.items():
        there = [_state(folder / name)] if (folder / name).exists() else []
        entries[name] = [*there, _state(path)]
    _save(folder, entries)
    for name, path in made.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        os.replace(path, folder / name)


def _check_names(
    folder: Path, names: Iterable[str], entries: Entries, inputs: Collection[Path], remedy: str
) -> None:
    read = _resolved(inputs)
    for name in names:
        path = folder / name
        blocking = [p for p in path.relative_to(folder).parents[:-1] if (folder / p).is_file()]
        if blocking:
            raise InputError(f"{folder / blocking[0]} is a file, not a folder; {remedy}")
        if not _is_inside(folder, name):
            raise InputError(f"{path.parent} is a link out of {folder}; {remedy}")
        if not os.path.lexists(path):
            continue
        if path.resolve() in read:
            raise InputError(f"{path} is an input and would be overwritten; {remedy}")
        if name not in entries or not _is_ours(path, entries[name]):
            what = f"{path} would be overwritten, and is not an unchanged result of an earlier run"
            raise InputError(what, remedy=remedy)


def _check_writable(folder: Path) -> None:
    """Write to the folder, because permissions do not tell for every file system."""
    made = [p for p in (folder, *folder.parents) if not os.path.lexists(p)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=folder) as file:
            file.write(bytes(ROOM))
    except OSError as error:
        raise InputError(f"cannot write results to {folder}: {error.strerror}") from None
    finally:
        with suppress(OSError):
            for path in made:
                path.rmdir()


def _is_ours(path: Path, states: list[State]) -> bool:
    """Whether a file is a log or is in a state that the manifest lists."""
    if path.is_symlink() or not path.is_file():
        return False
    sizes = [size for size, _ in states]
    return not states or (path.stat().st_size in sizes and _state(path) in states)


def _is_inside(folder: Path, name: str) -> bool:
    """Whether a name leads to a place in the folder, also if it follows links."""
    try:
        return (folder / name).parent.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):  # links in a circle, zeros in a name
        return False


def _state(path: Path) -> State:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return [path.stat().st_size, digest.hexdigest()]


def _resolved(paths: Collection[Path]) -> set[Path]:
    return {Path(path).resolve() for path in paths}


def _read(folder: Path) -> Entries:
    """Entries of the manifest, without names outside the folder; empty without a manifest."""
    path = folder / NAME
    if not os.path.lexists(path):
        return {}
    try:
        listed = read_json(path)["files"].items()
        states = {name: [[int(size), str(sha)] for size, sha in known] for name, known in listed}
    except (ValueError, TypeError, LookupError, AttributeError):
        raise InputError(f"{path} is not a list of results; choose another output_dir") from None
    return {n: s for n, s in states.items() if _is_inside(folder, n) and (s or n.endswith(LOG))}


def _save(folder: Path, entries: Entries) -> None:
    text = json.dumps({"files": dict(sorted(entries.items()))}, indent=1)
    with scratch_folder(folder) as scratch:
        (scratch / NAME).write_text(text, encoding="utf-8")
        os.replace(scratch / NAME, folder / NAME)
