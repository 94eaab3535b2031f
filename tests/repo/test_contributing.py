"""CONTRIBUTING.md names places of the repository that exist."""

from __future__ import annotations

import re

import pytest

from tests.repo.tree import ROOT, text_of

_PAGE = text_of("CONTRIBUTING.md")
_PATH = r"(?:aeros|tests|tools)/[\w./-]*"
"""A path below one of the folders that the page is about."""

_PLACEHOLDER = r"/[A-Z]+/"
"""A part of a path that the reader chooses, such as NAME in `aeros/sim/NAME/`."""


def _paths_in_code() -> list[str]:
    found = {path for code in re.findall(r"`([^`\n]+)`", _PAGE) for path in re.findall(rf"\b{_PATH}", code)}
    return sorted(path for path in found if not re.search(_PLACEHOLDER, path))


def _packages_with_parts() -> list[tuple[str, str]]:
    """Packages of the map, each with one of the folders that its row lists."""
    rows = re.findall(rf"^\| `({_PATH}/)`(?:, `[^`]+`)* \| (.*) \|$", _PAGE, re.MULTILINE)
    return [(package, part) for package, text in rows for part in re.findall(r"`([a-z_]+/)`", text)]


def test_the_page_names_paths_and_parts() -> None:
    assert len(_paths_in_code()) > 30
    assert len(_packages_with_parts()) > 20


@pytest.mark.parametrize("path", _paths_in_code())
def test_every_path_that_the_page_names_exists(path: str) -> None:
    assert (ROOT / path).exists()
    assert (ROOT / path).is_dir() == path.endswith("/") or path in ("tests/repo", "tests/corpus")


@pytest.mark.parametrize(("package", "part"), _packages_with_parts())
def test_every_part_of_a_package_in_the_map_exists(package: str, part: str) -> None:
    assert (ROOT / package / part).is_dir() or (ROOT / part).is_dir()


def test_the_example_of_a_move_begins_with_a_file_that_exists() -> None:
    (source,) = re.findall(r"^python tools/rename_module\.py (\S+) \S+$", _PAGE, re.MULTILINE)
    assert (ROOT / source).is_file()
