"""Values that the words of a request say of a task's parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from aeros.agent.instructions.phrases import Words
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.expr.types import IntegerType
from aeros.spec.expr.units import format_number
from aeros.spec.model.ecm import Task
from aeros.spec.model.task_parameters import OBJECTS, TaskParameter


@dataclass(frozen=True, slots=True)
class ValuePhrase:
    """A phrase for values of a parameter.

    Attributes:
        words: its words.
        parameter: name of the parameter.
        values: every value that it may mean.
        names_object: it names something that the task acts on, or a part of it: `the left half`.
        is_place: it is a member of a set that the module lists, such as sides.
    """

    words: Words
    parameter: str
    values: frozenset[str]
    names_object: bool
    is_place: bool


def value_phrases(task: Task) -> tuple[ValuePhrase, ...]:
    """Collect the phrases for values of a task's parameters.

    Args:
        task: the task.

    Returns:
        The phrases, longest first.
    """
    found: dict[tuple[str, Words], set[str]] = {}
    for name, parameter in task.parameters.items():
        for value, stated in parameter.phrases.items():
            for words in map(normalized_words, stated):
                # `can red`, as in many other languages
                turned = [words[::-1]] if len(words) == 2 else []
                for order in (words, *turned):
                    found.setdefault((name, tuple(order)), set()).add(value)
    acts_on_parameter = any(map(is_object, task.parameters.values()))
    phrases = (
        ValuePhrase(
            words,
            name,
            frozenset(values),
            is_object(task.parameters[name])
            or (bool(task.object_phrases) and not acts_on_parameter and len(words) > 1),
            not is_object(task.parameters[name]),
        )
        for (name, words), values in found.items()
    )
    return tuple(sorted(phrases, key=lambda one: len(one.words), reverse=True))


def has_object_of(routed: RoutedTask, last: RoutedTask) -> bool:
    """Check if `it` in a request for a task may mean the object of the request before.

    Args:
        routed: the task.
        last: the task of the request before.

    Returns:
        True if that is the same task, or one with the same words for its object, of which no part was said.
    """
    is_whole = all(last.task.parameters[name].default == one for name, one in last.arguments.items())
    return routed.covers(last) or (is_whole and are_of_one_object((routed, last)))


def are_of_one_object(tasks: Sequence[RoutedTask]) -> bool:
    """Check if tasks have the same words for what they act on, none of which is a parameter.

    Args:
        tasks: at least one.

    Returns:
        True if they do.
    """
    phrases = {frozenset(one.task.object_phrases) for one in tasks}
    chosen = any(is_object(parameter) for one in tasks for parameter in one.task.parameters.values())
    return len(phrases) == 1 and phrases != {frozenset()} and not chosen


def is_object(parameter: TaskParameter) -> bool:
    """Say if a parameter is what its task acts on.

    Args:
        parameter: the parameter.

    Returns:
        True for one of the site's objects.
    """
    return getattr(parameter.declared.variable.type, "name", "") == OBJECTS


def counted_parameter(task: Task) -> TaskParameter | None:
    """Return the parameter that a number before an object sets.

    Args:
        task: the task.

    Returns:
        Its only whole number; None if there is none, or several.
    """
    found = [one for one in task.parameters.values() if isinstance(one.declared.variable.type, IntegerType)]
    return found[0] if len(found) == 1 else None


@dataclass
class StatedValues:
    """Values that the words of one request state for the parameters of a task.

    Attributes:
        task: the task.
        values: the values that are still possible, for each parameter of which something is said.
        numbers: numbers, as said, with their values.
        fault: why no arguments follow; empty if they do.
    """

    task: Task
    values: dict[str, frozenset[str]] = field(default_factory=dict)
    numbers: list[tuple[str, int]] = field(default_factory=list)
    fault: str = ""

    def add(self, phrase: ValuePhrase) -> None:
        """Note a phrase for a value.

        Args:
            phrase: the phrase.
        """
        known = self.values.get(phrase.parameter)
        both = phrase.values if known is None else known & phrase.values
        if known is not None and phrase.is_place:
            self.fault = f"{quoted(' '.join(phrase.words))} is a second `{phrase.parameter}`"
        if not both:
            self.fault = f"{quoted(' '.join(phrase.words))} contradicts another `{phrase.parameter}`"
        self.values[phrase.parameter] = both

    def add_number(self, word: str, number: int) -> None:
        """Note a number before an object.

        Args:
            word: the number as said.
            number: its value.
        """
        parameter = counted_parameter(self.task)
        bounds = None if parameter is None else parameter.declared.range
        if parameter is None or bounds is None:
            return
        self.numbers.append((word, number))
        if len(self.numbers) > 1:
            self.fault = f"{quoted(word)} is a second `{parameter.name}`"
        elif not bounds[0] <= number <= bounds[1]:
            low, high = map(format_number, bounds)
            named = f"`{parameter.name}` is {low} to {high}{parameter.note}"
            self.fault = f"{quoted(word)} is out of range: {named}"

    def add_all(self, word: str) -> None:
        """Note a word for all of a kind: no number of things says how many that is.

        Args:
            word: the word as said.
        """
        parameter = counted_parameter(self.task)
        if parameter is not None:
            named = f"`{parameter.name}` says how many; say a number"
            self.fault = f"{quoted(word)} is not understood: {named}"

    @property
    def names_part(self) -> bool:
        """True if a part of what the task acts on is named, such as its left half."""
        acts_on_parameter = any(map(is_object, self.task.parameters.values()))
        return bool(self.values) and not acts_on_parameter

    @property
    def names_place(self) -> bool:
        """True if a value is stated of a set that the module lists, such as sides."""
        return any(not is_object(self.task.parameters[name]) for name in self.values)

    @property
    def is_specific(self) -> bool:
        """True if an object is named that a parameter stands for."""
        return any(is_object(self.task.parameters[name]) for name in self.values)

    @property
    def stated(self) -> dict[str, Any]:
        """The arguments that are stated, by the parameter's name."""
        stated: dict[str, Any] = {name: next(iter(one)) for name, one in self.values.items() if len(one) == 1}
        parameter = counted_parameter(self.task)
        if parameter is not None and self.numbers:
            stated[parameter.name] = Fraction(self.numbers[0][1])
        return {name: stated[name] for name in self.task.parameters if name in stated}

    @property
    def arguments(self) -> dict[str, Any]:
        """The stated arguments, and the defaults; parameters of which neither is known are absent."""
        stated = self.stated
        complete = self.task.complete_arguments(stated)
        # A default does not settle which of several values is meant.
        return {name: one for name, one in complete.items() if name in stated or name not in self.values}

    def open_parameters(self) -> Iterator[tuple[str, Sequence[str]]]:
        """Find the parameters that are still open.

        Yields:
            Each parameter without a value, and the values that it may have; empty for a number.
        """
        given = self.arguments
        for name, parameter in self.task.parameters.items():
            if name not in given:
                possible = self.values.get(name)
                yield name, [one for one in parameter.values if possible is None or one in possible]
