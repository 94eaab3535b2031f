"""Covering of the words of a request by the phrases of one task, and by words that change nothing."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import (
    StatedValues,
    ValuePhrase,
    counted_parameter,
    is_object,
)
from aeros.agent.instructions.coverage import ONE, SPEAKERS, Coverage
from aeros.agent.instructions.lexicon import TaskPhrases, plural_objects, universal_noun
from aeros.agent.instructions.phrases import Words
from aeros.spec.diagnostics.codes import quoted

_LOOSE_PARTICLES: Final = frozenset({"across", "along", "over", "round", "through", "up"})
"""Particles that change no verb into its opposite, as `back` and `away` may."""
_UPRIGHT: Final = ("right", "side", "up")
_OF_SPEAKERS: Final = (("my",), ("our",), ("his",), ("her",), ("their",))
_SIDES: Final = frozenset({"left", "right"})
_NO_SIDE: Final = tuple(
    (word,)
    for word in (
        "after",
        "alone",
        "away",
        "back",
        "behind",
        "before",
        "here",
        "now",
        "off",
        "out",
        "over",
        "then",
    )
)
"""Words after `left` and `right` with which they name no side."""

_EMPHASIZED: Final = _LOOSE_PARTICLES | {"down"}
"""Words after a bare `left` and `right` with which they name no side."""
_ARTICLES: Final = english.DETERMINERS | english.POSSESSIVES
_BEFORE_NOUNS: Final = frozenset({"a", "an", "little", "my", "our", "single", "some", "the", "your"})
"""Determiners that say nothing without a noun, or say another thing."""

_ABOUT: Final = (("for",), ("on",))


def cover(entry: TaskPhrases, words: Words, *, knows_pronoun: bool, is_perfect: bool = False) -> Coverage:
    """Cover words with the longest declared phrases, from the left.

    Args:
        entry: the task.
        words: of a request, without openers and closers.
        knows_pronoun: True if `it` can only mean an object of this task.
        is_perfect: True if the verb is a past participle, as after `once you have`.

    Returns:
        The coverage.
    """
    cover = _Cover(entry, words, knows_pronoun=knows_pronoun, is_perfect=is_perfect)
    cover.run()
    return cover.result()


class _CoveredWords:
    """What a pass over the words has covered so far."""

    def __init__(self, entry: TaskPhrases, words: Words, *, knows_pronoun: bool, is_perfect: bool) -> None:
        self._entry = entry
        self._words = words
        self._knows_pronoun = knows_pronoun
        self._is_perfect = is_perfect
        self._triggers: list[Words] = []
        self._objects: list[Words] = []
        self._unknown: list[str] = []
        self._counts: list[str] = []
        self._repetitions: list[str] = []
        self._stated = StatedValues(entry.routed.task)
        self._starts_with_object = False
        self._prepositions: list[str] = []
        self._is_order = False
        self._partial: list[str] = []
        self._names_all = False
        self._has_extras = False
        self._describes_place = False
        self._names_origin = False
        self._last: object = None

    def result(self) -> Coverage:
        """Return the coverage after `run`."""
        if not self._stated.names_part:
            self._unknown += self._prepositions
        if self._names_all:
            self._unknown += self._partial  # `sort some bolts`: not all of them
        return Coverage(
            self._entry,
            tuple(self._triggers),
            tuple(self._objects),
            tuple(self._unknown),
            tuple(self._counts),
            tuple(self._repetitions),
            self._stated,
            self._starts_with_object,
            self._describes_place,
            not english.DIRECTIONS.isdisjoint(self._words),
            not english.DETERMINERS.isdisjoint(self._words),
            self._is_order,
            self._words[-1:] == ("here",),
            self._has_extras,
            self._names_origin,
        )

    def _add_object(self, words: Words) -> None:
        has_act = any(one[0] not in SPEAKERS for one in self._triggers)
        self._starts_with_object = self._starts_with_object or not has_act
        self._names_all = self._names_all or words in plural_objects(self._entry)
        self._objects.append(words)
        self._last = self._objects

    def _stated_part(self, parameter: str) -> bool:
        return StatedValues(self._stated.task, {parameter: frozenset()}).names_part


class _Cover(_CoveredWords):
    """One pass over the words, from the left. Each step returns how many words it has covered."""

    def run(self) -> None:
        """Cover all words."""
        steps: tuple[Callable[[int], int], ...] = (
            self._declared,
            self._label,
            self._possessive,
            self._pronoun,
            self._extent_of_pronoun,
            self._beneficiary,
            self._number,
            self._universal,
            partial(_extent, self._entry, self._words),
            self._unstressed,
            self._preposition,
        )
        at, words = 0, self._words
        while at < len(words):
            is_body = words[at] in english.BODY and words[max(at - 1, 0)] in _ARTICLES  # `your hand`
            covered = 0 if is_body else next((covered for step in steps if (covered := step(at))), 0)
            if not covered:
                self._unknown.append(words[at])
            at += covered or 1

    def _declared(self, at: int) -> int:
        """Cover the longest phrase of the task, or of a value of its parameters."""
        words = self._words
        found, length = self._entry.longest(words, at, is_perfect=self._is_perfect)
        value = self._entry.value_phrase(words, at, more_than=length - 1, is_perfect=self._is_perfect)
        is_preposition = length == 1 and found is self._entry.extras and words[at] in english.TO_PLACES
        if is_preposition and not _leads(self._entry, words, at):
            found, length = (), 0
        is_body = value is not None and value.words[-1] in english.BODY and words[at - 1 : at] in _OWN
        if value is not None and words[at] in _SIDES and _is_no_side(words, at, value, self._triggers):
            return 0
        if is_body:
            return 0  # `in your left hand`
        if value is not None:
            self._stated.add(value)
            length = len(value.words)
            if value.names_object:
                self._add_object(words[at : at + length])
            if value.is_place:
                # `the left spot`
                length += at + length < len(words) and words[at + length] in english.PLACE_NOUNS
                self._note_description(at, at + length, value)
            return length
        spoken = words[at : at + length]
        if length and found is self._entry.triggers:
            self._triggers.append(spoken)
            # `the cleaning procedure`
            is_named = at + length < len(words) and words[at + length] in english.ACT_NOUNS
            length += is_named
            is_for = is_named and words[at + length : at + length + 1] in _ABOUT
            length += is_for  # `the cleaning procedure for the table`
            self._last = self._triggers
        elif length and found is self._entry.objects:
            self._add_object(spoken)
        elif length and self._wants_to_act(at):
            return 0
        elif length:
            self._last = self._entry.extras
            self._has_extras = self._has_extras or spoken[0] in _STARTS_PLACE
            self._names_origin = self._names_origin or _is_origin(self._entry, spoken)
        return length

    def _wants_to_act(self, at: int) -> bool:
        """Return True at the `to` of `i want to fetch it` and `prepare to fetch it`: nobody fetches yet."""
        is_behind_verb = self._last is self._triggers and bool(self._triggers)
        follows = self._entry.longest(self._words, at + 1)[0] is self._entry.triggers
        return self._words[at] == "to" and is_behind_verb and follows

    def _note_description(self, at: int, end: int, value: ValuePhrase) -> None:
        """Note if a place may only say which object: `the left can`, `the can on the left`."""
        words = self._words
        default = self._stated.task.parameters[value.parameter].default
        before = _before(words, at - 1, english.DETERMINERS)
        following = self._entry.value_phrase(words, end)
        is_of_object = following is not None and not following.is_place
        is_of_object = is_of_object or self._entry.longest(words, end)[0] is self._entry.objects
        if _says_which_one(self._entry, value):
            return
        is_bare = before == at - 1 == end - 2 and (at == 0 or words[before] not in english.TO_PLACES)
        if (before < at - 1 or is_bare) and is_of_object:
            self._stated.fault = f"{quoted(words[at])} may say which one, or where to"
        elif value.values == {default}:
            return
        elif before >= 0 and words[before] in english.POSITIONS and not value.names_object:
            is_of_place = self._entry.longest(words, end)[0] is self._entry.extras
            self._describes_place = self._describes_place or not is_of_place

    def _label(self, at: int) -> int:
        """Cover the name of a parameter before its value: `region left`, `quantity 2`."""
        words = self._words
        following = self._entry.value_phrase(words, at + 1)
        if following is not None:
            is_name = words[at] == following.parameter
            return int(is_name or (following.is_place and words[at] in english.PLACE_NOUNS))
        counted = counted_parameter(self._entry.routed.task)
        at_number = at if counted is None else _labelled_number(words, at, counted.name)
        if at_number > at:
            self._stated.add_number(words[at_number], english.number_of(words[at_number]) or 0)
            self._is_order = True
            return at_number + 1 - at
        return 0

    def _possessive(self, at: int) -> int:
        """Cover `s` and `its` before a part of the object: `the table's left half`."""
        following = self._entry.value_phrase(self._words, at + 1)
        if following is None or not following.is_place:
            return 0
        is_relative = any(map(is_object, self._entry.routed.task.parameters.values()))
        if is_relative and self._words[at] != "s":
            return 0  # `put the cup to its left`: to the left of what was named before
        is_of_thing = self._words[at] == "s" and self._last in (self._objects, self._entry.extras)
        is_known = self._knows_pronoun or bool(self._objects)
        return int(is_of_thing or (self._words[at] in ("its", "their") and is_known))

    def _pronoun(self, at: int) -> int:
        word = self._words[at]
        part = self._words[at + 1 : at + 2]
        is_that_part = word in ("that", "this") and part and part[0] in english.PART_PRONOUNS
        if is_that_part and (self._knows_pronoun or self._stated.names_part):
            self._add_object((word, *part))
            return 2
        # A task without objects acts on one thing only.
        # In `the table, please clean it`, too, it can only mean that.
        # `the left half of it` says of nothing that it is a half.
        is_of_it = self._words[at - 1 : at] == ("of",) and self._stated.names_part and len(self._objects) == 1
        is_known = self._knows_pronoun or (bool(self._objects) and not is_of_it)
        if word in english.PRONOUNS and (is_known or not self._entry.objects):
            self._add_object((word,))
            return 1
        whole = english.WHOLE_PRONOUNS.starting(self._words, at)
        if whole and self._knows_pronoun:
            self._add_object(whole)
            return len(whole)
        if word == "there" and self._knows_pronoun:
            return 1
        if word in self._entry.particles and self._triggers and self._objects:
            # Apart from its verb, as in `tidy the table up`; `to the back` is a place.
            verbs = {
                form
                for one in self._triggers
                for form in english.base_forms(one[0]) | english.participle_bases(one[0])
            }
            is_of_verb = any((verb, word) in self._entry.triggers for verb in verbs)
            return int(is_of_verb and self._words[at - 1] not in english.DETERMINERS)
        return 0

    def _extent_of_pronoun(self, at: int) -> int:
        """Cover `every bit of` before `it`."""
        found = english.EXTENTS.starting(self._words, at)
        is_of_it = found[-1:] == ("of",) and self._words[at + len(found) :][:1] == ("it",)
        return len(found) if is_of_it and (self._knows_pronoun or self._objects) else 0

    def _beneficiary(self, at: int) -> int:
        """Cover who gets it, directly behind the verb: `make him a tea`."""
        found = english.BENEFICIARIES.starting(self._words, at)
        is_behind_verb = self._last is self._triggers and bool(self._triggers)
        return len(found) if is_behind_verb and at + len(found) < len(self._words) else 0

    def _number(self, at: int) -> int:
        """Cover numbers and words that ask for several times."""
        words, entry = self._words, self._entry
        if words[at] in english.REPETITIONS:
            self._repetitions.append(words[at])
            return 1
        is_times = words[at][:1] == "x" and words[at][1:].isdigit()
        self._is_order = self._is_order or is_times
        number = english.number_of(words[at][1:] if is_times else words[at])
        if number is None:
            return 0
        noun = _noun_after_number(words, at)
        nouns = entry.objects or entry.triggers
        is_of_noun = entry.longest(words, noun, is_perfect=self._is_perfect)[0] is nouns
        following = entry.value_phrase(words, noun)
        is_of_thing = is_of_noun or (following is not None and following.names_object)
        is_behind = self._last is self._objects and bool(self._objects)
        # `teas, two of them`
        of_them = 2 if words[at + 1 : at + 3] == ("of", "them") and self._objects else 0
        is_head = self._knows_pronoun and self._last is self._triggers and not self._objects
        counted = counted_parameter(entry.routed.task)
        # `one of the bolts` is not all of them.
        is_number = number != 1 or bool(plural_objects(entry))
        if is_of_noun or is_behind or of_them or is_head:
            if counted is not None:
                self._stated.add_number(words[at].removeprefix("x"), number)
            elif is_number or not (is_of_thing or is_head):
                self._counts.append(words[at])
            if is_head and not is_of_noun:
                self._add_object(ONE)
        elif is_number or not is_of_thing:
            self._counts.append(words[at])
        has_of = is_of_noun and words[at + 1 : at + 2] == ("of",)
        return 1 + of_them + has_of

    def _universal(self, at: int) -> int:
        """Cover a word for all of a kind with its noun: `all of the bolts`, `every bolt`."""
        if noun := universal_noun(self._entry, self._words, at):
            self._stated.add_all(self._words[at])
            self._add_object(self._words[noun.start : noun.stop])
            self._names_all = True
        return noun.stop - at if noun else 0

    def _unstressed(self, at: int) -> int:
        word = self._words[at]
        following = self._words[at + 1 : at + 2]
        if word == "some" and following == ("of",):
            return 0  # `clean some of it`
        if word in _LOOSE_PARTICLES and english.number_of("".join(following)) is not None:
            return 0  # `over two`
        if word == "too" and self._entry.longest(self._words, at + 1)[0] is self._entry.objects:
            return 0  # `make too teas`, by sound
        if word in _BEFORE_NOUNS and english.DETERMINERS.issuperset(self._words[at:]):
            return 0  # `clean it a little`
        if word in english.FILLERS or word in english.DETERMINERS:
            self._partial += [word] if word in english.PARTIAL_DETERMINERS else []
            return 1
        is_given_up = self._words[at - 1 : at] == ("give",)
        if (
            word in _LOOSE_PARTICLES
            and not is_given_up
            and (self._last is self._triggers or at + 1 == len(self._words))
        ):
            return 1
        if word == "of" and self._triggers and self._last is self._triggers:
            return 1  # `delivery of the can`
        if word == "to" and self._last is self._entry.extras:
            # `use the brush to sweep it`
            return int(self._entry.longest(self._words, at + 1)[0] is self._entry.triggers)
        return 0

    def _preposition(self, at: int) -> int:
        """Cover a preposition before a part or before the whole of a part: `on the table, the left half`."""
        words = self._words
        if words[at] not in english.PART_PREPOSITIONS:
            return 0
        end = _after(words, at + 1, english.DETERMINERS | english.POSSESSIVES)
        value = self._entry.value_phrase(words, end)
        if value is not None and self._stated_part(value.parameter):
            return 1
        if self._entry.longest(words, end)[0] is self._entry.objects:
            self._prepositions.append(words[at])
            return 1
        return 0


def _is_no_side(words: Words, at: int, value: ValuePhrase, triggers: Collection[Words]) -> bool:
    """Return True for `right now`, `left over`, `my left`, `right side up` and the end of `wipe it right`."""
    before = words[at - 1 : at]
    if words[at : at + 3] == _UPRIGHT or before in _OF_SPEAKERS:
        return True
    if len(value.words) > 1:
        return False
    verbs = {form for one in triggers for form in english.base_forms(one[0])}
    is_put = not verbs or not english.PUTTING_VERBS.isdisjoint(verbs)
    is_named = before[:1] and before[0] in english.TO_PLACES | english.DETERMINERS | english.PLACE_NOUNS
    # `wipe the table right`
    is_manner = at + 1 == len(words) and words[at] == "right" and not is_put and not is_named
    following = words[at + 1 : at + 2]
    is_emphasis = not is_named and not _EMPHASIZED.isdisjoint(following)  # `put it right up there`
    return is_manner or is_emphasis or following in _NO_SIDE


def _leads(entry: TaskPhrases, words: Words, at: int) -> bool:
    """Return True if a preposition leads to something: `on the left`, and not the one of `pick on it`."""
    end = _after(words, at + 1, english.DETERMINERS | english.POSSESSIVES | english.POSITIONS)
    value = entry.value_phrase(words, end)
    if value is not None and not value.names_object:
        return True
    found = entry.longest(words, end)[0]
    acts_on_one = not any(map(is_object, entry.routed.task.parameters.values()))
    is_of_it = found is entry.objects and acts_on_one  # `do a clean on the table`
    is_of_act = found is entry.triggers and words[at] == "to"
    return is_of_it or is_of_act or found is entry.extras


def _labelled_number(words: Words, at: int, name: str) -> int:
    """Return the place of the number behind a parameter's name, as in `with a quantity of two`; else `at`."""
    begin = at + (words[at] in ("with", "in", "a"))
    begin += begin > at and words[begin : begin + 1] == ("a",)
    if not words[begin : begin + 1] or words[begin] not in english.COUNT_NOUNS | {name}:
        return at
    found = begin + 1 + (words[begin + 1 : begin + 2] == ("of",))
    if words[begin] == "number" and found == begin + 1:
        return at  # `tea number two` is the second
    return found if found < len(words) and english.number_of(words[found]) is not None else at


