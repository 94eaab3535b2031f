"""Readings in full: of one in 25 sentences of all lists, the tasks with their goals, or the refusal."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.reports_in_full import compare_with_file
from tests.unit.agent.instructions.lists.reference import LISTS, parametric_modules

EACH = 25


def _sentences(content: Any) -> Iterator[str]:
    """Yield the sentences of a list, whose entries are `SENTENCE: MEANING` in groups, or have `say`."""
    if isinstance(content, list):
        for one in content:
            yield from _sentences(one)
    elif isinstance(content, dict) and "say" in content:
        yield str(content["say"])
    elif isinstance(content, dict):
        for name, one in content.items():
            yield from _sentences(one) if isinstance(one, dict | list) else [str(name)]


def _read(sentence: str) -> str:
    try:
        meaning = understand(sentence, parametric_modules())
    except InstructionError as refusal:
        return f"  refused: {refusal}\n"
    texts = [f"  {one.formal_text}" for one in meaning.errands]
    texts += [f"  never {one.formal_text}" for one in meaning.prohibited]
    return "".join(f"{one}\n" for one in texts)


def test_sentences_are_read_as_before_and_refused_in_the_same_words() -> None:
    files = sorted(LISTS.glob("*.yaml"))
    every = sorted({one for path in files for one in _sentences(yaml.safe_load(path.read_text("utf-8")))})
    text = "".join(f"{' '.join(one.split())}\n{_read(one)}" for one in every[::EACH])
    compare_with_file(Path(__file__).with_name("readings.txt"), text)
