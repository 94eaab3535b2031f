"""All forms in which a request may be read: each class of English, and one class in another."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final

from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.wordings.causatives import causatives, duties, passives
from aeros.agent.instructions.wordings.light_verbs import acts_named_last, given_acts, intensified_nouns
from aeros.agent.instructions.wordings.wishes import wishes
from aeros.agent.instructions.wordings.word_order import attributes, particles
from aeros.agent.instructions.wordings.wording import WANT, Wording

_CLASSES: Final[tuple[Callable[[Wording], Iterator[Wording]], ...]] = (
    particles,
    passives,
    intensified_nouns,
    causatives,
    duties,
    given_acts,
    acts_named_last,
    wishes,
    attributes,
)

_MAX_FORMS: Final = 60
"""Limit on the forms that are tried; an instruction may be any text at all."""


def wordings(
    words: Words, *, is_polite: bool, is_perfect: bool, carried: Sequence[Words] = ()
) -> Iterator[Wording]:
    """Yield the forms that a request may be read in; the first that a task covers counts.

    Args:
        words: words of the request.
        is_polite: True if `please` is said with it.
        is_perfect: True if its verb is in the perfect or the past.
        carried: words of the request before that this one goes on with, as `have` in `have the table
            cleaned and a tea made`.

    Yields:
        The words as they are, then each form, then each form of that.
    """
    pending = [Wording(words, is_perfect=is_perfect)]
    if is_polite:
        pending.append(Wording(WANT + words))  # `two teas, please`
    # `see that the table is wiped and that a tea is made`
    rest = words[1:] if words[:1] == ("that",) else words
    pending += [Wording(one + rest) for one in carried]
    seen = set(pending)
    at = 0
    while at < len(pending):
        yield pending[at]
        for one in _CLASSES:
            new = [form for form in one(pending[at]) if form not in seen]
            new = new[: max(0, _MAX_FORMS - len(pending))]
            seen.update(new)
            pending += new
        at += 1
