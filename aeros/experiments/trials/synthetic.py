"""Synthetic modules under the reference site, of ten skills by default; a number always gives one module.

No two skills have the same numbers, so no question about one answers another's.  Three skills in ten take an
input, one in two starts under a precondition, one module in four has a task, and one in ten depends on its
predecessor.  Rules that speak of the state are runtime-checked, as in real modules.
"""

from __future__ import annotations

from pathlib import Path

SKILLS = 10

_PREDICATES = ("open", "shut", "narrow", "wide", "still")
"""Names of the predicates of each module, which are defined by the gap between the fingers."""


def write_modules(folder: Path, count: int, skills: int = SKILLS) -> list[Path]:
    """Write modules 0, 1, … below a folder.

    Args:
        folder: made where it does not exist.
        count: number of modules.
        skills: of each module, from 5 to 10.

    Returns:
        Folders of the modules.
    """
    return [write_module(folder, number, skills=skills) for number in range(count)]


def write_module(folder: Path, number: int, version: str = "1.0.0", skills: int = SKILLS) -> Path:
    """Write one module.

    Args:
        folder: of all modules.
        number: of the module, which decides its content.
        version: any version other than the default is a change of the module that stays proved.
        skills: from 5 to 10.

    Returns:
        Folder of the module.
    """
    module = folder / f"module_{number:04}"
    module.mkdir(parents=True, exist_ok=True)
    (module / "ecm.yaml").write_text(_manifest(number, version, skills), encoding="utf-8")
    bodies = (
        f"def skill_{index}(inputs, observation):\n    yield act('grip', width=0.03, force=1.0)\n"
        for index in range(skills)
    )
    (module / "skills.py").write_text(
        "from aeros.skill import act\n\n\n" + "\n\n".join(bodies), encoding="utf-8"
    )
    return module


def _manifest(number: int, version: str, skills: int) -> str:
    declared = "".join(_skill(number, index) for index in range(skills))
    provided = ", ".join(f"skill_{index}" for index in range(skills))
    depends = f"\n  modules:\n    module_{number - 1:04}: '>=1.0'" if number % 10 == 9 else ""
    return f"""\
schema: aeros/ecm/2
id: module_{number:04}
version: {version}
description: Synthetic module {number}, for benchmarks.
license: Apache-2.0
capabilities:
  capability_{number:04}:
    description: what module {number} makes the robot able to do
    provided_by: [{provided}]
state:
{_state()}skills:
{declared}{_task(number) if number % 4 == 0 else ""}permissions:
  actuators: [arm, gripper]
  sensors:
    [joint_encoders, gripper, cell_survey, wheel_odometry, overhead_camera, side_camera]
  actions:
    move_tool: target in bench_area and speed <= 250 mm/s
    grip: width <= 81 mm and force <= 15 N
    slide: target in bench_area and force <= 15 N and speed <= 210 mm/s
    wait: duration <= 20 s
dependencies:
  aeros: ">=0.1,<0.2"{depends}
"""


def _state() -> str:
    """Declare the predicates."""
    return "".join(
        f"  {name}: {{type: bool, max_age: 1 s, definition: finger_gap >= {10 * index} mm}}\n"
        for index, name in enumerate(_PREDICATES, 1)
    )


def _skill(number: int, index: int) -> str:
    """Declare skill `index`, whose numbers no other skill has."""
    own = number * SKILLS + index
    # Of the second thousand the numbers lie between those of the first: higher ones would break rules.
    share = own if number < 1000 else own - 1000 * SKILLS + 0.5
    speed, force, width = 100 + share / 100, 5 + share / 2000, 40 + share / 500
    inputs, most = "", f"{speed:.3f} mm/s"
    if index % 3 == 2:
        range_ = f"range: [0, {speed / 1000:.6f}]"
        inputs = f"    inputs:\n      pace: {{type: real, unit: m/s, {range_}, default: 50 mm/s}}\n"
        most = "inputs.pace"
    precondition = f"    precondition: not {_PREDICATES[(own + 1) % 5]}\n" if index % 2 else ""
    last = f"wait: duration <= {1 + share / 1000:.4f} s"
    if index % 2:
        last = (
            "slide: >-\n        target in bench_area and target - base_position in workspace"
            "\n        and target - base_position not in own_base"
            f"\n        and force <= {force:.5f} N and speed <= {speed:.3f} mm/s"
        )
    return f"""\
  skill_{index}:
    description: synthetic skill {index}
    entry: skills:skill_{index}
{inputs}{precondition}    outcomes:
      done: {{effects: {{{_PREDICATES[own % 5]}: true}}, probability: 0.9, duration: 10 s}}
      failed: {{failure: true, probability: 0.1, duration: 10 s}}
    envelope:
      move_tool: >-
        target in bench_area and target - base_position in workspace
        and target - base_position not in own_base and speed <= {most}
      grip: width <= {width:.3f} mm and force <= {force:.5f} N
      {last}
    gated: [arm-separation]
    actuators: [arm, gripper]
    resources: [arm, gripper]
    risk: medium
    timeout: 60 s
"""


def _task(number: int) -> str:
    first, second = (_PREDICATES[(number * SKILLS + index) % 5] for index in (0, 2))
    return f"""\
tasks:
  task_{number:04}:
    description: two skills in order
    words: [errand{number:04}]
    goal: {first} and {second}
    rules:
      - {{unless: {first}, do: skill_0, retry: 1, between_tries: skill_4}}
      - {{unless: {second}, do: skill_2}}
    initial: {{{first}: false, {second}: false}}
"""
