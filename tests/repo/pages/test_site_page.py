"""docs/reference/panda_cell.md lists the names of the reference site, as `aeros site` does."""

from __future__ import annotations

from aeros.apps.site_listing import as_markdown, site_tables
from aeros.spec.elaborate.load import decode_site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import check_generated


def test_the_page_lists_the_reference_site() -> None:
    site = decode_site(reference_site_path())
    assert site is not None
    check_generated("docs/reference/panda_cell.md", "names", f"\n{as_markdown(site_tables(site))}\n")
