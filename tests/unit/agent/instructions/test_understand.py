from __future__ import annotations

from collections import Counter

import pytest
import yaml
from hypothesis import assume, given
from hypothesis import strategies as st

from aeros.agent.instructions import english
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import AmbiguousInstructionError, InstructionError
from aeros.agent.instructions.understand import understand
from aeros.spec.model.ecm import Ecm
from tests.hypothesis_profiles import examples
from tests.unit.agent.dumplings import CLEAN, DUMPLING, module, task
from tests.unit.agent.instructions.lists.reference import (
    LETTERS,
    LISTS,
    parametric_modules,
    reference_modules,
)

GROUPS: dict[str, dict[str, str]] = yaml.safe_load((LISTS / "authors.yaml").read_text())
EXPECTED = {text: meaning for group in GROUPS.values() for text, meaning in group.items()}
REFUSE = "refuse"
MODULES = {"dumpling": DUMPLING, "clean": CLEAN}


def letters(meaning: Understanding) -> str:
    errands = [
        LETTERS[one.routed.module] + ("?" if one.condition is not None else "") for one in meaning.errands
    ]
    return " ".join(errands + [f"-{LETTERS[one.module]}" for one in meaning.prohibited])


def answer(instruction: str) -> str:
    try:
        return letters(understand(instruction, reference_modules()))
    except InstructionError:
        return REFUSE


def test_instructions_of_many_styles_mean_what_a_person_expects_and_none_moves_wrongly() -> None:
    counted: Counter[str] = Counter()
    differing = {}
    for text, expected in EXPECTED.items():
        got = answer(text)
        doable = expected != REFUSE
        kind = "right" if got == expected else "wrongly refused" if got == REFUSE else "wrong motion"
        counted[f"{'doable' if doable else 'refusable'}: {kind}"] += 1
        if got != expected:
            differing[text] = f"{got}, not {expected}"
    assert counted["doable: wrong motion"] + counted["refusable: wrong motion"] == 0, differing
    assert counted["doable: right"] >= 0.95 * (counted["doable: right"] + counted["doable: wrongly refused"])
    assert sum(counted.values()) >= 300
    assert counted["doable: right"] > 150
    assert counted["refusable: right"] > 150


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("The table! Clean it!", ("clean_table.clean_table(region = whole)",)),
        ("The left half of the table! Clean it!", None),
        ("Two dumplings! Clean it!", None),
        (
            "Clean the left half of the table. Now wipe that half.",
            ("clean_table.clean_table(region = left)",),
        ),
        ("Clean the table. Wipe that half.", None),
        ("Pick up the can. Deliver left.", ("fetch_object.fetch_object(object = red_can, to = left)",)),
        ("Deliver left.", None),
        (
            "Take the can and drop it on the left.",
            ("fetch_object.fetch_object(object = red_can, to = left)",),
        ),
        (
            "I left the can on the stand, please fetch it.",
            ("fetch_object.fetch_object(object = red_can, to = anywhere)",),
        ),
        ("The can is in the fridge, please fetch it.", None),
        ("The can is on the left, please fetch it.", None),
        ("Stack the blocks.", None),
        ("If the table is dirty, clean.", ("clean_table.clean_table(region = whole)",)),
        ("If the table is dirty, fetch.", None),
        ("Clean.", None),
    ],
)
def test_words_that_stand_for_others_mean_what_was_named_before(
    text: str, meaning: tuple[str, ...] | None
) -> None:
    found = lines(text)
    assert tuple(line.partition(":")[0] for line in found) == (meaning or ())


def test_a_part_of_the_thing_before_may_be_left_alone() -> None:
    found = understand("Clean the left side, leave the right as it is.", reference_modules())
    assert [one.formal_text for one in found.prohibited] == ["clean_table.clean_table(region = right)"]


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("Clean the table, but leave the right half alone.", ("clean_table.clean_table(region = left)",)),
        ("Clean the left half, er, the right half.", ("clean_table.clean_table(region = right)",)),
        (
            "Bring the can and clean the table, sorry, not the can, the block.",
            (
                "fetch_object.fetch_object(object = blue_block, to = anywhere)",
                "clean_table.clean_table(region = whole)",
            ),
        ),
        ("First: can. Second: wipe the table.", ("fetch_object.fetch_object", "clean_table.clean_table")),
        ("we have guests at eight so please wipe the table", ("clean_table.clean_table",)),
        ("Stop making dumplings and clean the table.", ("clean_table.clean_table",)),
        (
            "Frankly, give the table a wipe, my guests are about to arrive.",
            ("clean_table.clean_table",),
        ),
        ("If the table is, clean it.", ()),
        ("Clean the table, it has been cleaned.", ()),
        ("There are five of us, make dumplings.", ()),
        ("My can is green, bring it.", ()),
        ("Clean the table, yeah right.", ()),
    ],
)
def test_wordings_of_many_speakers(text: str, meaning: tuple[str, ...]) -> None:
    found = [line for line in lines(text) if not line.startswith("never")]
    assert len(found) == len(meaning)
    assert all(line.startswith(one) for line, one in zip(found, meaning, strict=True))


