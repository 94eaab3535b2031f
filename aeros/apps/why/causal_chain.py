"""Causal chain of a run: from its end back to the measured values that caused it.

The log may come from another version of AEROS, so missing or unexpected fields are skipped.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from aeros.apps.stop_text import stop_text
from aeros.apps.why.failed_measurements import failures_before
from aeros.apps.why.judged_end import refuted_belief, undecided_branches
from aeros.apps.why.provider_choices import explain_choice
from aeros.runtime.audit.check import Record
from aeros.spec.expr.shortfall import UnmetBound, format_value
from aeros.spec.migrations.renamed_names import current_event
from aeros.spec.model.cause import Cause

_START_EVENTS: Final = ("step-started", "step-not-started")
_DISAGREEMENT: Final = "gate-disagreement"
_REFUTED: Final = "the robot measured that the goal was reached, and it was not"
_END_EVENTS: Final = ("run-ended", "run-interrupted", "task-not-found")


@dataclass(frozen=True)
class CausalLink:
    """One event and its causes.

    Attributes:
        record: Sequence number of the audit record.
        text: The event in one line.
        causes: Causes of the event as data; empty if none were recorded.
        is_failed_measurement: True if a perceiver or tool failed, so that values were unknown at the end.
    """

    record: int
    text: str
    causes: tuple[Cause, ...] = ()
    is_failed_measurement: bool = False


@dataclass(frozen=True)
class StepTrace:
    """A step of the run.

    Attributes:
        number: Number of the step in the run, from 1.
        skill: Skill as MODULE.SKILL.
        start_index: Index in the log of the note about its start.
        end_index: Index in the log of the note about its end; None if the log ends before.
        failed: True if it failed or has no recorded end.
        reason: Reason for its end in words.
    """

    number: int
    skill: str
    start_index: int
    end_index: int | None
    failed: bool
    reason: str


@dataclass(frozen=True)
class CausalExplanation:
    """Explanation of the end of a run or step.

    Attributes:
        headline: The end in one line.
        chain: Failed measurements, then links from the end back to the first cause.
        failed: Steps that failed before.
        broken_assumptions: Assumptions of certificates that were broken in the run.
        stops: Stops of the robot, and how it came to rest.
        changes: Values that would have to differ, one line each.
    """

    headline: str
    chain: tuple[CausalLink, ...] = ()
    failed: tuple[StepTrace, ...] = ()
    broken_assumptions: tuple[CausalLink, ...] = ()
    stops: tuple[CausalLink, ...] = ()
    changes: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        every = (cause for link in self.chain for cause in link.causes)
        object.__setattr__(self, "changes", tuple(dict.fromkeys(one for c in every for one in _changes(c))))


class RunLog:
    """The records of one log, in order.

    Args:
        records: Records of a sound audit log.

    Attributes:
        steps: The steps of the run.
    """

    def __init__(self, records: Sequence[Record]) -> None:
        self._records = records
        self._notes = [
            (place, current_event(event), details)
            for place, record in enumerate(records)
            if (event := _text(record["details"], "event")) and record["event"] == "note"
            if isinstance(details := record["details"].get("details"), dict)
        ]
        self.steps = tuple(self._steps())

    def explain_end(self) -> CausalExplanation:
        """Explain the end of the run, or the last ended step if the log has no end.

        Returns:
            The explanation.
        """
        stops = tuple(self._stops(0, len(self._records)))
        return replace(self._explain_end(), broken_assumptions=tuple(self._broken()), stops=stops)

    def _stops(self, start: int, end: int) -> Iterator[CausalLink]:
        """Yield the stops that are recorded in this range of the log."""
        for place in range(start, end):
            if self._records[place]["event"] == "stopped":
                yield CausalLink(place, stop_text(self._records[place]["details"]))

    def _broken(self) -> Iterator[CausalLink]:
        for place, event, details in self._notes:
            if event == "broken-assumption":
                listed = details.get("obligations")
                rest = f"{len(listed)} obligations" if isinstance(listed, list) else "what"
                certificate = _text(details, "certificate")[:12] or "none"
                text = f"{_text(details, 'skill')} ended with an undeclared outcome"
                text += f"; {rest} of certificate {certificate} rest on what it does"
                yield CausalLink(place, text, _causes(details))

    def _explain_end(self) -> CausalExplanation:
        end = next((one for one in reversed(self._notes) if one[1] in _END_EVENTS), None)
        failed = tuple(one for one in self.steps if one.failed)
        events = [record["event"] for record in self._records]
        halt = max((at for at, one in enumerate(events) if one == _DISAGREEMENT), default=None)
        if halt is not None and (end is None or end[1] != "run-ended" or end[0] < halt):
            return CausalExplanation(
                "the robot was halted: the compiled gate and Z3 decided an action differently",
                (CausalLink(halt, *_disagreement(self._records[halt])),),
                failed,
            )
        if end is None:
            return self._unfinished_link(failed)
        place, event, details = end
        if event != "run-ended":
            text = _text(details, "reason") or event.replace("-", " ")
            return CausalExplanation(text, (CausalLink(place, text),))
        goal = _goal(details)
        if details.get("reached") is True:
            return _reached(f"{_text(details, 'task')}: ", goal, refuted_belief(self._records, place), failed)
        if details.get("skipped") is True:
            headline = f"{_text(details, 'task')}: skipped, as its condition does not hold"
            return CausalExplanation(headline, failed=failed)
        headline = f"{_text(details, 'task')}: the goal was not reached{goal}"
        task = _text(details, "task")
        unmet = self._unmet_definitions(place, task)
        links = [
            CausalLink(place, _text(details, "reason")),
            *unmet,
            *self._cause_of_end(place),
            *(CausalLink(at, text, _causes(one)) for at, text, one in undecided_branches(self._notes, place)),
        ]
        failures = {one.record: one for one in links if one.is_failed_measurement}
        failures |= {one.record: one for one in self._failed_measurements(0, place, task)}
        # What a failed perceiver left unknown came before all that followed from it.
        chain = (*failures.values(), *(one for one in links if not one.is_failed_measurement))
        return CausalExplanation(headline, chain, failed)

    def _unmet_definitions(self, end: int, task: str) -> Iterator[CausalLink]:
        """Yield the values behind predicates by definition for which the goal was not met at the end."""
        for at, event, details in reversed([one for one in self._notes if one[0] < end]):
            if event in ("run-ended", "task-selected"):
                return
            if event == "goal-unmet" and _text(details, "task") == task:
                yield CausalLink(
                    at, "predicates by definition, with the values measured then", _causes(details)
                )
                return

    def explain_step(self, step: StepTrace) -> CausalExplanation:
        """Explain the end of a step.

        Args:
            step: One of `steps`.

        Returns:
            The explanation.
        """
        how = "failed" if step.failed else "did not fail"
        if step.end_index is None:
            return CausalExplanation(
                f"step {step.number}, {step.skill}: the log ends before the step ended", failed=(step,)
            )
        return CausalExplanation(
            f"step {step.number}, {step.skill}, {how}",
            tuple(self._step_links(step)),
            stops=tuple(self._stops(step.start_index, step.end_index)),
        )

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
                    (place, end_details)
                    for place, kind, end_details in self._notes
                    if place > at and kind == "step-ended" and end_details.get("skill") == skill
                ),
                None,
            )
            if ended is None:
                yield StepTrace(number, skill, at, None, True, "the log ends before the step ended")
            else:
                place, end_details = ended
                yield StepTrace(
                    number,
                    skill,
                    at,
                    place,
                    end_details.get("failed") is not False,
                    _text(end_details, "reason"),
                )

    def _cause_of_end(self, place: int) -> Iterator[CausalLink]:
        """Yield the cause of the run's end: the last rejected plan, or the last step that failed finally."""
        for at, event, details in reversed([one for one in self._notes if one[0] < place]):
            if event == "plan-rejected":
                problems = details.get("problems")
                text = "; ".join(map(str, problems)) if isinstance(problems, list) else "the plan"
                cause = Cause("plan", _text(details, "planner"), text)
                yield CausalLink(at, f"the plan of `{_text(details, 'planner')}` was rejected", (cause,))
                return
            if event in ("step-ended", "step-not-started"):
                step = next((one for one in self.steps if one.end_index == at), None)
                if step is not None and step.failed and details.get("status") != "cancelled":
                    yield from self._step_links(step)
                    return

    def _step_links(self, step: StepTrace) -> Iterator[CausalLink]:
        """Yield the end of a step: the agent's judgement, the runtime's record, and the gate's denial."""
        if step.end_index is None:
            return
        event, details = next((event, noted) for at, event, noted in self._notes if at == step.end_index)
        judged = _causes(details)
        if event == "step-not-started":
            yield from self._failed_measurements(step.start_index, step.end_index, step.skill)
            yield CausalLink(step.end_index, f"{step.skill} was not started: {step.reason}", judged)
            return
        ended = self._last_before(step.end_index, "step-ended", step.skill)
        denial = None if ended is None else self._denial(ended, step.skill)
        deeper: list[CausalLink] = []
        if ended is not None:
            runtime_details = self._records[ended]["details"]
            found = _causes(runtime_details)
            text = _ended(runtime_details) if not found else f"ended as {_status(runtime_details)}"
            deeper.append(CausalLink(ended, f"runtime status: {text}", () if denial is not None else found))
            judged = tuple(one for one in judged if one not in found)
        if denial is not None:
            deeper.append(_denial_link(self._records, denial))
        outcome = _text(details, "outcome")
        reason = step.reason or f"outcome `{outcome}`"
        if any(link.causes for link in deeper):
            reason = _text(details, "status").replace("_", " ")
        text = f"step {step.number}, {step.skill}: {reason}"
        if step.failed:
            yield from self._failed_measurements(step.start_index, step.end_index, step.skill)
        yield CausalLink(step.end_index, text, judged if deeper and step.failed else _causes(details))
        if step.failed:
            yield from deeper
            if ended is not None and denial is None:
                yield from _survived_denial(self._records, ended)
        yield from self._choice(step)

    def _choice(self, step: StepTrace) -> Iterator[CausalLink]:
        """Yield the choice of the step's skill among several that provide the same."""
        before = [one for one in self._notes if one[0] < step.start_index]
        if not before or before[-1][1] != "provider-selected":
            return
        place, _, details = before[-1]
        if details.get("skill") == step.skill:
            yield CausalLink(place, *explain_choice(details))

    def _failed_measurements(self, start: int, end: int, name: str) -> Iterator[CausalLink]:
        """Yield failures that left values unknown at the end of a step or task `MODULE.NAME`."""
        for at, failure in failures_before(self._records, start, end, name.partition(".")[0]):
            yield CausalLink(at, failure, is_failed_measurement=True)

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
        """Return the index of the denial that ended the step; None if no denial did."""
        if self._records[ended]["details"].get("status") != "denied":
            return None
        at = self._last_before(ended, "decision", skill)
        return at if at is not None and self._records[at]["details"].get("verdict") == "DENY" else None

    def _unfinished_link(self, failed: tuple[StepTrace, ...]) -> CausalExplanation:
        headline = "the record does not say how the run ended: it goes on, or was killed"
        if self._records and self._records[-1]["details"].get("closing") is True:
            headline = "the record was closed before the run ended: no end of its task is in it"
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


