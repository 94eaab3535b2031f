"""Closed classes of English words that an instruction may use around the phrases that modules declare.

Every other word of an instruction must be declared by the task that it asks for; otherwise the instruction is
refused. So the lists of `english.toml` may be short: a missing word costs a refusal, and never a motion.
"""

from __future__ import annotations

import re
import tomllib
from importlib.resources import files
from typing import Any, Final

from aeros.agent.instructions.phrases import PhraseSet, Words

_DATA: Final[dict[str, Any]] = tomllib.loads(
    files(__package__).joinpath("english.toml").read_text(encoding="utf-8")
)


def _words(name: str) -> frozenset[str]:
    return frozenset(_DATA[name])


def _phrases(*names: str) -> PhraseSet:
    return PhraseSet((text for name in names for text in _DATA[name]), _DATA["classes"], BARRED)


_BARRING: Final = (
    "choices",
    "desires",
    "determiners",
    "modals",
    "negatives",
    "no_statements",
    "numbers",
    "pronouns",
    "repetitions",
    "retractions",
    "turns",
)
BARRED: Final = frozenset({",", ":", "then", *(word for name in _BARRING for word in _DATA[name])})
"""Words that no free part of a phrase has."""


_OTHER_WORDS: Final = ("no_slips", "place_words", "turning_words")
"""Lists of words that instructions do not use, and that are no typing slips."""

# The comments in `english.toml` describe each list.
DETERMINERS: Final = _words("determiners")
PARTIAL_DETERMINERS: Final = _words("partial_determiners")
EACH_DETERMINERS: Final = _words("each_determiners")
FILLERS: Final = _words("fillers")
HEDGES: Final = _words("hedges")
DEGREES: Final = _words("degrees")
HESITATIONS: Final = _words("hesitations")
ASIDES: Final = _phrases("asides")
CORRECTIONS: Final = _phrases("corrections")
WEAK_CORRECTIONS: Final = _phrases("weak_corrections")
VALUE_CORRECTIONS: Final = _phrases("value_corrections")
PRONOUNS: Final = _words("pronouns")
PART_PRONOUNS: Final = _words("part_pronouns")
WHOLE_PRONOUNS: Final = _phrases("whole_pronouns")
COUNTED_WISHES: Final = _phrases("counted_wishes")
PREPARATIONS: Final = _phrases("preparations")
NEGATIVES: Final = _words("negatives")
UNIVERSAL: Final = _words("universal")
QUESTIONS: Final = _words("questions")
CHOICES: Final = _words("choices")
REPETITIONS: Final = _words("repetitions")
OPENERS: Final = _phrases("openers", "past_openers", "remarks")
SENTENCE_OPENERS: Final = _phrases("sentence_openers")
CLOSERS: Final = _phrases("closers", "remarks")
GROUPS: Final = _words("groups")
DEADLINES: Final = _phrases("deadlines")
IN_ANY_CASE: Final = _phrases("in_any_case")
SEQUENCE: Final = _phrases("sequence")
REVERSED: Final = _phrases("reversed")
PROHIBITIONS: Final = _phrases("prohibitions")
CONDITIONALS: Final = _phrases("conditionals")
CONCESSIONS: Final = _phrases("concessions")
DURATIONS: Final = _phrases("durations")
FINDINGS: Final = _phrases("findings")
TIME_CONDITIONALS: Final = _phrases("time_conditionals")
NEW_REQUEST: Final = _phrases("new_request")
PERFECT: Final = _phrases("perfect")
ABILITY: Final = _phrases("ability")
LEADING: Final = _phrases("leading")
LABELS: Final = _phrases("labels")
GREETINGS: Final = _phrases("greetings")
WISHES: Final = _phrases("wishes")
WISH_ENDS: Final = _phrases("wish_ends")
CAUSATIVES: Final = _phrases("causatives")
COPULAS: Final = _phrases("copulas")
DUTIES: Final = _phrases("duties")
MOVES: Final = _phrases("moves")
NEGATIVE_DUTIES: Final = _phrases("negative_duties")
LEFT_ALONE: Final = _phrases("left_alone")
ADJECTIVES: Final = _words("adjectives")
INTENSIFIERS: Final = _words("intensifiers")
PARTICLES: Final = _words("particles")
REASONS: Final = _phrases("reasons")
TURNS: Final = _words("turns")
PLACES: Final = _words("places")
SUBJECTS: Final = _words("subjects")
PAST_OPENERS: Final = _phrases("past_openers")
PLACE_NOUNS: Final = _words("place_nouns")
ACT_NOUNS: Final = _words("act_nouns")
ACT_MARKERS: Final = _words("act_markers")
THING_NOUNS: Final = _words("thing_nouns")
COUNT_NOUNS: Final = _words("count_nouns")
EXTENTS: Final = _phrases("extents")
BENEFICIARIES: Final = _phrases("beneficiaries")
PART_PREPOSITIONS: Final = _words("part_prepositions")
POSSESSIVES: Final = _words("possessives")
LIGHT_VERBS: Final = _phrases("light_verbs")
NO_STATEMENTS: Final = _words("no_statements")
DESIRES: Final = _words("desires")
MODALS: Final = _words("modals")
FINITE: Final = _words("finite")
FINITE_OF_PERSONS: Final = _words("finite_of_persons")
PERSONS: Final = _words("persons")
CHECKS: Final = _phrases("checks")
ASKS_IF: Final = _phrases("asks_if")
LOOKS: Final = _phrases("looks")
AFFIRMATIONS: Final = _phrases("affirmations")
OTHERWISE: Final = _phrases("otherwise")
ELSE_PRONOUNS: Final = _words("else_pronouns")
DENIALS: Final = _phrases("denials")
NOTHINGS: Final = _phrases("nothings")
SENTENCE_TURNS: Final = _phrases("sentence_turns")
GOAL_CHECKS: Final = _phrases("goal_checks")
PLACE_WORDS: Final = _words("place_words")
PLACING_VERBS: Final = _words("placing_verbs")
PUTTING_VERBS: Final = _words("putting_verbs")
DIRECTIONS: Final = _words("directions")
RECEIPTS: Final = _phrases("receipts")
POINTINGS: Final = _phrases("pointings")
RELATIVES: Final = _phrases("relatives")
BEING: Final = _phrases("being")
POSITIONS: Final = _words("positions")
TO_PLACES: Final = POSITIONS | DIRECTIONS
BE: Final = frozenset({"is", "s", "are"})
GRASP_VERBS: Final = _words("grasp_verbs")
MOVING_VERBS: Final = _words("moving_verbs")
NO_SLIPS: Final = _words("no_slips")
TURNING_WORDS: Final = _words("turning_words")
BODY: Final = frozenset(_DATA["classes"]["body"])
CONCLUSIONS: Final = _phrases("conclusions")
COLOURS: Final = _words("colours")
WITHDRAWALS: Final = _phrases("withdrawals")
RETRACTIONS: Final = _words("retractions")
STATEMENT_OPENERS: Final = _phrases("statement_openers")
BARRED_IN_REMARKS: Final = (BARRED - DETERMINERS) | PRONOUNS | RETRACTIONS
"""Words that no remark has: determiners ask for nothing there."""
FREE_REMARKS: Final = PhraseSet(_DATA["free_remarks"], _DATA["classes"], BARRED_IN_REMARKS)
ALL_WORDS: Final = frozenset(
    word
    for texts in (
        *(one for name, one in _DATA.items() if name not in _OTHER_WORDS),
        *_DATA["classes"].values(),
    )
    for text in texts
    for word in re.findall(r"[^\s(|)<>]+", text)
)
"""Every word of the lists that instructions use."""
INDEFINITE: Final = (("a",), ("an",), ("one",), ("some",))
"""Words for one or some of a kind, no matter which."""

