"""Changes of a file that no other comparison understands: reported with the text before and now.

Each field of a manifest and of a site file is compared by what it allows, and then in a table below, or it is
reported here where its value differs.  So no change is passed over in silence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

from aeros.spec.declared.ecm import Ecm
from aeros.spec.declared.site import Site
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.difference.declared_differences import (
    DeclaredDifference,
    Path,
    declared_differences,
    span_of,
)
from aeros.spec.difference.policy_change import PolicyChange, Relation, finite_change

MODULE_FIELDS: Final = (
    "permissions.actuators",
    "permissions.sensors",
    "permissions.channels",
    "permissions.compute",
    "permissions.actions.*",
    "permissions.worker.memory",
    "permissions.worker.answer_within",
    "permissions.worker.processor",
    "skills.*.envelope.*",
    "skills.*.precondition",
    "skills.*.hold",
    "skills.*.risk",
    "skills.*.timeout",
    "skills.*.idempotent",
    "skills.*.actuators",
    "skills.*.resources",
    "skills.*.gated",
    "state.*.max_age",
    "state.*.uncertainty",
    "state.*.sensor",
    "state.*.definition",
    "state.*.public",
    "perceivers.*.pictures.*.width",
    "perceivers.*.pictures.*.height",
    "perceivers.*.pictures.*.depth",
    "perceivers.*.readings",
    "perceivers.*.rate",
    "perceivers.*.timeout",
    "perceivers.*.memory",
    "perceivers.*.processor",
)
"""Fields of a manifest that `module_changes` and `perception_changes` compare by what they allow."""

SITE_FIELDS: Final = (
    "state.*.sensor",
    "state.*.max_age",
    "actions.*.risk",
    "actions.*.actuators",
    "actions.*.protective",
    "actions.*.tool.timeout",
    "actions.*.tool.answers",
    "actions.*.tool.http",
    "actions.*.tool.program",
    "actions.*.tool.mcp.tool",
    "actions.*.tool.mcp.command",
    "actions.*.tool.mcp.url",
    "actions.*.tool.channel",
    "actions.*.tool.confinement.reads",
    "actions.*.tool.confinement.writes",
    "actions.*.tool.confinement.network",
    "actions.*.tool.confinement.memory",
    "actions.*.tool.confinement.processor",
    "actions.*.tool.confinement.processes",
    "invariants.*.require",
    "invariants.*.on",
    "invariants.*.attenuate.*",
    "joint.*.require",
    "cameras.*.sensor",
    "cameras.*.width",
    "cameras.*.height",
    "resources.*",
    "policy.access.actuators",
    "policy.access.sensors",
    "policy.access.channels",
    "policy.access.compute",
    "policy.grants.*.actuators",
    "policy.grants.*.sensors",
    "policy.grants.*.channels",
    "policy.grants.*.compute",
    "policy.risk_ceiling",
    "policy.limits.skill_timeout",
    "policy.limits.retries",
    "policy.limits.replans",
    "policy.limits.planning",
    "policy.blocks.*.module",
    "policy.blocks.*.skill",
    "policy.blocks.*.action",
    "policy.quotas.*.on",
    "policy.quotas.*.at_most",
    "policy.quotas.*.within",
    "policy.isolation.require",
    "policy.isolation.missing",
    "policy.isolation.trusted",
    "policy.isolation.answer_within",
    "policy.isolation.memory",
    "policy.isolation.processor",
    "policy.mcp.execute",
    "policy.mcp.most_steps",
    "policy.mcp.skills",
    "policy.undeclared_outcome",
    "policy.perception.public",
    "policy.perception.timeout",
    "policy.perception.memory",
    "policy.perception.processor",
    "policy.perception.rate",
    "policy.perception.shared.*.max_age",
    "policy.perception.shared.*.uncertainty",
    "policy.perception.shared.*.in_invariants",
)
"""Fields of a site file that `site_changes` and `perception_changes` compare by what they allow."""

_NEEDED_ON_BOTH_SIDES: Final = ("state.*.definition",)
"""Compared fields, besides the entries of mappings, that are compared only where both versions have them."""


def other_module_changes(
    module: str, old: Ecm, new: Ecm, compared: Sequence[PolicyChange]
) -> Iterator[PolicyChange]:
    """Report the changes of a manifest that no other comparison understands.

    Args:
        module: id of the module.
        old: the manifest before, as declared.
        new: the manifest now.
        compared: what the other comparisons found.

    Yields:
        A change for each part that differs.
    """
    yield from _other_changes(
        old, new, MODULE_FIELDS, compared, lambda path: _module_subject(module, path), f"{module}/"
    )


def other_site_changes(old: Site, new: Site, compared: Sequence[PolicyChange]) -> Iterator[PolicyChange]:
    """Report the changes of a site file that no other comparison understands.

    Args:
        old: the site before, as declared.
        new: the site now.
        compared: what the other comparisons found.

    Yields:
        A change for each part that differs.
    """
    yield from _other_changes(old, new, SITE_FIELDS, compared, _site_subject, "")


def _other_changes(
    old: Any,
    new: Any,
    compared_fields: Sequence[str],
    compared: Sequence[PolicyChange],
    subject_of: Callable[[Path], str],
    prefix: str,
) -> Iterator[PolicyChange]:
    reported = tuple(one.subject for one in compared if one.relation is not Relation.EQUAL)
    for one in declared_differences(old, new):
        pattern = ".".join(one.pattern)
        is_entry = pattern.endswith(".*") or pattern in _NEEDED_ON_BOTH_SIDES
        if pattern in compared_fields and not (one.is_of_presence and is_entry):
            continue
        subject = subject_of(one.path)
        if one.is_of_presence and any(f"{name}/".startswith(f"{subject}/") for name in reported):
            continue
        yield finite_change(
            prefix + "/".join(one.path),
            Relation.CHANGED_OTHERWISE,
            _headline(one),
            one.old_place,
            one.new_place,
        )


def _module_subject(module: str, path: Path) -> str:
    """Return the subject under which other comparisons report that a part of a manifest is new or gone."""
    match path:
        case ("skills", skill, "envelope", kind):
            return f"{module}/{skill}/{kind}"
        case ("skills", *rest):
            return "/".join((module, *rest))
        case ("state", name, *rest):
            return "/".join(("state", f"{module}.{name}", *rest))
        case ("permissions", "actions", *rest):
            return "/".join((module, "permissions", *rest))
        case ("permissions", *rest):
            return "/".join((module, *rest))
        case _:
            return "/".join((module, *path))


def _site_subject(path: Path) -> str:
    """Return the subject under which other comparisons report that a part of a site is new or gone."""
    match path:
        case ("policy", "perception", "shared", name, *rest):
            return "/".join(("state", name, *rest))
        case ("actions", kind, "tool", "mcp"):
            return f"actions/{kind}/tool/service"
        case _:
            return "/".join(path)


def _headline(one: DeclaredDifference) -> str:
    name = ".".join(one.path)
    if one.old is None:
        return f"`{name}` is new: {_text(one.new)}"
    if one.new is None:
        return f"`{name}` was removed: {_text(one.old)}"
    return f"`{name}` was {_text(one.old)} and is {_text(one.new)}"


def _text(part: Any) -> str:
    """Return the text of a part in one line, shortened."""
    span = span_of(part)
    return quoted(" ".join(span.text.split())) if span else "empty"
