"""A folder of results never loses a file of the user, and is never refused to its own program."""

import errno
import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.errors import InputError
from polycube.io import manifest
from polycube.io.manifest import NAME, append_to, check, files, remove, writing

NAMES = ("hex.vtu", "stages/read.npz", "report.json")


class Killed(BaseException):
    """The end of a process at a moment that nobody chose."""


def write(folder: Path, **contents: str) -> None:
    with writing(folder) as scratch:
        for name, text in contents.items():
            path = scratch / name.replace("_", "/").replace("DOT", ".")
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)


def test_files_appear_together_and_are_listed(tmp_path):
    write(tmp_path / "new", hexDOTvtu="1", stages_readDOTnpz="2")
    assert files(tmp_path / "new") == ["hex.vtu", "stages/read.npz"]
    assert (tmp_path / "new/stages/read.npz").read_text() == "2"
    assert {p.name for p in (tmp_path / "new").iterdir()} == {"hex.vtu", "stages", manifest.NAME}


def test_a_block_that_fails_leaves_what_was_there(tmp_path):
    write(tmp_path, a="1")
    with pytest.raises(OSError, match="disk full"), writing(tmp_path) as scratch:
        (scratch / "a").write_text("2")
        raise OSError("disk full")
    assert (tmp_path / "a").read_text() == "1"
    assert {p.name for p in tmp_path.iterdir()} == {"a", manifest.NAME}


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS])
def test_a_disk_that_is_full_is_one_sentence_and_changes_nothing(tmp_path, number):
    write(tmp_path, a="1")
    with pytest.raises(InputError, match=f"cannot write results to .*: {os.strerror(number)}; "):
        with writing(tmp_path) as scratch:
            (scratch / "a").write_text("2")
            raise OSError(number, os.strerror(number))
    assert (tmp_path / "a").read_text() == "1"
    assert {p.name for p in tmp_path.iterdir()} == {"a", manifest.NAME}


def test_a_file_that_may_not_grow_is_refused_before_anything_is_made(tmp_path):
    import resource

    write(tmp_path, a="1")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (manifest.ROOM // 2, before[1]))
    try:
        with pytest.raises(InputError, match=r"cannot write results to .*: File too large"):
            check(tmp_path, ["a"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    check(tmp_path, ["a"])
    assert {p.name for p in tmp_path.iterdir()} == {"a", manifest.NAME}


@pytest.mark.parametrize("present", ["file", "folder", "link", "dangling link"])
def test_what_the_program_did_not_write_is_never_replaced(tmp_path, present):
    write(tmp_path / "run", b="ours")
    path, other = tmp_path / "run" / "a", tmp_path / "other"
    other.write_text("mine")
    if present == "file":
        path.write_text("mine")
    elif present == "folder":
        path.mkdir()
    else:
        path.symlink_to(other if present == "link" else tmp_path / "nowhere")
    before = path.lstat()
    with pytest.raises(InputError, match=r"a would be overwritten.*choose another output_dir"):
        check(tmp_path / "run", ["b", "a"])
    with pytest.raises(InputError, match="would be overwritten"):
        write(tmp_path / "run", a="ours", b="new")
    remove(tmp_path / "run", ["a"])
    assert path.lstat() == before and other.read_text() == "mine"
    assert (tmp_path / "run" / "b").read_text() == "ours"  # all files of a block or none


def test_a_result_that_the_user_changed_is_the_users(tmp_path):
    write(tmp_path, a="ours", b="ours")
    (tmp_path / "a").write_text("mine")  # of the same size
    with pytest.raises(InputError, match="not an unchanged result"):
        check(tmp_path, ["a"])
    remove(tmp_path, ["a", "b"])
    assert (tmp_path / "a").read_text() == "mine" and not (tmp_path / "b").exists()
    assert files(tmp_path) == []


def test_what_a_run_reads_is_the_users_whoever_wrote_it(tmp_path):
    write(tmp_path, a="ours", b="ours")
    with pytest.raises(InputError, match="a is an input and would be overwritten"):
        check(tmp_path, ["a"], [tmp_path / ".." / tmp_path.name / "a"])
    remove(tmp_path, ["a", "b"], [tmp_path / "a"])
    assert files(tmp_path) == ["a"]


def test_a_log_is_appended_to_and_never_removed(tmp_path):
    with append_to(tmp_path / "run", "run.log").open("a") as log:
        log.write("first\n")
    remove(tmp_path / "run", ["run.log"])
    with append_to(tmp_path / "run", "run.log").open("a") as log:
        log.write("second\n")
    assert (tmp_path / "run" / "run.log").read_text() == "first\nsecond\n"
    (tmp_path / "run.log").write_text("of another program")
    with pytest.raises(InputError, match=r"run\.log would be overwritten"):
        append_to(tmp_path, "run.log")


@pytest.mark.parametrize(
    "text", ["mine", "[]", "{}", '{"files": []}', '{"files": {"a": [1]}}', '{"files": {"a": "b"}}']
)
def test_another_file_of_the_manifests_name_is_refused(tmp_path, text):
    (tmp_path / manifest.NAME).write_text(text)
    with pytest.raises(InputError, match="is not a list of results"):
        write(tmp_path, a="ours")
    assert (tmp_path / manifest.NAME).read_text() == text


def test_names_that_lead_out_of_the_folder_are_ignored(tmp_path):
    write(tmp_path / "run", a="ours")
    (tmp_path / "mine").write_text("ours")  # the bytes of a result
    listed = json.loads((tmp_path / "run" / manifest.NAME).read_text())["files"]
    entries = {"../mine": listed["a"], str(tmp_path / "mine"): listed["a"]}
    (tmp_path / "run" / manifest.NAME).write_text(json.dumps({"files": entries}))
    remove(tmp_path / "run", list(entries))
    assert (tmp_path / "mine").exists()


def test_a_file_where_a_folder_is_needed_is_refused(tmp_path):
    (tmp_path / "stages").write_text("mine")
    with pytest.raises(InputError, match="stages is a file, not a folder"):
        write(tmp_path, stages_readDOTnpz="ours")


@pytest.mark.parametrize("folder", ["/proc/nowhere", "file", "file/below"])
def test_a_folder_that_can_not_be_written_is_refused_and_nothing_is_made(tmp_path, folder):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot write results to"):
        check(tmp_path / folder, [])
    check(tmp_path / "deep" / "er", [])
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@contextmanager
def killed_at(moment: int) -> Iterator[None]:
    """Raise at the so-manieth change of the file system, and at all that follow."""
    left = [moment]

    def limited(change):
        def call(*args, **kwargs):
            left[0] -= 1
            if left[0] < 0:
                raise Killed
            return change(*args, **kwargs)

        return call

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "replace", limited(os.replace))
        patch.setattr(Path, "unlink", limited(Path.unlink))
        yield


@pytest.mark.parametrize("moment", range(12))
def test_a_run_that_is_killed_leaves_a_folder_that_the_next_accepts(tmp_path, moment):
    for text in ("first", "second run"):
        with suppress(Killed), killed_at(moment):
            remove(tmp_path, NAMES)
            write(tmp_path, hexDOTvtu=text, stages_readDOTnpz=text)
            write(tmp_path, reportDOTjson=text)
            write(tmp_path, hexDOTvtu=text + " again")
        check(tmp_path, NAMES)
    remove(tmp_path, NAMES)
    assert not any((tmp_path / name).exists() for name in NAMES)


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["run", "killed", "remove", "user writes", "user deletes"]),
        st.sampled_from(NAMES),
        st.integers(0, 5),
    ),
    max_size=12,
)