_LONG_PLEASE: Final = re.compile(r"p+l+e+a+s+e+")
"""As in `pleeease`."""
_MISSPELT: Final[dict[str, str]] = _DATA["misspelt"]
_PARTICIPLES: Final[dict[str, str]] = _DATA["participles"]
_NOMINALS: Final[dict[str, str]] = _DATA["nominals"]
_NUMBERS: Final[dict[str, int]] = _DATA["numbers"]


def number_of(word: str) -> int | None:
    """Read a number word or numeral.

    Args:
        word: one normalized word.

    Returns:
        The number; None if it is none.
    """
    if word.isascii() and word.isdigit():
        return int(word[:18])
    return _NUMBERS.get(word)


def respelt(words: Words) -> Words:
    """Correct courtesy words that are often misspelt, such as `plese`, and part `gimme` into its words.

    Args:
        words: words of an instruction.

    Returns:
        The words; none that a module declares is changed.
    """
    spelt = ("please" if _LONG_PLEASE.fullmatch(word) else _MISSPELT.get(word, word) for word in words)
    return tuple(word for text in spelt for word in text.split())


def is_gerund(word: str) -> bool:
    """Say if a word is an -ing form: `wiping`, and not `bring`.

    Args:
        word: one normalized word.

    Returns:
        True if it is one, by its letters.
    """
    return word.endswith("ing") and any(letter in "aeiouy" for letter in word[:-3])


def is_act_noun(word: str) -> bool:
    """Say if a word is the noun of an act: `wiping`, `delivery`.

    Args:
        word: one normalized word.

    Returns:
        True if it is an -ing form, or one of the nouns that are none.
    """
    return is_gerund(word) or word in _NOMINALS


def is_plural(word: str) -> bool:
    """Say if a declared noun is in the plural, by its ending.

    Args:
        word: one normalized word.

    Returns:
        True if it ends with an `s` of its own; False for a plural without one, such as `people`.
    """
    return len(word) > 2 and word.endswith("s") and not word.endswith("ss")


def participle_bases(word: str) -> frozenset[str]:
    """List the verbs that `word` may be the past participle of.

    Args:
        word: one normalized word.

    Returns:
        Candidates; empty if it is no participle.
    """
    if word in _PARTICIPLES:
        return frozenset({_PARTICIPLES[word]})
    if not word.endswith("ed") or len(word) < 4:
        return frozenset()
    stem = word[:-2]
    forms = {stem, stem + "e"}
    if stem.endswith("i"):
        forms.add(stem[:-1] + "y")
    if stem[-1] == stem[-2]:
        forms.add(stem[:-1])
    return frozenset(forms)


def base_forms(word: str) -> frozenset[str]:
    """List the words that `word` may be a form of: itself, a singular, the verb of an -ing form or noun.

    Past tenses are no forms of a request, and are left out.

    Args:
        word: one normalized word.

    Returns:
        Candidates, `word` among them; most of them are no words of English.
    """
    forms = {word, _NOMINALS.get(word, word)}
    if word.endswith("s") and not word.endswith("ss") and len(word) > 2:
        forms.add(word[:-1])
        if word.endswith("es") and len(word) > 3:
            forms.add(word[:-2])
        if word.endswith("ies") and len(word) > 4:
            forms.add(word[:-3] + "y")
    if word.endswith("ing") and len(word) > 4:
        stem = word[:-3]
        forms |= {stem, stem + "e"}
        if stem.endswith("y"):
            forms.add(stem[:-1] + "ie")
        if len(stem) > 2 and stem[-1] == stem[-2]:
            forms.add(stem[:-1])
    return frozenset(forms)
