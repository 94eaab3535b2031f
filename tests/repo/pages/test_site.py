"""The documentation as a site: every page is in its menu, and links out of `docs/` lead to the repository."""

from __future__ import annotations

import re
from types import SimpleNamespace

import pytest

from aeros.distribution import repository
from tests.repo.tree import ROOT, text_of
from tools.site_links import on_page_markdown

_PAGES = {
    path.relative_to(ROOT / "docs").as_posix()
    for folder in ("docs", "docs/how-to", "docs/reference")
    for path in (ROOT / folder).glob("*.md")
}
_FILES = SimpleNamespace(get_file_from_path=lambda path: path in _PAGES | {"codes/README.md"} or None)
_REPOSITORY = "https://example.org/aeros"


def test_each_page_is_in_the_menu() -> None:
    menu = text_of("mkdocs.yml").partition("\nnav:\n")[2].partition("\nvalidation:")[0]
    assert set(re.findall(r"[\w/-]+\.md", menu)) == _PAGES | {"codes/README.md"}


def test_the_site_names_the_repository() -> None:
    assert f"repo_url: {repository()}\n" in text_of("mkdocs.yml")


@pytest.mark.parametrize(
    ("page", "link", "target"),
    [
        ("trust.md", "audit.md#what-is-noticed", "audit.md#what-is-noticed"),
        ("trust.md", "../aeros/cli/main.py", f"{_REPOSITORY}/blob/main/aeros/cli/main.py"),
        ("how-to/behaviour-trees.md", "../trust.md", "../trust.md"),
        ("how-to/behaviour-trees.md", "../../README.md#x", f"{_REPOSITORY}/blob/main/README.md#x"),
        ("trust.md", "codes", "codes/README.md"),
        ("trust.md", "examples/a.yaml", f"{_REPOSITORY}/blob/main/docs/examples/a.yaml"),
        ("trust.md", "#here", "#here"),
        ("trust.md", "https://example.com/x", "https://example.com/x"),
    ],
)
def test_a_link_out_of_the_pages_leads_to_the_repository(page: str, link: str, target: str) -> None:
    text = on_page_markdown(
        f"see [it]({link}), ![picture](clips/x.webp)",
        page=SimpleNamespace(file=SimpleNamespace(src_uri=page)),
        config=SimpleNamespace(repo_url=_REPOSITORY),
        files=_FILES,
    )
    assert text == f"see [it]({target}), ![picture](clips/x.webp)"
