"""Laws of the layout of YAML files: it is its own layout, and says the same with the same comments."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.text.layout.check import has_same_content
from tests.hypothesis_profiles import examples
from tests.unit.spec.text.layout.laying_out import check_laws, laid_out, spread
from tests.unit.spec.text.layout.written_yaml import write_yaml

_ROOT = Path(__file__).parents[2]
_SHIPPED = sorted(
    path
    for part in ("aeros", "docs", "ecms", "learned", "services")
    for path in (_ROOT / part).rglob("*.yaml")
)
_KEEPS_LINES = Path("ecms/fetch_object/ecm.yaml")
"""A file with a text over several lines in brackets, whose lines stay as they are."""


@examples(80)
@given(st.randoms(use_true_random=False))
def test_the_laws_hold_however_a_file_is_written(random: Random) -> None:
    assert check_laws(write_yaml(random))


@examples(80)
@given(st.data())
def test_the_laws_hold_for_parts_of_files_with_changes_at_any_place(data: st.DataObject) -> None:
    lines = data.draw(st.sampled_from(_SHIPPED)).read_text(encoding="utf-8").split("\n")
    first = data.draw(st.integers(0, len(lines) - 1))
    part = lines[first : first + data.draw(st.integers(1, 12))]
    margin = min((len(line) - len(line.lstrip()) for line in part if line.strip()), default=0)
    text = "\n".join(line[margin:] for line in part)
    for _ in range(data.draw(st.integers(0, 3))):
        at = data.draw(st.integers(0, len(text)))
        length = data.draw(st.integers(0, 3))
        signs = st.sampled_from(
            ["", "\n", "  ", " # c", "- ", ": ", "[", "}", ", ", "|+\n", "'", '"', "\\\n", "\t"]
        )
        text = text[:at] + data.draw(signs) + text[at + length :]
    check_laws(text)


@pytest.mark.parametrize("path", _SHIPPED, ids=lambda path: str(path.relative_to(_ROOT)))
def test_a_shipped_file_has_the_one_layout_however_it_was_indented(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert laid_out(text) == text, "run `aeros fmt` on it"
    assert check_laws(text)
    other = spread(text)
    assert other != text
    if not has_same_content(text, other.replace("\r\n", "\n")):
        assert re.search(": [|>]", text)  # a text whose lines are indented by different numbers of spaces
    elif path.relative_to(_ROOT) != _KEEPS_LINES:
        assert laid_out(other) == text


@pytest.mark.deep
def test_the_laws_hold_for_every_file_of_the_corpus() -> None:
    texts = [path.read_bytes() for path in sorted((_ROOT / "tests/corpus").rglob("*.yaml"))]
    held = [check_laws(text.decode()) for text in texts if _is_text(text)]
    assert len(held) > 400
    assert held.count(False) < len(held) / 10


def _is_text(content: bytes) -> bool:
    try:
        content.decode()
    except UnicodeDecodeError:
        return False
    return True
