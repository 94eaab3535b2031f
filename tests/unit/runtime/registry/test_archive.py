"""Archives: what is packed comes out again, and nothing else is let in."""

from __future__ import annotations

import stat
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.registry.archive import pack, unpack
from aeros.runtime.registry.bundle_store import module_files
from aeros.spec.diagnostics.errors import UserError

PARTS = st.text("abcXYZ09_", min_size=1, max_size=8)
FILES = st.dictionaries(
    st.lists(PARTS, min_size=1, max_size=3).map(tuple), st.binary(max_size=200), max_size=6
)


@given(FILES)
def test_packed_files_are_unpacked_unchanged(
    tmp_path_factory: pytest.TempPathFactory, files: dict[tuple[str, ...], bytes]
) -> None:
    names = {"/".join(parts): content for parts, content in files.items()}
    kept = {
        name: content
        for name, content in names.items()
        if not any(other.startswith(f"{name}/") for other in names)
    }
    folder = tmp_path_factory.mktemp("archive")
    (folder / "a.zip").write_bytes(pack(kept))
    assert pack(dict(reversed(kept.items()))) == pack(kept)
    unpack(folder / "a.zip", folder / "out")
    (folder / "out").mkdir(exist_ok=True)
    assert module_files(folder / "out") == kept


def archive(path: Path, *entries: tuple[str | zipfile.ZipInfo, bytes]) -> Path:
    with zipfile.ZipFile(path, "w") as written:
        for entry, content in entries:
            written.writestr(entry, content)
    return path


def link(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name)
    entry.create_system = 3
    entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    return entry


@pytest.mark.parametrize(
    ("entries", "why"),
    [
        ([("../out_of_it", b"")], "is outside the module's folder"),
        ([("/etc/passwd", b"")], "is outside the module's folder"),
        ([("a/../../b", b"")], "is outside the module's folder"),
        ([("a\\b", b"")], "is outside the module's folder"),
        ([(link("skills.py"), b"/etc/passwd")], "is not a regular file"),
        ([(zipfile.ZipInfo(""), b"1")], "a file in it has no name"),
        ([("a", b"1"), (zipfile.ZipInfo(""), b""), ("b/", b"")], "a file in it has no name"),
        ([("a", b"1"), ("./a", b"2")], "is in it twice"),
        ([(f"f{n}", b"") for n in range(10_001)], "at most 10,000 files"),
        ([("a", b""), ("a/b", b"")], "cannot be unpacked"),
        ([("a/" * 51 + "b", b"")], "at most 50 folders inside each other"),
        ([("a/" * 2000 + "b", b"")], "at most 50 folders inside each other"),
    ],
)
def test_a_malformed_archive_is_refused_and_nothing_is_written_outside(
    tmp_path: Path, entries: list[tuple[str | zipfile.ZipInfo, bytes]], why: str
) -> None:
    path = archive(tmp_path / "a.zip", *entries)
    inside = tmp_path / "in" / "side"
    inside.mkdir(parents=True)
    with pytest.raises(UserError) as raised:
        unpack(path, inside)
    assert why in raised.value.diagnostics[0].headline
    assert sorted(tmp_path.rglob("*")) == sorted([path, tmp_path / "in", inside, *inside.rglob("*")])


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as written:
        for number in range(3):
            written.writestr(f"zeros{number}", bytes(100 * 1024 * 1024))
    assert path.stat().st_size < 1024 * 1024
    with pytest.raises(UserError, match="256 MiB"):
        unpack(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_damaged_archive_is_refused_in_words_or_gives_what_was_packed(tmp_path: Path) -> None:
    files = {"ecm.yaml": b"id: tidy\n" * 100, "skills.py": b"pass\n"}
    whole = pack(files)
    path = tmp_path / "a.zip"
    refused = accepted = 0
    for position in range(0, len(whole), 3):
        for damaged in (
            whole[:position],
            whole[:position] + bytes([whole[position] ^ 0x5A]) + whole[position + 1 :],
        ):
            path.write_bytes(damaged)
            out = tmp_path / f"out-{refused + accepted}"
            try:
                unpack(path, out)
            except UserError:
                refused += 1
                continue
            # Zip files hold times and flags that nothing reads.
            accepted += 1
            assert module_files(out) == files
    assert refused > accepted > 0
