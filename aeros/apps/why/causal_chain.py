"""From the record of a run to why it ended as it did: a chain, from its end back to what was measured.

A log may be of another version of AEROS, so what is not there, or not as expected, is left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from aeros.runtime.audit.check import Record
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause

_START_EVENTS: Final = ("step-started", "step-not-started")
_END_EVENTS: Final = ("run-ended", "run-interrupted", "not-routed")


@dataclass(frozen=True)
class CausalLink:
    """What happened at one record, and why as far as that says.

    record: its sequence number.
    """

    record: int
    text: str
    causes: tuple[Cause, ...] = ()


@dataclass(frozen=True)
class StepTrace:
    """A step that was to be run.

    begin, end: the places, in the log, of the notes about it; `end` None where the log ends before.
    failed: whether it did, or why it is not known that it did not.
    """

    number: int
    skill: str
    start_index: int
    end_index: int | None
    failed: bool
    reason: str


@dataclass(frozen=True)
class CausalExplanation:
    """Why a run or a step ended as it did.

    headline: how that was.
    chain: from there back to the first cause.
    failed: the steps that failed on the way.
    broken: assumptions of certificates that were broken on the way.
    """

    headline: str
    chain: tuple[CausalLink, ...] = ()
    failed: tuple[StepTrace, ...] = ()
    broken_assumptions: tuple[CausalLink, ...] = ()
    changes: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        every = (cause for link in self.chain for cause in link.causes)
        object.__setattr__(self, "changes", tuple(dict.fromkeys(one for c in every for one in _changes(c))))


class RunLog:
    """The records of one log, in order."""

    def __init__(self, records: Sequence[Record]) -> None:
        self._records = records
        self._notes = [
            (place, event, details)
            for place, record in enumerate(records)
            if (event := _text(record["details"], "event")) and record["event"] == "note"
            if isinstance(details := record["details"].get("details"), dict)
        ]
        self.steps = tuple(self._steps())

    def explain_end(self) -> CausalExplanation:
        """Why the run ended as it did, or, where the agent says nothing of its end, what ended last."""
        return replace(self._explain_end(), broken_assumptions=tuple(self._broken()))

    def _broken(self) -> Iterator[CausalLink]:
        for place, event, details in self._notes:
            if event == "broken-assumption":
                listed = details.get("obligations")
                rest = f"{len(listed)} obligations" if isinstance(listed, list) else "what"
                certificate = _text(details, "certificate")[:12] or "none"
                said = f"{_text(details, 'skill')} came to what it does not declare"
                said += f"; {rest} of certificate {certificate} rest on what it does"
                yield CausalLink(place, said, _causes(details))

    def _explain_end(self) -> CausalExplanation:
        end = next((one for one in reversed(self._notes) if one[1] in _END_EVENTS), None)
        failed = tuple(one for one in self.steps if one.failed)
        if end is None:
            return self._unfinished_link(failed)
        place, event, details = end
        if event != "run-ended":
            said = _text(details, "reason") or event.replace("-", " ")
            return CausalExplanation(said, (CausalLink(place, said),))
        goal = _goal(details)
        if details.get("reached") is True:
            return CausalExplanation(f"{_text(details, 'task')}: the goal is measured{goal}", failed=failed)
        headline = f"{_text(details, 'task')}: the goal was not reached{goal}"
        chain = [CausalLink(place, _text(details, "reason")), *self._cause_of_end(place)]
        return CausalExplanation(headline, tuple(chain), failed)

    def explain_step(self, step: StepTrace) -> CausalExplanation:
        """Why a step ended as it did."""
        how = "failed" if step.failed else "did not fail"
        if step.end_index is None:
            return CausalExplanation(
                f"step {step.number}, {step.skill}: the record ends before it did", failed=(step,)
            )
        return CausalExplanation(f"step {step.number}, {step.skill}, {how}", tuple(self._step_links(step)))

    def _steps(self) -> Iterator[StepTrace]:
        for number, (at, event, details) in enumerate(
            (one for one in self._notes if one[1] in _START_EVENTS), 1
        ):
            skill, reason = _text(details, "skill"), _text(details, "reason")
            if event == "step-not-started":
                yield StepTrace(number, skill, at, at, True, reason)
                continue
            ended = next(
                (
                    (place, told)
                    for place, kind, told in self._notes
                    if place > at and kind == "step-ended" and told.get("skill") == skill
                ),
                None,
            )
            if ended is None:
                yield StepTrace(number, skill, at, None, True, "the record ends before it did")
            else:
                place, told = ended
                yield StepTrace(
                    number, skill, at, place, told.get("failed") is not False, _text(told, "reason")
                )

    def _cause_of_end(self, place: int) -> Iterator[CausalLink]:
        """What the end of the run followed: the last plan rejected, or the last step that failed for good."""
        for at, event, details in reversed([one for one in self._notes if one[0] < place]):
            if event == "plan-rejected":
                problems = details.get("problems")
                said = "; ".join(map(str, problems)) if isinstance(problems, list) else "the plan"
                cause = Cause("plan", _text(details, "planner"), said)
                yield CausalLink(at, f"the plan of `{_text(details, 'planner')}` was rejected", (cause,))
                return
            if event in ("step-ended", "step-not-started"):
                step = next((one for one in self.steps if one.end_index == at), None)
                if step is not None and step.failed and details.get("status") != "cancelled":
                    yield from self._step_links(step)
                    return

    def _step_links(self, step: StepTrace) -> Iterator[CausalLink]:
        """The end of a step as the agent judged it, as the runtime recorded it, and the gate's denial."""
        if step.end_index is None:
            return
        event, details = next((event, told) for at, event, told in self._notes if at == step.end_index)
        judged = _causes(details)
        if event == "step-not-started":
            yield CausalLink(step.end_index, f"{step.skill} was not started: {step.reason}", judged)
            return
        ended = self._last_before(step.end_index, "step-ended", step.skill)
        denial = None if ended is None else self._denial(ended, step.skill)
        deeper: list[CausalLink] = []
        if ended is not None:
            told = self._records[ended]["details"]
            found = _causes(told)
            said = _ended(told) if not found else f"ended as {_status(told)}"
            deeper.append(
                CausalLink(ended, f"the runtime says that it {said}", () if denial is not None else found)
            )
            judged = tuple(one for one in judged if one not in found)
        if denial is not None:
            decision = self._records[denial]["details"]
            asked = decision.get("asked")
            kind = asked.get("kind") if isinstance(asked, dict) else "an action"
            causes = _causes(decision) or tuple(_reasons(decision))
            deeper.append(CausalLink(denial, f"the gate denied `{kind}`", causes))
        outcome = _text(details, "outcome")
        reason = step.reason or f"outcome `{outcome}`"
        if any(link.causes for link in deeper):
            reason = _text(details, "status").replace("_", " ")
        said = f"step {step.number}, {step.skill}: {reason}"
        yield CausalLink(step.end_index, said, judged if deeper and step.failed else _causes(details))
        if step.failed:
            yield from deeper

    def _last_before(self, place: int, event: str, skill: str) -> int | None:
        return next(
            (
                at
                for at in range(place - 1, -1, -1)
                if self._records[at]["event"] == event and _skill(self._records[at]) == skill
            ),
            None,
        )

    def _denial(self, ended: int, skill: str) -> int | None:
        """The decision that ended the step, where it was denied."""
        if self._records[ended]["details"].get("status") != "denied":
            return None
        at = self._last_before(ended, "decision", skill)
        return at if at is not None and self._records[at]["details"].get("verdict") == "DENY" else None

    def _unfinished_link(self, failed: tuple[StepTrace, ...]) -> CausalExplanation:
        headline = "the record does not say how the run ended: it goes on, or was killed"
        stopped = next(
            (
                at
                for at in range(len(self._records) - 1, -1, -1)
                if self._records[at]["event"] == "step-ended"
                and self._records[at]["details"].get("status") != "finished"
            ),
            None,
        )
        if stopped is None:
            return CausalExplanation(headline, failed=failed)
        record = self._records[stopped]
        skill = _skill(record)
        denial = self._denial(stopped, skill)
        chain = [CausalLink(stopped, f"{skill} {_ended(record['details'])}", _causes(record["details"]))]
        if denial is not None:
            decision = self._records[denial]["details"]
            chain = [
                CausalLink(stopped, chain[0].text),
                CausalLink(denial, "the gate denied it", _causes(decision)),
            ]
        return CausalExplanation(headline, tuple(chain), failed)


