"""Stored modules: which files belong to one, where they are kept, and what is swept."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.registry import bundle_store
from aeros.runtime.registry.bundle_store import (
    MAX_MODULE,
    bundle_digest,
    module_files,
    remove_unreferenced,
    store_bundle,
    stored_bundle,
    write_files,
)
from aeros.spec.diagnostics.errors import UserError

FILES = {"ecm.yaml": b"id: tidy\n", "skills.py": b"", "data/deep/a.bin": b"\x00\xff"}


def _write(folder: Path, files: dict[str, bytes]) -> Path:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def _refusal(folder: Path) -> str:
    with pytest.raises(UserError) as refused:
        module_files(folder)
    (found,) = refused.value.diagnostics
    assert found.code == "AE961"
    return found.headline


def test_a_module_is_all_its_files_by_relative_path(tmp_path: Path) -> None:
    assert module_files(_write(tmp_path / "tidy", FILES)) == FILES
    (tmp_path / "tidy" / "empty").mkdir()
    assert module_files(tmp_path / "tidy") == FILES
    assert module_files(tmp_path / "absent") == {}


@pytest.mark.parametrize(
    "name",
    [".git/config", ".env", "data/.hidden", "__pycache__/skills.pyc", "data/__pycache__/a", "ecm.lock"],
)
def test_hidden_files_caches_and_the_certificate_do_not_belong_to_a_module(tmp_path: Path, name: str) -> None:
    assert module_files(_write(tmp_path, {**FILES, name: b"x"})) == FILES


def test_a_link_and_a_pipe_are_refused(tmp_path: Path) -> None:
    for name, make in (
        ("file", lambda path: path.symlink_to("ecm.yaml")),
        ("folder", lambda path: path.symlink_to("data")),
        ("pipe", os.mkfifo),
    ):
        folder = _write(tmp_path / name, FILES)
        make(folder / "odd")
        assert _refusal(folder) == f"`{folder / 'odd'}` cannot be stored: it is not a regular file"


@pytest.mark.parametrize("name", ["a\u202egnp.md", "a\x1b[2J", "a\nb", "data\u200b/a", "a\u00a0b"])
def test_a_name_that_a_listing_would_not_show_as_it_is_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).touch()
    with pytest.raises(UserError, match="holds the character U\\+"):
        module_files(tmp_path)


def test_a_module_has_a_greatest_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert MAX_MODULE == 268_435_456
    folder = _write(tmp_path, {"a": b"12345", "b": b"12345"})
    monkeypatch.setattr(bundle_store, "MAX_MODULE", 10)
    assert len(module_files(folder)) == 2
    monkeypatch.setattr(bundle_store, "MAX_MODULE", 9)
    assert "a module has at most" in _refusal(folder)


def test_folders_are_nested_only_so_deep(tmp_path: Path) -> None:
    deepest = tmp_path / Path(*["a"] * 50)
    deepest.mkdir(parents=True)
    (deepest / "b").touch()
    assert [*module_files(tmp_path)] == ["a/" * 50 + "b"]
    (deepest / "a").mkdir()
    why = "a module has at most 50 folders inside each other"
    assert _refusal(tmp_path) == f"`{tmp_path}` cannot be stored: {why}"


def test_a_great_file_is_refused_in_mebibytes_and_not_read(tmp_path: Path) -> None:
    with (tmp_path / "weights.bin").open("wb") as sparse:
        sparse.truncate(MAX_MODULE + 1)
    assert _refusal(tmp_path).endswith("a module has at most 256 MiB")


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    _write(tmp_path, FILES)
    monkeypatch.setattr(Path, "read_bytes", denied)
    assert _refusal(tmp_path) == f"`{tmp_path}` cannot be stored: Permission denied"


def test_a_digest_is_of_names_and_contents() -> None:
    digest = bundle_digest({"a": b"1", "b": b"2"})
    assert len(digest) == 64
    assert bundle_digest({"b": b"2", "a": b"1"}) == digest
    others = [{"a": b"2", "b": b"1"}, {"a": b"1"}, {"a": b"1", "c": b"2"}, {"a": b"12", "b": b""}]
    assert digest not in {bundle_digest(files) for files in others}


_NAMES = st.text("ab", min_size=1, max_size=3)


@given(st.dictionaries(_NAMES, st.binary(max_size=3)), st.dictionaries(_NAMES, st.binary(max_size=3)))
def test_only_equal_files_have_the_same_digest(one: dict[str, bytes], other: dict[str, bytes]) -> None:
    assert (bundle_digest(one) == bundle_digest(other)) == (one == other)


def test_stored_files_are_in_the_folder_of_their_digest(tmp_path: Path) -> None:
    target = store_bundle(FILES, tmp_path, "tidy")
    assert target == tmp_path / bundle_digest(FILES) / "tidy"
    assert module_files(target) == FILES
    assert [path.name for path in tmp_path.iterdir()] == [bundle_digest(FILES)]


def test_files_that_are_stored_already_are_left_as_they_are(tmp_path: Path) -> None:
    target = store_bundle(FILES, tmp_path, "tidy")
    before = (target / "ecm.yaml").stat().st_ino
    assert store_bundle(FILES, tmp_path, "tidy") == target
    assert (target / "ecm.yaml").stat().st_ino == before


def test_stored_files_that_were_edited_are_stored_anew(tmp_path: Path) -> None:
    target = store_bundle(FILES, tmp_path, "tidy")
    (target / "ecm.yaml").write_bytes(b"edited")
    (target / "more.py").write_bytes(b"added")
    assert module_files(store_bundle(FILES, tmp_path, "tidy")) == FILES


def test_the_leftovers_of_an_interrupted_write_are_replaced(tmp_path: Path) -> None:
    left = tmp_path / f".{bundle_digest(FILES)}.{os.getpid()}" / "tidy"
    _write(left, {"half.py": b"x"})
    assert module_files(store_bundle(FILES, tmp_path, "tidy")) == FILES
    assert not left.parent.exists()


def test_each_folder_is_flushed_to_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[Path] = []
    monkeypatch.setattr(bundle_store, "sync_folder", synced.append)
    store_bundle({"ecm.yaml": b"", "data/a": b""}, tmp_path, "tidy")
    staging = tmp_path / f".{bundle_digest({'ecm.yaml': b'', 'data/a': b''})}.{os.getpid()}"
    assert synced == [staging, staging / "tidy", staging / "tidy" / "data", tmp_path]


def test_modules_that_no_record_names_are_deleted(tmp_path: Path) -> None:
    kept = store_bundle(FILES, tmp_path, "tidy")
    gone = store_bundle({"ecm.yaml": b"other"}, tmp_path, "tidy")
    _write(tmp_path / ".half", FILES)
    remove_unreferenced(tmp_path, {kept.parent.name})
    assert [path.name for path in tmp_path.iterdir()] == [kept.parent.name]
    assert not gone.exists()
    remove_unreferenced(tmp_path, set())
    assert list(tmp_path.iterdir()) == []
    remove_unreferenced(tmp_path / "absent", {kept.parent.name})


def test_a_bundle_stays_stored_if_the_block_succeeds(tmp_path: Path) -> None:
    with stored_bundle(FILES, tmp_path / "modules", "tidy") as folder:
        assert module_files(folder) == FILES
    assert module_files(folder) == FILES


def test_of_a_block_that_fails_nothing_new_stays_stored(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), stored_bundle(FILES, tmp_path / "registry" / "modules", "tidy"):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    kept = store_bundle(FILES, tmp_path / "modules", "tidy")
    with pytest.raises(ZeroDivisionError), stored_bundle(FILES, tmp_path / "modules", "tidy"):
        raise ZeroDivisionError
    assert module_files(kept) == FILES


def test_files_are_written_where_they_are_named(tmp_path: Path) -> None:
    write_files(FILES, tmp_path / "new")
    assert module_files(tmp_path / "new") == FILES
