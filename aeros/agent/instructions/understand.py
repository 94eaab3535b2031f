"""Understand an instruction whole or not at all.

1.  Each request must be covered word by word by the phrases of exactly one task of the active modules and by
    the words of `english.py`. A word that nothing declares is named, and the instruction refused.
2.  Requests are done in the order in which they are said; `A after B` is B, then A.
3.  A prohibition never moves anything. Skills that only prohibited tasks use are used for nothing else.
4.  A condition of a request is measured when its turn comes. Unless it is measured as true, the request is
    skipped.
5.  If several tasks may be meant, or several values of a parameter, all are named; the caller may ask the
    user which one.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Final, TypeAlias

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import is_object
from aeros.agent.instructions.conditions import find_condition
from aeros.agent.instructions.grammar import (
    InstructionError,
    Link,
    Mood,
    Segment,
    Sentence,
    check_scopes,
    parse_instruction,
)
from aeros.agent.instructions.lexicon import Coverage, TaskPhrases, task_phrases
from aeros.agent.instructions.named_task import named_tasks
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.reasons import require_plain_reason, without_statements
from aeros.agent.instructions.wordings import wordings
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import ActionCondition, Ecm

_ALSO_NOT: Final = frozenset({"nor"})
"""Words that go on with a prohibition, as in `do not … nor …`."""

_INDEFINITE: Final = (("a",), ("an",), ("one",), ("some",))
_MAX_MERGES: Final = 6
"""Limit on the joints of a sentence at which segments may be one request: all combinations are tried."""


class NothingAskedError(InstructionError):
    """An instruction that is understood and moves nothing: it only prohibits, or contradicts itself."""


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


@dataclass(frozen=True, slots=True)
class Errand:
    """One request of an instruction.

    Attributes:
        routed: the task that it asks for.
        condition: it is done only if this is measured as true at its turn; None for always.
        condition_text: the condition as the module declares it; empty if there is none.
        proposed_plan: unverified plan that came with the meaning, for its first plan; None if there is none.
    """

    routed: RoutedTask
    condition: t.Term | None = None
    condition_text: str = ""
    proposed_plan: TaskGraph | None = None

    @property
    def formal_text(self) -> str:
        """Formal text: the task with its arguments, its goal and its condition."""
        text = f"{self.routed.formal_text}: {self.routed.task.goal_text}"
        return f"{text} (if {self.condition_text})" if self.condition is not None else text


@dataclass(frozen=True, slots=True)
class Understanding:
    """Meaning of a whole instruction.

    Attributes:
        instruction: words of the user.
        errands: requests in the order in which they are done; at least one.
        prohibited: tasks that must not be done.
        source: who read it, for the audit record.
        account: for each phrase, the part of the meaning that it accounts for, if a model read it.
    """

    instruction: str
    errands: tuple[Errand, ...]
    prohibited: tuple[RoutedTask, ...] = ()
    source: str = "grammar"
    account: tuple[str, ...] = ()

    def __str__(self) -> str:
        return self.instruction

    @property
    def first(self) -> RoutedTask:
        """The task of the first request."""
        return self.errands[0].routed

    @property
    def formal_lines(self) -> tuple[str, ...]:
        """Formal text of each request in order, then of each prohibition."""
        return tuple(one.formal_text for one in self.errands) + tuple(
            f"never {routed.formal_text}" for routed in self.prohibited
        )


Spoken: TypeAlias = str | Understanding
"""An instruction: words of the user, or their meaning."""


def understand(
    instruction: str,
    modules: Mapping[str, Ecm],
    inactive: Callable[[], Mapping[str, Ecm]] = dict,
) -> Understanding:
    """Find the tasks that an instruction asks for.

    Args:
        instruction: words of the user, or the name of a task (`MODULE.TASK` or `TASK`), with values of its
            parameters, as in `fetch_object object=red_can`.
        modules: active modules by id.
        inactive: returns the other installed modules; called only if the instruction is not understood.

    Returns:
        The meaning of the whole instruction.

    Raises:
        AmbiguousInstructionError: a request may mean several tasks.
        InstructionError: a part is not understood, prohibits what another part asks for, or asks for nothing.
    """
    tasks = task_phrases(modules)
    named = named_tasks(instruction, [entry.routed for entry in tasks])
    if len(named) > 1:
        raise _ambiguous(instruction, named)
    if named:
        return Understanding(instruction, (Errand(named[0]),))
    try:
        return _understand(instruction, tasks)
    except (AmbiguousInstructionError, NothingAskedError):
        raise
    except InstructionError as refusal:
        raise _with_inactive(instruction, refusal, inactive()) from refusal


def is_task_name(instruction: str, modules: Mapping[str, Ecm]) -> bool:
    """Check if an instruction is the name of a task, and so needs no reading.

    Args:
        instruction: words of the user.
        modules: active modules by id.

    Returns:
        True if it is MODULE.TASK or TASK.
    """
    return bool(named_tasks(instruction, [entry.routed for entry in task_phrases(modules)]))


def single_errand(understanding: Understanding) -> RoutedTask:
    """Return the task of an instruction that asks for exactly one, without a condition or prohibition.

    Args:
        understanding: meaning of the instruction.

    Returns:
        The task.

    Raises:
        InstructionError: it asks for more.
    """
    errands = understanding.errands
    if len(errands) == 1 and errands[0].condition is None and not understanding.prohibited:
        return errands[0].routed
    raise InstructionError(
        f"{quoted(understanding.instruction)} asks for more than one task: "
        f"{'; '.join(understanding.formal_lines)}; here, give an instruction for one task without conditions"
    )


def settle_meaning(spoken: Spoken, modules: Mapping[str, Ecm], goal: ActionCondition | None) -> Understanding:
    """Find the meaning of an instruction that the active modules can pursue.

    Args:
        spoken: words of the user, or a meaning that was settled before; its goals may differ from those of
            its tasks.
        modules: active modules by id.
        goal: goal that replaces the goal of the only task; None for no other goal.

    Returns:
        The meaning.

    Raises:
        InstructionError: it is not understood, a task is no longer active, or `goal` is given for several
            tasks.
    """
    meaning = understand(spoken, modules) if isinstance(spoken, str) else spoken
    for routed in (*(errand.routed for errand in meaning.errands), *meaning.prohibited):
        module = modules.get(routed.module)
        if module is None or routed.task.id not in module.tasks:
            raise InstructionError(f"`{routed}` is no longer active; give the instruction again")
    return meaning if goal is None else with_goal(meaning, goal)


def with_goal(understanding: Understanding, goal: ActionCondition) -> Understanding:
    """Replace the goal of the only task of an instruction.

    Args:
        understanding: meaning of the instruction.
        goal: the goal to pursue instead.

    Returns:
        The meaning with that goal.

    Raises:
        InstructionError: the instruction asks for several tasks.
    """
    if len(understanding.errands) != 1:
        raise InstructionError(
            f"a goal replaces that of one task, and {quoted(understanding.instruction)} asks for several"
        )
    (errand,) = understanding.errands
    task = replace(errand.routed.task, goal=goal.term, goal_text=goal.text)
    return replace(understanding, errands=(replace(errand, routed=replace(errand.routed, task=task)),))


def _with_inactive(
    instruction: str, refusal: InstructionError, inactive: Mapping[str, Ecm]
) -> InstructionError:
    """Return the refusal, or one that names the modules to activate if they would understand it."""
    if not inactive:
        return refusal
    tasks = task_phrases(inactive)
    try:
        found = named_tasks(instruction, [entry.routed for entry in tasks]) or [
            errand.routed for errand in _understand(instruction, tasks).errands
        ]
    except AmbiguousInstructionError:
        return refusal
    except InstructionError:
        return refusal
    means = ", ".join(f"`{routed}` (`aeros activate {routed.module}`)" for routed in found)
    return InstructionError(f"no active module provides {quoted(instruction)}; installed is {means}")


def _understand(instruction: str, tasks: Sequence[TaskPhrases]) -> Understanding:
    errands: list[Errand] = []
    prohibited: list[RoutedTask] = []
    prohibits_all = ""
    reasons: list[Segment] = []
    leading: list[Segment] = []
    for parsed in parse_instruction(instruction):
        sentence, own_reasons = without_statements(parsed, tasks)
        reasons += own_reasons
        # A sentence that is only a reason, as in `The table is dirty. Clean it.`, leads the next one.
        context = _context(errands, own_reasons or leading, tasks)
        leading = [] if sentence else own_reasons
        for segment, condition in _requests(_merged(check_scopes(sentence), tasks, context)):
            if segment.mood is Mood.REQUEST:
                errand = _errand(segment, condition, tasks, context)
                context.append(errand)
                if errands and segment.link is Link.JOINED and _says_where(errands[-1], errand, segment):
                    errands[-1] = errand
                elif not errands or errands[-1] != errand:
                    errands.append(errand)
            elif _is_universal(segment):
                prohibits_all = segment.text
            else:
                prohibited += [one for one in _prohibited(segment, tasks, errands) if one not in prohibited]
    if prohibits_all and errands:
        raise NothingAskedError(f"{quoted(prohibits_all)} contradicts the rest of the instruction")
    if prohibits_all or not errands:
        never = ", ".join(f"`{routed.formal_text}`" for routed in prohibited) or quoted(prohibits_all)
        raise NothingAskedError(f"nothing is asked for, and {never} is prohibited, so nothing moves")
    for errand in errands:
        if any(one.covers(errand.routed) for one in prohibited):
            raise NothingAskedError(
                f"the instruction asks for `{errand.routed.formal_text}` and prohibits it"
            )
    for reason in reasons:
        require_plain_reason(reason, tasks, [errand.routed for errand in errands])
    account = tuple(f"{quoted(' '.join(reason.words))}: a reason, asks for nothing" for reason in reasons)
    return Understanding(instruction, tuple(errands), tuple(prohibited), account=account)


def _says_where(before: Errand, errand: Errand, segment: Segment) -> bool:
    """Return True for the second half of `fetch the can and put it on the right`: one request, not two."""
    routed = before.routed
    is_same = routed.task is errand.routed.task and before.condition is errand.condition is None
    parameters = routed.task.parameters
    unsaid = all(
        is_object(one) or routed.arguments.get(name) == one.default for name, one in parameters.items()
    )
    return is_same and bool(parameters) and unsaid and "it" in segment.words


def _context(
    errands: Sequence[Errand], reasons: Sequence[Segment], tasks: Sequence[TaskPhrases]
) -> list[Errand]:
    """Return the requests that `it` may mean the object of, the last one first of all.

    After a reason such as `the floor is dirty, so …`, `it` is what the reason names.
    """
    leading = [reason for reason in reasons if reason.link is not Link.ADJUNCT]
    if not leading:
        return list(errands)
    named = [
        Errand(entry.routed) for entry in tasks if entry.cover(leading[-1].words, knows_pronoun=False).objects
    ]
    return named if len(named) == 1 else []


def _requests(sentence: Sentence) -> Iterator[tuple[Segment, Segment | None]]:
    """Yield requests and prohibitions, each with its condition.

    Raises:
        InstructionError: a prohibition has a condition, or a condition has no request.
    """
    leading: Segment | None = None
    for at, segment in enumerate(sentence):
        if segment.mood is Mood.CONDITION:
            if at == 0 or segment.link is not Link.ADJUNCT:
                leading = segment
            continue
        trailing = sentence[at + 1] if at + 1 < len(sentence) else None
        is_trailing = (
            trailing is not None and trailing.mood is Mood.CONDITION and trailing.link is Link.ADJUNCT
        )
        condition = trailing if is_trailing else leading
        if condition is not None and segment.mood is Mood.PROHIBITION:
            raise InstructionError(
                f"a prohibition with a condition is not understood: {quoted(condition.text)}"
            )
        yield segment, condition
        leading = None
    if leading is not None:
        raise InstructionError(
            f"{quoted(leading.text)} has no request: write `if …, …`, with a comma before the request"
        )


def _merged(sentence: Sentence, tasks: Sequence[TaskPhrases], before: Sequence[Errand]) -> Sentence:
    """Merge segments that are one request: `wipe and tidy the table`, `the table and the bench`.

    The fewest merges are made with which every request is understood; if none is, nothing is merged.
    """
    joints = [
        at
        for at in range(1, len(sentence))
        if sentence[at].link is Link.JOINED
        and sentence[at].mood is Mood.REQUEST
        and sentence[at - 1].mood is Mood.REQUEST
    ]
    if len(joints) > _MAX_MERGES:
        return sentence
    for choice in sorted(product((False, True), repeat=len(joints)), key=sum):
        merged: list[Segment] = []
        joined = {at for at, is_merged in zip(joints, choice, strict=True) if is_merged}
        for at, segment in enumerate(sentence):
            if at in joined:
                merged[-1] = replace(merged[-1], words=merged[-1].words + segment.words)
            else:
                merged.append(segment)
        context = list(before)
        try:
            for segment in merged:
                if segment.mood is Mood.REQUEST:
                    context.append(Errand(_task_of(segment, tasks, context)))
        except AmbiguousInstructionError:
            return sentence
        except InstructionError:
            continue
        return tuple(merged)
    return sentence


def _errand(
    segment: Segment, condition: Segment | None, tasks: Sequence[TaskPhrases], before: Sequence[Errand]
) -> Errand:
    if condition is None:
        return Errand(_task_of(segment, tasks, before))
    meanings = [(entry, *found) for entry in tasks if (found := find_condition(condition, entry)) is not None]
    # The condition names an object, so `it` in the request may stand for that.
    context = [*before, *(Errand(entry.routed) for entry, *_ in meanings[:1])]
    routed = _task_of(segment, tasks, context)
    asked = next(entry for entry in tasks if entry.routed.covers(routed))
    own = find_condition(condition, asked, is_own=True)
    if own is None and not meanings:
        declared = sorted({phrase for entry in tasks for phrase in entry.routed.task.condition_phrases})
        known = ", ".join(f"`{one}`" for one in declared[:8]) or "none is declared"
        raise InstructionError(f"the condition {quoted(condition.text)} is not understood; known: {known}")
    # Another task may declare the condition, as in `bring tea if the table is clean`.
    term, text = own or meanings[0][1:]
    if own is None and any(other != term for _, other, _ in meanings):
        raise InstructionError(f"several tasks declare the condition {quoted(condition.text)}")
    if condition.marker == ("unless",):
        return Errand(routed, t.Not(term), f"not ({text})")
    return Errand(routed, term, text)


def _task_of(segment: Segment, tasks: Sequence[TaskPhrases], before: Sequence[Errand]) -> RoutedTask:
    """Find the one task that covers a request.

    Raises:
        AmbiguousInstructionError: several tasks cover it.
        InstructionError: none does, or it holds a negation or a choice.
    """
    for word in segment.words:
        if word in english.NEGATIVES:
            raise InstructionError(f"the negation {quoted(word)} in {quoted(segment.text)} is not understood")
        if word in english.CHOICES:
            raise InstructionError(f"{quoted(segment.text)} leaves a choice; ask for one thing")
    last = before[-1].routed if before else None
    refusal: InstructionError | None = None
    for number in range(len(segment.openers) + 1):
        # The phrase of a task may begin with words that are openers elsewhere, as in `go on`.
        words = segment.openers[len(segment.openers) - number :] + segment.words
        # `clean the table, then the can, please` does not wish for the can.
        may_wish = segment.link is Link.START or words[:1] in _INDEFINITE
        is_polite = segment.is_polite and may_wish
        for variant in wordings(words, is_polite=is_polite, is_perfect=segment.is_perfect):
            coverages = [
                entry.cover(
                    variant.words,
                    knows_pronoun=last is not None and entry.routed.covers(last),
                    is_perfect=variant.is_perfect,
                )
                for entry in tasks
            ]
            whole = [
                one
                for one in coverages
                if (one.is_whole and (one.starts_with_object or not variant.needs_object_first))
                or one.repeats(last)
            ]
            if len(whole) == 1:
                return _with_arguments(segment, whole[0], last)
            if whole:
                raise _ambiguous(segment.text, [one.entry.routed for one in whole])
            refusal = refusal or _not_covered(segment, coverages)
    assert refusal is not None  # noqa: S101 - the first round makes one
    raise refusal


def _ambiguous(text: str, candidates: Sequence[RoutedTask]) -> AmbiguousInstructionError:
    named = ", ".join(f"`{routed}` ({', '.join(routed.task.trigger_phrases)})" for routed in candidates)
    return AmbiguousInstructionError(
        f"{quoted(text)} may mean several tasks: {named}",
        text,
        {str(routed): routed.instruction for routed in candidates},
    )


def _with_arguments(segment: Segment, coverage: Coverage, last: RoutedTask | None) -> RoutedTask:
    """Return the task with its arguments; a pronoun stands for the object of the request before.

    Raises:
        AmbiguousInstructionError: an argument may have several values.
        InstructionError: an argument is missing that is a number.
    """
    routed = coverage.routed
    if last is not None and coverage.names_pronoun and not coverage.values.is_specific:
        before = {
            name: one for name, one in last.arguments.items() if is_object(routed.task.parameters[name])
        }
        arguments = routed.task.complete_arguments({**routed.arguments, **before})
        return replace(routed, arguments=arguments)
    for name, values in coverage.values.open_parameters():
        candidates = {
            one: replace(routed, arguments={**routed.arguments, name: one}).instruction for one in values
        }
        listed = ", ".join(f"`{one}`" for one in values)
        parameter = routed.task.parameters[name]
        stated = {one: ", ".join(parameter.phrases.get(one, ())) for one in values}
        shown = ", ".join(f"`{one}` ({stated[one]})" for one in values) if any(stated.values()) else listed
        if not values:
            raise InstructionError(
                f"{quoted(segment.text)} does not say `{name}` of `{routed}`; write "
                f"`aeros run --task {routed} {name}=VALUE`"
            )
        raise AmbiguousInstructionError(
            f"{quoted(segment.text)} leaves open `{name}` of `{routed}`: {shown}", segment.text, candidates
        )
    return routed


def _prohibited(segment: Segment, tasks: Sequence[TaskPhrases], before: Sequence[Errand]) -> list[RoutedTask]:
    """Return all tasks that a prohibition may mean: if it is not certain, all are prohibited.

    Raises:
        InstructionError: it means none, or holds another negation.
    """
    for word in segment.words:
        if word in english.NEGATIVES and word not in _ALSO_NOT:
            raise InstructionError(f"{quoted(segment.text)} negates twice, which is not understood")
    parts = list(_split(segment.words, english.CHOICES | _ALSO_NOT))
    if not all(parts):
        raise InstructionError(f"it is not clear what {quoted(segment.text)} prohibits")
    last = before[-1].routed if before else None
    found: list[RoutedTask] = []
    for part in parts:
        coverages = [
            entry.cover(part, knows_pronoun=last is not None and entry.routed.covers(last), is_perfect=True)
            for entry in tasks
        ]
        possible = [
            one.prohibited
            for one in coverages
            if not (one.unknown or one.repetitions) and (one.triggers or one.objects)
        ] or [
            one.prohibited
            for one in coverages
            if one.triggers and all(word in english.UNIVERSAL for word in one.unknown)
        ]
        if not possible:
            raise _not_covered(replace(segment, words=part), coverages)
        found += possible
    return found


def _split(words: Words, at: frozenset[str]) -> Iterator[Words]:
    part: list[str] = []
    for word in words:
        if word in at:
            yield tuple(part)
            part = []
        else:
            part.append(word)
    yield tuple(part)


def _is_universal(segment: Segment) -> bool:
    """Return True for a prohibition of everything: `do not do anything`, `stop`."""
    words = [word for word in segment.words if word not in english.FILLERS]
    if not words:
        return segment.marker in (("stop",), ("quit",), ("cease",))
    return all(word in english.UNIVERSAL for word in words)


def _not_covered(segment: Segment, coverages: Sequence[Coverage]) -> InstructionError:
    """Say why no task covers a request, from the task that comes nearest."""
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
        return InstructionError(f"in {text}, `{routed}` does not know {unknown}; {_known_phrases(best)}")
    if best.values.fault:
        return InstructionError(f"in {text}, {best.values.fault}")
    if best.counts or best.repetitions:
        counted = ", ".join(quoted(word) for word in best.counts + best.repetitions)
        return InstructionError(
            f"in {text}, {counted} is not understood: `{routed}` is done once for one goal"
        )
    if not best.triggers:
        return InstructionError(f"{text} does not say what to do; {_known_phrases(best)}")
    return InstructionError(f"{text} does not say with what; {_known_phrases(best)}")


def _known_phrases(coverage: Coverage) -> str:
    entry = coverage.entry
    verbs = ", ".join(f"`{' '.join(one)}`" for one in reversed(entry.triggers[-8:]))
    if not entry.objects:
        return f"`{entry.routed}` knows {verbs}"
    objects = ", ".join(f"`{' '.join(one)}`" for one in reversed(entry.objects[-8:]))
    return f"`{entry.routed}` knows {verbs} with {objects}"


def _suggestion(words: Words, coverages: Sequence[Coverage]) -> str:
    declared = {
        " ".join(phrase): one.entry.routed
        for one in coverages
        for phrase in (*one.entry.triggers, *one.entry.objects)
    }
    if not declared:
        return "no task is installed"
    # An instruction may be any text at all, and difflib is quadratic.
    close = [near for word in words[:50] for near in difflib.get_close_matches(word[:64], declared, n=1)]
    shown = dict.fromkeys(close or sorted(declared))
    return "nearest: " + ", ".join(f"`{word}` ({declared[word]})" for word in list(shown)[:8])
