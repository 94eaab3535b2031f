"""docs/formats.md lists the formats of the registry, and every `schema` that reports of commands name.

AEROS_UPDATE_GOLDEN=1 pytest tests/repo     rewrites the table, and fails
"""

from __future__ import annotations

import re

from aeros.spec.migrations.format import Format, Kind
from aeros.spec.migrations.formats import FORMATS
from aeros.spec.migrations.renamed_names import RENAMED_EVENTS
from aeros.spec.migrations.renamed_options import RENAMED_OPTIONS
from tests.repo.tree import PYTHON, check_generated, text_of


def _remedy(one: Format) -> str:
    return one.cure or "`aeros migrate`"


def _changes(one: Format) -> str:
    numbered = enumerate(one.versions, one.first)
    return "<br>".join(f"{number}: {version.change}" for number, version in numbered)


def test_the_table_is_that_of_the_registry() -> None:
    expected = "\n| format | file | version | held in | what each version changed | how to migrate |\n"
    expected += "|---|---|---|---|---|---|\n"
    for one in FORMATS:
        files = ", ".join(f"`{name}`" for name in one.files) or "any name"
        schema = f"`{one.schema}`" if one.kind is not Kind.DATABASE else str(one.version)
        cells = (one.title, files, schema, one.kind.value, _changes(one), _remedy(one))
        expected += f"| {' | '.join(cells)} |\n"
    check_generated("docs/formats.md", "formats", expected + "\n")


def test_the_tables_of_renamed_names_are_those_of_the_code() -> None:
    events = "\n| old event | current event |\n|---|---|\n"
    events += "".join(f"| `{old}` | `{new}` |\n" for old, new in RENAMED_EVENTS.items())
    check_generated("docs/formats.md", "renamed events", events + "\n")
    options = "\n| command | old option | current option |\n|---|---|---|\n"
    for command, names in RENAMED_OPTIONS.items():
        options += "".join(f"| `aeros {command}` | `{old}` | `{new}` |\n" for old, new in names.items())
    check_generated("docs/formats.md", "renamed options", options + "\n")


def test_every_schema_in_the_code_is_on_the_page() -> None:
    page = text_of("docs/formats.md")
    named = {name for path in PYTHON for name in re.findall(r'"(aeros/[a-z-]+/\d)"', text_of(path))}
    assert {name for name in named if f"`{name}`" not in page} == set()


def test_the_readme_leads_to_the_page() -> None:
    assert "(formats.md)" in text_of("docs/README.md")
