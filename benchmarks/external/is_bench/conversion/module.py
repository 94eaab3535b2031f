"""A converted task as files of AEROS: a site, a module with its skills and goal, and plans."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.external.is_bench.conversion.formulas import FALSE, TRUE, conjunction, disjunction, negation
from benchmarks.external.is_bench.conversion.primitives import GroundSkill, Primitives
from benchmarks.external.is_bench.conversion.task import Action, Task, parse_action
from benchmarks.external.is_bench.conversion.vocabulary import UnsupportedError, Vocabulary, identifier

MODULE = "household"

_SITE = """\
# Made from a task of IS-Bench. Its sensors and its one action kind stand for a simulator that is not used.
schema: aeros/site/1
id: home
description: A home of IS-Bench.
enums: {{support: [{places}]}}
state:
{state}
actions:
  stop: {{description: protective stop, risk: low, protective: true}}
  act:
    description: one primitive of the benchmark
    risk: low
    parameters: {{things: {{type: int, range: [0, 9]}}}}
invariants:
  - id: few-things
    on: [act]
    require: things <= 2
    rationale: a primitive has two things at most
    source: IS-Bench
policy:
  risk_ceiling: low
  access: {{actuators: [], sensors: [eyes]}}
  limits: {{skill_timeout: 60 s, retries: 0, replans: 0}}
"""

_MODULE = """\
schema: aeros/ecm/2
id: household
version: 1.0.0
description: Primitives of IS-Bench on the things of one task.
license: Apache-2.0
"""


_SKILLS = """\
from aeros.skill import Inputs, Observation, SkillBody, act


