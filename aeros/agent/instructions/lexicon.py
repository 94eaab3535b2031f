"""Phrases that the tasks of modules declare, and how they cover the words of a request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import StatedValues, ValuePhrase, counted_parameter, value_phrases
from aeros.agent.instructions.phrases import Words
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.model.ecm import Ecm


@dataclass(frozen=True, slots=True)
class Coverage:
    """Words of a request as one task understands them.

    Attributes:
        entry: the task.
        triggers: declared phrases that ask for the task.
        objects: declared phrases of what it acts on, and pronouns.
        unknown: words that the task does not declare.
        counts: numbers, as said, but for a `one` before an object.
        repetitions: words that ask for several times, as said.
        values: values that the words state for the task's parameters.
        starts_with_object: True if an object is named before the first phrase that asks for the task.
    """

    entry: TaskPhrases
    triggers: tuple[Words, ...]
    objects: tuple[Words, ...]
    unknown: Words
    counts: Words
    repetitions: Words
    values: StatedValues
    starts_with_object: bool = False

    @property
    def routed(self) -> RoutedTask:
        """The task with its arguments."""
        return replace(self.entry.routed, arguments=self.values.arguments)

    @property
    def prohibited(self) -> RoutedTask:
        """The task with only those arguments that the words say: without any, all are meant."""
        return replace(self.entry.routed, arguments=self.values.stated)

    @property
    def names_pronoun(self) -> bool:
        """True if a pronoun stands for what it acts on."""
        return any(one[0] in english.PRONOUNS for one in self.objects if len(one) == 1)

    def repeats(self, last: RoutedTask | None) -> bool:
        """Check if the words only name another object of the request before: `the can and the block`.

        Args:
            last: the task of the request before; None if there is none.

        Returns:
            True if the same task is asked for again, with that object.
        """
        is_same = last is not None and self.entry.routed.covers(last)
        return is_same and self.is_object_alone and self.values.is_specific

    @property
    def is_whole(self) -> bool:
        """True if the words ask for the task, name an object if it needs one, and leave nothing over."""
        names_object = bool(self.objects) or not self.entry.objects
        leaves_nothing = not (self.unknown or self.counts or self.repetitions or self.values.fault)
        return bool(self.triggers) and names_object and leaves_nothing

    @property
    def is_object_alone(self) -> bool:
        """True if the words name objects of the task and nothing else."""
        is_more = self.triggers or self.unknown or self.counts or self.repetitions or self.values.fault
        return bool(self.objects) and not is_more


@dataclass(frozen=True, slots=True)
class TaskPhrases:
    """A task with its declared phrases as words, longest first.

    Attributes:
        routed: the task.
        triggers: phrases that ask for it: verbs, or any words if it declares no objects.
        objects: phrases of what it acts on.
        extras: phrases that may be said with it and change nothing.
        values: phrases for values of its parameters.
    """

    routed: RoutedTask
    triggers: tuple[Words, ...]
    objects: tuple[Words, ...]
    extras: tuple[Words, ...]
    values: tuple[ValuePhrase, ...] = ()

    def cover(self, words: Words, *, knows_pronoun: bool, is_perfect: bool = False) -> Coverage:
        """Cover words with the longest declared phrases, from the left.

        Args:
            words: of a request, without openers and closers.
            knows_pronoun: True if `it` can only mean an object of this task.
            is_perfect: True if the verb is a past participle, as after `once you have`.

        Returns:
            The coverage.
        """
        triggers: list[Words] = []
        objects: list[Words] = []
        unknown: list[str] = []
        counts: list[str] = []
        repetitions: list[str] = []
        stated = StatedValues(self.routed.task)
        starts_with_object = False
        particles = {phrase[-1] for phrase in self.triggers if len(phrase) == 2} & english.PARTICLES
        at = 0
        while at < len(words):
            found, length = self._longest(words, at, is_perfect=is_perfect)
            word = words[at]
            value = self._value_phrase(words, at, more_than=length - 1, is_perfect=is_perfect)
            if value is not None:
                stated.add(value)
                if value.names_object:
                    starts_with_object = starts_with_object or not triggers
                    objects.append(words[at : at + len(value.words)])
                at += len(value.words)
                continue
            if length:
                spoken = words[at : at + length]
                if found is self.triggers:
                    triggers.append(spoken)
                elif found is self.objects:
                    starts_with_object = starts_with_object or not triggers
                    objects.append(spoken)
                at += length
                continue
            number = english.number_of(word)
            # A task without objects acts on one thing only.
            # In `the table, please clean it`, too, it can only mean that.
            if (knows_pronoun or objects or not self.objects) and word in english.PRONOUNS:
                starts_with_object = starts_with_object or not triggers
                objects.append((word,))
            elif word in particles and triggers and objects and words[at - 1] not in english.DETERMINERS:
                pass  # apart from its verb, as in `tidy the table up`; `to the back` is a place
            elif word in english.REPETITIONS:
                repetitions.append(word)
            elif number is not None:
                nouns = self.objects or self.triggers
                is_of_noun = self._longest(words, at + 1, is_perfect=is_perfect)[0] is nouns
                following = self._value_phrase(words, at + 1, more_than=0, is_perfect=is_perfect)
                if counted_parameter(self.routed.task) is not None and is_of_noun:
                    stated.add_number(word, number)
                elif number != 1 or not (is_of_noun or (following is not None and following.names_object)):
                    counts.append(word)
            elif word not in english.FILLERS and word not in english.DETERMINERS:
                unknown.append(word)
            at += 1
        return Coverage(
            self,
            tuple(triggers),
            tuple(objects),
            tuple(unknown),
            tuple(counts),
            tuple(repetitions),
            stated,
            starts_with_object,
        )

    def _value_phrase(self, words: Words, at: int, *, more_than: int, is_perfect: bool) -> ValuePhrase | None:
        """Return the longest phrase for a value at a place, if it has more words than that."""
        return next(
            (
                one
                for one in self.values
                if len(one.words) > more_than
                and _stands_at(one.words, words, at, is_perfect=is_perfect, is_verb=False)
            ),
            None,
        )

    def _longest(self, words: Words, at: int, *, is_perfect: bool) -> tuple[tuple[Words, ...], int]:
        """Return the list with the longest phrase at a place, and the phrase's length; 0 if there is none."""
        found: tuple[tuple[Words, ...], int] = ((), 0)
        for phrases in (self.triggers, self.objects, self.extras):
            is_verb = phrases is self.triggers and bool(self.objects)
            fits = (
                one for one in phrases if _stands_at(one, words, at, is_perfect=is_perfect, is_verb=is_verb)
            )
            length = next((len(one) for one in fits), 0)
            if length > found[1]:
                found = phrases, length
        return found


