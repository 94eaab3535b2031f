"""Referee: the truth of a goal in the simulator, beside what the agent believes.

It reads what a scene's `truth` defines from bodies and contacts, never a reading. The agent and the gate
cannot import it. What no scene defines is not refereed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.scenes.truths_of_arguments import truths_for


class GoalJudgement(NamedTuple):
    """Belief and truth of a goal at the end of a run.

    Attributes:
        believed: True if the agent measured that the goal is reached.
        true: True if it is reached in the simulator; None if the scene does not define that.
        values: the truth of each state variable of the goal that the scene defines.
    """

    believed: bool
    true: bool | None
    values: Mapping[str, int]

    @property
    def is_false_claim(self) -> bool:
        """True if the goal is believed and known to be false."""
        return self.believed and self.true is False

    def record(self) -> dict[str, Any]:
        """Encode the judgement for the audit record.

        Returns:
            Values for JSON.
        """
        return {"believed": self.believed, "true": self.true, "values": dict(self.values)}

    def __str__(self) -> str:
        """As printed at the end of a run."""
        belief = f"goal reached: believed {_word(self.believed)}"
        if self.true is None:
            return f"{belief}, not refereed: the scene does not define its truth"
        text = f"{belief}, {_word(self.true)} in the simulator"
        values = ", ".join(f"{name} = {_word(value)}" for name, value in self.values.items())
        return f"{text}: {values}" if self.is_false_claim else text


def truth_of(plant: object) -> Mapping[str, int]:
    """Read what is true in a plant's simulator.

    Args:
        plant: any plant.

    Returns:
        The truth, or the number, of each state variable that its scene defines; empty for a plant that knows
        no truth.
    """
    source = getattr(plant, "truth", None)
    return {} if source is None else source()


def truth_by_variable(
    truth: Mapping[str, int], module: str, arguments: Mapping[str, Any]
) -> Mapping[str, int]:
    """Name truths as a module does.

    Args:
        truth: the truth of state variables, as `truth_of` reads it.
        module: id of the module; a scene names that module's own variables by their short names.
        arguments: values of the parameters of tasks, by full name.

    Returns:
        The truth that holds for these arguments, by full and by short name.
    """
    # Of its own module a scene may say what is the site's, as `holding`, and the other way round.
    found = {variable: truth[name] for variable, name in truths_for(truth, arguments, module).items()}
    own = f"{module}."
    return {
        **{f"{own}{name}": value for name, value in found.items()},
        **{name.removeprefix(own): value for name, value in found.items()},
        **found,
    }


def judge_goal(
    goal: t.Term,
    believed: bool,
    truth: Mapping[str, int],
    module: str = "",
    arguments: Mapping[str, Any] = MappingProxyType({}),
) -> GoalJudgement:
    """Judge a goal by the truth.

    Args:
        goal: condition on state variables.
        believed: True if the agent measured that it is reached.
        truth: the truth of state variables.
        module: id of the goal's module; a scene names that module's own variables by their short names.
        arguments: values of the parameters of tasks, by full name.

    Returns:
        The judgement: false if a conjunct is false, true if all are known and true, else not refereed.
    """
    truth = truth_by_variable(truth, module, arguments)
    names = {name for part in _conjuncts(goal) for name in t.variables_of(part)}
    values = {name: truth[name] for name in sorted(names & truth.keys())}
    judged = [_judge(part, {**arguments, **values}) for part in _conjuncts(goal)]
    return GoalJudgement(believed, _all_true(judged), values)


def join_judgements(judgements: Sequence[GoalJudgement]) -> GoalJudgement:
    """Join the judgements of several goals that all were to be reached.

    Args:
        judgements: one for each goal, at least one.

    Returns:
        True if all are true, false if one is false, else not refereed.
    """
    judged = [one.true for one in judgements]
    values = {name: value for one in judgements for name, value in one.values.items()}
    return GoalJudgement(all(one.believed for one in judgements), _all_true(judged), values)


def _all_true(judged: Sequence[bool | None]) -> bool | None:
    return False if False in judged else None if None in judged or not judged else True


def _conjuncts(goal: t.Term) -> Iterator[t.Term]:
    if isinstance(goal, t.And):
        for part in goal.operands:
            yield from _conjuncts(part)
    else:
        yield goal


def _judge(condition: t.Term, values: Mapping[str, Any]) -> bool | None:
    if t.variables_of(condition).keys() <= values.keys():
        return is_true(condition, values)
    return None


def _word(value: int) -> str:
    return str(value).lower()
