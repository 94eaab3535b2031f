"""Requests that go on with the one before: `fetch the can and put it on the right` is one request."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import takewhile
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import counted_parameter, is_object
from aeros.agent.instructions.conditions import find_condition
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.requests import Request
from aeros.agent.instructions.segments import COMMA, Link, Mood, Segment
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.expr import terms as t

_AND: Final = ("and", "along with", "and along with", "as well as", "plus")
"""Joints of two things that get the same."""


def refined_request(before: Request, request: Request, segment: Segment, first: Segment) -> Request | None:
    """Join a request with the one before if it only says more about that.

    Args:
        before: the request before.
        request: the request.
        segment: words of the request.
        first: words of the request before.

    Returns:
        The one request that both are; None if they are two.

    Raises:
        InstructionError: it is not clear if it is one, as in `make a tea and two`.
    """
    if not request.only_refers or before.errand.routed.task is not request.errand.routed.task:
        return None
    # `clean the whole table, well, only the left half`
    is_limit = not {"only", "just"}.isdisjoint(segment.words) and not request.has_verb
    is_instead = is_limit and segment.joint in ("", COMMA)
    if request.errand.condition is not None or (request.stated & before.stated and not is_instead):
        return None
    # `clean the table. Only the left half.`
    is_of_part = segment.link is Link.START and not request.has_verb and not _names_object(request)
    is_more = is_of_part or segment.link in (Link.JOINED, Link.ADJUNCT) or "but" in segment.joint.split()
    if not is_more and not _is_one_act(segment, first):
        return None
    task = request.errand.routed.task
    has_parts = counted_parameter(task) is None and not any(map(is_object, task.parameters.values()))
    is_part = has_parts and segment.words[0] in english.DETERMINERS and not (request.has_verb or is_limit)
    if "but" in segment.joint.split() and is_part:
        # `clean all of the table, but the left half`
        raise InstructionError(f"{quoted(f'but {segment.text}')} may be an exception; say `except` or `only`")
    if request.stated and not request.has_verb and segment.joint in _AND:
        raise InstructionError(
            f"is {quoted(segment.text)} wanted beside that, or instead? say it in two sentences"
        )
    new = {name: request.errand.routed.arguments[name] for name in request.stated}
    routed = before.errand.routed
    arguments = {**routed.arguments, **new}
    errand = replace(before.errand, routed=replace(routed, arguments=arguments))
    return Request(errand, before.stated | request.stated, before.only_refers)


def with_shared_place(before: Request, request: Request, segment: Segment) -> Request | None:
    """Give the place of `move the cup and the block to the left` to both.

    Args:
        before: the request before.
        request: the request.
        segment: words of the request.

    Returns:
        The request before, with the values that the request states, and that stand for both; None if there
        are none.

    Raises:
        InstructionError: only the request before says a place, so that it is not clear where this one is to
            go.
    """
    task = request.errand.routed.task
    is_of_things = any(map(is_object, task.parameters.values()))
    is_shared = segment.link is Link.JOINED or (segment.link is Link.THEN and is_of_things)
    if request.has_verb or not is_shared or before.errand.routed.task is not task:
        return None
    places = {name for name, one in task.parameters.items() if one.values and not is_object(one)}
    if (before.stated - request.stated) & places:
        name = min((before.stated - request.stated) & places)
        raise InstructionError(f"{quoted(segment.text)} does not say `{name}`; say it of both")
    missing = (request.stated - before.stated) & places
    if not missing or segment.link is Link.THEN or not is_of_things:
        return None
    if segment.joint not in _AND:
        raise InstructionError(f"`{min(missing)}` in {quoted(segment.text)} may be of both; say it of each")
    routed = before.errand.routed
    values = {name: request.errand.routed.arguments[name] for name in missing}
    errand = replace(before.errand, routed=replace(routed, arguments={**routed.arguments, **values}))
    return replace(before, errand=errand, stated=before.stated | missing)


def placed_things(
    errands: Sequence[Errand], before: Request, request: Request, segment: Segment
) -> list[Errand]:
    """Give the place of `bring the cup and the block, and put them on the left` to each of the things.

    Args:
        errands: the requests before, in order.
        before: the last of them.
        request: the request.
        segment: words of the request.

    Returns:
        The last requests before, with the values that the request states; none if it is about one thing.

    Raises:
        InstructionError: it is not clear which things are meant, or where they are to go.
    """
    routed = request.errand.routed
    objects = {name for name, one in routed.task.parameters.items() if is_object(one)}
    earlier = takewhile(lambda one: one.routed.task is routed.task, reversed(errands))
    things = list(earlier)[::-1]
    if not request.only_refers or not objects or len(things) < 2:
        return []
    if _THEM.isdisjoint(segment.words) and "both" not in segment.openers:
        if not before.has_verb and ("it" in segment.words or not request.stated & objects):
            raise InstructionError(f"{quoted(segment.text)} may be about one of several things; say which")
        return []
    if request.errand.condition is not None or request.stated & objects:
        raise InstructionError(f"it is not clear which things are meant by {quoted(segment.text)}")
    new = {name: routed.arguments[name] for name in request.stated}
    defaults = {name: routed.task.parameters[name].default for name in new}
    if any(one.routed.arguments[name] not in (defaults[name], new[name]) for one in things for name in new):
        raise InstructionError(f"{quoted(segment.text)} says another place than before; say it of each thing")
    return [
        replace(one, routed=replace(one.routed, arguments={**one.routed.arguments, **new})) for one in things
    ]


def _names_object(request: Request) -> bool:
    parameters = request.errand.routed.task.parameters
    return any(is_object(parameters[name]) for name in request.stated)


_THEM: Final = frozenset({"them", "these", "those", "they"})


def require_no_other_one(before: Request, request: Request, segment: Segment) -> None:
    """Require that `bring the cup, the blue one` says more about the same thing.

    Args:
        before: the request before.
        request: the request.
        segment: words of the request.

    Raises:
        InstructionError: `one` stands for another thing, which may be wanted, too, or instead.
    """
    objects = [name for name, one in request.errand.routed.task.parameters.items() if is_object(one)]
    is_place = objects and not request.has_verb and not request.stated & {*objects}
    if is_place and request.stated & before.stated and segment.link is not Link.THEN:
        raise InstructionError(f"{quoted(segment.text)} says another place than before")
    is_bare = segment.words[-1:] == ("one",) and segment.joint in ("", COMMA) and not request.has_verb
    is_same_task = before.errand.routed.task is request.errand.routed.task
    values = [one.errand.routed.arguments for one in (before, request)]
    if is_bare and is_same_task and any(values[0].get(name) != values[1].get(name) for name in objects):
        raise InstructionError(f"is {quoted(segment.text)} wanted beside that, or instead?")


def require_no_other_number(errands: Sequence[Errand], request: Request, segment: Segment) -> None:
    """Require that a request asks for no more of a kind than those before.

    Args:
        errands: the requests before.
        request: the request.
        segment: its words.

    Raises:
        InstructionError: it may, as in `make a tea for me, and make two for Ben`.
    """
    routed, has_condition = request.errand.routed, request.errand.condition is not None
    is_again = any((one.routed.module, one.routed.task) == (routed.module, routed.task) for one in errands)
    counted = counted_parameter(routed.task)
    refers = counted is None or (request.only_refers and counted.name not in request.stated)
    if is_again and not (refers or has_condition):
        raise InstructionError(
            f"is {quoted(segment.text)} one more, or the same as before? say how many are wanted in all"
        )


_BEFORE_THINGS: Final = frozenset({"but", "except", "instead", "not", "rather", "without"})
"""First words of prohibitions that need no verb of their own."""


def require_own_place(before: Request, prohibited: Sequence[RoutedTask], segment: Segment) -> None:
    """Require that a prohibition says no place that the request before may need.

    Args:
        before: the request before.
        prohibited: what may be prohibited.
        segment: words of the prohibition.

    Raises:
        InstructionError: it does, as in `put the cup and not the block on the left`.
    """
    routed = before.errand.routed
    places = {name for name, one in routed.task.parameters.items() if one.values and not is_object(one)}
    is_of_things = any(map(is_object, routed.task.parameters.values()))
    stated = {name for one in prohibited if one.task is routed.task for name in one.arguments}
    is_bare = segment.marker[0] in _BEFORE_THINGS
    if is_bare and is_of_things and (places & stated) - before.stated and stated - places:
        raise InstructionError(
            f"the place in {quoted(segment.text)} may be of what is wanted; say it with that"
        )


def is_contrast(before: Request, segment: Segment, tasks: Sequence[TaskPhrases]) -> bool:
    """Check if a negation only names other values than the request before says.

    Args:
        before: the request before.
        segment: words of the negation.
        tasks: all tasks.

    Returns:
        True for `make one tea, not two` and `…on the left, not the right`; False for `…, not the cup`, which
        prohibits a thing.
    """
    if segment.marker != ("not",) or segment.link not in (Link.JOINED, Link.ADJUNCT):
        return False
    routed = before.errand.routed
    entry = next(one for one in tasks if one.routed.covers(routed))
    found = cover(entry, segment.words, knows_pronoun=False)
    if found.unknown or found.repetitions or found.triggers or found.objects:
        return False
    stated = found.prohibited.arguments
    counted = counted_parameter(routed.task)
    if found.counts and counted is not None and not stated:
        numbers = [english.number_of(word) for word in found.counts]
        return counted.name in before.stated and routed.arguments[counted.name] not in numbers
    is_of_stated = bool(stated) and not found.counts and stated.keys() <= before.stated
    return is_of_stated and all(routed.arguments[name] != value for name, value in stated.items())


def is_own_check(segment: Segment, before: Request, tasks: Sequence[TaskPhrases]) -> bool:
    """Check if some words ask only to check what the goal of the request before says.

    Args:
        segment: the words.
        before: the request before.
        tasks: all tasks.

    Returns:
        True for `…, then check that it is clean`.
    """
    check = english.GOAL_CHECKS.starting(segment.words)
    if not check or before.errand.condition is not None:
        return False
    routed = before.errand.routed
    condition = replace(segment, mood=Mood.CONDITION, words=segment.words[len(check) :])
    entry = next(one for one in tasks if one.routed.covers(routed))
    found = find_condition(condition, entry, is_own=True)
    goal = routed.task.goal
    conjuncts = goal.operands if isinstance(goal, t.And) else (goal,)
    return found is not None and found.term in conjuncts


def _is_one_act(segment: Segment, first: Segment) -> bool:
    """Return True for a second part of one act.

    As in `take the can, then put it on the left`, `bring the can. Put it left.` and `I love tea. Make one.`.
    """
    is_of_kind = any(english.number_of(word) is not None for word in segment.words)
    is_grasped = first.words[:1] and first.words[0] in english.GRASP_VERBS
    is_put = segment.words[0] in english.PUTTING_VERBS and not english.PRONOUNS.isdisjoint(segment.words)
    return bool(is_grasped) or (segment.link is Link.START and (is_of_kind or is_put))
