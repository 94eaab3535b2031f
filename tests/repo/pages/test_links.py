from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import unquote

from tests.repo.tree import ROOT, markdown, prose_of

_LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s]+)\)|!\[[^\]]*\]\(([^)\s]+)\)")
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
