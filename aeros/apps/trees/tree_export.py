"""Export of compositions as BehaviorTree.CPP v4 XML, which Groot2 opens.

The tree has the same order of leaves.  A condition is a leaf `StateCondition` with its expression as a port,
and a skill is an action with its inputs and outputs as ports; an output that another step takes is the entry
`STEP.OUTPUT` of the blackboard.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any, Final

from aeros.apps.trees.leaves import STATE_CONDITION, leaf_id
from aeros.spec.expr.units import format_number, format_quantity
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    TimedPart,
    steps_of,
)
from aeros.spec.model.variables import Declared

MAX_ELEMENTS: Final = 5000


class UnexportableError(Exception):
    """A composition that no such file can hold; the message says why."""


def export_tree(ecm: Ecm, composition: Composition) -> str:
    """Write a composition as XML.

    Args:
        ecm: module that declares it.
        composition: the composition; its handlers form no cycle.

    Returns:
        The file's text.

    Raises:
        UnexportableError: it is too large when its handlers are written out, two ports have one name, or a
            name is reserved.
    """
    root = ET.Element("root", BTCPP_format="4", main_tree_to_execute=composition.id)
    tree = ET.SubElement(root, "BehaviorTree", ID=composition.id)
    writer = _Writer(ecm, composition)
    if composition.precondition_span is not None:
        tree = _child(tree, "Sequence")
        _condition(tree, composition.precondition_span.text)
    writer.add(tree, composition.body)
    if "root" in (composition.id, *writer.used):
        raise UnexportableError("BehaviorTree.CPP reserves the name `root`; rename the composition or skill")
    root.append(_models(ecm, writer.used))
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _child(parent: ET.Element, tag: str, /, **attributes: str) -> ET.Element:
    return ET.SubElement(parent, tag, attributes)


def _condition(parent: ET.Element, text: str, element: str = "Condition") -> None:
    _child(parent, element, ID=STATE_CONDITION, expression=text)


class _Writer:
    """Writer of one composition.

    Attributes:
        used: the skills of which an action runs one, by the name of that skill or of their capability.
    """

    def __init__(self, ecm: Ecm, composition: Composition) -> None:
        self._ecm = ecm
        self._composition = composition
        flows = (
            flow
            for step in (*steps_of(composition.body), *composition.handlers.values())
            for flow in step.output_references.values()
        )
        self._flowing = {(flow.step, flow.output) for flow in flows}
        self._count = 0
        self.used: dict[str, tuple[str, ...]] = {}

    def add(self, parent: ET.Element, part: Part) -> None:
        """Add a part to an element.

        Args:
            parent: the element.
            part: the part.

        Raises:
            UnexportableError: the tree is too large, or two ports have one name.
        """
        self._count += 1
        if self._count > MAX_ELEMENTS:
            reason = f"it makes more than {MAX_ELEMENTS} elements with its tries and handlers written out"
            raise UnexportableError(f"{reason}; use fewer tries")
        match part:
            case Step():
                self._step(parent, part)
            case Seq(parts=()):
                _child(parent, "AlwaysSuccess")
            case Seq(parts=parts):
                self._all(_child(parent, "Sequence"), parts)
            case Par(branches=branches):
                self._all(_child(parent, "Parallel", success_count="-1", failure_count="1"), branches)
            case Fallback(parts=(one, Seq(parts=()))):
                self.add(_child(parent, "ForceSuccess"), one)
            case Fallback(parts=parts):
                self._all(_child(parent, "Fallback"), parts)
            case RetriedPart(part=one, retry=retry):
                self.add(_child(parent, "RetryUntilSuccessful", num_attempts=str(retry + 1)), one)
            case HeldPart(part=one, condition=condition):
                held = _child(parent, "ReactiveSequence")
                _condition(held, condition.text)
                self.add(held, one)
                for child in held:  # BehaviorTree.CPP reads no other form here
                    if child.tag in ("Action", "Condition"):
                        child.tag = child.attrib.pop("ID")
            case TimedPart(part=one, timeout=timeout):
                milliseconds = timeout * 1000
                if milliseconds.denominator != 1:
                    reason = f"the `timeout` of {format_number(timeout)} s is no whole number of milliseconds"
                    raise UnexportableError(f"{reason}; change it")
                self.add(_child(parent, "Timeout", msec=str(milliseconds)), one)
            case If(text=text, then=Seq(parts=()), otherwise=FailingPart()):
                _condition(parent, text)
            case If(text=text, then=then, otherwise=otherwise):
                choice = _child(parent, "IfThenElse")
                _condition(choice, text)
                self._all(choice, (then,) if otherwise is None else (then, otherwise))
            case FailingPart():
                _child(parent, "AlwaysFailure")

    def _all(self, element: ET.Element, parts: tuple[Part, ...]) -> None:
        for one in parts:
            self.add(element, one)

    def _step(self, parent: ET.Element, step: Step) -> None:
        """Add a step with its tries, the handler between them, and the one after the last."""
        if step.last_handler is not None:
            parent = _child(parent, "Fallback")
        if step.between_tries is None:
            tries = parent
            if step.retry:
                tries = _child(parent, "RetryUntilSuccessful", num_attempts=str(step.retry + 1))
            self._action(tries, step)
        else:
            self._tries_with_handler(parent, step)
        if step.last_handler is not None:
            self.add(_child(parent, "ForceFailure"), self._composition.handlers[step.last_handler])

    def _tries_with_handler(self, parent: ET.Element, step: Step) -> None:
        handler = self._composition.handlers[step.between_tries or ""]
        for _ in range(step.retry):
            either = _child(parent, "Fallback")
            self._action(either, step)
            parent = _child(either, "Sequence")
            self.add(parent, handler)
        self._action(parent, step)

    def _action(self, parent: ET.Element, step: Step) -> None:
        self.used[step.skill] = step.runs
        names = [port for run in step.runs for _, port in _ports(self._ecm.callable_skills[run])]
        doubled = {"ID", "name"}.intersection(names) or {
            one for one in names if len(step.runs) == 1 and names.count(one) > 1
        }
        if doubled:
            reason = "which is an input and an output, or a word of the format"
            raise UnexportableError(f"`{step.skill}` has the port `{min(doubled)}`, {reason}")
        skills = [self._ecm.callable_skills[name] for name in step.runs]
        ports = {name: _value(skills[0].inputs[name], value) for name, value in step.inputs.items()}
        ports |= {name: f"{{{flow.step}.{flow.output}}}" for name, flow in step.output_references.items()}
        ports |= {name: f"{{{id_}.{name}}}" for id_, name in sorted(self._flowing) if id_ == step.id}
        _child(parent, "Action", ID=leaf_id(step.skill), name=step.id, **ports)


def _value(declared: Declared, value: Any) -> str:
    match value:
        case bool():
            return str(value).lower()
        case Fraction():
            return format_quantity(value, declared.unit)
        case tuple():
            return f"[{', '.join(_value(declared, one) for one in value)}]"
        case _:
            return str(value)


def _models(ecm: Ecm, used: Mapping[str, tuple[str, ...]]) -> ET.Element:
    """Describe the leaves for Groot2."""
    models = ET.Element("TreeNodesModel")
    condition = _child(models, "Condition", ID=STATE_CONDITION)
    _child(condition, "input_port", name="expression")
    for name, runs in sorted(used.items()):
        action = _child(models, "Action", ID=leaf_id(name))
        for tag, port in dict.fromkeys(one for run in runs for one in _ports(ecm.callable_skills[run])):
            _child(action, tag, name=port)
    return models


def _ports(skill: Skill) -> Iterator[tuple[str, str]]:
    declared: tuple[tuple[str, Mapping[str, Declared]], ...] = (
        ("input_port", skill.inputs),
        ("output_port", skill.outputs),
    )
    for tag, ports in declared:
        yield from ((tag, name) for name in ports)