def _noun_after_number(words: Words, at: int) -> int:
    """Return the place of the noun behind a number, as in `two of those teas`."""
    return _after(words, at + 1 + (words[at + 1 : at + 2] == ("of",)), english.DETERMINERS)


def _before(words: Words, at: int, skipped: Collection[str]) -> int:
    """Return the last place up to `at` whose word is none of some words; -1 if there is none."""
    while at >= 0 and words[at] in skipped:
        at -= 1
    return at


def _after(words: Words, at: int, skipped: Collection[str]) -> int:
    """Return the first place from `at` on whose word is none of some words."""
    while at < len(words) and words[at] in skipped:
        at += 1
    return at


def _is_origin(entry: TaskPhrases, extra: Words) -> bool:
    """Return True for `on the shelf` if the task knows `from the shelf`: it is where the thing is."""
    place = _without_articles(extra)
    origins = [_without_articles(one[1:]) for one in entry.extras if one[:1] == ("from",)]
    return place[:1] in _AT and (place in origins or place[1:] in origins)


def _without_articles(words: Words) -> Words:
    return tuple(word for word in words if word not in _ARTICLES)


_AT: Final = (("at",), ("atop",), ("in",), ("on",))
_OWN: Final = (("my",), ("your",))
_STARTS_PLACE: Final = english.TO_PLACES | {"across", "back", "here", "over", "the", "there", "where"}


