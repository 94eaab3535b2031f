"""The same policy in other engines, each as fast as its own documentation says how.  All are optional."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from benchmarks.gate_policy import ACTUATORS, ALLOWED_SKILLS, BLOCKED_SKILLS, LOWER, RISKS, UPPER

Decide = Callable[[Mapping[str, Any]], bool]


def _listed(names: tuple[str, ...]) -> str:
    return "[" + ", ".join(f'"{name}"' for name in names) + "]"


def cel() -> Decide:
    """Build Google's CEL in C++, type-checked and compiled once."""
    engine = import_module("cel_expr_python.cel")
    kinds = {"skill": engine.Type.STRING, "risk": engine.Type.STRING, "human": engine.Type.BOOL}
    kinds["actuators"] = engine.Type.List(engine.Type.STRING)
    kinds |= dict.fromkeys(("x", "y", "z", "speed", "force"), engine.Type.DOUBLE)
    box = " && ".join(
        f"{low!r} <= {name} && {name} <= {high!r}"
        for name, low, high in zip("xyz", LOWER, UPPER, strict=True)
    )
    compiled = engine.NewEnv(variables=kinds).compile(
        f"!(skill in {_listed(BLOCKED_SKILLS)}) && skill in {_listed(ALLOWED_SKILLS)}"
        f" && risk in {_listed(RISKS)} && actuators.all(one, one in {_listed(ACTUATORS)})"
        f" && (!human || speed <= 0.25) && {box} && force <= 30.0"
    )
    return lambda asked: compiled.eval(data=asked).value() is True


def cedar() -> Decide:
    """Build Cedar with the policy parsed once.  It has no doubles: numbers are whole nanounits."""
    engine = import_module("cedarpy")
    scale = 10**9
    box = " && ".join(
        f"context.{name} >= {int(low * scale)} && context.{name} <= {int(high * scale)}"
        for name, low, high in zip("xyz", LOWER, UPPER, strict=True)
    )
    policies = engine.PolicySet.from_str(
        f"""permit (principal, action, resource) when {{
          {_listed(ALLOWED_SKILLS)}.contains(context.skill) && {_listed(RISKS)}.contains(context.risk)
          && {_listed(ACTUATORS)}.containsAll(context.actuators) && {box} && context.force <= {30 * scale}
        }};
        forbid (principal, action, resource) when {{ {_listed(BLOCKED_SKILLS)}.contains(context.skill) }};
        forbid (principal, action, resource) when {{ context.human && context.speed > {scale // 4} }};"""
    )
    entities = engine.Entities.from_json_str("[]")
    who = {"principal": 'Skill::"it"', "action": 'Action::"press"', "resource": 'Robot::"it"'}

    def decide(asked: Mapping[str, Any]) -> bool:
        context = {
            name: round(value * scale) if type(value) is float else value for name, value in asked.items()
        }
        return engine.is_authorized({**who, "context": context}, policies, entities).allowed is True

    return decide


def casbin() -> Decide:
    """Build Casbin with the policy as its matcher."""
    engine = import_module("casbin")
    box = " && ".join(
        f"r.sub.{name} >= {low!r} && r.sub.{name} <= {high!r}"
        for name, low, high in zip("xyz", LOWER, UPPER, strict=True)
    )

    def either(name: str, values: tuple[str, ...]) -> str:
        return "(" + " || ".join(f"r.sub.{name} == '{value}'" for value in values) + ")"

    model = engine.Model()
    model.load_model_from_text(
        "[request_definition]\nr = sub\n[policy_definition]\np = sub\n"
        "[policy_effect]\ne = some(where (p.eft == allow))\n[matchers]\n"
        f"m = !{either('skill', BLOCKED_SKILLS)} && {either('skill', ALLOWED_SKILLS)}"
        f" && {either('risk', RISKS)} && subset(r.sub.actuators, r.sub.known)"
        f" && (!r.sub.human || r.sub.speed <= 0.25) && {box} && r.sub.force <= 30.0\n"
    )
    enforcer = engine.Enforcer(model)
    enforcer.add_function("subset", lambda given, known: all(one in known for one in given))

    class Subject:
        known = ACTUATORS

        def __init__(self, asked: Mapping[str, Any]) -> None:
            self.__dict__.update(asked)

    return lambda asked: enforcer.enforce(Subject(asked)) is True


def rego() -> Decide:
    """Build Rego in rego-cpp, with the module added once."""
    engine = import_module("regopy").Interpreter()
    box = "\n".join(
        f"  input.{name} >= {low!r}\n  input.{name} <= {high!r}"
        for name, low, high in zip("xyz", LOWER, UPPER, strict=True)
    )
    engine.add_module(
        "robot",
        f"""package robot
import rego.v1
default allow := false
blocked if input.skill in {_listed(BLOCKED_SKILLS)}
too_fast if {{
  input.human
  input.speed > 0.25
}}
allow if {{
  not blocked
  not too_fast
  input.skill in {_listed(ALLOWED_SKILLS)}
  input.risk in {_listed(RISKS)}
  every one in input.actuators {{ one in {_listed(ACTUATORS)} }}
{box}
  input.force <= 30
}}
""",
    )

    def decide(asked: Mapping[str, Any]) -> bool:
        engine.set_input(asked)
        # As text: asking an undefined result for its expressions ends the process.
        return str(engine.query("data.robot.allow")) == '{"expressions":[true]}'

    return decide


OTHER_ENGINES: Mapping[str, tuple[str, Callable[[], Decide]]] = {
    "cel-expr-python": ("cel_expr_python", cel),
    "cedarpy": ("cedarpy", cedar),
    "casbin": ("casbin", casbin),
    "regopy": ("regopy", rego),
}
"""By distribution: the module it is imported as, and how to make a decider of it."""