def task_phrases(modules: Mapping[str, Ecm]) -> tuple[TaskPhrases, ...]:
    """Collect the phrases of all tasks.

    Args:
        modules: modules by id.

    Returns:
        One entry for each task.
    """
    return tuple(
        TaskPhrases(
            RoutedTask(name, task),
            _as_words(task.trigger_phrases),
            _as_words(task.object_phrases),
            _as_words(task.extra_phrases),
            value_phrases(task),
        )
        for name, module in modules.items()
        for task in module.tasks.values()
    )


def _as_words(phrases: Sequence[str]) -> tuple[Words, ...]:
    spoken = (words for one in phrases if (words := normalized_words(one)))
    return tuple(sorted(spoken, key=len, reverse=True))


def _stands_at(phrase: Words, words: Words, at: int, *, is_perfect: bool, is_verb: bool) -> bool:
    """Compare a declared phrase with words, in any number, and verbs in their -ing form, too.

    In the perfect, verbs may be past participles. A verb with an `s`, as in `he cleans`, asks for nothing.
    """
    spoken = words[at : at + len(phrase)]
    if is_verb and spoken and spoken[0] == f"{phrase[0]}s":
        return False
    return len(spoken) == len(phrase) and all(
        declared == word
        or declared in english.base_forms(word)
        or (is_perfect and declared in english.participle_bases(word))
        for declared, word in zip(phrase, spoken, strict=True)
    )
