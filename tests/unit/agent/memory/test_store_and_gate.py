"""Memory never influences the gate: it cannot reach it, and whatever it holds, the same is decided.

That it cannot is a contract of pyproject.toml; here two memories lead through the same requests, and
through others, all of which a gate that has no memory decides again.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from aeros.agent.agent import MEMORY_FILE, start_agent
from aeros.agent.identity import Identity
from aeros.agent.memory.context import evidence_context
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, open_memory
from aeros.agent.world.world import world_from_readings
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.proving import prove_configuration
from aeros.runtime.records.replay import LogReplay
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT

WIPES = ("wipe", "wipe_again")
RULE = "{unless: table_wiped, do: wipe, retry: 1, on_failure: recover}"


@pytest.fixture(scope="module")
def configuration(tmp_path_factory: pytest.TempPathFactory) -> Configuration:
    """`clean_table` with a second skill that wipes, and a rule that leaves open which."""
    folder = tmp_path_factory.mktemp("modules") / "clean_table"
    shutil.copytree(ROOT / "ecms" / "clean_table", folder)
    manifest = (folder / "ecm.yaml").read_text("utf-8")
    _, skill = manifest.split("\n  wipe:", 1)
    skill, _ = skill.split("\n  organize:", 1)
    for old, new in (
        ("\n  organize:", f"\n  wipe_again:{skill}\n  organize:"),
        (
            "capabilities:\n",
            "capabilities:\n  wiping: {description: wipes, provided_by: [wipe, wipe_again]}\n",
        ),
        (RULE, RULE.replace("do: wipe", "do: wiping")),
    ):
        assert manifest.count(old) == 1
        manifest = manifest.replace(old, new)
    (folder / "ecm.yaml").write_text(manifest, "utf-8")
    return prove_configuration([folder], reference_site_path(), certified=False)[0]


def remember(folder: Path, configuration: Configuration, tries: dict[str, tuple[int, int]]) -> None:
    """Successes and failures of each skill, in the context in which the task begins."""
    ecm = configuration.modules["clean_table"]
    plant = SymbolicPlant(
        configuration.site, configuration.modules, 7, to_doubles(ecm.tasks["clean_table"].initial)
    )
    world = world_from_readings(configuration.site.state, plant.observe(), plant.now())
    task = "clean_table.clean_table"
    context = evidence_context(task, ecm, [ecm.skills[name] for name in WIPES], world)
    folder.mkdir()
    with open_memory(folder / MEMORY_FILE, Identity(uuid4(), "panda", "", 1)) as memory:
        for skill, (successes, failures) in tries.items():
            for failed in [False] * successes + [True] * failures:
                beginning = EpisodeStart(task, ecm.id, skill, "step", {}, 0.0, {}, context)
                ending = EpisodeEnd("finished", None, failed, "", 1.0, {}, counts_toward_record=True)
                memory.end_episode(memory.start_episode(beginning), ending)


def decisions(
    folder: Path, configuration: Configuration, tries: dict[str, tuple[int, int]]
) -> list[dict[str, Any]]:
    """Requests and decisions of an agent with these memories, each decided again by a gate alone."""
    folder.mkdir()
    remember(folder / "state", configuration, tries)
    initial = to_doubles(configuration.modules["clean_table"].tasks["clean_table"].initial)
    plant = SymbolicPlant(configuration.site, configuration.modules, 7, initial)
    with (
        AuditLog(folder / "audit.jsonl", clock=lambda: 0.0) as audit,
        Executor(configuration, CompiledGate(configuration), plant, audit, run_in_process) as executor,
        start_agent(folder / "state", "panda", executor) as agent,
    ):
        agent.run("clean the table")
    again = LogReplay(lambda _: configuration)
    records = [json.loads(line) for line in (folder / "audit.jsonl").read_text("utf-8").splitlines()]
    for record in records:
        again.replay_record(record)
    assert again.mismatches == []
    found = [one["details"] for one in records if one["event"] == "decision"]
    assert again.matching_count == len(found) > 10
    return found


def test_the_same_requests_are_decided_alike_for_every_memory(
    tmp_path: Path, configuration: Configuration
) -> None:
    praised = decisions(tmp_path / "praised", configuration, {"wipe": (200, 0), "wipe_again": (0, 200)})
    blamed = decisions(tmp_path / "blamed", configuration, {"wipe": (20, 180), "wipe_again": (0, 400)})
    assert {one["skill"] for one in praised} == {"wipe", "organize", "verify"}
    assert praised == blamed


def test_another_choice_asks_for_the_same_and_is_decided_alike(
    tmp_path: Path, configuration: Configuration
) -> None:
    one = decisions(tmp_path / "one", configuration, {"wipe": (200, 0), "wipe_again": (0, 200)})
    other = decisions(tmp_path / "other", configuration, {"wipe": (0, 200), "wipe_again": (200, 0)})
    assert {decision["skill"] for decision in other} == {"wipe_again", "organize", "verify"}
    for decision in other:
        decision["skill"] = "wipe" if decision["skill"] == "wipe_again" else decision["skill"]
    assert one == other
