"""Corrections that a speaker makes at once: `clean the left, no, the right half`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import counted_parameter
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import COMMA, without_commas
from aeros.agent.instructions.sentences.spoken_sentences import spoken_sentences
from aeros.spec.diagnostics.codes import quoted

_MAX_CORRECTIONS: Final = 3
"""Limit on the corrections of an instruction."""

_HESITATION: Final = re.compile(
    r"(?i)(?:,|\s-+)\s*(?:er+|erm|u+h+|uhm|um+|hm+|ah|oops|whoops)\b[.\u2026]*\s*(?:,|-+\s)\s*"
)
"""A hesitation between two pauses, after which a speaker may say another value."""

_CORRECTED_WITHOUT_PAUSE: Final = re.compile(
    r"(?i)(?<=[a-z0-9]) (?:er+|erm|u+h+|uhm|um+|hm+|ah|oh|oops|whoops) "
    r"((?:(?:no|sorry|wait|actually|rather|i mean|i meant|scratch that) ?)+)(?<= )"
    r"(?!(?:and|at|for|here|in|on|outside|there|till|until|while)\b)(?=[a-z0-9])"
)
"""A hesitation before a correction, in a transcript without pauses."""

_NO_THE: Final = re.compile(r"(?i)(?<=[a-z0-9]),? (?:no|nope|sorry) (?=(?:the|that|this|my) )")
"""`no` before an article, which is no determiner there: it corrects, as in `bring the block no the can`."""

_MAX_WORDS: Final = 24
"""Limit on the words of a sentence that is corrected: all parts of it are tried."""

_LONGER: Final = 2
"""Words that the corrected part may have more than the words that replace it."""


@dataclass(frozen=True, slots=True)
class _Correction:
    """One correction.

    Attributes:
        before: the sentences before.
        wrong: words of the sentence, or of the sentence before, up to the correction.
        right: words after it, up to the next correction.
        rest: the next correction, and the words after it.
        after: the sentences after.
        may_go_on: True if it may only hold on, as `wait` may, before something else that is wanted, too.
    """

    before: tuple[str, ...]
    wrong: Words
    right: Words
    rest: Words
    after: tuple[str, ...]
    may_go_on: bool


def without_corrections(
    instruction: str, tasks: Sequence[TaskPhrases], read: Callable[[str], Understanding]
) -> tuple[str, tuple[str, ...]]:
    """Replace what a speaker corrects by what was said instead.

    A part of the sentence is replaced by the words after the correction if the result is understood, asks
    for the same task, and changes only those parameters that these words state; or the whole sentence, if
    these words are a request of their own. If there is no such part, the instruction stays as it is.

    Args:
        instruction: words of the user.
        tasks: all tasks.
        read: finds the meaning of an instruction; raises `InstructionError`.

    Returns:
        The instruction, and a note for each part that was replaced.

    Raises:
        InstructionError: the instruction holds a number with a sign, a fraction or the like.
    """
    notes: tuple[str, ...] = ()
    instruction = _CORRECTED_WITHOUT_PAUSE.sub(lambda match: f", {match[1].strip()}, ", instruction)
    instruction = _NO_THE.sub(", no, ", instruction)
    if _HESITATION.search(instruction):
        hesitant = _HESITATION.sub(", no, ", instruction)
        correction = _find(hesitant)
        is_link = correction and english.SEQUENCE.ending(correction.wrong)
        is_value = correction and not is_link and _is_value(correction.right, tasks)
        if correction and is_value and _corrected(correction, tasks, read):
            instruction = hesitant
    for _ in range(_MAX_CORRECTIONS):
        correction = _find(instruction)
        corrected = correction and _corrected(correction, tasks, read)
        if not correction or not corrected:
            break
        words, wrong = corrected
        instruction = _text((*correction.before, _sentence(words + correction.rest), *correction.after))
        right = quoted(" ".join(without_commas(correction.right)))
        notes += (f"{quoted(' '.join(wrong))}: corrected to {right}",)
    return instruction, notes


_NO_VALUES: Final = (
    english.SUBJECTS - english.DETERMINERS
    | english.FINITE
    | english.MODALS - english.DIRECTIONS
    | {"if", "pretend", "when", "you"}
)
"""Words of a statement or condition: what holds one is no value that a speaker corrects."""

_HOLDING: Final = frozenset({COMMA, "a", "hang", "hold", "minute", "moment", "on", "second", "wait"})


def _names_act(words: Words, tasks: Sequence[TaskPhrases]) -> bool:
    return any(cover(entry, without_commas(words), knows_pronoun=True).triggers for entry in tasks)


def _names_thing(words: Words, tasks: Sequence[TaskPhrases]) -> bool:
    """Return True if all words are understood, and state a value or name an object."""
    found = [cover(entry, without_commas(words), knows_pronoun=False) for entry in tasks]
    return any((one.values.stated or one.objects) and not one.unknown for one in found)


def _is_value(words: Words, tasks: Sequence[TaskPhrases]) -> bool:
    """Return True if some words only state a value, as in `the left, er, the right half`."""
    found = [cover(entry, without_commas(words), knows_pronoun=False) for entry in tasks]
    return any(one.values.stated and not one.unknown for one in found) and not any(
        one.triggers and not one.unknown for one in found
    )


def _find(instruction: str) -> _Correction | None:
    """Find the first correction."""
    spoken = list(spoken_sentences(instruction))
    texts = tuple(_sentence(tokens) + "?" * is_question for tokens, is_question in spoken)
    for number, (tokens, _) in enumerate(spoken):
        for at in range(len(tokens)):
            end = _end_at(tokens, at) if at or number else 0
            if not end:
                continue
            wrong = tokens[:at] or spoken[number - 1][0]
            before = texts[:number] if at else texts[: number - 1]
            rest = next((to for to in range(end + 1, len(tokens)) if _ends(tokens, to)), len(tokens))
            may_go_on = {*tokens[at:end]} <= _HOLDING
            return _Correction(before, wrong, tokens[end:rest], tokens[rest:], texts[number + 1 :], may_go_on)
    return None


def _end_at(tokens: Words, at: int) -> int:
    """Return the place after a correction that begins at a place, with or without a pause; 0 if none does."""
    if tokens[at] == COMMA or at == 0:
        return _end_of_correction(tokens, at + (tokens[at] == COMMA))
    # In a transcript without pauses, only phrases of several words are certain.
    marker = english.CORRECTIONS.starting(tokens, at)
    return _end_of_correction(tokens, at) if len(marker) > 1 and tokens[at - 1] != "or" else 0


def _ends(tokens: Words, at: int) -> bool:
    """Return True where the words of a correction end: at the next one, and at the next request."""
    return bool(_end_at(tokens, at) or english.SEQUENCE.starting(tokens, at + (tokens[at] == COMMA)))


def _end_of_correction(tokens: Words, start: int) -> int:
    """Return the place after a correction that begins at `start`; 0 if none begins there."""
    at, is_certain = start, False
    while True:
        strong = max(english.CORRECTIONS.starting(tokens, at), _value_correction(tokens, at), key=len)
        weak = english.WEAK_CORRECTIONS.starting(tokens, at)
        found = max(strong, weak, key=len)
        if not found:
            break
        at += len(found)
        has_pause = tokens[at : at + 1] == (COMMA,)
        # `no` corrects only before a pause: `…, no wiping` prohibits.
        is_certain |= len(strong) >= len(weak) or has_pause
        at += has_pause
    waits = tokens[at - 1 : at] == ("wait",) and tokens[at : at + 1] in _AFTER_WAIT
    return at if is_certain and at < len(tokens) and not waits else 0


_AFTER_WAIT: Final = tuple(
    (word,) for word in ("and", "at", "for", "here", "in", "on", "outside", "there", "till", "until", "while")
)


def _value_correction(tokens: Words, at: int) -> Words:
    """Return `make that` before a number or an article: `make it clean` asks for a state."""
    found = english.VALUE_CORRECTIONS.starting(tokens, at)
    following = "".join(tokens[at + len(found) :][:1])
    is_value = following in english.DETERMINERS or english.number_of(following) is not None
    return found if is_value else ()


def _corrected(
    correction: _Correction, tasks: Sequence[TaskPhrases], read: Callable[[str], Understanding]
) -> tuple[Words, Words] | None:
    """Return the corrected words of the sentence and those that were replaced; None if that is not clear."""
    wrong, right = correction.wrong, _with_noun(correction.right, correction.wrong, tasks)
    if right[:1] == ("not",) and right.count(COMMA) == 1:
        return _replaced(correction, read)
    if len(wrong) > _MAX_WORDS or _is_negative(wrong) or _is_negative(right):
        return None
    asked_before = _read(_text((*correction.before, _sentence(wrong))), read)
    alone = _read(_sentence(right), read)
    stated = _stated(right, tasks)
    names_thing = _names_thing(right, tasks)
    for start, end in _parts(len(wrong), len(without_commas(right))):
        words = wrong[:start] + right + wrong[end:]
        found = _read(_text((*correction.before, _sentence(words))), read)
        if found is None:
            continue
        replaced = without_commas(wrong[start:end])
        if asked_before is None:
            # What the sentence said before is not known as a whole; nothing that it said is lost.
            is_known = any(not cover(entry, replaced, knows_pronoun=True).unknown for entry in tasks)
            is_clear = _stated(replaced, tasks) <= stated and (start > 0 or (len(stated) > 0 and is_known))
            is_thing = end == len(wrong) or replaced[0] in english.DETERMINERS | english.POSSESSIVES
            is_clear &= is_thing and names_thing and _NO_VALUES.isdisjoint(replaced)
            is_clear &= start == 0 or not _names_act(replaced, tasks)
        else:
            is_whole = end - start == len(wrong)
            may_be_another = is_whole and not correction.may_go_on and _names_act(right, tasks)
            is_clear = _differs_only_in(stated, asked_before, found, may_be_another=may_be_another)
            # A correction that changes nothing, as `…, i mean cup`, says something else.
            is_other = alone is not None or found.errands != asked_before.errands
            is_clear &= is_other or english.PRONOUNS.issuperset(right)
        if is_clear and (alone is None or alone.errands[-1:] == found.errands[-1:]):
            return words, replaced
    return None


def _replaced(correction: _Correction, read: Callable[[str], Understanding]) -> tuple[Words, Words] | None:
    """Correct `…, sorry, not the can, the block`, which says itself which words are wrong."""
    wrong, pause = correction.wrong, correction.right.index(COMMA)
    old, new = correction.right[1:pause], correction.right[pause + 1 :]
    places = [at for at in range(len(wrong)) if wrong[at : at + len(old)] == old]
    if len(places) != 1 or _is_negative(wrong) or _is_negative(new):
        return None
    words = wrong[: places[0]] + new + wrong[places[0] + len(old) :]
    asked, found = (_read(_text((*correction.before, _sentence(one))), read) for one in (wrong, words))
    if asked is None or found is None or len(asked.errands) != len(found.errands):
        return None
    tasks = [
        (one.routed.task, other.routed.task) for one, other in zip(asked.errands, found.errands, strict=True)
    ]
    return (words, old) if all(one is other for one, other in tasks) else None


def _with_noun(right: Words, wrong: Words, tasks: Sequence[TaskPhrases]) -> Words:
    """Return `inspect the table` for `inspect it` after `clean the table, no`."""
    named = [cover(entry, without_commas(wrong), knows_pronoun=False) for entry in tasks]
    nouns = {one.objects[0] for one in named if len(one.objects) == 1 and one.triggers and not one.unknown}
    if len(nouns) != 1 or sum(word in ("it", "them") for word in right) != 1:
        return right
    return tuple(
        part for word in right for part in (("the", *min(nouns)) if word in ("it", "them") else (word,))
    )


def _parts(size: int, replacing: int) -> Iterator[tuple[int, int]]:
    """Yield the parts of a sentence that may be corrected: first those at its end, then others, then all."""
    longest = min(size - 1, replacing + _LONGER)
    for length in range(1, longest + 1):
        yield size - length, size
    for length in range(1, longest + 1):
        for start in range(size - length - 1, -1, -1):
            yield start, start + length
    yield 0, size


def _differs_only_in(
    stated: frozenset[str], before: Understanding, found: Understanding, *, may_be_another: bool
) -> bool:
    """Check that a meaning differs only in its last request, and there only in parameters that are stated."""
    if len(found.errands) != len(before.errands) or found.prohibited != before.prohibited:
        return False
    if found.errands[:-1] != before.errands[:-1]:
        return False
    one, other = before.errands[-1], found.errands[-1]
    if not one.routed.covers(other.routed) and one.routed.task is not other.routed.task:
        return may_be_another
    if one.condition_text != other.condition_text:
        return False
    arguments, changed = one.routed.arguments, other.routed.arguments
    return all(changed[name] == value for name, value in arguments.items() if name not in stated)


def _stated(words: Words, tasks: Sequence[TaskPhrases]) -> frozenset[str]:
    """Return the parameters of any task that words state a value of."""
    plain = without_commas(words)
    names = {name for entry in tasks for name in cover(entry, plain, knows_pronoun=False).values.stated}
    if any(english.number_of(word) is not None for word in plain):
        # A number alone, as in `make one tea, no, two`.
        names |= {one.name for entry in tasks if (one := counted_parameter(entry.routed.task))}
    return frozenset(names)


def _is_negative(words: Words) -> bool:
    return not english.NEGATIVES.isdisjoint(words) or any(
        english.PROHIBITIONS.starting(words, at) for at in range(len(words))
    )


def _read(text: str, read: Callable[[str], Understanding]) -> Understanding | None:
    try:
        return read(text)
    except InstructionError:
        return None


def _sentence(tokens: Words) -> str:
    return " ".join(tokens).replace(f" {COMMA}", COMMA)


def _text(sentences: Sequence[str]) -> str:
    return " ".join(one if one.endswith("?") else f"{one}." for one in sentences)
