from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote
from xml.etree import ElementTree

import pytest

from aeros.distribution import repository
from tests.repo.tree import ROOT, markdown, prose_of, text_of
from tools.draw_diagrams import FOLDER, finish, source_mark
from tools.site_links import on_page_markdown

_LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s]+)\)|!\[[^\]]*\]\(([^)\s]+)\)")
DIAGRAMS = sorted(FOLDER.glob("*.mmd"))
_PAGE_IN_CODE = re.compile(r"docs/[\w./-]+\.md")


def _slug(heading: str) -> str:
    """The anchor that GitHub gives a heading."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.strip().lower())
    return re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")


def _anchors(page: Path) -> set[str]:
    return {_slug(heading) for heading in re.findall(r"^#+ (.+)$", prose_of(page), re.MULTILINE)}


def test_every_link_of_each_page_leads_somewhere() -> None:
    pages = list(markdown())
    assert len(pages) > 100
    assert {page: dead for page in pages if (dead := _dead_links(page))} == {}


def _dead_links(page: Path) -> list[str]:
    """Targets of the page's links that are not there."""
    dead = []
    for found in _LINK.finditer(prose_of(page)):
        target = unquote(found[1] or found[2])
        if target.startswith(("https://", "mailto:")):
            continue
        path, _, anchor = target.partition("#")
        aim = (ROOT / page.parent / path).resolve() if path else ROOT / page
        inside = aim.is_relative_to(ROOT) and aim.exists()
        if not inside or (anchor and (aim.suffix != ".md" or anchor not in _anchors(aim.relative_to(ROOT)))):
            dead.append(target)
    return dead


def test_every_page_that_the_code_names_exists() -> None:
    sources = [
        path
        for folder in ("aeros", "ecms", "tests")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in {".py", ".yaml"}
    ]
    named = {name for path in sources for name in _PAGE_IN_CODE.findall(path.read_text("utf-8", "replace"))}
    assert {name for name in named if not (ROOT / name).is_file()} == set()


def test_every_decision_is_numbered_and_complete() -> None:
    pages = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    assert [page.name[:5] for page in pages] == [f"{n:04}-" for n in range(1, len(pages) + 1)]
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert text.startswith(f"# {int(page.name[:4])}. "), page.name
        for part in ("## Context", "## Decision", "## Consequences", "- Bad: "):
            assert part in text, f"{page.name}: {part}"


# The site that `make site` builds.

_PAGES = {
    path.relative_to(ROOT / "docs").as_posix()
    for pattern in ("*.md", "how-to/*.md", "reference/*.md", "results/*/report.md")
    for path in (ROOT / "docs").glob(pattern)
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


@pytest.mark.parametrize("text", DIAGRAMS, ids=lambda text: text.stem)
def test_a_picture_is_that_of_its_text_and_on_a_page(text: Path) -> None:
    drawn = text.with_suffix(".svg").read_text(encoding="utf-8")
    assert source_mark(text.read_text(encoding="utf-8")) in drawn, "python -m tools.draw_diagrams"
    root = ElementTree.fromstring(drawn)  # noqa: S314  a file of the repository
    assert float(root.attrib["width"]) <= 850, "wider than a page: its words would be too small"
    assert 'fill="white"' in drawn
    assert any(f"](diagrams/{text.stem}.svg)" in page.read_text() for page in (ROOT / "docs").glob("*.md"))


def test_all_pictures_have_a_text() -> None:
    assert {path.stem for path in FOLDER.glob("*.svg")} == {path.stem for path in DIAGRAMS}


def test_a_picture_without_a_size_is_refused() -> None:
    with pytest.raises(ValueError, match="no viewBox"):
        finish("<svg></svg>", "flowchart LR")
