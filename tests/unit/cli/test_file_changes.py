"""Changes of files are shown as `patch` reads them, and written with the mode and links that files had."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.file_changes import is_pinned, replace_text, unified_diff
from aeros.spec.migrations import formats


def test_a_diff_ends_lines_at_line_feeds_alone() -> None:
    assert unified_diff("a\x0bb\nc\n", "a\x0bb\nd", "f", "g").splitlines()[:2] == ["--- f", "+++ g"]
    assert unified_diff("a\x0bb\nc\n", "a\x0bb\nd", "f").endswith(
        " a\x0bb\n-c\n+d\n\\ No newline at end of file\n"
    )
    assert unified_diff("a\n", "a\n", "f") == ""


def test_mode_and_link_stay(tmp_path: Path) -> None:
    file, link = tmp_path / "a.yaml", tmp_path / "b.yaml"
    file.write_text("a\n")
    file.chmod(0o640)
    link.symlink_to(file)
    replace_text(link, "a\n", "b\n")
    assert (file.read_text(), file.stat().st_mode & 0o777, link.is_symlink()) == ("b\n", 0o640, True)
    assert sorted(tmp_path.iterdir()) == [file, link]


def test_the_change_of_somebody_else_is_not_lost(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("other\n")
    with pytest.raises(OSError, match="was changed while"):
        replace_text(file, "a\n", "b\n")
    assert file.read_text() == "other\n"


def test_copies_of_a_registry_are_pinned(tmp_path: Path) -> None:
    (tmp_path / formats.REGISTRY.files[0]).touch()
    assert is_pinned(tmp_path / "modules" / "it" / "ecm.yaml")
    assert not is_pinned(tmp_path / "other" / "ecm.yaml")
