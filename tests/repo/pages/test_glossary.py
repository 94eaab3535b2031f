from __future__ import annotations

import re

from tests.repo.tree import PYTHON, ROOT, text_of

_TERMS = re.findall(r"^\| \*\*(.+?)\*\* \| (.+) \|$", text_of("docs/glossary.md"), re.MULTILINE)


def test_every_word_has_one_meaning() -> None:
    words = [word.lower() for word, _ in _TERMS]
    assert len(words) > 40
    assert len(set(words)) == len(words)


def test_every_word_is_used_where_it_is_needed() -> None:
    sources = [ROOT / path for path in PYTHON]
    sources += [
        *(ROOT / "aeros").rglob("*.yaml"),
        *(ROOT / "docs" / "decisions").glob("*.md"),
        ROOT / "README.md",
    ]
    everything = " ".join(path.read_text(encoding="utf-8") for path in sources).lower()
    everything = re.sub(r"[\s_]+", " ", everything)
    assert [word for word, _ in _TERMS if word.lower() not in everything] == []


def test_the_verdicts_and_decisions_of_the_glossary_are_those_of_the_code() -> None:
    from aeros.runtime.gate.decision import DecisionKind as DecisionKind
    from aeros.spec.obligations.verdicts import Verdict as Proved

    meanings = dict(_TERMS)
    for word, enum in (("verdict", Proved), ("decision", DecisionKind)):
        assert re.findall(r"\b[A-Z]{4,}\b", meanings[word]) == [one.name for one in enum]
