"""A renamed key and the new version are all that a migration of a manifest changes."""

from __future__ import annotations

from pathlib import PurePath

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.migrations.rewriting import rewrite
from tests.unit.spec.migrations.migrating import OLD_ECM

_PATH = PurePath("it/ecm.yaml")
_COMMENTS = st.text("aä→ #:{}[]'\"-&*!|>%@`time_limit", max_size=20)
_QUOTES = st.sampled_from(["", "'", '"'])


@st.composite
def manifests(draw: st.DrawFn) -> tuple[str, str]:
    """A manifest of version 0, and the same of version 1; decoys are named as the key that is renamed."""
    old, new = [], []

    def line(before: str, after: str | None = None) -> None:
        ending = draw(st.sampled_from(["", " ", "  # "]))
        ending += draw(_COMMENTS) if "#" in ending else ""
        old.append(before + ending)
        new.append((before if after is None else after) + ending)
        for _ in range(draw(st.integers(0, 2))):
            comment = draw(st.sampled_from(["", "# ", "      # "]))
            comment += draw(_COMMENTS) if comment else ""
            old.append(comment)
            new.append(comment)

    def schema() -> None:
        quote = draw(_QUOTES)
        line(f"schema: {quote}aeros/ecm/1{quote}", f"schema: {quote}aeros/ecm/2{quote}")

    is_first = draw(st.booleans())
    if is_first:
        schema()
    line("time_limit: aeros/ecm/1")
    line("skills:")
    for number in range(draw(st.integers(1, 3))):
        quote = draw(_QUOTES)
        before, after = (f"{quote}{name}{quote}" for name in ("time_limit", "timeout"))
        if draw(st.booleans()):
            rest = "inner: {time_limit: 1}"
            line(f"  s{number}: {{{before}: 3 s, {rest}}}", f"  s{number}: {{{after}: 3 s, {rest}}}")
        else:
            line(f"  s{number}:")
            line("    note: 'time_limit: 3'")
            line(f"    {before}: time_limit", f"    {after}: time_limit")
            line("    list: [time_limit]")
    if not is_first:
        schema()
    end = draw(st.sampled_from(["\n", "\r\n"]))
    last = draw(st.sampled_from(["", end]))
    return end.join(old) + last, end.join(new) + last


@given(manifests())
def test_every_other_byte_stays(pair: tuple[str, str]) -> None:
    old, new = pair
    assert rewrite(_PATH, old, OLD_ECM).text == new


@given(manifests())
def test_migrating_twice_changes_nothing(pair: tuple[str, str]) -> None:
    once = rewrite(_PATH, pair[0], OLD_ECM)
    twice = rewrite(_PATH, once.text, OLD_ECM)
    assert (twice.text, twice.is_changed) == (once.text, False)
