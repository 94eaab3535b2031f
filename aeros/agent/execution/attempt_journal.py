"""Journal entries about attempts: choice of a skill, start, unusual length, end, and broken assumptions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import inf
from typing import Any

from aeros.agent.execution.attempt import PendingAttempt
from aeros.agent.execution.cancellable_wait import CancellableWait
from aeros.agent.execution.dispatcher import ChosenComposition, Dispatch
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.provider_choice import ProviderOption
from aeros.agent.execution.report import StepRole
from aeros.agent.execution.supervisor import StepAssessment
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import EndedStep, Runtime, StepResult, StepStatus
from aeros.spec.model.cause import Cause, causes_to_json
from aeros.spec.model.ecm import owner_of
from aeros.spec.verification.outcome_dependencies import obligations_assuming_outcomes


def record_provider_choice(
    journal: Journal, module: str, name: str, dispatch: Dispatch | ChosenComposition
) -> None:
    """Record which alternative was chosen for a capability; nothing if a skill was asked for by name.

    Args:
        journal: takes the entry.
        module: id of the module.
        name: capability that was asked for.
        dispatch: the choice, with its options.
    """
    choice = dispatch.choice
    if choice.options:
        journal.record(
            "provider-selected",
            f"`{_chosen_name(module, dispatch)}` for {module}.{name} ({choice.reason}): "
            + "; ".join(map(str, choice.options)),
            capability=f"{module}.{name}",
            skill=".".join(owner_of(_chosen_name(module, dispatch), module)),
            context=json.loads(dispatch.context),
            reason=choice.reason,
            explores=choice.is_exploration,
            options=[_option_to_json(option) for option in choice.options],
        )


def _chosen_name(module: str, dispatch: Dispatch | ChosenComposition) -> str:
    if isinstance(dispatch, ChosenComposition):
        return dispatch.name
    request = dispatch.request
    return request.skill if request.module == module else f"{request.module}.{request.skill}"


def record_start(journal: Journal, role: StepRole, dispatch: Dispatch, inputs: Mapping[str, Any]) -> None:
    """Record that a skill is about to start, with how it did before.

    Args:
        journal: takes the entry.
        role: reason for the invocation.
        dispatch: the request.
        inputs: its inputs as JSON values.
    """
    record, usual = dispatch.record, dispatch.typical_duration
    name = f"{dispatch.request.module}.{dispatch.request.skill}"
    tries = record.successes + record.failures
    took = "" if usual is None else f" in about {usual.median:.3g} s"
    history = f" (before: {record.successes} of {tries} succeeded{took})" if tries else ""
    journal.record_step(
        "step-started",
        f"{role.value} {name}{history}",
        skill=name,
        role=role.value,
        inputs=inputs,
        successes=record.successes,
        failures=record.failures,
        usual_seconds=None if usual is None else usual.median,
        timeout_seconds=float(dispatch.skill.timeout),
    )


def record_not_started(
    journal: Journal, role: StepRole, skill: str, reason: str, causes: tuple[Cause, ...]
) -> None:
    """Record that a skill did not start.

    Args:
        journal: takes the entry.
        role: reason for the invocation.
        skill: as `MODULE.SKILL`.
        reason: text of the reason why the step did not start.
        causes: the same reason as data.
    """
    journal.record(
        "step-not-started",
        f"{role.value} {skill}: {reason}",
        skill=skill,
        role=role.value,
        reason=reason,
        causes=causes_to_json(causes),
    )


def record_replan(journal: Journal, number: int, reason: str, causes: tuple[Cause, ...]) -> None:
    """Record that a plan went no further, so that the agent plans again.

    Args:
        journal: takes the entry.
        number: number of the new plan after the first one, from 1.
        reason: text of the reason why the plan went no further.
        causes: the values behind predicates by definition that decided no branch of it.
    """
    behind = {"causes": causes_to_json(causes)} if causes else {}
    journal.record("replan", f"re-plan {number}: {reason}", number=number, reason=reason, **behind)


def record_unmet_definitions(journal: Journal, task: str, causes: tuple[Cause, ...]) -> None:
    """Record the measured values behind predicates by definition for which a goal is not met.

    Args:
        journal: takes the entry, if there is any such predicate.
        task: as `MODULE.TASK`.
        causes: a cause for each predicate.
    """
    if causes:
        text = "; ".join(f"by definition of {cause}" for cause in causes)
        journal.record("goal-unmet", f"{task}: {text}", task=task, causes=causes_to_json(causes))


def record_end(
    journal: Journal, role: StepRole, dispatch: Dispatch, result: StepResult, judgement: StepAssessment
) -> None:
    """Record how a step ended.

    Args:
        journal: takes the entry.
        role: reason for the invocation.
        dispatch: the request.
        result: result that the runtime gave.
        judgement: its assessment by the measured world.
    """
    name = f"{dispatch.request.module}.{dispatch.request.skill}"
    journal.record_step(
        "step-ended",
        f"{role.value} {name}: {judgement.reason or f'outcome `{judgement.outcome}`'}",
        skill=name,
        role=role.value,
        status=result.status.value,
        outcome=judgement.outcome,
        failed=judgement.failed,
        reason=judgement.reason,
        causes=causes_to_json(judgement.causes),
    )


def record_broken_assumption(
    journal: Journal,
    runtime: Runtime,
    dispatch: Dispatch,
    result: StepResult,
    judgement: StepAssessment,
    *,
    before: Mapping[str, Any],
    after: WorldModel,
    ends_run: bool,
) -> None:
    """Record an undeclared outcome, with the proofs of the module that assume the declared ones.

    Args:
        journal: takes the entry.
        runtime: has the module and its certificate.
        dispatch: the request.
        result: result that the runtime gave.
        judgement: its assessment.
        before: predicates as measured before.
        after: the world as measured after.
        ends_run: the site stops the run for it.
    """
    request, skill = dispatch.request, dispatch.skill
    name = f"{request.module}.{request.skill}"
    certificate = runtime.certificate(request.module)
    ecm = runtime.active_modules().get(request.module)
    resting = (
        []
        if certificate is None or ecm is None
        else obligations_assuming_outcomes(ecm, skill.id, certificate)
    )
    rests = f"; {len(resting)} of its module's proofs rest on those" if resting else ""
    journal.record(
        "broken-assumption",
        f"{name} ended in a state that its manifest does not declare{rests}",
        module=request.module,
        skill=name,
        halted=result.status is not StepStatus.FINISHED,
        stops=ends_run,
        declared=list(skill.outcomes),
        certificate=None if certificate is None else certificate.digest,
        version=None if certificate is None else certificate.version,
        obligations=[str(one) for one in resting],
        before=dict(before),
        after=dict(after.predicates),
        causes=causes_to_json(judgement.causes),
    )


def _option_to_json(option: ProviderOption) -> dict[str, Any]:
    """Encode a provider by the field names that traces have."""
    return {
        "skill": option.skill,
        "record": asdict(option.record),
        "recent": {name: round(value, 6) for name, value in asdict(option.recent).items()},
        "usual_seconds": option.seconds,
        "expected_seconds": option.expected_s,
        "wear_seconds": option.wear_s,
        "drawn": option.sampled_success,
        "why_not": option.unavailable_reason,
    }


@dataclass(frozen=True, slots=True)
class _Watched:
    """A running step, and when it is overdue.

    Attributes:
        pending: the attempt.
        due: plant time from which it is overdue, s.
    """

    pending: PendingAttempt
    due: float


class OverdueSteps:
    """Running steps that take much longer than most successes of their skills did, each recorded once.

    Memory shortens no time-out: the proof of a task assumes the declared one, and a step that is cut short
    may leave a state that no outcome declares. So a person or a program that watches is told, and decides.

    Args:
        journal: takes an entry `step-overdue` for each that becomes overdue.
    """

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._watched: dict[int, _Watched] = {}

    def begin(self, pending: PendingAttempt) -> None:
        """Watch a step that has started; without enough successes before, it is never overdue.

        Args:
            pending: the attempt.
        """
        usual = pending.dispatch.typical_duration
        longest = None if usual is None else usual.longest_usual
        if longest is not None:
            due = pending.episode_start.started + longest
            self._watched[pending.episode_id] = _Watched(pending, due)

    def end(self, pending: PendingAttempt) -> None:
        """Watch a step no more.

        Args:
            pending: the attempt, watched or not.
        """
        self._watched.pop(pending.episode_id, None)

    def wait(self, waiting: CancellableWait, until: float) -> EndedStep | None:
        """Wait for the next step to end, and record meanwhile what is overdue.

        Args:
            waiting: the wait of the run.
            until: plant time at which the wait ends, s.

        Returns:
            As of `CancellableWait.until`.
        """
        while (due := min((one.due for one in self._watched.values()), default=inf)) < until:
            was_cancelled = waiting.was_cancelled
            ended = waiting.until(due)
            if ended is not None or waiting.was_cancelled is not was_cancelled:
                return ended
            # A simulator waits no longer than to the last tick before.
            self._record(max(due, waiting.now))
        return waiting.until(until)

    def _record(self, now: float) -> None:
        for one in [one for one in self._watched.values() if one.due <= now]:
            self.end(one.pending)
            request, usual = one.pending.dispatch.request, one.pending.dispatch.typical_duration
            name = f"{request.module}.{request.skill}"
            seconds = now - one.pending.episode_start.started
            timeout = float(one.pending.dispatch.skill.timeout)
            self._journal.record(
                "step-overdue",
                f"{one.pending.role.value} {name} still runs after {seconds:.3g} s; its successes took "
                f"{usual}; time-out after {timeout:g} s",
                skill=name,
                role=one.pending.role.value,
                seconds=seconds,
                usual_seconds=None if usual is None else usual.median,
                timeout_seconds=timeout,
            )
