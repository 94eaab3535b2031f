"""Hook of MkDocs: links of pages that lead out of `docs/` lead to the repository on the site."""

from __future__ import annotations

import posixpath
import re
from typing import Any, Final

_LINK: Final = re.compile(r"(?<!!)(\[[^\]]*\]\()(\.{0,2}[^)\s:#][^)\s:]*)(\))")


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Rewrite the links of a page.

    Args:
        markdown: text of the page.
        page: the page.
        config: the site's configuration, with the address of the repository.
        files: the files of the site.

    Returns:
        The text, in which a link to a file that is not on the site leads to the repository.
    """
    folder = posixpath.dirname(page.file.src_uri)
    return _LINK.sub(
        lambda link: link[1] + _target(link[2], folder, config.repo_url, files) + link[3], markdown
    )


def _target(link: str, folder: str, repository: str, files: Any) -> str:
    path, mark, anchor = link.partition("#")
    place = posixpath.normpath(posixpath.join("docs", folder, path))
    below = place.removeprefix("docs/")
    if place.startswith("docs/") and (not path or files.get_file_from_path(below) is not None):
        return link
    index = f"{below}/README.md"
    if place.startswith("docs/") and files.get_file_from_path(index) is not None:
        return posixpath.relpath(index, folder or ".") + mark + anchor
    return f"{repository}/blob/main/{place}{mark}{anchor}"