def _denial_link(records: Sequence[Record], denial: int, more: str = "") -> CausalLink:
    decision = records[denial]["details"]
    asked = decision.get("asked")
    kind = asked.get("kind") if isinstance(asked, dict) else "an action"
    causes = _causes(decision) or tuple(_reasons(decision))
    return CausalLink(denial, f"the gate denied `{kind}`{more}", causes)


def _survived_denial(records: Sequence[Record], ended: int) -> Iterator[CausalLink]:
    """Yield the last denial in a step that did not end as denied, as its skill went on."""
    skill = _skill(records[ended])
    if records[ended]["details"].get("status") == "denied":
        return
    for at in range(ended - 1, -1, -1):
        one = records[at]
        if _skill(one) != skill:
            continue
        if one["event"] == "step-began":
            return
        if one["event"] == "decision" and one["details"].get("verdict") == "DENY":
            yield _denial_link(records, at, ", and the skill went on")
            return


def _goal(details: Mapping[str, Any]) -> str:
    goal, measured = _text(details, "goal"), details.get("measured")
    if not goal or not isinstance(measured, dict):
        return ""
    values = ", ".join(f"{name} is {format_value(value)}" for name, value in measured.items())
    return f" (`{goal}`; {values})"


def _changes(cause: Cause) -> Iterator[str]:
    """Yield the values that would have to differ, one line each."""
    for part in cause.shortfalls:
        if not part.quantity:
            yield f"`{cause.rule}` denies it in every state"
        elif part.value is None:
            yield f"`{part.quantity}` {part.reason}; `{cause.rule}` needs it measured"
        else:
            value, bound = part.formatted_values()
            asked = bound if isinstance(part.bound, bool) else f"{part.required_op} {bound}"
            yield f"{part.quantity} is {value}; {asked} required by `{cause.rule}`"


