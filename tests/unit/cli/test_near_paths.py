"""A path that does not exist: the nearest one that does."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.near_paths import near_path
from aeros.cli.parsers import parse
from tests.repo.tree import ROOT


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of modules beside a site, which is the working directory."""
    for name in ("make_dumplings", "clean_table"):
        (tmp_path / "ecms" / name).mkdir(parents=True)
        (tmp_path / "ecms" / name / "ecm.yaml").write_text("schema: 1\n", encoding="utf-8")
    (tmp_path / "cell.yaml").write_text("schema: 1\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("given", "near"),
    [
        ("ecsm", "ecms"),
        ("cel.yaml", "cell.yaml"),
        ("ecms/make_dumpling", "ecms/make_dumplings"),
        ("ecsm/make_dumplings", "ecms/make_dumplings"),
        ("make_dumplings", "ecms/make_dumplings"),
        ("make_dumpling", "ecms/make_dumplings"),
        ("xyzzy", None),
        ("ecms/xyzzy", None),
        ("cell.yaml/x", None),
        ("", None),
        ("a\0b", None),
        ("x" * 5000, None),
    ],
)
def test_the_nearest_path_is_found(given: str, near: str | None) -> None:
    assert near_path(given) == near


@pytest.mark.parametrize(
    ("given", "near"),
    [
        ("ecms", "ecms"),
        ("ecms/", "ecms"),
        ("fetch_object", "ecms/fetch_object"),
        ("ecms/fetch_objekt", "ecms/fetch_object"),
        ("fetch_objects", "ecms/fetch_object"),
        ("ecms/clean_pot", None),
        ("other/fetch_object", None),
    ],
)
def test_modules_that_come_with_aeros_are_known_by_their_names(
    given: str, near: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    monkeypatch.chdir(empty)
    assert near_path(given) == (None if near is None else str(ROOT / near))


def test_an_absolute_path_is_corrected_as_one(folder: Path) -> None:
    assert near_path(f"{folder}/cell.yml") == f"{folder}/cell.yaml"


def test_a_link_that_leads_nowhere_is_no_cure(folder: Path) -> None:
    (folder / "sponge.yaml").symlink_to("nowhere")
    assert near_path("sponges.yaml") is None
    (folder / "nowhere").write_bytes(b"")
    assert near_path("sponges.yaml") == "sponge.yaml"


@pytest.mark.parametrize("words", [["verify", "ecsm"], ["fmt", "ecsm"], ["predict", "ecsm"]])
def test_a_command_names_the_path_that_was_intended(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        parse(words)
    assert "no file or folder `ecsm`; did you mean `ecms`?" in capsys.readouterr().err
