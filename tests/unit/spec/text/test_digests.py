from __future__ import annotations

import os
from pathlib import Path

import pytest

from aeros.spec.text.digests import MAX_FILE, code_digest, code_files, file_digest, model_digest


def test_digests_distinguish_names_contents_and_borders() -> None:
    variants: list[dict[str, bytes]] = [
        {},
        {"a.py": b""},
        {"b.py": b""},
        {"a.py": b"x"},
        {"a.py": b"x", "b.py": b"y"},
        {"a.py": b"xb.pyy"},
        {"a.py": b"y", "b.py": b"x"},
    ]
    assert len({code_digest(files) for files in variants}) == len(variants)
    assert code_digest({"a.py": b"x", "b.py": b"y"}) == code_digest({"b.py": b"y", "a.py": b"x"})
    assert file_digest(b"").startswith("e3b0c442")


def test_only_python_files_are_code(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    for name in ("b.py", "a.py", "notes.txt", "below/c.py"):
        (tmp_path / name).write_text(name)
    assert code_files(tmp_path) == {"a.py": b"a.py", "b.py": b"b.py", "below/c.py": b"below/c.py"}
    assert list(code_files(tmp_path)) == ["a.py", "b.py", "below/c.py"]


def test_code_is_not_looked_for_in_endless_folders(tmp_path: Path) -> None:
    deepest = tmp_path / Path(*["a"] * 50)
    deepest.mkdir(parents=True)
    (deepest / "b.py").touch()
    assert [*code_files(tmp_path)] == ["a/" * 50 + "b.py"]
    (deepest / "a").mkdir()
    with pytest.raises(OSError, match="at most 50 folders inside each other"):
        code_files(tmp_path)


def test_irregular_and_too_large_files_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "folder.py").mkdir()
    with pytest.raises(OSError, match=r"`folder.py` is not a regular file"):
        code_files(tmp_path)
    (tmp_path / "folder.py").rmdir()
    (tmp_path / "link.py").symlink_to("/dev/zero")
    with pytest.raises(OSError, match=r"`link.py` is not a regular file"):
        code_files(tmp_path)
    (tmp_path / "link.py").unlink()
    os.mkfifo(tmp_path / "pipe.py")
    with pytest.raises(OSError, match=r"`pipe.py` is not a regular file"):
        code_files(tmp_path)
    (tmp_path / "pipe.py").unlink()
    (tmp_path / "large.py").write_bytes(b"#" * (MAX_FILE + 1))
    with pytest.raises(OSError, match=r"`large.py` is larger"):
        code_files(tmp_path)


def test_a_model_digest_is_that_of_its_bytes(tmp_path: Path) -> None:
    content = b"weights" * 400_000  # more than one block
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "model.bin").write_bytes(content)
    assert model_digest(tmp_path, "below/model.bin") == (file_digest(content), len(content))
    assert model_digest(tmp_path, "below/model.bin", len(content))[1] == len(content)
    with pytest.raises(OSError, match="all models together have more than"):
        model_digest(tmp_path, "below/model.bin", len(content) - 1)


@pytest.mark.parametrize("name", ["../model.bin", "/etc/hostname", ".", "", "gone", "a\0b", "below"])
def test_a_path_to_no_file_in_the_folder_is_no_model(tmp_path: Path, name: str) -> None:
    (tmp_path / "model.bin").touch()
    (tmp_path / "module" / "below").mkdir(parents=True)
    descriptors = len(os.listdir("/proc/self/fd"))
    with pytest.raises(OSError, match=r"."):
        model_digest(tmp_path / "module", name)
    assert len(os.listdir("/proc/self/fd")) == descriptors
