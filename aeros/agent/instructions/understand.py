"""Understand an instruction whole or not at all.

1.  Each request must be covered word by word by the phrases of exactly one task of the active modules and by
    the words of `english.py`. A word that nothing declares is named, and the instruction refused.
2.  Requests are done in the order in which they are said; `A after B` is B, then A.
3.  A prohibition never moves anything. Skills that only prohibited tasks use are used for nothing else.
4.  A condition of a request is measured when its turn comes. Unless it is measured as true, the request is
    skipped. After `otherwise`, the same measurement decides.
5.  If several tasks may be meant, or several values of a parameter, all are named; the caller may ask the
    user which one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from aeros.agent.instructions import english
from aeros.agent.instructions.alternatives import read_otherwise, read_unless, require_no_alternative
from aeros.agent.instructions.condition_scopes import scoped
from aeros.agent.instructions.grammar import parse_instruction
from aeros.agent.instructions.lexicon import TaskPhrases, task_phrases
from aeros.agent.instructions.meaning import Errand, Spoken, Understanding, with_goal
from aeros.agent.instructions.merging import merged_requests
from aeros.agent.instructions.named_task import named_tasks
from aeros.agent.instructions.prohibitions import is_universal, prohibited_tasks, without_prohibited_parts
from aeros.agent.instructions.reasons.plain_reasons import (
    is_topic,
    require_no_retraction,
    require_plain_reason,
    without_statements,
)
from aeros.agent.instructions.reasons.references import named_before
from aeros.agent.instructions.refinements import (
    is_contrast,
    is_own_check,
    placed_things,
    refined_request,
    require_no_other_number,
    require_no_other_one,
    require_own_place,
    with_shared_place,
)
from aeros.agent.instructions.refusals import (
    AmbiguousInstructionError,
    InactiveTaskError,
    InstructionError,
    NothingAskedError,
    ambiguous_tasks,
)
from aeros.agent.instructions.requests import Request, read_request
from aeros.agent.instructions.segments import Link, Mood, Segment, Sentence
from aeros.agent.instructions.sentences.corrections import without_corrections
from aeros.agent.instructions.sentences.names import without_names
from aeros.agent.instructions.sentences.sets_of_things import without_sets
from aeros.agent.instructions.spelling import unknown_words, without_slips
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.model.ecm import ActionCondition, Ecm


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
        InactiveTaskError: only modules understand it that are not active.
        InstructionError: a part is not understood, prohibits what another part asks for, or asks for nothing.
    """
    tasks = task_phrases(modules)
    named = named_tasks(instruction, [entry.routed for entry in tasks])
    if len(named) > 1:
        raise ambiguous_tasks(instruction, named)
    if named:
        return Understanding(instruction, (Errand(named[0]),))
    text, names = without_names(instruction, lambda word: not unknown_words(word, tasks))
    text, slips = without_slips(text, tasks)
    try:
        text, corrections = without_corrections(text, tasks, lambda words: _understand(words, tasks))
        meaning = _understand(text, tasks)
        account = (*names, *slips, *corrections, *meaning.account)
        return replace(meaning, instruction=instruction, account=account)
    except (AmbiguousInstructionError, NothingAskedError):
        raise
    except InstructionError as error:
        refusal, reason = error, error.reason
        unnamed = [word for word in unknown_words(text, tasks) if word not in reason]
        if unnamed:
            refusal = InstructionError(f"{reason}; unknown: {', '.join(map(quoted, unnamed[:8]))}")
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
    return InactiveTaskError(f"no active module provides {quoted(instruction)}; installed is {means}")


