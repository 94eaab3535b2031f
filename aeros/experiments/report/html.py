"""A Markdown document as one HTML file that refers to nothing outside it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from aeros.experiments.report.markdown import OFF, Block

_PAGE: Final = """\
<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<title>{{ title }}</title><style>
body{font:14px/1.45 sans-serif;margin:2em auto;max-width:1200px;padding:0 1em;color:#222}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em;border-bottom:1px solid #ccc}
table{border-collapse:collapse;margin:1em 0;display:block;overflow-x:auto}
td,th{text-align:left;vertical-align:top;padding:2px 12px 2px 0;white-space:nowrap}
td{border-top:1px solid #eee}.off{color:#c62828}p{max-width:60em}
svg{max-width:100%;height:auto;display:block}summary{cursor:pointer;color:#1565c0}
</style></head><body>
{% for block in blocks -%}
{% if block.figure %}{{ block.figure.svg | safe }}
{% elif block.collapsed_title -%}
<details><summary>{{ block.collapsed_title }}</summary>
{{ block.markdown | html }}</details>
{% else %}{{ block.markdown | html }}
{%- endif %}
{%- endfor %}
</body></html>
"""


def as_html(blocks: Iterable[Block], title: str) -> str:
    """Render blocks as a page: figures inline, text without links, images or HTML of its own.

    Args:
        blocks: of a document.
        title: of the page.

    Returns:
        An HTML page that loads nothing.
    """
    from jinja2 import Environment, StrictUndefined  # these two are of the extra `experiments`
    from markdown_it import MarkdownIt
    from markupsafe import Markup

    markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
    markdown.disable(["autolink", "image", "link", "reference"])

    def html(text: str) -> Markup:
        marked = f'<b class="off">{OFF}</b>'
        return Markup(markdown.render(text).replace(OFF, marked))  # noqa: S704 - HTML in `text` is escaped

    environment = Environment(autoescape=True, undefined=StrictUndefined)
    environment.filters["html"] = html
    return environment.from_string(_PAGE).render(blocks=blocks, title=title)
