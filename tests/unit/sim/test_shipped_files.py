"""Files are found by the name of a shipped one, or by path; a name goes first."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.sim.shipped_files import find_file, shipped_files
from aeros.spec.diagnostics.errors import UserError

SHIPPED = {"at_the_table": Path("/aeros/at_the_table.yaml"), "passing": Path("/aeros/passing.yaml")}


def test_a_folder_of_the_package_is_listed_by_name() -> None:
    found = shipped_files("people")
    assert len(found) >= 3
    assert list(found) == sorted(found)
    for name, path in found.items():
        assert (path.name, path.parent.name) == (f"{name}.yaml", "people")
        assert path.is_file()
    assert shipped_files("no_such_folder") == {}


def test_a_name_goes_before_a_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("passing", "mine.yaml"):
        (tmp_path / name).touch()
    assert find_file("passing", SHIPPED, "people file") == Path("/aeros/passing.yaml")
    assert find_file("mine.yaml", SHIPPED, "people file") == "mine.yaml"
    assert find_file(str(tmp_path / "passing"), SHIPPED, "people file") == str(tmp_path / "passing")


def test_a_broken_link_is_a_path_too(tmp_path: Path) -> None:
    (tmp_path / "link.yaml").symlink_to(tmp_path / "absent")
    assert find_file(str(tmp_path / "link.yaml"), SHIPPED, "people file") == str(tmp_path / "link.yaml")


@pytest.mark.parametrize(
    ("name", "help_"),
    [
        ("at_the_tabel", "did you mean `at_the_table`?"),
        ("zzz", "give a people file, or one of `at_the_table`, `passing`"),
    ],
)
def test_a_path_that_is_neither_is_refused_with_a_suggestion(name: str, help_: str) -> None:
    with pytest.raises(UserError) as refused:
        find_file(name, SHIPPED, "people file")
    (found,) = refused.value.diagnostics
    assert found.code == "AE002"
    assert found.headline == f"no file `{name}`, and no people file of that name comes with AEROS or a module"
    assert found.help == (help_,)
