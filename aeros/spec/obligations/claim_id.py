"""Identities of claims: the kind of a claim, and the names of the things that it is about.

A claim is identified by a `ClaimId` and never by its text.  The text (`str(claim_id)`) is for lock files,
reports and JSON; nothing parses it.  Two different identities never have the same text, whatever names
authors and operators choose: see `ClaimForm`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import takewhile
from typing import Final

from aeros.spec.diagnostics.errors import MisuseError

_NUMBERS: Final = ("number", "case")
_PATH: Final = "path"


class _Segment:
    """One part of a text between slashes: a fixed word, or a prefix and then the name for `slot`.

    The slots `number` and `case` take a number in decimal, `path` takes a path that ends in `.py`.
    """

    def __init__(self, word: str, slot: str) -> None:
        self.word = word
        self.slot = slot

    def admits(self, text: str) -> bool:
        """Tell whether `text` may stand in this place."""
        if not self.slot:
            return text == self.word
        return text.startswith(self.word) and fits_slot(self.slot, text[len(self.word) :])

    def overlaps(self, other: _Segment) -> bool:
        """Tell whether some text may stand in both places; may say yes where there is none."""
        if not self.slot:
            return other.admits(self.word)
        if not other.slot:
            return self.admits(other.word)
        return self.word.startswith(other.word) or other.word.startswith(self.word)


class ClaimPattern:
    """One kind of claim, by the pattern of its text; the members of `ClaimForm` are the only ones.

    Attributes:
        name: the member's name in `ClaimForm`.
        value: the pattern, with each slot in braces, as in `safety/{skill}/can-start`.
    """

    name: str

    def __init__(self, value: str) -> None:
        self.value = value

    def __set_name__(self, _owner: type, name: str) -> None:
        self.name = name

    def __reduce__(self) -> tuple[Callable[[str], ClaimPattern], tuple[str]]:
        # Another process has the same members: a copy would be none of them.
        return claim_form, (self.name,)

    def __repr__(self) -> str:
        return f"ClaimForm.{self.name}"

    def __call__(self, *names: str | int) -> ClaimId:
        """Make the identity of a claim of this kind.

        Args:
            names: one for each slot of the pattern, in order.

        Raises:
            MisuseError: there are more or fewer names than slots, or one is not what its slot takes.
        """
        return ClaimId(self, tuple(map(str, names)))

    @cached_property
    def segments(self) -> tuple[_Segment, ...]:
        """The parts of the pattern between its slashes."""
        parts = (part.partition("{") for part in self.value.split("/"))
        return tuple(_Segment(word, rest.rstrip("}")) for word, _, rest in parts)

    @cached_property
    def slots(self) -> tuple[str, ...]:
        """The slots of the pattern, in order: one for each name of a claim of this kind."""
        return tuple(segment.slot for segment in self.segments if segment.slot)

    @cached_property
    def group(self) -> str:
        """The group of claims that this kind belongs to, such as `safety`."""
        return self.segments[0].word

    @cached_property
    def checked_slots(self) -> tuple[tuple[int, str], ...]:
        """The slots that do not take every name, with the position of each."""
        return tuple((at, slot) for at, slot in enumerate(self.slots) if slot in (*_NUMBERS, _PATH))

    @cached_property
    def format(self) -> str:
        """The pattern with `%s` for each slot."""
        return "/".join(segment.word + ("%s" if segment.slot else "") for segment in self.segments)

    @cached_property
    def rivals(self) -> tuple[tuple[int, str, ClaimPattern], ...]:
        """The kinds listed before this one that share some text with it.

        Each comes with a quick test that most texts of this kind fail: the position of a part, and how that
        part begins in a text of the other kind.
        """
        earlier = takewhile(lambda one: one is not self, _forms_of(self.group))
        found = [one for one in earlier if _overlap(one, self)]
        return tuple((*_difference(self, one), one) for one in found)


@dataclass(frozen=True, slots=True)
class ClaimId:
    """The identity of a claim.

    Attributes:
        form: the kind of claim.
        names: the things that it is about: a name for each slot of the form's pattern.
    """

    form: ClaimPattern
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        form, names = self.form, self.names
        if len(names) != len(form.slots):
            raise MisuseError(f"`{form.value}` takes {len(form.slots)} names, not {len(names)}")
        for at, slot in form.checked_slots:
            if not fits_slot(slot, names[at]):
                raise MisuseError(f"`{names[at]}` is no {slot}, which `{form.value}` takes")

    @property
    def group(self) -> str:
        """The group of claims that this claim belongs to, such as `safety`."""
        return self.form.group

    def name_of(self, slot: str) -> str:
        """Return the name for a slot.

        Args:
            slot: slot of the form's pattern, such as `skill`.

        Returns:
            The name that stands there.

        Raises:
            MisuseError: the form has no such slot.
        """
        if slot not in self.form.slots:
            raise MisuseError(f"`{self.form.value}` has no `{slot}`")
        return self.names[self.form.slots.index(slot)]

    def __str__(self) -> str:
        form = self.form
        names = self.names
        for name in names:
            if "/" in name or "=" in name or "%" in name:
                names = tuple(map(_escaped, form.slots, names))
                break
        text = form.format % names
        if form.rivals:
            parts = text.split("/")
            if any(parts[at].startswith(word) and _fits(rival, parts) for at, word, rival in form.rivals):
                left = iter(zip(form.slots, names, strict=True))
                return "/".join(
                    segment.word + ("=".join(next(left)) if segment.slot else "") for segment in form.segments
                )
        return text


class ClaimForm:
    """Every kind of claim, with the pattern of its text.

    Call a member with a name for each slot of its pattern to make a `ClaimId`.  Some patterns overlap: the
    text `safety/goal/move/effective` fits a task named `move`, and a skill named `goal` with an invariant
    named `effective`.  The kind that is listed first keeps that text.  In the text of the other, each name is
    written with its slot: `safety/skill=goal/action=move/invariant=effective`, which fits no pattern.


    A plain class, as an enumeration of so many members takes a thirtieth of the start of `aeros verify`.
    """

    # Every state that a task's planning rules can reach.
    RULES_ANALYSED = ClaimPattern("closed-loop/{task}/analysed")
    RULES_DISPATCH = ClaimPattern("closed-loop/{task}/dispatch")
    RULES_PROGRESS = ClaimPattern("closed-loop/{task}/progress")
    RULES_EFFECTIVE = ClaimPattern("closed-loop/{task}/effective")
    RULES_CERTIFIED = ClaimPattern("closed-loop/{task}/certificate/{number}")
    RULES_KEEP_INVARIANT = ClaimPattern("closed-loop/{task}/invariant/{invariant}")

    # Every path through a composition.
    HANDLERS_ACYCLIC = ClaimPattern("composition/{composition}/handlers")
    PATHS_EXPLORED = ClaimPattern("composition/{composition}/explored")
    COMPOSITION_CAN_START = ClaimPattern("composition/{composition}/can-start")
    IF_COVERS = ClaimPattern("composition/{composition}/if-{number}/covers")
    IF_COVERS_CASE = ClaimPattern("composition/{composition}/if-{number}/covers/{case}")
    PART_FAILURE_HANDLED = ClaimPattern("composition/{composition}/part-{number}/handled")
    PART_CAN_SUCCEED = ClaimPattern("composition/{composition}/part-{number}/can-succeed")
    COMPOSITION_FITS_PLAN = ClaimPattern("composition/{composition}/fits-plan")
    PAR_RESOURCES = ClaimPattern("composition/{composition}/par-{number}/resources/{resource}")
    PAR_ACTUATORS = ClaimPattern("composition/{composition}/par-{number}/{first}/{second}/actuators")
    PAR_EFFECTS = ClaimPattern("composition/{composition}/par-{number}/{first}/{second}/effects")
    PAR_JOINT_RULE = ClaimPattern("composition/{composition}/par-{number}/joint/{first}/{second}/{invariant}")
    STEP_FAILURE_HANDLED = ClaimPattern("composition/{composition}/{step}/handled")
    STEP_REACHABLE = ClaimPattern("composition/{composition}/{step}/reachable")
    STEP_READY = ClaimPattern("composition/{composition}/{step}/ready")
    STEP_READY_CASE = ClaimPattern("composition/{composition}/{step}/ready/{case}")
    INPUT_AVAILABLE = ClaimPattern("composition/{composition}/{step}/{input}/there")
    INPUT_FITS = ClaimPattern("composition/{composition}/{step}/{input}/fits")
    HANDLER_REACHABLE = ClaimPattern("composition/{composition}/handler/{handler}/reachable")
    HANDLER_READY = ClaimPattern("composition/{composition}/handler/{handler}/ready")
    HANDLER_READY_CASE = ClaimPattern("composition/{composition}/handler/{handler}/ready/{case}")

    # All modules together.
    MODULE_UNIQUE = ClaimPattern("configuration/identity/{module}")
    CAPABILITY_UNIQUE = ClaimPattern("configuration/capability/{capability}")
    WORDS_UNAMBIGUOUS = ClaimPattern("configuration/word/{words}")
    EFFECTS_AGREE = ClaimPattern("configuration/effect/{variable}")
    VERSIONS_AGREE = ClaimPattern("configuration/dependency/{module}")
    GRANT_IS_USED = ClaimPattern("configuration/grant/{module}")
    BLOCK_IS_USED = ClaimPattern("configuration/block/{block}")
    SETTINGS_ARE_USED = ClaimPattern("configuration/settings/{module}")
    SHARED_IS_USED = ClaimPattern("configuration/shared/{variable}")

    # The AEROS version and the other modules that a module needs.
    RUNTIME_SUITS = ClaimPattern("dependencies/runtime")
    DEPENDENCIES_ACYCLIC = ClaimPattern("dependencies/acyclic")
    DEPENDENCY_MET = ClaimPattern("dependencies/{module}")
    CAPABILITY_PROVIDED = ClaimPattern("dependencies/capability/{capability}")

    # The interface of a capability, for each alternative that provides it.
    INTERFACE_CAN_START = ClaimPattern("interface/{capability}/can-start")
    INTERFACE_FITS = ClaimPattern("interface/{capability}/{alternative}/fits")
    INTERFACE_READY = ClaimPattern("interface/{capability}/{alternative}/ready")
    INTERFACE_ACHIEVED = ClaimPattern("interface/{capability}/{alternative}/achieved")
    INTERFACE_ACHIEVED_CASE = ClaimPattern("interface/{capability}/{alternative}/achieved/{case}")

    # Skill code.
    CODE_REACHES_NOTHING = ClaimPattern("form/code/{path}")
    CODE_FINDS_NEIGHBOURS = ClaimPattern("form/code/{path}/imports")
    CODE_IS_ACYCLIC = ClaimPattern("form/code-imports/acyclic")
    CODE_ASKS_PLAINLY = ClaimPattern("form/code/{path}/asking")
    ENTRY_POINT = ClaimPattern("form/{skill}/entry")
    SKILL_ASKS_WITHIN_ENVELOPE = ClaimPattern("form/{skill}/asks")
    PERCEIVER_READS_GIVEN = ClaimPattern("form/perceiver/{perceiver}/reads")
    PERCEIVER_ENTRY_POINT = ClaimPattern("form/perceiver/{perceiver}/entry")

    # Models of a module.
    MODEL_INTERFACE = ClaimPattern("models/{model}/interface")
    MODEL_BOUND = ClaimPattern("models/{model}/bound/{bound}")

    # Permissions of a module.
    ACCESS_GRANTED = ClaimPattern("permission/access/{device}")
    NOT_BLOCKED = ClaimPattern("permission/unblocked/{block}")
    PERMISSION_NOT_EMPTY = ClaimPattern("permission/{action}/not-empty")
    SKILL_ACTUATORS_PERMITTED = ClaimPattern("permission/{skill}/actuators")
    SKILL_ACTUATORS_HELD = ClaimPattern("permission/{skill}/held")
    SKILL_RISK_UNDER_CEILING = ClaimPattern("permission/{skill}/risk-ceiling")
    SKILL_RISK_STATED = ClaimPattern("permission/{skill}/risk-stated")
    SKILL_SENSORS_PERMITTED = ClaimPattern("permission/{skill}/sensors")
    TASK_SENSORS_PERMITTED = ClaimPattern("permission/task/{task}/sensors")
    COMPOSITION_SENSORS_PERMITTED = ClaimPattern("permission/composition/{composition}/sensors")
    DEFINITION_SENSORS_PERMITTED = ClaimPattern("permission/definition/{variable}/sensors")
    PERCEIVER_SENSORS_PERMITTED = ClaimPattern("permission/perceiver/{perceiver}/sensors")
    ENVELOPE_ACTUATORS_DECLARED = ClaimPattern("permission/{skill}/{action}/actuators")
    ENVELOPE_CHANNELS_PERMITTED = ClaimPattern("permission/{skill}/{action}/channels")
    ENVELOPE_PERMITTED = ClaimPattern("permission/{skill}/{action}")

    # A site's policy.
    JOINT_RULE_SATISFIABLE = ClaimPattern("policy/joint/{invariant}/satisfiable")
    JOINT_RULE_EFFECTIVE = ClaimPattern("policy/joint/{invariant}/effective")
    QUOTA_EFFECTIVE = ClaimPattern("policy/quotas/{quota}/effective")
    QUOTA_NEEDED = ClaimPattern("policy/quotas/{quota}/needed")
    RULES_SATISFIABLE = ClaimPattern("policy/{action}/satisfiable")
    STOP_ALLOWED = ClaimPattern("policy/{action}/allowed/{invariant}")
    STOP_NOT_BLOCKED = ClaimPattern("policy/{action}/unblocked/{block}")
    RULE_EFFECTIVE = ClaimPattern("policy/{action}/effective/{invariant}")
    RULE_NOT_SHADOWED = ClaimPattern("policy/{action}/unshadowed/{invariant}")
    ATTENUATION_ALLOWED = ClaimPattern("policy/{action}/attenuation-allowed/{invariant}")
    CONTACT_SPEED_KEPT = ClaimPattern("policy/{action}/contact-speed")
    ATTENUATION_SHRINKS = ClaimPattern("policy/{action}/attenuation-shrinks/{invariant}")

    # A skill's envelope and a task's goal.
    GOAL_SATISFIABLE = ClaimPattern("safety/goal/{task}")
    GOAL_EFFECTIVE = ClaimPattern("safety/goal/{task}/effective")
    SKILL_CAN_START = ClaimPattern("safety/{skill}/can-start")
    HOLD_SATISFIABLE = ClaimPattern("safety/{skill}/hold")
    HOLD_ALLOWS_SUCCESS = ClaimPattern("safety/{skill}/hold/{outcome}")
    INCREMENT_IN_RANGE = ClaimPattern("safety/{skill}/outcome/{outcome}/{variable}")
    RANGE_AGREES = ClaimPattern("safety/{skill}/outcome/{outcome}/{variable}/agrees")
    VALUE_FOLLOWS = ClaimPattern("safety/{skill}/outcome/{outcome}/{variable}/follows")
    ENVELOPE_NOT_EMPTY = ClaimPattern("safety/{skill}/{action}/not-empty")
    ENVELOPE_NOT_DEAD = ClaimPattern("safety/{skill}/{action}/not-dead")
    GATED_RULE_READS_STATE = ClaimPattern("safety/{skill}/gated-{invariant}")
    GATED_RULE_NEEDS_STATE = ClaimPattern("safety/{skill}/gated-{invariant}/{action}")
    ENVELOPE_OBEYS = ClaimPattern("safety/{skill}/{action}/{invariant}")

    # Differences of two manifests or sites.
    DIFFERENCE = ClaimPattern("difference/{subject}/{relation}")


CLAIM_FORMS: Final = tuple(form for form in vars(ClaimForm).values() if isinstance(form, ClaimPattern))
"""Every kind of claim, in the order in which they are listed."""


def claim_form(name: str) -> ClaimPattern:
    """Return the kind of claim of a name.

    Args:
        name: name of a member of `ClaimForm`.

    Returns:
        The member.

    Raises:
        KeyError: there is none of that name.
    """
    form = vars(ClaimForm)[name]
    if not isinstance(form, ClaimPattern):
        raise KeyError(name)
    return form


@cache
def _forms_of(group: str) -> tuple[ClaimPattern, ...]:
    """Return the kinds of claim of a group, in order."""
    return tuple(form for form in CLAIM_FORMS if form.group == group)


def fits_slot(slot: str, name: str) -> bool:
    """Tell whether a slot accepts a name.

    Args:
        slot: name of the slot; `number` and `case` accept decimal digits, `path` a path that ends in `.py`,
            and any other slot every name.
        name: the name.

    Returns:
        True if the slot accepts it.
    """
    if slot in _NUMBERS:
        return name.isascii() and name.isdecimal()
    return slot != _PATH or name.endswith(".py")


def _fits(form: ClaimPattern, parts: list[str]) -> bool:
    """Tell whether a text, given by its parts between slashes, fits the pattern of `form`."""
    return all(segment.admits(part) for segment, part in zip(form.segments, parts, strict=True))


def _overlap(one: ClaimPattern, other: ClaimPattern) -> bool:
    """Tell whether some text fits both patterns; may say yes where there is none."""
    if _PATH in (*one.slots, *other.slots):  # a path has any number of parts, so the last ones must differ
        return one.segments[-1].overlaps(other.segments[-1])
    if len(one.segments) != len(other.segments):
        return False
    return all(mine.overlaps(its) for mine, its in zip(one.segments, other.segments, strict=True))


def _difference(form: ClaimPattern, rival: ClaimPattern) -> tuple[int, str]:
    """Return the first position at which `rival` has another fixed word or prefix, and that word."""
    pairs = enumerate(zip(form.segments, rival.segments, strict=True))
    return next(((at, its.word) for at, (own, its) in pairs if own.word != its.word and its.word), (0, ""))


def _escaped(slot: str, name: str) -> str:
    """Escape the characters of patterns in a name; a path stays as it is."""
    if slot == _PATH:
        return name
    return name.replace("%", "%25").replace("/", "%2F").replace("=", "%3D")
