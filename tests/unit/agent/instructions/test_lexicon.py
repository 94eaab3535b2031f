from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.agent.instructions.lexicon import task_phrases
from tests.unit.agent.dumplings import module, task

TEA = replace(
    task("tea", ("make", "brew up"), "wrapper_aligned"),
    object_phrases=("tea", "green tea"),
    extra_phrases=("from the other shelf", "leave it there"),
)


@pytest.mark.parametrize(
    ("words", "length"),
    [
        ("brew up tea", 2),
        ("brewing up tea", 2),
        ("brews up tea", 0),
        ("brewed up tea", 0),
        ("green teas", 2),
        ("from its other shelf", 4),
        ("from other shelf", 3),
        ("leave them there", 3),
        ("leave her there", 0),
    ],
)
def test_a_phrase_stands_for_its_forms(words: str, length: int) -> None:
    (entry,) = task_phrases({"kitchen": module("kitchen", (), TEA)})
    assert entry.longest(tuple(words.split()), 0)[1] == length


def test_in_the_perfect_a_participle_stands_for_its_verb() -> None:
    (entry,) = task_phrases({"kitchen": module("kitchen", (), TEA)})
    assert entry.longest(("brewed", "up"), 0, is_perfect=True)[1] == 2


def test_phrases_are_collected_once_for_the_same_modules_and_anew_for_others() -> None:
    shop = module("shop", (), TEA)
    (entry,) = task_phrases({"shop": shop})
    assert task_phrases({"shop": shop})[0] is entry
    assert entry.particles == {"up"}
    assert task_phrases({"other": shop})[0].routed.module == "other"
    (changed,) = task_phrases({"shop": module("shop", (), replace(TEA, trigger_phrases=("pour",)))})
    assert changed.triggers == (("pour",),)
