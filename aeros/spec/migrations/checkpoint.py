"""Migration steps of `checkpoint.json`: the body is JSON in a string, next to the digest of that string."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from typing import Any, Final, NoReturn

from aeros.spec.migrations.format import UnmigratableError


def to_2(_text: str) -> NoReturn:
    """Refuse: version 1 did not keep `barred`, and without it an action could be done twice.

    Args:
        _text: checkpoint of version 1.

    Returns:
        Nothing: it always raises.

    Raises:
        UnmigratableError: always.
    """
    raise UnmigratableError(
        "version 1 did not record the actions that may have happened before a crash, so the task cannot be "
        "resumed safely; start it again, without `--resume`"
    )


def to_3(text: str) -> str:
    """Add `ended`, null: version 2 kept checkpoints only of tasks that had not ended.

    Args:
        text: checkpoint of version 2.

    Returns:
        The checkpoint in version 3.

    Raises:
        UnmigratableError: it is damaged.
    """
    return _rewritten(text, 3, lambda body: {**body, "ended": None})


def to_4(text: str) -> str:
    """Give classes and fields the names that the code has had since version 4.

    Args:
        text: checkpoint of version 3.

    Returns:
        The checkpoint in version 4.

    Raises:
        UnmigratableError: it is damaged.
    """
    return _rewritten(text, 4, lambda body: _renamed_fields("Checkpoint", _renamed(body)))


def to_5(text: str) -> str:
    """Add `errand` and `earlier_reports`: until version 4 an instruction had one task.

    Args:
        text: checkpoint of version 4.

    Returns:
        The checkpoint in version 5.

    Raises:
        UnmigratableError: it is damaged.
    """
    return _rewritten(text, 5, lambda body: {**body, "errand": 0, "earlier_reports": {"tuple": []}})


def to_6(text: str) -> str:
    """Name what runs between two tries `between_tries`, and add that no attempt was of a composition.

    `on_failure` runs after the last try now.

    Args:
        text: checkpoint of version 5.

    Returns:
        The checkpoint in version 6.

    Raises:
        UnmigratableError: it is damaged.
    """
    return _rewritten(
        text, 6, lambda body: {name: _with_objects(value, _fields_of_6) for name, value in body.items()}
    )


def to_7(text: str) -> str:
    """Add `repeated_failures`, none: until version 6 a failure was not compared with those before it.

    Args:
        text: checkpoint of version 6.

    Returns:
        The checkpoint in version 7.

    Raises:
        UnmigratableError: it is damaged.
    """

    def rewritten(body: dict[str, Any]) -> dict[str, Any]:
        kept = {name: _with_objects(value, _fields_of_7) for name, value in body.items()}
        return {**kept, "repeated_failures": {"tuple": []}}

    return _rewritten(text, 7, rewritten)


def to_8(text: str) -> str:
    """Add `is_verdict`, false: until version 7 no outcome said why another try cannot succeed.

    Args:
        text: checkpoint of version 7.

    Returns:
        The checkpoint in version 8.

    Raises:
        UnmigratableError: it is damaged.
    """
    return _with_field(text, 8, "AttemptResult", {"is_verdict": False})


def to_9(text: str) -> str:
    """Add `skipped`: until version 8 only the goal of a skipped report says that there was a condition.

    Args:
        text: checkpoint of version 8.

    Returns:
        The checkpoint in version 9. No report of it is skipped: nothing in an instruction of its time depends
        on that.

    Raises:
        UnmigratableError: it is damaged.
    """
    return _with_field(text, 9, "RunReport", {"skipped": False})


def _with_field(text: str, version: int, kind: str, added: Mapping[str, Any]) -> str:
    """Rewrite a checkpoint to a version in which each object of a kind has fields more."""

    def rewritten(name: str, held: dict[str, Any]) -> dict[str, Any]:
        return {**held, **added} if name == kind else held

    return _rewritten(
        text, version, lambda body: {name: _with_objects(value, rewritten) for name, value in body.items()}
    )


_ADDED_IN_6: Final[Mapping[str, Mapping[str, Any]]] = {
    "AttemptHistory": {"alternative": ""},
    "AttemptResult": {"is_composed": False},
}
"""Fields with their values, by class: until version 5 there was no composition among attempts."""

_WAIT_OF_6: Final = {
    "class": "Wait",
    "fields": {"subject": "the measured state changes", "limit_s": 60.0},
}
"""Until version 6 every wait was for measured values, and of 60 s at most."""

_Rewrite = Callable[[str, dict[str, Any]], dict[str, Any]]
"""Returns the fields that an object is to have, by the name of its class and its encoded fields."""


def _with_objects(value: Any, rewrite: _Rewrite) -> Any:
    """Rewrite each object in an encoded value, those inside it first."""
    if isinstance(value, list):
        return [_with_objects(item, rewrite) for item in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"map"}:
        return {"map": {key: _with_objects(item, rewrite) for key, item in value["map"].items()}}
    if value.keys() != {"class", "fields"}:
        return {key: _with_objects(item, rewrite) for key, item in value.items()}
    held = {key: _with_objects(item, rewrite) for key, item in value["fields"].items()}
    return {"class": value["class"], "fields": rewrite(value["class"], held)}


def _fields_of_6(name: str, held: dict[str, Any]) -> dict[str, Any]:
    if name != "PlanStep":
        return {**held, **_ADDED_IN_6.get(name, {})}
    handler, skill = held.pop("handler", None), held.pop("on_failure", None)
    between = handler
    if skill is not None:
        plain = {"module": held["module"], "skill": skill, "inputs": {"map": {}}}
        between = {"class": "PlanStep", "fields": plain}
    return held | {"between_tries": between, "on_failure": None, "needs_recovery": handler is not None}


def _fields_of_7(name: str, held: dict[str, Any]) -> dict[str, Any]:
    if name != "AttemptResult":
        return held
    wait = _WAIT_OF_6 if held.pop("is_transient", False) else None
    return held | {"is_repeated": False, "pause_s": 0.0, "wait": wait}


_CLASS_NAMES: Final = {
    "Step": "PlanStep",
    "Head": "LogHead",
    "Table": "ConstantTable",
    "Attempt": "AttemptResult",
    "Begun": "UnfinishedAttempt",
    "Tried": "AttemptHistory",
}
"""Classes by their names in version 3, with those in version 4."""

_FIELD_NAMES: Final[Mapping[str, Mapping[str, str]]] = {
    "Since": {"kept": "sustained", "reset": "trigger", "within": "window_s"},
    "Occurrences": {"within": "window_s"},
    "Attempt": {
        "repeatable": "is_retryable",
        "may_pass": "is_transient",
        "hopeless": "no_retry_reason",
        "stops": "ends_run",
    },
    "Tried": {"tries": "attempt_count", "begun": "unfinished", "last": "last_result"},
    "Checkpoint": {
        "head": "audit_head",
        "waited": "waited_s",
        "until": "deadline",
        "denied": "denied_steps",
        "avoided": "avoided_skills",
        "barred": "uncertain_steps",
        "rejected": "last_plan_problems",
        "planned_in": "planning_states",
        "tried": "attempts",
        "settled": "done_paths",
        "branches": "branch_choices",
        "ended": "final_report",
    },
}
"""Fields by the class and the name that they have in version 3, with their names in version 4."""


def _renamed(value: Any) -> Any:
    """Rename the classes in an encoded value, and their fields; the keys of a mapping stay."""
    if isinstance(value, list):
        return [_renamed(item) for item in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"map"}:
        return {"map": {key: _renamed(item) for key, item in value["map"].items()}}
    if value.keys() == {"class", "fields"}:
        name = value["class"]
        return {
            "class": _CLASS_NAMES.get(name, name),
            "fields": _renamed_fields(name, _renamed(value["fields"])),
        }
    return {key: _renamed(item) for key, item in value.items()}


def _renamed_fields(name: str, held: Mapping[str, Any]) -> dict[str, Any]:
    names = _FIELD_NAMES.get(name, {})
    return {names.get(key, key): item for key, item in held.items()}


def _rewritten(text: str, version: int, rewrite: Callable[[dict[str, Any]], Mapping[str, Any]]) -> str:
    """Rewrite the body of a checkpoint if its digest is right.

    Args:
        text: checkpoint of the previous version.
        version: version of the result.
        rewrite: function from the old body to the new one.

    Returns:
        The checkpoint in that version.

    Raises:
        UnmigratableError: the file is damaged.
    """
    try:
        envelope = json.loads(text)
        body = envelope["body"]
        if hashlib.sha256(body.encode()).hexdigest() != envelope["digest"]:
            raise UnmigratableError("it is damaged: its digest does not match")
        body = json.dumps(rewrite(json.loads(body)), sort_keys=True, allow_nan=False)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise UnmigratableError("it is damaged: it does not have the layout of a checkpoint") from error
    digest = hashlib.sha256(body.encode()).hexdigest()
    return json.dumps({"schema": version, "digest": digest, "body": body}, indent=1)