def _says_which_one(entry: TaskPhrases, value: ValuePhrase) -> bool:
    """Return True at no place, as `the yellow jar`, and if the parameter has the object's name, `jar`."""
    if english.PLACE_WORDS.isdisjoint(value.words):
        return True
    named = set(value.parameter.split("_"))
    return any(named.issuperset(noun) for noun in entry.objects if noun)


def _extent(entry: TaskPhrases, words: Words, at: int) -> int:
    """Cover `all of` before one thing, and what a task changes before its object: `the dirty table`."""
    found = english.EXTENTS.starting(words, at)
    if found and words[at + len(found) : at + len(found) + 1] in [(one[0],) for one in plural_objects(entry)]:
        return 0  # `the full bins` are some of them
    end = _after(words, at + len(found), english.DETERMINERS)
    if found:
        phrases, length = entry.longest(words, end)
        is_one = phrases is entry.objects and words[end : end + length] in phrases
        value = entry.value_phrase(words, end)
        return len(found) if is_one or (value is not None and value.is_place) else 0
    if words[at] in entry.states:
        after = at + 1 + (words[at + 1 : at + 2] == ("and",))
        phrases, _ = entry.longest(words, after)
        return int(phrases is entry.objects or words[after : after + 1] in [(word,) for word in entry.states])
    return 0
