"""A whole run on the symbolic plant, with or without a bus that hears of it."""

from __future__ import annotations

from pathlib import Path

from aeros.agent.agent import start_agent
from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.port import PublisherFactory
from aeros.runtime.isolation.run_factory import SkillRunFactory
from aeros.runtime.ports import Plant
from aeros.runtime.proving import prove_configuration
from aeros.session.assembly import build_executor
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT


def wipe_the_table(folder: Path, bus: PublisherFactory | None) -> str:
    """The hash of the last record of the run's audit log."""
    folder.mkdir()
    configuration, _ = prove_configuration(
        [ROOT / "ecms" / "clean_table"], reference_site_path(), certified=False
    )
    feed = None if bus is None else BusFeed(bus, configuration.site)
    task = configuration.modules["clean_table"].tasks["clean_table"]
    plant: Plant = SymbolicPlant(configuration.site, configuration.modules, 7, to_doubles(task.initial))
    listener = None if feed is None else feed.on_record
    with (
        SkillRunFactory(configuration.site, configuration.modules.values()) as skills,
        AuditLog(folder / "audit.jsonl", clock=lambda: 0.0, listener=listener) as audit,
        build_executor(
            configuration, plant, audit, skills, listeners=() if feed is None else (feed,)
        ) as executor,
        start_agent(folder / "state", "panda", executor) as agent,
    ):
        assert agent.run("clean the table").reached
    if feed is not None:
        feed.close()
        assert (feed.lost, feed.trouble) == (0, None)
    return verify_log(folder / "audit.jsonl").head