def _understand(instruction: str, tasks: Sequence[TaskPhrases]) -> Understanding:
    errands: list[Errand] = []
    prohibited: list[RoutedTask] = []
    prohibits_all = ""
    reasons: list[Segment] = []
    leading: list[Segment] = []
    unplaced: list[tuple[Errand, Segment]] = []
    last: tuple[Request, Segment] | None = None
    first: Request | None = None  # request that `otherwise` may follow
    pending = list(parse_instruction(instruction))
    while pending:
        sentence, own_reasons = without_statements(pending.pop(0), tasks)
        if pending and is_topic(sentence, pending[0], tasks):
            own_reasons, sentence = [*own_reasons, *sentence], ()
        if errands:
            require_no_retraction(own_reasons, tasks, [one.routed for one in errands])
        reasons += own_reasons
        # A sentence that is only a reason, as in `The table is dirty. Clean it.`, leads the next one.
        context = named_before(errands, [*leading, *own_reasons], tasks)
        is_named = any(one.link is not Link.ADJUNCT for one in (*leading, *own_reasons)) and bool(context)
        leading = [] if sentence else own_reasons
        if sentence and sentence[0].is_otherwise:
            other = read_otherwise(sentence, first, tasks, context)
            errands += [] if other is None else [other]
            last = first = None
            continue
        sentence, earlier = scoped(sentence, tasks, context), len(errands)
        following = pending[0] if pending and pending[0][0].is_otherwise else ()
        if following and (only := read_unless(sentence, following, tasks, context)):
            errands.append(only)
            last = first = None
            pending.pop(0)
            continue
        sentence = merged_requests(without_sets(sentence, tasks), tasks, context)
        for segment, condition in _requests(sentence):
            if segment.mood is Mood.REQUEST and last and is_own_check(segment, last[0], tasks):
                continue  # `…, then check that it is clean`: the goal says that
            if segment.is_check and not _is_understood(segment, tasks, context):
                continue
            if segment.mood is Mood.REQUEST:
                refers = any(
                    word in english.PRONOUNS or english.number_of(word) is not None for word in segment.words
                )
                known = context or [_denied(one) for one in prohibited[-1:] if refers]
                request = read_request(
                    segment, condition, tasks, known, last and last[0].topic, may_elide=is_named
                )
                request = replace(request, has_verb=False) if segment.is_of_set else request
                if last:
                    require_no_other_one(last[0], request, segment)
                things = placed_things(errands, last[0], request, segment) if last else []
                refined = last and not things and refined_request(last[0], request, segment, last[1])
                if things:
                    errands[-len(things) :] = things
                    request = replace(request, errand=things[-1])
                elif refined:
                    errands[-1] = refined.errand
                elif last and (shared := with_shared_place(last[0], request, segment)):
                    errands[-1:] = [shared.errand, request.errand]
                else:
                    require_no_other_number(errands, request, segment)
                    errands += [request.errand] if errands[-1:] != [request.errand] else []
                unplaced += [(request.errand, segment)] if request.lacks_place and not refined else []
                last = (refined or request, segment)
                context.append(last[0].errand)
            elif is_universal(segment):
                prohibits_all = segment.text
            elif last and is_contrast(last[0], segment, tasks):
                continue
            else:
                found = prohibited_tasks(segment, tasks, errands)
                if last and segment.link in (Link.JOINED, Link.ADJUNCT):
                    require_own_place(last[0], found, segment)
                prohibited += [one for one in found if one not in prohibited]
        conditional = [one for one in errands[earlier:] if one.condition is not None]
        first = last[0] if last and conditional == [last[0].errand] == errands[-1:] else None
    if prohibits_all and errands:
        raise NothingAskedError(f"{quoted(prohibits_all)} contradicts the rest of the instruction")
    if not errands and not prohibited and reasons and not prohibits_all:
        raise InstructionError(f"{quoted(reasons[0].text)} states something, and asks for nothing")
    if prohibits_all or not errands:
        never = ", ".join(f"`{routed.formal_text}`" for routed in prohibited) or quoted(prohibits_all)
        raise NothingAskedError(f"nothing is asked for, and {never} is prohibited, so nothing moves")
    for errand, segment in unplaced:
        if errand in errands:
            raise InstructionError(f"{quoted(segment.text)} does not say where to")
    for errand in errands:
        if any(one.covers(errand.routed) for one in prohibited):
            raise NothingAskedError(
                f"the instruction asks for `{errand.routed.formal_text}` and prohibits it"
            )
    errands = without_prohibited_parts(errands, prohibited)
    require_no_alternative(errands)
    for reason in reasons:
        require_plain_reason(reason, tasks, [errand.routed for errand in errands])
    account = tuple(f"{quoted(' '.join(reason.words))}: a reason, asks for nothing" for reason in reasons)
    return Understanding(instruction, tuple(errands), tuple(prohibited), account=account)


def _denied(prohibited: RoutedTask) -> Errand:
    """Return what `it` may mean in `do not wipe the table, inspect it`."""
    arguments = prohibited.task.complete_arguments(prohibited.arguments)
    return Errand(replace(prohibited, arguments=arguments))


def _is_understood(segment: Segment, tasks: Sequence[TaskPhrases], context: Sequence[Errand]) -> bool:
    """Return True if a task does what a check asks for."""
    try:
        read_request(segment, None, tasks, context)
    except InstructionError:
        return False
    return True


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