def run(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("act", things=2)
"""


@dataclass(frozen=True)
class Conversion:
    """A task in AEROS's terms.

    Attributes:
        task: the task.
        vocabulary: its variables.
        skills: skills of its actions.
        goal: condition of a plan that is complete and safe at its end, as text.
        left_out: reason for each action that has no skill.
    """

    task: Task
    vocabulary: Vocabulary
    skills: tuple[GroundSkill, ...]
    goal: str
    left_out: dict[Action, str]

    def write(self, folder: Path) -> None:
        """Write `site.yaml`, `household/ecm.yaml`, `goal.txt`, and `start.txt` with a NAME=VALUE per line."""
        module = folder / MODULE
        module.mkdir(parents=True)
        (folder / "site.yaml").write_text(self._site(), "utf-8")
        (module / "ecm.yaml").write_text(_MODULE + "\n".join(self._module()) + "\n", "utf-8")
        (module / "skills.py").write_text(_SKILLS, "utf-8")

        (folder / "goal.txt").write_text(self.goal + "\n", "utf-8")
        start = "".join(f"{name}={value}\n" for name, value in self.vocabulary.initial.items())
        (folder / "start.txt").write_text(start, "utf-8")

    def plan(self, steps: Iterable[str]) -> str:
        """Write a plan of the benchmark as a file for `aeros plan check`."""
        return "".join(f"({MODULE}.{skill_id(parse_action(step))})\n" for step in steps)

    def _site(self) -> str:
        state = "\n".join(
            f"  {name}: {{type: {_type(name)}, sensor: eyes, max_age: 1 h}}"
            for name in self.vocabulary.initial
        )
        return _SITE.format(places=", ".join(self.vocabulary.places), state=state)

    def _module(self) -> Iterator[str]:
        several = {skill_id(one.action): len(one.variants) for one in self.skills if len(one.variants) > 1}
        if several:
            yield "capabilities:"
        for name, number in several.items():
            providers = ", ".join(f"{name}__{n}" for n in range(1, number + 1))
            yield f"  {name}: {{description: one primitive, provided_by: [{providers}]}}"
        yield "skills:"
        for one in self.skills:
            yield from self._skill(one)
        yield from (
            "permissions: {sensors: [eyes], actions: {act: things <= 2}}",
            'dependencies: {aeros: ">=0.1"}',
        )

    def _skill(self, one: GroundSkill) -> Iterator[str]:
        words = self.vocabulary
        before = [
            words.condition(each.condition) for each in self.task.precautions if each.action == one.action
        ]
        noted = {words.run_variable(one.action): TRUE} if words.is_noted(one.action) else {}
        name = skill_id(one.action)
        for number, variant in enumerate(one.variants, 1):
            needed = conjunction((one.needs, variant.condition, *before))
            effects = ", ".join(f"{key}: {value}" for key, value in {**variant.effects, **noted}.items())
            yield f"  {name}__{number}:" if len(one.variants) > 1 else f"  {name}:"
            yield f"    description: {one.action[0].replace('_', ' ')}"
            yield "    entry: skills:run"
            if needed != TRUE:
                yield f'    precondition: "{needed}"'
            yield f"    outcomes: {{done: {{effects: {{{effects}}}}}}}"
            yield "    envelope: {act: things <= 2}"
            yield "    risk: low"
            yield "    timeout: 60 s"


def convert(task: Task, actions: Sequence[Action], *, offered: bool = False) -> Conversion:
    """Convert a task.

    Args:
        task: the task.
        actions: actions that get skills.
        offered: leave out actions that can never start.

    Returns:
        The conversion.

    Raises:
        UnsupportedError: the goal or a condition cannot be said.
    """
    vocabulary = Vocabulary(task, [action for action in actions if set(action[1:]) <= task.kinds.keys()])
    primitives = Primitives(vocabulary)
    skills, left_out = [], {}
    for action in dict.fromkeys(actions):
        try:
            skill = primitives.skill(action)
        except UnsupportedError as why:
            left_out[action] = str(why)
            continue
        if not offered or skill.needs != FALSE:
            skills.append(skill)
    return Conversion(task, vocabulary, tuple(skills), _goal(vocabulary), left_out)


def _goal(words: Vocabulary) -> str:
    goal = words.condition(words.task.goal)
    parts = [goal]
    for one in words.task.final:
        holds = words.condition(one.condition)
        if one.after and not words.is_noted(one.after):
            continue  # no skill runs the action, so the condition never counts
        # `on_success` counts where the goal is reached, which the goal itself demands.
        parts.append(disjunction((negation(words.run_variable(one.after)), holds)) if one.after else holds)
    return conjunction(parts)


def skill_id(action: Action) -> str:
    """Return the id of the skill, or of the capability, that runs an action."""
    return "__".join(map(identifier, action))


def offered_actions(task: Task) -> Sequence[Action]:
    """List the actions that a planner may choose from, by the abilities of the things.

    Things that have a support at the start may be moved; into things with an inside, and onto anything that
    stays where it is, or that carries or contains something in the task's start or conditions.
    """
    things = [one for one in task.kinds if not task.is_substance(one) and not one.startswith("agent.")]
    moved = [fact[1] for fact in task.init if fact[0] in {"inside", "ontop"} and fact[1] in things]
    mentioned = _mentioned_supports(task)
    found: list[Action] = []
    for thing in things:
        if task.is_able(thing, "openable"):
            found += [("open", thing), ("close", thing)]
        if task.is_able(thing, "toggleable"):
            found += [("toggle_on", thing), ("toggle_off", thing)]
        if any(fact[0] in {"frozen", "hot"} and fact[1] == thing for fact in task.init):
            found.append(("wait", thing))
        if task.has(thing, "cookable") or task.is_able(thing, "fillable"):
            found.append(("wait_for_cooked", thing))
        if "washer" in thing.split(".")[0]:
            found.append(("wait_for_washed", thing))
    for thing in moved:
        for place in things:
            if place == thing or (place in moved and place not in mentioned):
                continue
            found.append(("place_on_top", thing, place))
            if place in mentioned or any(task.is_able(place, one) for one in ("openable", "fillable")):
                found.append(("place_inside", thing, place))
    tools = [one for one in things if any(rule.tool == one.split(".")[0] for rule in task.wash_rules)]
    vessels = [one for one in things if task.is_able(one, "fillable")]
    sources = list(dict.fromkeys(fact[1] for fact in task.init if fact[0] == "insource"))
    covered = list(dict.fromkeys(fact[1] for fact in task.init if fact[0] == "covered"))
    found += [("wipe", thing, tool) for thing in covered for tool in tools if tool != thing]
    found += [("soak_inside", tool, one) for tool in tools for one in vessels]
    found += [("soak_under", tool, one) for tool in tools for one in sources]
    found += [("fill_with", one, source) for one in vessels for source in sources]
    filled = [fact[1] for fact in task.init if fact[0] == "filled"]
    found += [("pour_into", one, other) for one in filled for other in vessels if one != other]
    found += [("spread", one, other) for one in filled for other in things if one != other]
    cold = [one for one in things if "refrigerator" in one]
    found += [
        ("wait_for_frozen", one, place) for one in moved for place in cold if task.has(one, "freezable")
    ]
    return found


def _mentioned_supports(task: Task) -> set[str]:
    found = {fact[2] for fact in task.init if fact[0] in {"inside", "ontop"}}
    pending = [
        task.goal,
        *(one.condition for one in task.precautions),
        *(one.condition for one in task.final),
    ]
    while pending:
        node = pending.pop()
        if isinstance(node, tuple):
            pending += node
            if node and node[0] in {"inside", "ontop"}:
                found.add(str(node[2]))
    return found


def _type(name: str) -> str:
    return "support" if name.startswith("at_") else "bool"
