"""Tasks of IS-Bench as data: things, start, goal, safety conditions, wash rules and example plan."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, TypeAlias

Node: TypeAlias = "str | tuple[Node, ...]"
"""A word of BDDL, or a list of them in round brackets."""

Action: TypeAlias = tuple[str, ...]
"""A ground action in lower case: the primitive, then its things."""

KNOWLEDGE: Final = Path("bddl", "bddl", "generated_data")
"""Folder of the benchmark with the properties of kinds of things."""


class BenchmarkFileError(Exception):
    """A file of the benchmark that cannot be read; the message says where and why."""


@dataclass(frozen=True)
class Precaution:
    """A condition that must hold before an action.

    Attributes:
        action: the action.
        condition: the condition.
    """

    action: Action
    condition: Node


@dataclass(frozen=True)
class FinalCondition:
    """A condition that must hold at the end of a plan.

    Attributes:
        after: it counts only if this action was run; empty for always.
        on_success: it counts only where the goal is reached.
        condition: the condition.
    """

    after: Action
    on_success: bool
    condition: Node


@dataclass(frozen=True)
class WashRule:
    """A rule on tools that remove a substance.

    Attributes:
        tool: category of the tool.
        system: category of the substance.
        needs: alternatives, one of which the tool needs: `saturated` with a category, or `toggled_on`.
    """

    tool: str
    system: str
    needs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Kinds:
    """Properties of kinds of things.

    Attributes:
        having: kinds that have a property, by its name.
        heat_inside: heat sources that heat what is in them; the others heat what is on them.
    """

    having: Mapping[str, frozenset[str]]
    heat_inside: frozenset[str]


@dataclass(frozen=True)
class Task:
    """One task of the benchmark.

    Attributes:
        name: name of its file, without ending.
        instruction: the task in words.
        kinds: kind of each thing by name, in the order of its problem file.
        abilities: abilities of each thing by name.
        init: facts of the start that are not denied.
        goal: condition to reach.
        precautions: conditions before actions.
        final: conditions at the end.
        wash_rules: rules on cleaning tools.
        plan: the example plan, without its `DONE`.
        knowledge: properties of kinds of things.
    """

    name: str
    instruction: str
    kinds: Mapping[str, str]
    abilities: Mapping[str, frozenset[str]]
    init: tuple[tuple[str, ...], ...]
    goal: Node
    precautions: tuple[Precaution, ...]
    final: tuple[FinalCondition, ...]
    wash_rules: tuple[WashRule, ...]
    plan: tuple[str, ...]
    knowledge: Kinds

    def has(self, thing: str, what: str) -> bool:
        """Tell if the kind of `thing` has a property."""
        return self.kinds[thing] in self.knowledge.having.get(what, ())

    def is_able(self, thing: str, ability: str) -> bool:
        """Tell if `thing` is `openable`, `toggleable` or `fillable`."""
        return ability in self.abilities[thing]

    def is_substance(self, thing: str) -> bool:
        """Tell if `thing` is a substance such as water or dust, which has no place."""
        return self.has(thing, "substance") or self.kinds[thing].startswith("cooked__")


def category(kind: str) -> str:
    """Return the first word of a kind or of a thing, `mug` of `mug.n.04_1`."""
    return kind.split(".")[0]


def without_safety(task: Task) -> Task:
    """Return the task without its safety conditions, for the control of an experiment."""
    return replace(task, precautions=(), final=())


def parse_action(text: str) -> Action:
    """Parse `OPEN(oven.n.01_1)`."""
    name, _, rest = text.strip().lower().partition("(")
    things = rest.rstrip(")").split(",") if rest.strip(") ") else []
    return (name.strip(), *(thing.strip() for thing in things))


def parse_bddl(text: str, origin: str) -> Node:
    """Parse the first list of a text of BDDL.

    Args:
        text: the text; `;` starts a comment.
        origin: the text's place, for messages.

    Returns:
        The list.

    Raises:
        BenchmarkFileError: its brackets do not match.
    """
    words = []
    for line in text.lower().splitlines():
        words += line.split(";")[0].replace("(", " ( ").replace(")", " ) ").split()
    open_lists: list[list[Node]] = []
    for word in words:
        if word == "(":
            open_lists.append([])
            continue
        node: Node = word.lstrip("?")
        if word == ")" and open_lists:
            node = tuple(open_lists.pop())
            if not open_lists:
                return node
        if not open_lists:
            break
        open_lists[-1].append(node)
    raise BenchmarkFileError(f"{origin}: the brackets of `{' '.join(words)[:60]}` do not match")


def read_tasks(folder: Path) -> Iterator[Task]:
    """Read all tasks of the benchmark.

    Args:
        folder: its checked-out repository.

    Yields:
        Each task, by name.

    Raises:
        BenchmarkFileError: a file is missing or cannot be read.
    """
    files = sorted((folder / "data" / "tasks").glob("*.json"))
    if not files:
        raise BenchmarkFileError(f"`{folder}` has no data/tasks/*.json: give the folder of the benchmark")
    knowledge = _read_kinds(folder / KNOWLEDGE)
    problems = {
        path: _sections(parse_bddl(path.read_text("utf-8"), str(path)))
        for path in sorted((folder / "data" / "bddl").glob("*/*.bddl"))
    }
    for file in files:
        try:
            yield _read_task(file, problems, knowledge)
        except (KeyError, TypeError, ValueError, IndexError) as why:
            raise BenchmarkFileError(f"{file}: not a task of the benchmark: {why!r}") from why


def _read_kinds(folder: Path) -> Kinds:
    try:
        having = json.loads((folder / "properties_to_synsets.json").read_text("utf-8"))
        parameters = json.loads((folder / "propagated_annots_params.json").read_text("utf-8"))
    except (OSError, ValueError) as why:
        raise BenchmarkFileError(f"`{folder}`: the properties of kinds cannot be read: {why}") from why
    inside = [name for name, one in parameters.items() if one.get("heatSource", {}).get("requires_inside")]
    return Kinds({name: frozenset(kinds) for name, kinds in having.items()}, frozenset(inside))


def _sections(problem: Node) -> Mapping[str, tuple[Node, ...]]:
    return {str(part[0]): part[1:] for part in problem[1:] if isinstance(part, tuple)}


def _read_task(file: Path, problems: Mapping[Path, Mapping[str, tuple[Node, ...]]], knowledge: Kinds) -> Task:
    data: dict[str, Any] = json.loads(file.read_text("utf-8"))
    title = str(data["task_info"]["task_name"])
    named = [one for path, one in problems.items() if path.parent.name == title]
    named = named or [one for one in problems.values() if one["problem"] == (f"{title.lower()}-0",)]
    if len(named) != 1:
        raise ValueError(f"it has {len(named)} problem files")
    (problem,) = named
    kinds = dict(_declared_kinds(problem[":objects"]))
    context, conditions = data["planning_context"], data["evaluation_goal_conditions"]
    listed = {name.lower(): frozenset(able) for name, able in context["object_abilities"].items()}
    shown = {name.lower() for name in context["object_list"]}
    abilities = {
        thing: listed.get(thing, frozenset())
        if thing in shown
        else frozenset(
            able for able in ("openable", "toggleable", "fillable") if kind in knowledge.having[able]
        )
        for thing, kind in kinds.items()
    }
    facts = [tuple(map(str, one)) for one in problem[":init"] if one[0] != "not"]
    plan = [step["action"] for step in data["example_planning"]]
    return Task(
        file.stem,
        context["task_instruction"],
        kinds,
        abilities,
        tuple(facts),
        _condition(conditions["execution_goal_condition"], file),
        tuple(
            Precaution(parse_action(one["action"]), _condition(one["safety_bddl"], file))
            for one in conditions["process_safety_goal_condition"]
        ),
        tuple(_final(one, file) for one in conditions["termination_safety_goal_condition"]),
        tuple(_wash_rule(one) for one in context["wash_rules"]),
        tuple(step for step in plan if step.strip().upper() != "DONE"),
        knowledge,
    )


def _declared_kinds(words: tuple[Node, ...]) -> Iterator[tuple[str, str]]:
    start = 0
    for place, word in enumerate(words):
        if word == "-":
            for thing in words[start:place]:
                yield str(thing), str(words[place + 1])
            start = place + 2


def _condition(text: str, file: Path) -> Node:
    # `(:goal A B)` counts as A, as in the benchmark's own compiler, which reads no further.
    return parse_bddl(text, str(file))[1]


def _final(one: Mapping[str, Any], file: Path) -> FinalCondition:
    condition, action = _condition(one["safety_bddl"], file), one["action"]
    if action is None:
        return FinalCondition((), False, condition)
    if action.strip().lower() == "completion":
        return FinalCondition((), True, condition)
    return FinalCondition(parse_action(action), False, condition)


def _wash_rule(one: Mapping[str, Any]) -> WashRule:
    needs = [
        (need["type"], "" if need["type"] == "toggled_on" else need["value"])
        for need in one.get("conditions", ())
    ]
    return WashRule(one["cleaning_tool"], one["support_system"], tuple(needs))
