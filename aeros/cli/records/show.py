"""Audit records as text: filters, and the reasons why an action was denied or attenuated."""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Iterator, Mapping
from datetime import datetime
from fractions import Fraction
from math import isfinite
from typing import Any, TypeGuard

from aeros.runtime.audit.check import Record
from aeros.spec.diagnostics.codes import CODES
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.expr import terms as t
from aeros.spec.expr.units import format_number, format_quantity
from aeros.spec.migrations.renamed_names import current_event
from aeros.spec.model.policy import Quota
from aeros.spec.model.rules import Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared

_INDENT = " " * 8
_MAX_CHARS = 400
_HEXADECIMAL = re.compile(r"[0-9a-f]{32,}")
_EXACT_FROM = 1000.0
"""Larger numbers are times and the like, which six digits would falsify."""


def add_filters(parser: argparse.ArgumentParser) -> None:
    """Add the options that select records.

    Args:
        parser: Parser of the command.
    """
    group = parser.add_argument_group("filters (repeat one for OR; several are ANDed)")
    group.add_argument(
        "--decision", action="append", choices=("ALLOW", "ATTENUATE", "DENY"), help="with this decision"
    )
    group.add_argument("--module", action="append", help="of this module")
    group.add_argument("--skill", action="append", help="of this skill, SKILL or MODULE.SKILL")
    group.add_argument("--kind", action="append", help="with an action of this kind")
    group.add_argument("--rule", action="append", help="with this rule, field or AE code among the reasons")
    group.add_argument(
        "--event", action="append", help="of this kind, or a note of this event, as `decision`, `run-ended`"
    )
    group.add_argument(
        "--from-record", type=int, dest="first", metavar="N", help="from this sequence number on"
    )
    group.add_argument("--to-record", type=int, dest="last", metavar="N", help="up to this sequence number")
    group.add_argument("--since", type=_time, metavar="T", help="written at T or later, as 2026-11-21T05:16")
    group.add_argument("--until", type=_time, metavar="T", help="written at T or earlier")


def _time(text: str) -> float:
    try:
        return datetime.fromisoformat(text).timestamp()
    except (ValueError, OverflowError, OSError):
        raise argparse.ArgumentTypeError("expected a date and time, as 2026-11-21T05:16:28") from None


def matches_filters(record: Record, filters: argparse.Namespace) -> bool:
    """Compare a record with the options.

    Args:
        record: An audit record.
        filters: Parsed options of `add_filters`.

    Returns:
        True if the options select the record.
    """
    details = record["details"]
    module, skill = details.get("module"), details.get("skill")
    asked = details.get("asked")
    kind = asked.get("kind") if type(asked) is dict else None
    listed = [
        (filters.decision, [details.get("verdict")] if record["event"] == "decision" else []),
        (filters.module, [module]),
        (filters.skill, [skill, f"{module}.{skill}"]),
        (filters.kind, [kind]),
        (filters.rule, [word for code, rule, _ in decision_reasons(record) for word in (code, rule)]),
        (filters.event, [record["event"], _noted_event(record), current_event(_noted_event(record))]),
    ]
    ranges = [
        (filters.first, record["sequence"], filters.last),
        (filters.since, record["written"], filters.until),
    ]
    return all(some is None or any(one in there for one in some) for some, there in listed) and all(
        (low is None or low <= value) and (high is None or value <= high) for low, value, high in ranges
    )


def _noted_event(record: Record) -> str:
    """Return the event of a note of the agent, which has a name of its own; empty for any other record."""
    noted = record["details"].get("event") if record["event"] == "note" else None
    return noted if isinstance(noted, str) else ""


def decision_reasons(record: Record) -> list[tuple[str, str, str]]:
    """Return the reasons of a decision.

    Args:
        record: An audit record.

    Returns:
        Code, rule and text of each reason; empty if the record is no decision.
    """
    reasons = record["details"].get("reasons") if record["event"] == "decision" else None
    if type(reasons) is not list:
        return []
    triples = (one for one in reasons if type(one) is list and len(one) == 3)
    return [(str(code), str(rule), str(text)) for code, rule, text in triples]


def format_record(record: Record, site: Site | None) -> str:
    """Format a record as a line, followed by the reasons if the action was denied or attenuated.

    Args:
        record: An audit record.
        site: The site of the run, to show its rules; None if unknown.

    Returns:
        Lines of text.
    """
    try:
        written = datetime.fromtimestamp(record["written"]).astimezone().isoformat(" ", "milliseconds")
    except (ValueError, OverflowError, OSError):
        written = "at no time"
    line = f"{record['sequence']:6}  {written:29}  {record['event']:14}  {_summary(record)}"
    return "\n".join(
        [
            escape_invisible(line if len(line) <= _MAX_CHARS else f"{line[: _MAX_CHARS - 1]}…"),
            *(_INDENT + escape_invisible(one) for one in explain_record(record, site)),
        ]
    )


def explain_record(record: Record, site: Site | None) -> list[str]:
    """Explain each reason of a decision.

    Args:
        record: An audit record.
        site: The site of the run, to show its rules and the values that they read; None if unknown.

    Returns:
        Lines of text; empty if the record is no decision or has no reasons.
    """
    lines: list[str] = []
    for code, rule, text in decision_reasons(record):
        lines.append(f"{code} {rule}: {text}")
        summary = CODES[code].summary if code in CODES else "not a code of this version"
        lines.append(f"   {code} means: {summary}")
        if site is not None:
            lines += [f"   {line}" for line in _rule_lines(record, code, rule, site)]
    joint_records = record["details"].get("beside")
    if lines and type(joint_records) is list:
        lines.append(f"decided jointly with the actions of records {', '.join(map(str, joint_records))}")
    if record["details"].get("verdict") == "ATTENUATE" and lines:
        lines.append(f"attenuated to {_action(record['details'].get('decided'))}")
    return lines