def _goal(details: Mapping[str, Any]) -> str:
    goal, measured = _text(details, "goal"), details.get("measured")
    if not goal or not isinstance(measured, dict):
        return ""
    values = ", ".join(f"{name} is {_shown(value)}" for name, value in measured.items())
    return f" (`{goal}`; {values})"


def _shown(value: Any) -> str:
    return "unknown" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _changes(cause: Cause) -> Iterator[str]:
    """What would have to be otherwise, a line for each part."""
    for part in cause.shortfalls:
        if not part.quantity:
            yield f"{cause.rule} never allows it"
        elif part.value is None:
            yield f"`{part.quantity}` {part.reason}; `{cause.rule}` needs it measured"
        else:
            value, bound = part.formatted_values()
            asked = bound if isinstance(part.bound, bool) else f"{part.required_op} {bound}"
            yield f"{part.quantity} is {value}; {asked} is asked by `{cause.rule}`"


def _ended(details: Mapping[str, Any]) -> str:
    reason = _text(details, "reason")
    return f"ended as {_status(details)}" + (f": {reason}" if reason else "")


def _status(details: Mapping[str, Any]) -> str:
    return _text(details, "status").replace("_", " ") or "nothing known"


def _skill(record: Record) -> str:
    return f"{record['details'].get('module')}.{record['details'].get('skill')}"


def _reasons(decision: Mapping[str, Any]) -> Iterator[Cause]:
    """The reasons of a decision that holds no causes."""
    reasons = decision.get("reasons")
    for one in reasons if isinstance(reasons, list) else ():
        if isinstance(one, list) and len(one) == 3:
            code, rule, text = map(str, one)
            yield Cause("gate", rule, text, code=code)


def _causes(details: Mapping[str, Any]) -> tuple[Cause, ...]:
    listed = details.get("causes")
    return tuple(
        Cause(
            _text(one, "kind"),
            _text(one, "rule"),
            _text(one, "text"),
            _text(one, "source"),
            _text(one, "at"),
            tuple(_shortfalls(one.get("shortfalls"))),
            _text(one, "code"),
        )
        for one in (listed if isinstance(listed, list) else ())
        if isinstance(one, dict)
    )


def _shortfalls(listed: Any) -> Iterator[UnmetBound]:
    for one in listed if isinstance(listed, list) else ():
        if isinstance(one, dict) and _is_value(one.get("value"), None) and _is_value(one.get("bound")):
            texts = [_text(one, name) for name in ("asked", "unit", "why")]
            asked, unit, why = texts
            yield UnmetBound(
                _text(one, "quantity"), _real(one["value"]), asked, _real(one["bound"]), unit, why
            )


def _is_value(value: Any, *others: Any) -> bool:
    return isinstance(value, float | int | bool | str) or value in others


def _real(value: Any) -> Any:
    return float(value) if type(value) is int else value


def _text(details: Mapping[str, Any], name: str) -> str:
    found = details.get(name)
    return found if isinstance(found, str) else ""
