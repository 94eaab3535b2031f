"""The name of the distribution, how more of it is installed, and where its repository is."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from aeros import distribution
from tests.repo.tree import text_of


@pytest.fixture(autouse=True)
def _no_kept_answer() -> None:
    distribution.repository.cache_clear()
    distribution._source.cache_clear()


def test_name_and_repository_are_those_of_the_project() -> None:
    project = tomllib.loads(text_of("pyproject.toml"))["project"]
    assert project["name"] == distribution.NAME
    assert distribution.repository() == project["urls"]["Repository"]


def test_an_extra_is_installed_from_the_clone() -> None:
    assert distribution.install_command("mcp") == "`pip install '.[mcp]'` in the clone of AEROS"


@pytest.mark.parametrize(
    ("python", "needed"),
    [
        ((3, 11), "`pip install '.[sim]'` in the clone of AEROS"),
        ((3, 12), "Python 3.11, as PyBullet has no wheel for Python 3.12"),
    ],
)
def test_pybullet_is_not_compiled(
    python: tuple[int, int], needed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(distribution, "_PYTHON", python)
    assert distribution.install_command("sim") == needed


@pytest.mark.parametrize(
    ("url", "source"),
    [
        ({"url": "file://{folder}/a%20b.whl", "archive_info": {}}, "'{folder}/a b.whl[mcp]'"),
        ({"url": "file://{folder}/gone.whl", "archive_info": {}}, None),
        ({"url": "file://{folder}", "dir_info": {"editable": True}}, None),
        (
            {"url": "https://x.org/a.git", "vcs_info": {"vcs": "git", "commit_id": "12ab"}},
            "'aeros-robot[mcp] @ git+https://x.org/a.git@12ab'",
        ),
        (None, None),
        ([], None),
        ("no JSON", None),
    ],
)
def test_an_extra_is_installed_from_where_aeros_came(
    url: object, source: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a b.whl").touch()
    text = None if url is None else json.dumps(url).replace("{folder}", str(tmp_path))

    class Installed:
        def read_text(self, name: str) -> str | None:
            return "{" if url == "no JSON" else text

    monkeypatch.setattr(distribution, "distribution", lambda name: Installed())
    wanted = "`pip install '.[mcp]'` in the clone of AEROS"
    if source is not None:
        wanted = f"`pip install {source.replace('{folder}', str(tmp_path))}`"
    assert distribution.install_command("mcp") == wanted


def test_metadata_without_a_repository_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    class Nothing:
        def get_all(self, name: str) -> None:
            return None

    monkeypatch.setattr(distribution, "metadata", lambda name: Nothing())
    with pytest.raises(LookupError, match="name no repository"):
        distribution.repository()