def _rule_lines(record: Record, code: str, rule: str, site: Site) -> Iterator[str]:
    details = record["details"]
    match code:
        case "AE750" | "AE790":
            found = next((one for one in site.rules if one.id == rule), None)
            if found is not None:
                yield f"the rule is written at {found.require_span}, and comes from: {found.source}"
                yield from _rule_inputs(found, details, site)
        case "AE751":
            joint = next((one for one in site.joint_rules if one.id == rule), None)
            if joint is not None:
                yield f"the joint rule is written at {joint.require_span}, and comes from: {joint.source}"
                for name in sorted(t.variables_of(joint.term).keys() & site.observed_variables.keys()):
                    yield _measured(site.observed_variables[name], details)
        case "AE742" | "AE703" if any(quota.id == rule for quota in site.quotas):
            quota = next(one for one in site.quotas if one.id == rule)
            yield _quota_line(quota, details)
        case "AE710":
            block = next((one for one in site.blocks if one.id == rule), None)
            if block is not None and block.span is not None:
                yield f"the operator override is written at {block.span}"
        case _ if rule in site.observed_variables:
            declared = site.observed_variables[rule]
            yield f"it is declared at {declared.span}"
            yield _measured(declared, details)


def _rule_inputs(rule: Rule, details: Mapping[str, Any], site: Site) -> Iterator[str]:
    """Yield the inputs of a rule: requested parameters and measured state."""
    asked = details.get("asked")
    if not _is_action(asked) or asked["kind"] not in rule.terms:
        return
    kind = site.kinds[asked["kind"]]
    for name, variable in sorted(t.variables_of(rule.terms[kind.name]).items()):
        if variable.role is t.VariableRole.PARAMETER:
            yield f"requested `{name}` = {_value(kind.parameters[name], asked['parameters'].get(name))}"
        elif name in site.observed_variables:
            yield _measured(site.observed_variables[name], details)


def _measured(declared: Declared, details: Mapping[str, Any]) -> str:
    name = declared.name
    state, now = details.get("state"), details.get("time")
    found = state.get(name) if type(state) is dict else None
    if type(found) is not list or len(found) != 2:
        return f"`{name}` was not measured"
    value, at = found
    age = f", measured {now - at:.3g} s before" if type(at) is float and type(now) is float else ""
    return f"`{name}` was {_value(declared, value)}{age}"


def _value(declared: Declared, value: Any) -> str:
    if type(value) is float and isfinite(value):
        return format_quantity(Fraction(repr(value)), declared.unit)
    if type(value) is list:
        return "[" + ", ".join(_value(declared, part) for part in value) + "]"
    return json.dumps(value)


def _quota_line(quota: Quota, details: Mapping[str, Any]) -> str:
    usage = details.get("usage")
    used = usage.get(quota.id, "an unknown number") if type(usage) is dict else "an unknown number"
    return f"of {quota.max_count} actions within {format_number(quota.window_s)} s, {used} had been executed"


def _summary(record: Record) -> str:
    details = record["details"]
    who = f"{details.get('module')}.{details.get('skill')}"
    if record["event"] == "decision":
        time = details.get("time")
        at = f"{time:.3f} s" if type(time) is float else json.dumps(time)
        return f"{details.get('verdict')!s:9}  {who} asks for {_action(details.get('asked'))} at {at}"
    if record["event"] == "gate-disagreement":
        found = (details.get(name) for name in ("compiled", "z3"))
        verdicts = [one.get("verdict") if isinstance(one, dict) else None for one in found]
        return f"compiled {verdicts[0]}, z3 {verdicts[1]}  {who} asks for {_action(details.get('asked'))}"
    words = [str(details[name]) for name in ("status", "reason") if details.get(name)]
    if details.get("event"):
        words.append(current_event(str(details["event"])))
    if "module" in details:
        words.insert(0, who)
    return ": ".join(words) or json.dumps(_shortened(details), ensure_ascii=False)


def _shortened(value: Any) -> Any:
    """Round numbers, and shorten digests and keys; `--format json` has them whole."""
    if type(value) is float and isfinite(value):
        return float(f"{value:.6g}") if abs(value) < _EXACT_FROM else round(value, 3)
    if type(value) is str and _HEXADECIMAL.fullmatch(value):
        return f"{value[:12]}…"
    if type(value) is list:
        return [_shortened(one) for one in value]
    if type(value) is dict:
        is_module = type(value.get("version")) is str and "manifest" in value
        return value["version"] if is_module else {name: _shortened(one) for name, one in value.items()}
    return value


def _is_action(action: Any) -> TypeGuard[dict[str, Any]]:
    return type(action) is dict and type(action.get("kind")) is str and type(action.get("parameters")) is dict


def _action(action: Any) -> str:
    if not _is_action(action):
        return json.dumps(action)
    given = ", ".join(
        f"{name}={json.dumps(_shortened(value), ensure_ascii=False)}"
        for name, value in action["parameters"].items()
    )
    return f"{action['kind']}({given})"