@settings(max_examples=60, deadline=None)
@given(STEPS)
def test_in_any_history_no_file_of_the_user_is_lost(tmp_path_factory, steps):
    folder, mine = tmp_path_factory.mktemp("run"), {}
    for number, (step, name, moment) in enumerate(steps):
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        if step == "user writes":
            mine[name] = f"mine, {number}"
            path.write_text(mine[name])
        elif step == "user deletes":
            path.unlink(missing_ok=True)
            mine.pop(name, None)
        else:
            try:
                with killed_at(moment if step == "killed" else 1000):
                    if step == "remove":
                        remove(folder, NAMES)
                    else:
                        with writing(folder) as scratch:
                            (scratch / name).parent.mkdir(exist_ok=True)
                            (scratch / name).write_text(f"ours, {number}")
                assert step == "remove" or name not in mine
            except InputError:
                assert name in mine
            except Killed:
                assert step == "killed"
        assert all((folder / n).read_text() == text for n, text in mine.items())


def test_a_scratch_folder_of_a_killed_process_is_removed_by_the_next_one(tmp_path):
    with writing(tmp_path) as scratch:
        own = scratch.name
    ended = subprocess.Popen(["true"])
    ended.wait()
    left = own.replace(str(os.getpid()), str(ended.pid))
    others = [f"{left}-elsewhere", ".polycube-mine"]  # of another machine, of the user
    for name in (own, left, *others):
        (tmp_path / name).mkdir()
        (tmp_path / name / "half").write_text("half")
    write(tmp_path, a="1")
    assert {p.name for p in tmp_path.iterdir()} == {"a", manifest.NAME, own, *others}


def test_links_out_of_the_folder_are_not_followed(tmp_path):
    """A linked `stages`: its files are neither removed nor replaced, also if they are equal."""
    run, outside = tmp_path / "run", tmp_path / "outside"
    with writing(run) as scratch:
        (scratch / "stages").mkdir()
        (scratch / "stages" / "a.npz").write_text("same")
    outside.mkdir()
    (outside / "a.npz").write_text("same")
    (run / "stages" / "a.npz").unlink()
    (run / "stages").rmdir()
    (run / "stages").symlink_to(outside)
    remove(run, ["stages/a.npz"])
    with pytest.raises(InputError, match="stages is a link out of"):
        check(run, ["stages/a.npz"])
    with pytest.raises(InputError, match="is a link out of"), writing(run) as scratch:
        (scratch / "stages").mkdir()
        (scratch / "stages" / "a.npz").write_text("new")
    assert (outside / "a.npz").read_text() == "same"


def test_only_a_log_may_have_any_content(tmp_path):
    (tmp_path / "hex.vtu").write_text("mine")
    (tmp_path / NAME).write_text(json.dumps({"files": {"hex.vtu": []}}))
    with pytest.raises(InputError, match="would be overwritten"):
        check(tmp_path, ["hex.vtu"])


def test_a_manifest_without_end_is_refused(tmp_path):
    (tmp_path / NAME).write_text('{"files":' + 100_000 * "[")
    with pytest.raises(InputError, match="is not a list of results"):
        files(tmp_path)
