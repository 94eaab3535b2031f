"""Sentences in other words, before they are split: time clauses, passives that prohibit, inversions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.segments import COMMA
from aeros.agent.instructions.sentences.clauses import strip_closers, strip_openers
from aeros.agent.instructions.sentences.relatives import without_relatives
from aeros.agent.instructions.sentences.shares import without_shares

_TIMES: Final = frozenset({"once", "after", "when"})
_SPEAKERS: Final = (("i",), ("we",), ("you",), ("they",))
_PRONOUNS: Final = (("it",), ("them",))
_DONE: Final = frozenset({"done", "finished", "complete", "completed", "over", "through"})
_PLACED: Final = frozenset(
    {"at", "by", "for", "here", "in", "into", "on", "onto", "over", "there", "to", "with"}
)
"""Words that say where something is to be left."""

_WANTED: Final = frozenset({"needed", "required", "necessary", "wanted"})
_PERFECT: Final[Words] = ("once", "you", "have")


def with_subject(tokens: Words) -> Words:
    """Write `clean the table, is very dirty` as `…, it is very dirty`, and `must clean it` as `you must …`.

    Args:
        tokens: words and commas of a sentence that is no question.

    Returns:
        The sentence, with the subject that was left out.
    """
    for at in range(-1, len(tokens) - 2):
        starts = at < 0 or tokens[at] == COMMA
        if at < 0 and tokens[:2] == ("would", "be"):
            return ("it", *tokens)
        if starts and tokens[at + 1] == "must" and tokens[at + 2] not in _AFTER_VERB:
            return (*tokens[: at + 1], "you", *tokens[at + 1 :])
        if at > 0 and starts and tokens[at + 1] == "is" and tokens[at + 2] not in _AFTER_VERB:
            return (*tokens[: at + 1], "it", *tokens[at + 1 :])
    return tokens


def rephrased(tokens: Words) -> Words:
    """Write a sentence in the words that the grammar knows.

    Args:
        tokens: words and commas of a sentence.

    Returns:
        The sentence, without `both`; with `once you have` before an act that is to be over, and
        with `do not` before one that is prohibited.
    """
    for rewrite in _REWRITES:
        tokens = rewrite(tokens)
    return tokens


def _with_plain_extents(tokens: Words) -> Words:
    """Write `nothing but it`, `both halves of it` and `right in the` as `only it`, `all of it`, `in the`."""
    for at in range(1, len(tokens) - 1):
        if tokens[at] == "first" and tokens[at + 1] == "the" and tokens[at - 1] in english.MOVING_VERBS:
            return (*tokens[:at], *tokens[at + 1 :])  # `bring first the can, then …`
        if tokens[at : at + 2] == ("nothing", "but"):
            return (*tokens[:at], "only", *tokens[at + 2 :])
        if tokens[at] == "but" and tokens[at + 1] in _ARTICLES and _names_all(tokens[:at]):
            return (*tokens[:at], "except", *tokens[at + 1 :])  # `everything but the can`
        if tokens[at] == "right" and tokens[at + 1 : at + 3] in _RIGHT_AT and tokens[at - 1] not in _ARTICLES:
            return (*tokens[:at], *tokens[at + 1 :])
        is_piece = tokens[at] in ("piece", "pieces") and tokens[at + 1] == "of"
        if is_piece and english.number_of(tokens[at - 1]) is not None:
            return (*tokens[:at], *tokens[at + 2 :])  # `two pieces of cake`
        number = tokens[at + 2 : at + 3] if tokens[at] == "but" and tokens[at + 1] in _ONLY else ()
        if number and english.number_of(number[0]) is not None and tokens[at + 3 : at + 4] in ((), (COMMA,)):
            return (*tokens[:at], *tokens[at + 2 :])  # `make teas, but only one`
        if tokens[at : at + 3] == ("both", "halves", "of"):
            return (*tokens[:at], "all", *tokens[at + 2 :])
    return tokens


def _names_all(tokens: Words) -> bool:
    """Return True for words that end with `everything`, `all of the objects`, `each object` or the like."""
    if tokens[-1] in _THINGS:
        return True
    at = len(tokens) - 2
    while at > 0 and tokens[at] in _ARTICLES | {"of"}:
        at -= 1
    return at >= 0 and tokens[at] in _ALL


_ALL: Final = english.EACH_DETERMINERS | {"all", "both"}
_THINGS: Final = frozenset({"all", "everything", *(f"{noun}s" for noun in english.THING_NOUNS)})
_ARTICLES: Final = english.DETERMINERS | english.POSSESSIVES
_AFTER_VERB: Final = _ARTICLES | english.PRONOUNS | {"there", "anybody", "anyone", "not", "no"}
"""Words behind `is` in a question; after others the subject was left out."""
_ONLY: Final = frozenset({"just", "only"})
_RIGHT_AT: Final = frozenset((word, "the") for word in ("at", "in", "into", "on", "onto"))


def _with_speaker(tokens: Words) -> Words:
    """Write `need two teas` as `i need two teas`."""
    return ("i", *tokens) if tokens[:1] == ("need",) else tokens


def _without_both(tokens: Words) -> Words:
    """Leave out `both` before two things, and write it as `them` where it is a pronoun: `put both down`."""
    for at, word in enumerate(tokens):
        following = tokens[at + 1 : at + 2]
        is_last = following in ((), (COMMA,)) or not english.TO_PLACES.isdisjoint(following)
        is_object = at > 0 and tokens[at - 1] not in _ARTICLES | english.PRONOUNS | {COMMA, "and"}
        if word == "both" and is_object and is_last and "and" not in tokens[at:]:
            return (*tokens[:at], "them", *tokens[at + 1 :])
    for at, word in enumerate(tokens[:-1]):
        if word == "both" and tokens[at + 1] in english.DETERMINERS and "and" in tokens[at:]:
            return tokens[:at] + tokens[at + 1 :]
        # `bring both of them: the can and the block`
        end = at + (3 if tokens[at + 1 : at + 3] == ("of", "them") else 1)
        if word == "both" and tokens[end : end + 1] == (COMMA,) and "and" in tokens[end:]:
            return tokens[:at] + tokens[end + 1 :]
    return tokens


def _with_plain_wish(tokens: Words) -> Words:
    """Write `it is the can that I want` as `I want the can`."""
    wish = next((tokens[at:] for at in range(3, len(tokens)) if tokens[at:] in english.RELATIVES), ())
    is_cleft = bool(wish) and tokens[0] == "it" and tokens[1] in english.BE and COMMA not in tokens
    if not is_cleft or wish[-1] not in _WISHED:
        return tokens
    return ("i", "want", *tokens[2 : len(tokens) - len(wish)])


def _with_preference(tokens: Words) -> Words:
    """Write `I would rather have the can than the cup` as `I want the can rather than the cup`."""
    for at in range(len(tokens) - 4):
        if tokens[at] in ("i", "we") and tokens[at + 1 : at + 4] in _RATHER:
            rest = tuple(token for word in tokens[at + 4 :] for token in _THAN.get(word, (word,)))
            return (*tokens[: at + 1], "want", *rest)
    return tokens


_RATHER: Final = tuple(
    (would, "rather", have) for would in ("would", "d") for have in ("have", "get", "take")
)
_THAN: Final = {"than": ("rather", "than")}


def _with_number_before_noun(tokens: Words) -> Words:
    """Write `make teas until there are two` as `make two teas`: a request ends when its goal is reached."""
    for at in range(2, len(tokens) - 3):
        if tokens[at] != "until" or not english.is_plural(tokens[at - 1]):
            continue
        begin = at + (4 if tokens[at + 2 : at + 4] == ("have", "got") else 3)
        end = begin + (3 if tokens[begin + 1 : begin + 3] == ("of", "them") else 1)
        number = tokens[begin : begin + 1]
        is_reached = tokens[at + 1 : at + 3] in _REACHED and tokens[end : end + 1] in ((), (COMMA,))
        has_number = any(english.number_of(word) is not None for word in tokens[:at])
        if is_reached and not has_number and english.number_of("".join(number)) is not None:
            return (*tokens[: at - 1], *number, tokens[at - 1], *tokens[end:])
    return tokens


_REACHED: Final = (("there", "are"), *((one, have) for one in ("i", "we", "you") for have in ("have", "ve")))


_WISHED: Final = frozenset({"want", "need", "like", "for"})


def _with_put(tokens: Words) -> Words:
    """Write `take the can and leave it on the left` as `take the can and put it on the left`.

    Only after an act that moves it: `the can is fine, leave it on the left` asks for nothing.
    """
    is_moved = english.MOVING_VERBS.issuperset(strip_openers(tokens)[:1])
    for at in range(2, len(tokens) - 3 if is_moved else 0):
        link = english.SEQUENCE.ending(tokens[:at])
        is_placed = tokens[at + 1 : at + 2] in _PRONOUNS and tokens[at + 2] in english.POSITIONS
        if tokens[at] == "leave" and link and is_placed:
            return (*tokens[:at], "put", *tokens[at + 1 :])
    return tokens


def _with_duty_of_each(tokens: Words) -> Words:
    """Write `the can and the block should be brought` as `the can should be brought and the block …`."""
    for at in range(3, len(tokens)):
        subjects = tokens[:at]
        if not english.DUTIES.starting(tokens, at) or COMMA in subjects or subjects.count("and") != 1:
            continue
        joint = subjects.index("and")
        both = subjects[:joint], subjects[joint + 1 :]
        if all(one and one[0] in english.DETERMINERS and len(one) <= _MAX_THING_WORDS for one in both):
            return (*both[0], *tokens[at:], "and", *both[1], *tokens[at:])
    return tokens


def _without_preparation(tokens: Words) -> Words:
    """Write `find the can and bring it here` as `bring the can here`: the robot finds it in any case.

    `go to the shelf, find the cup and bring it here` is `bring the cup from the shelf here`.
    """
    at = 0
    while not (found := english.PREPARATIONS.starting(tokens, at)):
        opener = english.OPENERS.starting(tokens, at)
        if not opener:
            return tokens
        at += len(opener)
    thing, rest = _thing_before_joint(tokens[at + len(found) :])
    if found[-1] in english.DIRECTIONS and (further := english.PREPARATIONS.starting(rest)):
        place = thing
        thing, rest = _thing_before_joint(rest[len(further) :])
        thing = (*thing, "from", *place)
    its = [to for to, word in enumerate(rest) if word in ("it", "them")]
    if not its or its[0] > _MAX_VERB_WORDS or not 1 <= len(thing) <= _MAX_PLACED_WORDS:
        return tokens
    if not english.TO_PLACES.isdisjoint(thing) and not english.PLACE_WORDS.isdisjoint(thing):
        return tokens  # `find the can on the left and bring it`: which one, or where to?
    return tokens[:at] + rest[: its[0]] + thing + rest[its[0] + 1 :]


def _thing_before_joint(tokens: Words) -> tuple[Words, Words]:
    """Return the words up to a pause, `and` or `then`, and those after it."""
    end = next((to for to in range(len(tokens)) if tokens[to] in _JOINTS), len(tokens))
    rest = tokens[end:]
    while rest and rest[0] in _JOINTS:
        rest = rest[1:]
    return tokens[:end], rest


_JOINTS: Final = frozenset({COMMA, "and", "then"})
_MAX_VERB_WORDS: Final = 2
"""Limit on the words before `it` in what is done with a thing: `put down`."""
_MAX_THING_WORDS: Final = 4
_MAX_PLACED_WORDS: Final = 7
"""Limit on the words of a thing with the place where it is: `the red cup from the first shelf`."""


def _without_all(tokens: Words) -> Words:
    """Write `clear it all up`, `clear all of it` and `move them both` as `clear it up` and `move them`."""
    for at, word in enumerate(tokens):
        is_all = word == "all" or (word == "both" and "and" in tokens[:at])
        if is_all and tokens[at - 1 : at] in _PRONOUNS and at:
            return tokens[:at] + tokens[at + 1 :]
        is_of = word in ("all", "each") and tokens[at + 1 : at + 2] == ("of",)
        if is_of and tokens[at + 2 : at + 3] in _PRONOUNS:
            return tokens[:at] + tokens[at + 2 :]
    return tokens


def _with_perfect(tokens: Words) -> Words:
    """Rewrite `once the table is wiped`, `when the wiping of the table is done`, `when done with wiping`."""
    for at, word in enumerate(tokens):
        as_soon_as = tokens[at : at + 3] == ("as", "soon", "as")
        if word not in _TIMES and not as_soon_as:
            continue
        begin = at + (3 if as_soon_as else 1)
        end = next((to for to in range(begin, len(tokens)) if tokens[to] == COMMA), len(tokens))
        clause = tokens[begin:end]
        act = _finished_act(clause, is_state=word == "when")
        if act:
            return tokens[:at] + _PERFECT + act + tokens[end:]
    return tokens


def _finished_act(clause: Words, *, is_state: bool) -> Words:
    """Return the words of the act that a clause says to be over; empty if it says nothing like that.

    `is_state` is True after `when`: `when the table is wiped` may be about what somebody else does. After a
    negation nothing is over.
    """
    if not english.NEGATIVES.isdisjoint(clause):
        return ()
    if clause[:2] in (("you", "are"), ("you", "re")) and clause[2:3] and clause[2] in _DONE:
        rest = clause[4:] if clause[3:4] == ("with",) else clause[3:]
        # `when you are done with that` names no act.
        is_act = clause[3:4] == ("with",) or (rest[:1] and english.is_gerund(rest[0]))
        return rest if is_act and not (rest[:1] and rest[0] in english.PRONOUNS) else ()
    if clause[:1] and clause[0] in _DONE and clause[1:2] == ("with",):
        return clause[2:]
    has_done = clause[:2] in (("you", "have"), ("you", "ve")) and clause[2:3] and clause[2] in _DONE
    if has_done and not is_state and clause[3:4] and clause[3] in english.DETERMINERS:
        return ("done", *clause[3:])  # `once you have finished the teas`
    for at in range(1, len(clause) - 1):
        if clause[at] in english.BE | {"has", "have"}:
            last = clause[-1]
            act = clause[:at]
            if last in _DONE and len(clause) <= at + 3:
                return act if any(english.is_gerund(word) for word in act) else ()
            if english.participle_bases(last) and len(clause) <= at + 3 and not is_state:
                return (*act, last)
            return ()
    return ()


def _with_prohibitions(tokens: Words) -> Words:
    """Rewrite `the table must not be cleaned` and `leave the table alone` as prohibitions of its cleaning."""
    found: Words = ()
    before: Words = ()
    begin = at = 0
    is_closed = False
    while at < len(tokens):
        link = english.SEQUENCE.starting(tokens, at) or (tokens[at : at + 1] if tokens[at] == COMMA else ())
        if link:
            clause = _prohibition(tokens[begin:at], before, found)
            is_closed = clause[:1] == ("without",) != tokens[begin : begin + 1] or (is_closed and not clause)
            # What is left alone ends before `and`: no second thing is prohibited.
            found += clause + (link if not is_closed or link != ("and",) else (COMMA,) if clause else ())
            # `…, and` parts more than `and`
            before = before if (*before, *link) == (COMMA, "and") and at == begin else link
            begin = at + len(link)
        at += len(link) or 1
    return found + _prohibition(tokens[begin:], before, found)


def _prohibition(clause: Words, link: Words, earlier: Words) -> Words:
    # `fetch it before wiping the table is forbidden` may forbid both
    may_be_of_both = bool(link) and link[-1] not in (COMMA, "and", "but", "then")
    for at in range(1, len(clause) if clause[:1] not in _SPEAKERS and not may_be_of_both else 0):
        duty = english.NEGATIVE_DUTIES.starting(clause, at)
        if duty and not (link and "be" not in duty and _may_forbid_more(clause, link, earlier)):
            return ("do", "not", *clause[:at], *clause[at + len(duty) :])
    if clause[:1] == ("no",) and clause[-2:-1] in (("is",), ("are",)) and clause[-1] in _WANTED:
        return clause[:-2]  # `no teas are needed`
    opener: Words = ()
    while found := english.OPENERS.starting(clause, len(opener)):
        opener += found
    rest = strip_closers(clause[len(opener) :])
    end = english.LEFT_ALONE.ending(rest) if rest[:1] in (("leave",), ("let",), ("keep",)) else ()
    if not end and rest[:1] == ("leave",) and not _PLACED.intersection(rest):
        return ("without", *rest[1:])  # `leave the left half`
    if end and len(rest) > 1 + len(end):
        # As after `without`, the prohibition ends here.
        return ("without", *rest[1 : -len(end)])
    return clause


def _may_forbid_more(clause: Words, link: Words, earlier: Words) -> bool:
    """Return True for `the cup is forbidden` of `fetch the can and the cup is forbidden`.

    Only after a pause, a subject of its own can begin, and none that goes on with a list of acts.
    """
    is_act = english.is_act_noun(clause[0])
    is_thing = is_act or clause[0] in _ARTICLES or english.is_plural(clause[0])
    is_listed = is_act and earlier[:1] != () and english.is_act_noun(earlier[0])
    return link[-1] not in (COMMA, "but") or not is_thing or is_listed


_REWRITES: Final[tuple[Callable[[Words], Words], ...]] = (
    _with_plain_extents,
    without_shares,
    _with_plain_wish,
    _with_preference,
    _with_number_before_noun,
    without_relatives,
    _with_put,
    _with_speaker,
    _without_both,
    _without_preparation,
    _with_duty_of_each,
    _without_all,
    _with_perfect,
    _with_prohibitions,
)
"""Rewrites of a sentence, in the order in which they are made."""
