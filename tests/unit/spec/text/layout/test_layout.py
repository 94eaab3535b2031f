"""The one layout, by cases; tests/property/test_layout.py has its laws."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.diagnostics.errors import InternalError, UserError
from aeros.spec.text.layout import LayoutRefusedError, flow
from tests.unit.spec.text.layout.laying_out import check_laws, laid_out

_DATA = Path(__file__).parent / "data"
_CASES = sorted(path.name.removesuffix(".before.yaml") for path in _DATA.glob("*.before.yaml"))


@pytest.mark.parametrize("name", _CASES)
def test_a_case_has_its_layout(name: str) -> None:
    before = (_DATA / f"{name}.before.yaml").read_text(encoding="utf-8")
    assert laid_out(before) == (_DATA / f"{name}.after.yaml").read_text(encoding="utf-8")
    assert check_laws(before)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("{}", "{}\n"),
        ("[ a,\n b ]\n", "[a, b]\n"),
        ("a", "a\n"),
        ("|\n x\n", "|\n  x\n"),
        ("# one\n---   # two\na:  b\n...\n# three\n", "# one\n--- # two\na: b\n...\n# three\n"),
        ("--- {a: b}\n", "---\n{a: b}\n"),
        ("a: |\n x", "a: |\n  x"),
        ("a: |-\n x", "a: |-\n  x\n"),
        ("a: |+\n x\n\n\n", "a: |+\n  x\n\n\n"),
        ("a:\t'b'\t# c\n", "a: 'b' # c\n"),
        ("a:\r\n   - b\r\n", "a:\n  - b\n"),
        ("a:\n  b\n", "a: b\n"),
        (f"a:\n   {'b' * 120}\n", f"a:\n  {'b' * 120}\n"),
        ("? a\n: b\n? c\nd: e\n", "a: b\nc:\nd: e\n"),
        ("? a\n:b: c\n", "a:\n:b: c\n"),
        ("a:   # b\n\n\n  # c\n  {d: e}\n", "a: # b\n  # c\n  {d: e}\n"),
        ("a:\n  # b\n  |\n   c\n", "a:\n  # b\n  |\n  c\n"),
        ("- |1\n  a\n", "- |1\n  a\n"),
    ],
)
def test_small_files(before: str, after: str) -> None:
    assert laid_out(before) == after
    assert check_laws(before)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("? a # b\n: c\n", "a.yaml:1:3"),
        (f"? {'a' * 1001}\n: c\n", "a.yaml:1:3"),
        ("? a\n  b\n: c\n", "a.yaml:1:3"),
    ],
)
def test_a_key_that_cannot_stand_before_a_colon_is_refused(text: str, place: str) -> None:
    with pytest.raises(LayoutRefusedError) as refused:
        laid_out(text)
    assert str(refused.value.span) == place
    assert refused.value.reason


@pytest.mark.parametrize("text", ["a: [\n", "a: &b c\n", "a: 1\n---\nb: 2\n", "a: 1\na: 2\n", ""])
def test_a_text_that_the_reader_refuses_has_its_diagnostic(text: str) -> None:
    with pytest.raises(UserError) as refused:
        laid_out(text)
    assert refused.value.diagnostics


def test_a_layout_that_says_something_else_is_no_result(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flow, "on_one_line", lambda _: "{}")
    with pytest.raises(InternalError, match="would change what it says"):
        laid_out("a: {b: c}\n")
