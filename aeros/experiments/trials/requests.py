"""Trials of the gate: requests for actions, some to be allowed and some to be denied, each decided once.

Settings of a condition: `policy`, whether the gate decides; `requests`, each with `name`, what is asked for
(`module`, `skill`, `kind`, `parameters`), whether it is `allowed`, and `why` not.  Of a parameter,
`[low, high]` is drawn uniformly by the trial's seed, and a list of three has one such entry for each.  A
request may have `risk`, to which that of its skill is raised, or `blocked`: the operator blocks its skill.

Requests are decided on the state where nothing has happened yet, so a denial is for what is asked for.
Nothing moves, so findings are the same on each plant.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from random import Random
from typing import Any, Final

from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.open_gate import OpenGate
from aeros.experiments.trial_kinds import Findings, Trial
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.gate.port import Gate
from aeros.runtime.ports import Readings
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import Action
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.rules import Risk

Request = Mapping[str, Any]


class RequestTrials:
    """Kind of trials in which the gate decides a list of requests."""

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """Implement `TrialKind.open`: the gate decides all requests of a trial in turn."""
        settings = condition.settings
        requests: list[Request] = settings["requests"]
        configuration = _with_risk_and_blocks(premises.configuration, requests)
        gate: Gate = CompiledGate(configuration) if settings["policy"] else OpenGate(configuration)
        measured = {one["module"]: _measured(configuration, one["module"]) for one in requests}

        def trial(seed: int) -> Findings:
            began = time.process_time()
            allowed = {
                one["name"]: _is_allowed(gate, configuration, one, measured[one["module"]], seed)
                for one in requests
            }
            valid = [allowed[one["name"]] for one in requests if one["allowed"]]
            invalid = [allowed[one["name"]] for one in requests if not one["allowed"]]
            wrong = [one["name"] for one in requests if allowed[one["name"]] is not one["allowed"]]
            return {
                "reached": not wrong,
                "wrong": wrong,
                "valid": len(valid),
                "rejected": valid.count(False),
                "invalid": len(invalid),
                "blocked": invalid.count(False),
                "accepted": invalid.count(True),
                "processor_s": time.process_time() - began,
            }

        yield trial

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Implement `TrialKind.expected_values`.

        An enforced policy blocks exactly the requests that it does not allow.
        """
        is_on = float(condition.settings["policy"])
        return {"blocked": is_on, "accepted": 1.0 - is_on, "rejected": 0.0}


def _with_risk_and_blocks(configuration: Configuration, requests: list[Request]) -> Configuration:
    """Raise the risk of some skills, and block some, as requests say."""
    modules = dict(configuration.modules)
    blocks = []
    for one in requests:
        if "risk" in one:
            ecm = modules[one["module"]]
            riskier = replace(ecm.skills[one["skill"]], risk=Risk[one["risk"].upper()])
            modules[ecm.id] = replace(ecm, skills={**ecm.skills, riskier.id: riskier})
        if one.get("blocked", False):
            blocks.append(OperatorOverride(one["name"], "an experiment", one["module"], one["skill"], None))
    return replace(configuration, site=configuration.site.with_overrides(blocks), modules=modules)


def _measured(configuration: Configuration, module: str) -> Readings:
    """Return the readings where the tasks of `module` begin; for a module that is not there, the defaults."""
    ecm = configuration.modules.get(module)
    initial = {} if ecm is None else {k: v for one in ecm.tasks.values() for k, v in one.start.items()}
    return SymbolicPlant(configuration.site, configuration.modules, 0, to_doubles(initial)).observe()


def _is_allowed(
    gate: Gate, configuration: Configuration, one: Request, measured: Readings, seed: int
) -> bool:
    random = Random(f"{seed} {one['name']}")  # noqa: S311  no secret
    parameters = {name: _sample_value(value, random) for name, value in one["parameters"].items()}
    unused = {quota.id: 0 for quota in configuration.site.quotas if one["kind"] in quota.kinds}
    caller = Caller(one["module"], one["skill"], {})
    decision = gate.decide(caller, measured, Action(one["kind"], parameters), 0.0, unused)
    return decision.kind is not DecisionKind.DENY


def _sample_value(value: Any, random: Random) -> Any:
    match value:
        case [low, high]:
            return random.uniform(low, high)
        case [x, y, z]:
            return (_sample_value(x, random), _sample_value(y, random), _sample_value(z, random))
        case "nan":
            return float("nan")
        case int():
            return float(value)
        case _:
            return value


KIND: Final = RequestTrials()