PLAIN = sorted(text for text in EXPECTED.keys() - GROUPS["reasons"] if EXPECTED[text] != REFUSE)
"""Instructions that can be done, without reasons, whose words are free."""


def lines(instruction: str) -> tuple[str, ...]:
    """Formal text of the meaning; empty if the instruction is refused."""
    try:
        return understand(instruction, reference_modules()).formal_lines
    except InstructionError:
        return ()


def with_word(text: str, word: str, data: st.DataObject) -> str:
    parts = text.split(" ")
    at = data.draw(st.integers(0, len(parts)))
    return " ".join([*parts[:at], word, *parts[at:]])


@examples(150)
@given(
    st.sampled_from(PLAIN),
    st.sampled_from(sorted(english.NEGATIVES | {"fridge", "seven", "twice", "or", "blue", "zzz"})),
    st.data(),
)
def test_a_word_that_is_put_in_never_leaves_the_same_motion(
    text: str, word: str, data: st.DataObject
) -> None:
    # `do not clean the table twice` may prohibit less, and is no request.
    assume(word not in ("seven", "twice") or "-" not in answer(text))
    changed = with_word(text, word, data)
    # `bring the can, but not before that clean the table` has the same order as `…, but before that …`.
    assume("not before" not in changed)
    assert not lines(text) or lines(changed) != lines(text), changed


@examples(150)
@given(st.sampled_from(PLAIN), st.sampled_from(["zzz", "fridge", "hammer", "upstairs", "bob"]), st.data())
def test_a_word_that_nobody_declares_is_refused_and_named(text: str, word: str, data: st.DataObject) -> None:
    assume(lines(text))
    changed = with_word(text, word, data)
    with pytest.raises(InstructionError) as refused:
        understand(changed, reference_modules())
    assert word in str(refused.value), changed


@examples(100)
@given(st.sampled_from(PLAIN), st.sampled_from(["please", "kindly"]), st.data())
def test_a_courtesy_changes_no_goal_anywhere(text: str, word: str, data: st.DataObject) -> None:
    changed = with_word(text, word, data)
    assert lines(changed) in ((), lines(text)), changed


@examples(100)
@given(
    st.sampled_from(PLAIN),
    st.sampled_from(["", "Please, ", "Good morning, dear robot! ", "Robot, ", "Hi there. "]),
    st.sampled_from(["", ", please", ", thank you", ". Thanks a lot!", ", if you don't mind"]),
)
def test_a_courtesy_before_or_behind_changes_nothing(text: str, before: str, after: str) -> None:
    assume(lines(text) and "?" not in text and "_" not in text)
    assert lines(before + text.rstrip(".!") + after) == lines(text)


@examples(100)
@given(st.text(max_size=80))
def test_any_text_is_understood_or_refused_with_a_reason(text: str) -> None:
    outcome: object
    try:
        outcome = understand(text, reference_modules()).errands
    except InstructionError as refusal:
        outcome = str(refusal)
    assert outcome


@pytest.mark.parametrize(
    ("instruction", "reason"),
    [
        ("bring me a beer from the fridge", "does not know `beer`, `from`, `fridge`"),
        (
            "make 12 dumplings",
            "`12` is out of range: `count` is 1 to 2 (at most 2: the cell has two wrappers)",
        ),
        ("fetch", "does not say with what to do `fetch_object.fetch_object`; it knows `fetch`, `bring`, "),
        ("bring me the bottle", "does not know `bottle`; it knows `fetch`, "),
        ("bring me the bottle", " with `red can`, `blue block`"),
        ("cook a soup", "it knows `make`, `cook`, `boil`, `boil up`, `prepare`, `produce` with `dumpling`"),
        ("the table", "does not say what `clean_table.clean_table` is to do; it knows `clean`, "),
        ("do not fetch anything", "`fetch_object.fetch_object` is prohibited, so nothing moves"),
        ("stop", "nothing is asked for, and `stop` is prohibited, so nothing moves"),
        (
            "make dumplings but do not make dumplings",
            "asks for `make_dumplings.make_dumplings(count = 1)` and prohibits",
        ),
        ("do not do anything, but clean the table", "`do not anything` contradicts the rest"),
        ("is the table clean?", "is a question"),
        (
            "clean the table when I am gone",
            "`when` is not understood: a request can have a condition with `if`",
        ),
        ("if it rains, clean the table", "the condition `if it rains` is not understood; known: `"),
        ("clean the table because otherwise I make dumplings", "only a reason, because of `make_dumplings"),
        ("clean it because it is cold, wipe it", "a part of the reason, or wanted, too?"),
        ("clean the table because nobody does", "only a reason, because of `nobody`"),
        ("do not clean the table and make dumplings", "is the second wanted, or prohibited, too?"),
        ("clean the table, please don't", "it is not clear what `don t` prohibits"),
        ("fly to the moon", "provides `fly to the moon`; tasks here: clean_table.clean_table, "),
        ("make -1 dumplings", "the number `-1` is not understood"),
        ("clean the table and", "nothing follows after `and`"),
        ("clean the table " * 80, "more than 200 words"),
        ("", "has no words"),
        ("thanks", "`thanks` asks for nothing"),
    ],
)
def test_a_refusal_says_which_part_is_not_understood_and_why(instruction: str, reason: str) -> None:
    with pytest.raises(InstructionError) as refused:
        understand(instruction, reference_modules())
    assert reason in str(refused.value)
    assert len(str(refused.value)) < 600


