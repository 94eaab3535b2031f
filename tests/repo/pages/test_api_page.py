"""docs/reference/api.md equals the page generated from the docstrings of the public names.

AEROS_UPDATE_GOLDEN=1 pytest tests/repo     rewrites the page, and fails
"""

from __future__ import annotations

import importlib
import re

from aeros.apps.site_listing import as_markdown, site_tables
from aeros.spec.elaborate.load import decode_site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.pages.api_page import PUBLIC, page, perception_page, port_page
from tests.repo.tree import check_generated, text_of

_PAGE = "docs/reference/api.md"


def test_the_page_is_that_of_the_docstrings() -> None:
    check_generated(_PAGE, "names", page())
    check_generated(_PAGE, "port", port_page())


def test_the_page_of_the_toolkit_is_that_of_its_docstrings() -> None:
    check_generated("docs/reference/perception.md", "perception", perception_page())


def test_every_exception_that_a_name_raises_is_explained_with_its_module() -> None:
    text = text_of(_PAGE)
    raised = set(re.findall(r"^- `(\w+Error)`: ", page(), re.MULTILINE))
    explained = dict(re.findall(r"^\| `(\w+)` \| `(aeros\.[\w.]+)` \|", text, re.MULTILINE))
    assert raised <= explained.keys()
    for name, module in explained.items():
        assert issubclass(getattr(importlib.import_module(module), name), Exception)


def test_the_page_has_the_public_names_and_no_other() -> None:
    generated = text_of(_PAGE).partition("<!-- generated: names -->")[2].partition("<!-- end: names -->")[0]
    assert sorted(re.findall(r"^## (\w+)$", generated, re.MULTILINE)) == sorted(PUBLIC)


def test_every_port_that_the_page_names_is_there() -> None:
    named = re.findall(r"^\| `(aeros\.[\w.]+)` \| (.*?) \|", text_of(_PAGE), re.MULTILINE)
    assert len(named) >= 6
    for module, names in named:
        found = importlib.import_module(module)
        for name in re.findall(r"`(\w+)`", names):
            assert hasattr(found, name), (module, name)


def test_the_page_lists_the_reference_site() -> None:
    site = decode_site(reference_site_path())
    assert site is not None
    check_generated("docs/reference/panda_cell.md", "names", f"\n{as_markdown(site_tables(site))}\n")
