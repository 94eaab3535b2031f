"""Invariants and modules read a module's variable where the site shares it, as the site declares it."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.ports import Reading
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from tests.unit.runtime import bench

_RULE = """  - id: cool-nearby
    on: [move]
    require: kettle.hot implies speed <= 62.5 mm/s
    rationale: hot water is not spilled
    source: tests
  - id: top-speed
"""
_SHARED = """  perception:
    shared:
      kettle.hot: {type: bool, max_age: 1 s, in_invariants: true}
      kettle.level: {type: real, unit: m, range: [0, 1], max_age: 1 s, uncertainty: 1 mm}
  quotas:
"""
_KETTLE = """schema: aeros/ecm/2
id: kettle
version: 1.0.0
description: Measures water.
license: Apache-2.0
state:
  hot: {type: bool, max_age: 1 s}
  level: {type: real, unit: m, range: [0, 1], max_age: 1 s, uncertainty: 1 mm}
perceivers:
  watch:
    description: watches the camera's words
    entry: perceivers:see
    readings: [dirt]
    provides: [hot, level]
    timeout: 100 ms
    memory: 64 MiB
capabilities: {}
skills: {}
permissions: {sensors: [camera], actions: {}}
dependencies: {aeros: ">=0.1"}
"""


def configuration(folder: Path, *, with_kettle: bool) -> Configuration:
    """The bench, which shares two variables, one with its invariants; its module requires the kettle."""
    site_text = bench.SITE.read_text()
    assert site_text.count("  - id: top-speed\n") == site_text.count("  quotas:\n") == 1
    site_file = folder / "bench.yaml"
    site_file.write_text(site_text.replace("  - id: top-speed\n", _RULE).replace("  quotas:\n", _SHARED))
    handling = (bench.MODULE / "ecm.yaml").read_text()
    for before, after in (
        ("carry: gait <= 100 mm/s", "carry: gait <= 100 mm/s and kettle.level <= 500 mm"),
        ('{aeros: ">=0.1"}', '{aeros: ">=0.1", modules: {kettle: ">=1"}}'),
    ):
        assert before in handling
        handling = handling.replace(before, after)
    for name, text in (("kettle", _KETTLE), ("handling", handling)):
        (folder / name).mkdir()
        (folder / name / "ecm.yaml").write_text(text)
    sink = Diagnostics()
    site = load_site(site_file, sink)
    assert site is not None, list(sink)
    loaded = [load_ecm(folder / name, site, sink) for name in ("handling", "kettle")[: 1 + with_kettle]]
    assert not sink.has_errors, [one.headline for one in sink]
    return Configuration(site, {one.ecm.id: one.ecm for one in loaded if one is not None}, {}, "c" * 64)


@pytest.mark.parametrize("mode", GateMode)
@pytest.mark.parametrize("with_kettle", [True, False])
def test_an_invariant_reads_what_the_site_shares_with_it(
    tmp_path: Path, mode: GateMode, with_kettle: bool
) -> None:
    gate = CompiledGate(configuration(tmp_path, with_kettle=with_kettle), mode)
    move = bench.request("quickly", "move", speed=0.125)
    assert bench.codes(move.decided_by(gate)) == [("AE703", "kettle.hot")]
    for hot, codes in ((False, []), (True, [("AE750", "cool-nearby")]), (1, [("AE704", "kettle.hot")])):
        readings = {**move.readings, "kettle.hot": Reading(hot, bench.NOW)}
        asked = bench.Request(move.caller, readings, move.action)
        assert bench.codes(asked.decided_by(gate)) == codes
    old = {**move.readings, "kettle.hot": Reading(False, bench.NOW - 1.5)}
    asked = bench.Request(move.caller, old, move.action)
    assert bench.codes(asked.decided_by(gate)) == [("AE706", "kettle.hot")]


@pytest.mark.parametrize("mode", GateMode)
def test_a_condition_of_another_module_reads_what_is_shared_with_modules(
    tmp_path: Path, mode: GateMode
) -> None:
    gate = CompiledGate(configuration(tmp_path, with_kettle=True), mode)
    carry = bench.request("quickly", "carry")
    assert bench.codes(carry.decided_by(gate)) == [("AE703", "kettle.level")]
    for level, kind in ((0.5, DecisionKind.ALLOW), (0.75, DecisionKind.DENY)):
        readings = {**carry.readings, "kettle.level": Reading(level, bench.NOW), "kettle.hot": Reading(0, 0)}
        asked = bench.Request(carry.caller, readings, carry.action)
        assert asked.decided_by(gate).kind is kind


def test_the_monitor_watches_what_invariants_may_read_and_nothing_else_of_modules(tmp_path: Path) -> None:
    both = configuration(tmp_path, with_kettle=True)
    gate = CompiledGate(both, GateMode.COMPILED)
    monitor = RuntimeMonitor(gate.monitor_rules, HistoryTracker(both.site))
    assert "kettle.hot" in gate.monitor_rules.forms
    assert "kettle.level" not in gate.monitor_rules.forms
    assert "kettle.hot" in gate.monitor_rules.by_kind["move"].reads
    assert monitor(bench.NOW, {"kettle.level": "much"}) is None
