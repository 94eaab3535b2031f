"""One robot policy, and requests under it: for AEROS as files, for the other engines as attributes.

The policy: operator block, allowed skills, risk, actuators, a slower speed near a person, a box for the
target, a limit on force.  For AEROS the first four are declarations of a proved module; the other engines
receive them as attributes.  Bounds are exact as doubles, so every engine can be right about every request.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import prove_configuration

NOW = 100.0
ALLOWED_SKILLS = ("wipe", "sand", "polish")
BLOCKED_SKILLS = ("polish",)
RISKS = ("low", "medium")
ACTUATORS = ("arm", "gripper")
KINDS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "press": ("medium", ("arm", "gripper")),
    "press_with_rail": ("medium", ("arm", "rail")),
    "blast": ("high", ("arm",)),
}
"""Risk and actuators of each kind of action."""
LOWER, UPPER = (0.25, -0.5, 0.0), (0.75, 0.5, 0.5)

_PARAMETERS = """
    parameters:
      x: {type: real, unit: m, range: [-2, 2]}
      y: {type: real, unit: m, range: [-2, 2]}
      z: {type: real, unit: m, range: [-2, 2]}
      speed: {type: real, unit: m/s, range: [0, 2]}
      force: {type: real, unit: N, range: [0, 200]}
"""
_CODE = """from aeros.skill import Inputs, Observation, SkillBody, act


def work(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("press", x=0.5, y=0.0, z=0.25, speed=0.125, force=10.0)
"""
_IN_BOX = "0.25 m <= x <= 0.75 m and -0.5 m <= y <= 0.5 m and 0 m <= z <= 0.5 m"


def _site() -> str:
    kinds = "".join(
        f"  {name}:\n    description: {name}\n    risk: {risk}\n"
        f"    actuators: [{', '.join(moved)}]{_PARAMETERS}"
        for name, (risk, moved) in KINDS.items()
    )
    about = "rationale: the benchmark, source: the benchmark"
    return f"""schema: aeros/site/1
id: benchmark
description: The policy that every engine decides.
state:
  human: {{type: bool, sensor: scanner, max_age: 100 ms}}
actions:
  stop: {{description: protective stop, risk: low, protective: true}}
{kinds}
invariants:
  - {{id: slow, on: [press], require: human implies speed <= 250 mm/s, {about}}}
  - {{id: box, on: [press], require: "{_IN_BOX}", {about}}}
  - {{id: gentle, on: [press], require: force <= 30 N, {about}}}
policy:
  risk_ceiling: medium
  access: {{actuators: [arm, gripper], sensors: [scanner]}}
  blocks: [{{id: no-polish, module: surfaces, skill: polish, reason: the benchmark}}]
  limits: {{skill_timeout: 60 s, retries: 2, replans: 5}}
resources: {{arm: 1}}
"""


def _module() -> str:
    skills = "".join(
        f"""  {name}:
    description: {name}
    entry: skills:work
    outcomes: {{done: {{}}}}
    envelope: {{press: "{_IN_BOX} and force <= 30 N"}}
    gated: [slow]
    actuators: [arm, gripper]
    resources: [arm]
    risk: medium
    timeout: 10 s
"""
        for name in ALLOWED_SKILLS
    )
    return f"""schema: aeros/ecm/2
id: surfaces
version: 1.0.0
description: Works on surfaces.
license: Apache-2.0
capabilities: {{surfaces: {{description: surfaces, provided_by: [{", ".join(ALLOWED_SKILLS)}]}}}}
skills:
{skills}permissions:
  actuators: [arm, gripper]
  sensors: [scanner]
  actions: {{press: "{_IN_BOX} and force <= 30 N"}}
dependencies: {{aeros: ">=0.1"}}
"""


def configuration(folder: Path) -> Configuration:
    """Write the policy and the module into `folder`, and prove them."""
    site, module = folder / "site.yaml", folder / "surfaces"
    module.mkdir()
    site.write_text(_site(), encoding="utf-8")
    (module / "ecm.yaml").write_text(_module(), encoding="utf-8")
    (module / "skills.py").write_text(_CODE, encoding="utf-8")
    return prove_configuration([module], site, certified=False)[0]


@dataclass(frozen=True)
class BenchmarkRequest:
    """A request; `attributes` is all of it, for engines without declarations."""

    kind: str
    attributes: Mapping[str, Any]


def requests(count: int) -> list[BenchmarkRequest]:
    """Draw requests: about four in ten are allowed; for each rule some are denied by it alone."""
    chance = random.Random(1)  # noqa: S311 - repeats, and guards nothing
    return [_request(chance) for _ in range(count)]


def _request(chance: random.Random) -> BenchmarkRequest:
    def usually(usual: Any, *others: Any) -> Any:
        return usual if chance.random() < 0.9 else chance.choice(others)

    kind = usually("press", *(name for name in KINDS if name != "press"))
    risk, actuators = KINDS[kind]
    outside = chance.random() < 0.15
    return BenchmarkRequest(
        kind,
        {
            "skill": usually(chance.choice(["wipe", "sand"]), "polish", "cut"),
            "risk": risk,
            "actuators": list(actuators),
            "human": chance.random() < 0.4,
            "x": chance.uniform(-2, 2) if outside else chance.uniform(0.25, 0.75),
            "y": chance.uniform(-0.5, 0.5),
            "z": chance.uniform(0, 0.5),
            "speed": chance.uniform(0, 0.5),
            "force": chance.uniform(0, 42),
        },
    )


# By hand.


def naive_policy(asked: Mapping[str, Any]) -> bool:
    """Decide by the policy as one expression, which trusts that every value has the right type."""
    return (
        asked["skill"] not in BLOCKED_SKILLS
        and asked["skill"] in ALLOWED_SKILLS
        and asked["risk"] in RISKS
        and all(one in ACTUATORS for one in asked["actuators"])
        and (not asked["human"] or asked["speed"] <= 0.25)
        and LOWER[0] <= asked["x"] <= UPPER[0]
        and LOWER[1] <= asked["y"] <= UPPER[1]
        and LOWER[2] <= asked["z"] <= UPPER[2]
        and asked["force"] <= 30.0
    )


_NUMBERS = {"x": (-2.0, 2.0), "y": (-2.0, 2.0), "z": (-2.0, 2.0), "speed": (0.0, 2.0), "force": (0.0, 200.0)}
_NAMES = frozenset({*_NUMBERS, "skill", "risk", "actuators", "human"})


def checked_policy(asked: Any) -> bool:
    """Decide after checking every value: exact types, finite, in range, none missing or unknown."""
    if type(asked) is not dict or asked.keys() != _NAMES:
        return False
    for name, (least, most) in _NUMBERS.items():
        value = asked[name]
        if type(value) is not float or not least <= value <= most:
            return False
    actuators = asked["actuators"]
    if type(asked["human"]) is not bool or type(actuators) is not list:
        return False
    if not all(type(one) is str for one in (asked["skill"], asked["risk"], *actuators)):
        return False
    return naive_policy(asked)
