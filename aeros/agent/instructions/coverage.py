"""Coverage of the words of a request by the phrases of one task, and by words that change nothing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import StatedValues
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.phrases import Words
from aeros.agent.planning.routing import RoutedTask

ONE: Final = ("one",)
"""Pronoun for a thing of the kind of the request before, as in `make one`."""

SPEAKERS: Final = frozenset({"i", "we"})
"""First words of wishes, after which `on the left` may be where a thing is to go."""
_THAT: Final = frozenset({"that", "this"})


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
        starts_with_object: True if an object is named before the first phrase that asks for the task and is
            no wish.
        is_order: True if a number is written as in an order: `teas x2`.
        says_here: True if the words end with `here`.
        says_to: True if `to` or the like is said.
        is_definite: True if there is an article.
        has_extras: True if a declared phrase says where to, and asks for nothing more: `to the other stand`.
        describes_place: True if a place may only say which object: `the can on the left`.
        names_origin: True if a place is said where the task finds its object: `on the shelf`.
    """

    entry: TaskPhrases
    triggers: tuple[Words, ...]
    objects: tuple[Words, ...]
    unknown: Words
    counts: Words
    repetitions: Words
    values: StatedValues
    starts_with_object: bool = False
    describes_place: bool = False
    says_to: bool = False
    is_definite: bool = False
    is_order: bool = False
    says_here: bool = False
    has_extras: bool = False
    names_origin: bool = False

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
        is_pronoun = any(one[0] in english.PRONOUNS or one == ONE for one in self.objects if len(one) == 1)
        return (
            is_pronoun
            or self.places_it
            or self.names_that_part
            or any(one in english.WHOLE_PRONOUNS for one in self.objects)
        )

    @property
    def names_that_part(self) -> bool:
        """True if words stand for the part that the request before is about: `that half`."""
        return any(one[0] in _THAT and one[1:2] and one[1] in english.PART_PRONOUNS for one in self.objects)

    def repeats(self, last: RoutedTask | None) -> bool:
        """Check if the words only name another object of the request before: `the can and the block`.

        Args:
            last: the task of the request before; None if there is none.

        Returns:
            True if the same task is asked for again, with that object.
        """
        is_same = last is not None and self.entry.routed.covers(last)
        if is_same and (self.places_it or self._is_place_alone):
            return True
        return is_same and self.is_object_alone and (self.values.is_specific or self.values.names_part)

    @property
    def is_verb_alone(self) -> bool:
        """True if the words only ask for the task, of a thing that was named before: `if …, clean`."""
        is_more = self.objects or self.unknown or self.counts or self.repetitions or self.values.fault
        is_wish = any(one[0] in ("i", "we") for one in self.triggers)
        return bool(self.triggers) and not (is_more or is_wish or self.values.stated)

    @property
    def places_it(self) -> bool:
        """True if the words say only where to put the object of the request before: `deliver right`."""
        leaves_nothing = not (self.unknown or self.counts or self.repetitions or self.values.fault)
        is_whole = self.puts and bool(self.entry.objects) and leaves_nothing
        return is_whole and not self.objects and self.values.names_place and not self.describes_place

    @property
    def _is_place_alone(self) -> bool:
        """True for `to the left`, without the object of the request before."""
        is_more = self.triggers or self.objects or self.unknown or self.counts or self.repetitions
        is_place = self.says_to and self.values.names_place and not self.describes_place
        return is_place and bool(self.entry.objects) and not (is_more or self.values.fault)

    @property
    def puts(self) -> bool:
        """True if a verb says to put something somewhere."""
        acts = [one for one in self.triggers if one[0] not in SPEAKERS]
        verbs = (
            form
            for one in acts or self.triggers
            for form in english.base_forms(one[0]) | english.participle_bases(one[0])
        )
        return not english.PUTTING_VERBS.isdisjoint(verbs)

    @property
    def lacks_place(self) -> bool:
        """True if a verb says to put a thing down, and no words say where: `put the can down`."""
        is_put = any(one[0] in english.PLACING_VERBS for one in self.triggers)
        return is_put and self.values.is_specific and not (self.values.names_place or self.has_extras)

    @property
    def has_vague_place(self) -> bool:
        """True if a place may say which thing, or where to: `put the can on the shelf`."""
        may_be_target = self.names_origin and not self.values.names_place
        return may_be_target if self.puts else self.describes_place

    @property
    def is_whole(self) -> bool:
        """True if the words ask for the task, name an object if it needs one, and leave nothing over."""
        names_object = bool(self.objects) or not self.entry.objects
        leaves_nothing = not (self.unknown or self.counts or self.repetitions or self.values.fault)
        # `i want bring the can`
        is_other_act = self.triggers[:1] and self.triggers[0][0] in SPEAKERS and self._names_move
        return (
            bool(self.triggers)
            and names_object
            and leaves_nothing
            and not (self.has_vague_place or is_other_act)
        )

    @property
    def _names_move(self) -> bool:
        return any(one[0] in english.MOVING_VERBS for one in self.triggers)

    def is_whole_without_verb(self, *, is_light: bool) -> bool:
        """Check if the words need no verb to ask for the task.

        Args:
            is_light: True if a verb such as `do` stands for any other.

        Returns:
            True for an object and where it is to go, as in `red cup to the left`; after `do`, for an object
            with its part or number, as in `do the left half`.
        """
        if not self.is_object_alone or not self.starts_with_object:
            return False
        if self.is_order and self.values.numbers:
            return True
        if is_light:
            return self.values.names_part or bool(self.values.numbers)
        is_where_to = (self.values.names_place and not self.describes_place) or self.says_here
        return self.values.is_specific and is_where_to and (self.says_to or not self.is_definite)

    @property
    def is_object_alone(self) -> bool:
        """True if the words name objects of the task and nothing else."""
        is_more = self.triggers or self.unknown or self.counts or self.repetitions or self.values.fault
        return bool(self.objects) and not is_more