def _reached(
    task: str, goal: str, refuted: tuple[int, str] | None, failed: tuple[StepTrace, ...]
) -> CausalExplanation:
    """Explain the end of a run that measured its goal as reached."""
    if refuted is None:
        return CausalExplanation(f"{task}goal reached{goal}", failed=failed)
    return CausalExplanation(f"{task}{_REFUTED}{goal}", (CausalLink(*refuted),), failed)


def _disagreement(record: Record) -> tuple[str, tuple[Cause, ...]]:
    """Return the action on which the compiled gate and Z3 disagreed, and the verdict of each as a cause."""
    details = record["details"]
    asked = details.get("asked")
    kind = asked.get("kind") if isinstance(asked, dict) else "an action"
    causes: list[Cause] = []
    for name in ("compiled", "z3"):
        outcome = details.get(name)
        if isinstance(outcome, dict):
            causes.append(Cause("verdict", name, _text(outcome, "verdict")))
            causes.extend(_reasons(outcome))
    return f"{_skill(record)} asked for `{kind}`", tuple(causes)


def _ended(details: Mapping[str, Any]) -> str:
    reason = _text(details, "reason")
    return f"ended as {_status(details)}" + (f": {reason}" if reason else "")


def _status(details: Mapping[str, Any]) -> str:
    return _text(details, "status").replace("_", " ") or "nothing known"


def _skill(record: Record) -> str:
    return f"{record['details'].get('module')}.{record['details'].get('skill')}"


def _reasons(decision: Mapping[str, Any]) -> Iterator[Cause]:
    """Yield the reasons of a decision without causes."""
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