def test_the_formal_text_names_tasks_goals_conditions_and_prohibitions() -> None:
    meaning = understand("if the table is dirty, clean it, but never make dumplings", reference_modules())
    assert meaning.formal_lines == (
        "clean_table.clean_table(region = whole): table_wiped and table_organized and table_verified "
        "(if not table_wiped)",
        "never make_dumplings.make_dumplings",
    )


def test_unless_is_the_negated_condition() -> None:
    (errand,) = understand("clean the table unless it is untidy", reference_modules()).errands
    assert errand.condition_text == "not (clutter_on_table)"


def test_a_task_without_objects_needs_only_its_words() -> None:
    assert str(understand("Clean up, please!".replace(" up", ""), MODULES).first) == "clean.clean_table"
    assert str(understand("one DUMPLING", MODULES).first) == "dumpling.make_dumplings"
    with pytest.raises(InstructionError, match="does not know `thoughts`"):
        understand("clean thoughts", MODULES)


def test_the_phrase_of_a_task_may_begin_with_words_that_are_openers_elsewhere() -> None:
    going = module("going", (), task("go_on", ("go on", "please proceed to the next one"), "dumpling_cooked"))
    for text in ("go on", "please go on", "robot, go on", "please proceed to the next one"):
        assert understand(text, {"going": going}).first.task.id == "go_on", text
    with pytest.raises(InstructionError, match="provides `on`"):
        understand("on", {"going": going})


def test_an_ambiguous_instruction_names_all_tasks_that_it_may_mean() -> None:
    twice = {
        "m": module("m", (), task("a", ("go",), "wrapper_aligned"), task("b", ("go",), "wrapper_aligned"))
    }
    with pytest.raises(
        AmbiguousInstructionError, match=r"`go` may mean several tasks: `m\.a` .*`m\.b`"
    ) as asked:
        understand("go", twice)
    assert asked.value.candidates == {"m.a": "m.a", "m.b": "m.b"}
    assert asked.value.is_about_all("go")
    with pytest.raises(AmbiguousInstructionError) as other:
        understand("go. clean", {**MODULES, **twice})
    assert not other.value.is_about_all("go. clean")
    assert str(understand("m.b", twice).first) == "m.b"


def test_an_installed_module_that_is_not_active_is_named_only_if_no_active_one_understands() -> None:
    with pytest.raises(InstructionError) as refused:
        understand("dumpling", {"clean": CLEAN}, lambda: {"dumpling": DUMPLING})
    assert refused.value.reason == (
        "no active module provides `dumpling`; installed is `dumpling.make_dumplings`"
        " (`aeros activate dumpling`)"
    )
    with pytest.raises(InstructionError, match="no installed module provides `fly`"):
        understand("fly", {"clean": CLEAN}, lambda: {"dumpling": DUMPLING})

    def unread() -> dict[str, Ecm]:
        raise AssertionError

    assert str(understand("clean", {"clean": CLEAN}, unread).first) == "clean.clean_table"


def test_without_tasks_nothing_is_provided() -> None:
    for modules in ({}, {"empty": module("empty", ())}):
        with pytest.raises(InstructionError, match="no task is installed"):
            understand("make dumplings", modules)


@pytest.mark.parametrize(
    ("instruction", "formal"),
    [
        ("get the table ready for our guests", ["serve_table.serve_table"]),
        ("2 dumplings", ["make_dumplings.make_dumplings(count = 2)"]),
        (
            "The red can should end up on the left.",
            ["fetch_object.fetch_object(object = red_can, to = left)"],
        ),
        ("red can, left. go.", ["fetch_object.fetch_object(object = red_can, to = left)"]),
    ],
)
def test_wordings_that_people_used(instruction: str, formal: list[str]) -> None:
    meaning = understand(instruction, parametric_modules())
    assert [one.routed.formal_text for one in meaning.errands] == formal


@pytest.mark.parametrize("instruction", ["two dumplings, thanks", "one dumpling", "the dumplings", "go"])
def test_a_thing_is_not_asked_for_by_its_name_alone(instruction: str) -> None:
    with pytest.raises(InstructionError):
        understand(instruction, parametric_modules())


def test_a_second_number_of_the_same_is_refused_unless_it_has_a_condition() -> None:
    modules = parametric_modules()
    with pytest.raises(InstructionError, match="say how many are wanted in all"):
        understand("make two dumplings, then make one dumpling", modules)
    either = "If the table is dirty, make a dumpling. If it is clean, make two dumplings."
    assert [str(one.routed.arguments["count"]) for one in understand(either, modules).errands] == ["1", "2"]
