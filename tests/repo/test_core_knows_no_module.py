"""Nothing under `aeros/` knows the tasks of the shipped modules: modules bring what they know.

Examples for people name them: texts of `--help`, examples in docstrings and in descriptions of fields, after
`as in`. So do the grants and objects of the reference site, which are an operator's.
"""

from __future__ import annotations

import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT
from tests.shipped_scenes import FOLDERS

_OBJECTS = ("dumpling", "sponge", "clutter", "red can")
"""Words of the shipped modules' objects that nobody else would use."""

_COMMON = {"bin_position"}
"""Variables that the template of a module has, too."""

_EXAMPLE = re.compile(r">>>|\bas in\b|such as `|aeros [a-z]+ |\{skill: ")
"""An example in a text."""


def _names() -> set[str]:
    """Ids of the shipped modules, and their state variables."""
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    found = [load_ecm(folder, site, Diagnostics()) for folder in FOLDERS]
    ecms = [one.ecm for one in found if one is not None]
    own = {name for ecm in ecms for full in ecm.state for name in (full.partition(".")[2],) if "_" in name}
    return ({ecm.id for ecm in ecms} | own) - _COMMON


def _tokens(path: Path) -> Iterator[tuple[int, str]]:
    """Tokens of a Python file, each with its line."""
    text = path.read_text(encoding="utf-8")
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        yield token.start[0], token.string


def test_no_code_of_the_core_names_a_shipped_module_or_its_objects() -> None:
    words = re.compile(rf"\b({'|'.join(sorted(_NAMES))})\b|{'|'.join(_OBJECTS)}", re.IGNORECASE)
    paths = sorted((ROOT / "aeros").rglob("*.py"))
    assert len(paths) > 500
    found = []
    for path in paths:
        # Few files have such a word at all, and to read tokens takes long.
        tokens = _tokens(path) if words.search(path.read_text(encoding="utf-8")) else ()
        for number, text in tokens:
            is_text = text.startswith(("#", '"', "'", 'f"', 'r"')) and " " in text
            is_example = is_text and (_EXAMPLE.search(text) or path.is_relative_to(ROOT / "aeros" / "cli"))
            if words.search(text) and not is_example:
                found.append(f"{path}:{number}: {text.strip()}")
    assert found == []


_NAMES = _names()


def test_no_data_of_the_core_names_a_shipped_module_or_its_objects() -> None:
    words = re.compile(rf"\b({'|'.join(sorted(_NAMES))})\b|{'|'.join(_OBJECTS)}", re.IGNORECASE)
    for path in sorted((ROOT / "aeros").rglob("*")):
        if path.suffix not in (".yaml", ".toml", ".template"):
            continue
        text = path.read_text(encoding="utf-8")
        if path.parent == reference_site_path().parent:
            text = re.sub(r"^  grants:\n(    .*\n)+", "", text, flags=re.MULTILINE)
            text = re.sub(r"^objects:\n(  .*\n)+", "", text, flags=re.MULTILINE)
        lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
        found = [line for line in lines if words.search(line)]
        assert found == [], path
