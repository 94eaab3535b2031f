"""Refusals of instructions: the errors, and the texts that say which words are not understood."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Final

from aeros.agent.errors import AgentError
from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import is_object
from aeros.agent.instructions.coverage import Coverage
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.segments import Segment
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words

_UNSAID: Final = frozenset({"a", "an", "the"}) | english.PRONOUNS
"""Words that no two phrases have in common."""

_OPTIONAL: Final = re.compile(r" ?\([^)]*\)")

_LEAST_SIMILARITY: Final = 0.75
"""Likeness from 0 to 1 of a known word that is named: `make` is not meant for `tackle`, which has 0.6."""

_MOST_SHOWN: Final = 6
"""Greatest number of phrases that a refusal lists."""


class InstructionError(AgentError):
    """An instruction that is not understood whole; `reason` says which words, and what can be said."""


class NothingAskedError(InstructionError):
    """An instruction that is understood and moves nothing: it only prohibits, or contradicts itself."""


class InactiveTaskError(InstructionError):
    """An instruction that only modules understand which are not active."""


class AmbiguousInstructionError(InstructionError):
    """An instruction of which a part may mean several tasks.

    Args:
        reason: text of the reason.
        part: words of the part.
        candidates: an unambiguous instruction for each meaning, by a name for it.
    """

    def __init__(self, reason: str, part: str, candidates: Mapping[str, str]) -> None:
        super().__init__(reason)
        self.part = part
        self.candidates = candidates

    def is_about_all(self, instruction: str) -> bool:
        """Check if the part is the whole instruction, so that a candidate may be given in its place.

        Args:
            instruction: words of the user.

        Returns:
            True if their words are the same.
        """
        return normalized_words(self.part) == normalized_words(instruction)


def ambiguous_tasks(text: str, candidates: Sequence[RoutedTask]) -> AmbiguousInstructionError:
    """Name the tasks that some words may mean.

    Args:
        text: the words.
        candidates: the tasks.

    Returns:
        The refusal.
    """
    named = ", ".join(f"`{routed}` ({', '.join(routed.task.trigger_phrases)})" for routed in candidates)
    return AmbiguousInstructionError(
        f"{quoted(text)} may mean several tasks: {named}",
        text,
        {str(routed): routed.instruction for routed in candidates},
    )


def not_covered(segment: Segment, coverages: Sequence[Coverage]) -> InstructionError:
    """Say why no task covers a request, from the task that comes nearest.

    Args:
        segment: words of the request.
        coverages: coverage by each task.

    Returns:
        The refusal.
    """
    text = quoted(segment.text)
    near = [one for one in coverages if one.triggers or one.objects]
    if not near:
        return InstructionError(
            f"no installed module provides {text}; {_suggestion(segment.words, coverages)}"
        )
    best = min(near, key=lambda one: (not one.triggers, len(one.unknown), not one.objects))
    routed = best.entry.routed
    if best.unknown:
        unknown = ", ".join(quoted(word) for word in dict.fromkeys(best.unknown))
        near_extra = _nearest_extra(best)
        also = f"; nearest to that is {quoted(near_extra)}" if near_extra else ""
        return InstructionError(
            f"in {text}, `{routed}` does not know {unknown}{also}; {_known_phrases(best)}"
        )
    if best.values.fault:
        return InstructionError(f"in {text}, {best.values.fault}")
    if best.counts or best.repetitions:
        counted = ", ".join(quoted(word) for word in best.counts + best.repetitions)
        return InstructionError(
            f"in {text}, {counted} is not understood: `{routed}` is done once for one goal"
        )
    if not best.triggers:
        return InstructionError(f"{text} does not say what `{routed}` is to do; {_known_phrases(best)}")
    if best.has_vague_place:
        return InstructionError(f"the place in {text} may say which one, or where to")
    return InstructionError(f"{text} does not say with what to do `{routed}`; {_known_phrases(best)}")


def _known_phrases(coverage: Coverage) -> str:
    """Say with which words the task is asked for: those that its module names first."""
    task = coverage.entry.routed.task
    known = f"it knows {_first(task.trigger_phrases)}"
    things = [
        value.replace("_", " ")
        for parameter in task.parameters.values()
        if is_object(parameter)
        for value in parameter.phrases
    ]
    objects = things or [one for one in task.object_phrases if not _describes_one(one, task.object_phrases)]
    return f"{known} with {_first(objects)}" if objects else known


def _describes_one(phrase: str, phrases: Iterable[str]) -> bool:
    """Return True for `freshly made tea` beside `tea`."""
    return any(phrase.endswith(f" {one}") for one in phrases)


def _first(patterns: Iterable[str]) -> str:
    """List the first phrases, without what may be said with them: `wipe` of `wipe (down|off|)`."""
    plain = (_OPTIONAL.sub("", one) for one in patterns if not one.startswith("("))
    return ", ".join(map(quoted, list(dict.fromkeys(plain))[:_MOST_SHOWN]))


def _nearest_extra(coverage: Coverage) -> str:
    """Return the extra, as declared, with most of the unknown words in it; empty if none has any."""
    unknown = set(coverage.unknown)
    best, shared = "", 0
    for text in coverage.entry.routed.task.extra_phrases:
        common = len(unknown.intersection(normalized_words(text)) - _UNSAID)
        if common > shared:
            best, shared = text, common
    return best


@lru_cache(maxsize=1024)
def _closest(word: str, known: Words) -> list[str]:
    """Return the known phrase that is closest to a word, if one is close.

    A reader of refused instructions tries many texts with the same words.
    """
    return difflib.get_close_matches(word, known, n=1, cutoff=_LEAST_SIMILARITY)


def _suggestion(words: Words, coverages: Sequence[Coverage]) -> str:
    declared = {
        " ".join(phrase): one.entry.routed
        for one in coverages
        for phrase in (*one.entry.triggers, *one.entry.objects)
    }
    if not declared:
        return "no task is installed"
    # An instruction may be any text at all, and difflib is quadratic.
    known = tuple(declared)
    close = [near for word in words[:50] for near in _closest(word[:64], known)]
    if close:
        named = (f"`{word}` ({declared[word]})" for word in list(dict.fromkeys(close))[:8])
        return f"nearest: {', '.join(named)}"
    tasks = (str(one.entry.routed) for one in coverages)
    return f"tasks here: {', '.join(list(dict.fromkeys(tasks))[:8])}"
