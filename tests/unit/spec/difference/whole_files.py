"""Edits of the site and module of the examples, after which they have every section."""

# ruff: noqa: E501  a section of one line stays one line

from __future__ import annotations

from pathlib import Path

from tests.unit.spec.difference.versions import change

RICH_SITE = (
    ("sensors: [scanner, panel, gripper, camera]\n", """sensors: [scanner, panel, gripper, camera]
    channels: [radio]
    compute: [gpu]
  grants: {tidy: {actuators: [arm], sensors: [camera], channels: [radio], compute: [gpu]}}
  blocks: [{id: worn, module: polish, skill: rub, action: grip, reason: a finger is worn}]
  isolation: {require: [seccomp, rlimits], missing: warn, trusted: [polish], answer_within: 2 s, memory: 128 MiB, processor: 80 %}
  mcp: {execute: denied, most_steps: 10, skills: [tidy.wipe]}
  undeclared_outcome: replan
  audit: {durability: batched}
  perception:
    shared: {kettle.hot: {type: real, unit: m, range: [0, 1], max_age: 1 s, uncertainty: 1 mm, in_invariants: true}}
    public: true
    timeout: 500 ms
    memory: 512 MiB
    processor: 70 %
    rate: 60 Hz
"""),
    ("enums: {joints: [shoulder]}", "enums: {joints: [shoulder], cameras: [top]}"),
    ("replans: 10}", "replans: 10, planning: 20 s}"),
    ("resources: {arm: 1}\n", """resources: {arm: 1}
compute: {gpu: /dev/nvidia0}
cameras: {top: {sensor: camera, width: 640, height: 480, sees: [bench_top], offers: [top_view]}}
sensors: {load_cell: force on the press}
modules: {polish: {bind: {surface: bench_top}, set: {force: 6 N}}}
joint: [{id: apart, on: {a: move, b: grip}, require: a.speed <= 1 m/s, rationale: a test, source: nobody}]
"""),
    ("  bench_clean: {", "  answered: {type: bool, sensor: ask, max_age: 1 s}\n  answered_too: {type: bool, sensor: ask, max_age: 1 s}\n  bench_clean: {"),
    ("  wait:\n", """  ask:
    description: asks a service
    risk: low
    tool: {http: "http://127.0.0.1:8080/ask", timeout: 2 s, answers: [answered, answered_too], token: TOKEN}
  start:
    description: asks a program
    risk: low
    tool: {program: [/usr/bin/true, now], timeout: 2 s, answers: [], channel: radio, confinement: {reads: [/opt/a], writes: [/opt/b], network: true, memory: 256 MiB, processor: 50 %, processes: 4}}
  look_up:
    description: asks a server
    risk: low
    tool: {mcp: {tool: times, url: "http://127.0.0.1:8081/mcp"}, timeout: 2 s, answers: []}
  call:
    description: asks a server of its own
    risk: low
    tool: {mcp: {tool: times, command: [/usr/bin/server]}, timeout: 2 s, answers: []}
  wait:
"""),
)  # fmt: skip
"""Edits that give the site of the examples every section."""

RICH_MODULE = (
    ("id: tidy\n", """id: tidy

state:
  dirt: {type: real, unit: mm, range: [0, 9], max_age: 1 s, uncertainty: 1 mm, public: true}
  spotless: {type: bool, max_age: 1 s, definition: dirt <= 1 mm}
  pressed: {type: bool, max_age: 1 s, sensor: load_cell}

perceivers:
  watch:
    description: looks at the bench
    entry: perceivers:see
    pictures: {top: {width: 320, height: 240, depth: true}}
    readings: [cloth_held, stop_pressed]
    rate: 20 Hz
    provides: [dirt]
    timeout: 200 ms
    memory: 256 MiB
"""),
    ("    precondition: cloth_held\n", "    precondition: cloth_held\n    hold: human_distance >= 500 mm\n    idempotent: true\n    gated: [separation]\n"),
    ("  actuators: [arm, gripper]\n  sensors: [scanner, gripper, camera]\n", "  actuators: [arm, gripper]\n  sensors: [scanner, gripper, camera, panel, load_cell]\n  channels: [radio]\n  compute: [gpu]\n  worker: {memory: 64 MiB, answer_within: 1 s, processor: 40 %}\n"),
)  # fmt: skip
"""Edits that give the module of the examples every section."""

_CODE = """\
from aeros.skill import estimate


def see(views):
    for view in views:
        yield {"dirt": estimate(0.0, 0.0)}
"""


def add_every_section(folder: Path) -> None:
    """Edit a copy of the examples."""
    for before, after in RICH_SITE:
        change(folder / "site.yaml", before, after)
    for before, after in RICH_MODULE:
        change(folder / "tidy" / "ecm.yaml", before, after)
    (folder / "tidy" / "perceivers.py").write_text(_CODE, "utf-8")
