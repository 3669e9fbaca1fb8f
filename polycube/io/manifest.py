"""The files that this program wrote into a folder, so that it never overwrites or deletes others.

`polycube-files.json` in the folder lists each of them with its size and SHA-256.  A file is
replaced or removed only while it is unchanged since; every other file belongs to the user.  Files
are written to a scratch folder, listed, and then moved to their places: a program that is killed at
any moment leaves no file of its own that the list does not contain, and a scratch folder that the
next run removes.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile

from polycube.errors import InputError
from polycube.io.atomic import scratch_folder

NAME = "polycube-files.json"
REMEDY = "choose another output_dir, or move the file away"

ROOM = 1 << 20  # bytes that a folder must have room for
UNWRITABLE = {  # errors that say something of the folder, not of the program
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EFBIG,
    errno.EROFS,
    errno.EACCES,
    errno.EPERM,
    errno.EIO,
}

State = list[object]  # size in bytes, SHA-256
Entries = dict[str, list[State]]  # two states while one replaces the other; none: appended to


def files(folder: Path) -> list[str]:
    """Names of the files in `folder` that the program wrote, sorted.

    Parameters
    ----------
    folder : may lack a manifest, or not exist

    Returns
    -------
    Names relative to the folder, with forward slashes; those that were deleted are left out.
    """
    return sorted(name for name in _read(folder) if os.path.lexists(folder / name))


def check(
    folder: Path, names: Iterable[str], inputs: Collection[Path] = (), remedy: str = REMEDY
) -> None:
    """Check that files can be written to a folder, and that none of them belongs to the user.

    Parameters
    ----------
    folder : need not exist, and is not made
    names : of the files to be written, relative to the folder
    inputs : files that are read; they belong to the user, whoever wrote them
    remedy : what the message proposes

    Raises
    ------
    InputError : naming the first file that would be overwritten, or why nothing can be written.
    """
    _check_writable(folder)
    _check_names(folder, names, _read(folder), inputs, remedy)


def remove(folder: Path, names: Iterable[str], inputs: Collection[Path] = ()) -> None:
    """Remove those of the named files that the program wrote and that are unchanged since.

    The manifest forgets the others of these names: they are the user's from now on.
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


def append_to(folder: Path, name: str) -> Path:
    """Make a file to append to, such as a log, or find that of an earlier run; never removed."""
    check(folder, [name])
    with _writable(folder):
        folder.mkdir(parents=True, exist_ok=True)
        _save(folder, {**_read(folder), name: []})
        (folder / name).open("a").close()
    return folder / name


@contextmanager
def writing(folder: Path, remedy: str = REMEDY) -> Iterator[Path]:
    """Yield a scratch folder; the files in it move to `folder` when the block ends well.

    Raises
    ------
    InputError : where a file would overwrite one of the user's, or the disk is full or read-only;
        then none is moved.
    """
    with _writable(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with scratch_folder(folder) as scratch:
            yield scratch
            _publish(scratch, folder, remedy)


@contextmanager
def _writable(folder: Path) -> Iterator[None]:
    """A folder that cannot be written to is an InputError."""
    try:
        yield
    except OSError as error:
        if error.errno not in UNWRITABLE:
            raise
        raise InputError(
            f"cannot write results to {folder}: {error.strerror}; files that were complete are kept"
        ) from error


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
    folder: Path,
    names: Iterable[str],
    entries: Entries,
    inputs: Collection[Path],
    remedy: str,
) -> None:
    read = _resolved(inputs)
    for name in names:
        path = folder / name
        blocking = [p for p in path.relative_to(folder).parents[:-1] if (folder / p).is_file()]
        if blocking:
            raise InputError(f"{folder / blocking[0]} is a file, not a folder; {remedy}")
        if not os.path.lexists(path):
            continue
        if path.resolve() in read:
            raise InputError(f"{path} is an input and would be overwritten; {remedy}")
        if name not in entries or not _is_ours(path, entries[name]):
            raise InputError(
                f"{path} would be overwritten, and is not an unchanged result of an earlier run; "
                f"{remedy}"
            )


def _check_writable(folder: Path) -> None:
    """Try it: what the operating system says beforehand is not true of every folder."""
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
    """Whether a file is appended to, or in a state that the manifest lists."""
    if path.is_symlink() or not path.is_file():
        return False
    sizes = [size for size, _ in states]
    return not states or (path.stat().st_size in sizes and _state(path) in states)


def _state(path: Path) -> State:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return [path.stat().st_size, digest.hexdigest()]


def _resolved(paths: Collection[Path]) -> set[Path]:
    return {Path(path).resolve() for path in paths}


def _read(folder: Path) -> Entries:
    """Entries of the manifest, those outside of the folder left out; empty without a manifest."""
    path = folder / NAME
    if not os.path.lexists(path):
        return {}
    try:
        listed = json.loads(path.read_text(encoding="utf-8"))["files"].items()
        states = {name: [[int(size), str(sha)] for size, sha in known] for name, known in listed}
    except (OSError, ValueError, TypeError, LookupError, AttributeError):
        raise InputError(f"{path} is not a list of results; choose another output_dir") from None
    return {n: s for n, s in states.items() if not Path(n).is_absolute() and ".." not in n}


def _save(folder: Path, entries: Entries) -> None:
    text = json.dumps({"files": dict(sorted(entries.items()))}, indent=1)
    with scratch_folder(folder) as scratch:
        (scratch / NAME).write_text(text, encoding="utf-8")
        os.replace(scratch / NAME, folder / NAME)
