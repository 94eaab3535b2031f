"""The name of the distribution, how more of it is installed, and where its repository is."""

from __future__ import annotations

import tomllib

import pytest

from aeros import distribution
from tests.repo.tree import text_of


@pytest.fixture(autouse=True)
def _no_kept_answer() -> None:
    distribution.repository.cache_clear()


def test_name_and_repository_are_those_of_the_project() -> None:
    project = tomllib.loads(text_of("pyproject.toml"))["project"]
    assert project["name"] == distribution.NAME
    assert distribution.repository() == project["urls"]["Repository"]


def test_an_extra_is_installed_from_the_clone() -> None:
    assert distribution.install_command("mcp") == "`pip install '.[mcp]'` in the clone of AEROS"


def test_metadata_without_a_repository_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    class Nothing:
        def get_all(self, name: str) -> None:
            return None

    monkeypatch.setattr(distribution, "metadata", lambda name: Nothing())
    with pytest.raises(LookupError, match="name no repository"):
        distribution.repository()
