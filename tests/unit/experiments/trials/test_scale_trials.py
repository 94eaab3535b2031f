"""Many modules: what is measured of them is there, of the right module, and of no time in particular."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import InputPaths
from aeros.experiments.trials.scale import KIND
from aeros.experiments.trials.synthetic import write_module, write_modules
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.verify import verify
from tests.unit.experiments.support.common import premises


def condition(modules: int) -> TrialCondition:
    return TrialCondition.create("scale", "symbolic", {"modules": modules, "skills": 5})


def test_the_right_task_is_found_and_its_action_allowed_among_five_modules() -> None:
    with KIND.open(condition(5), premises()) as trial:
        found = [trial(seed) for seed in range(2)]
    for one in found:
        assert one["reached"]
        times = {name: one[name] for name in one if name.endswith(("_s", "_ms", "_us"))}
        assert len(times) == 8
        # The processor's clock may stand still for a few microseconds.
        assert min(times.values()) >= 0.0
        assert min(times["proving_s"], times["installing_s"], times["processor_s"]) > 0.0
    assert found[0]["proving_s"] == found[1]["proving_s"]
    assert KIND.expected_values(condition(5), premises()) == {"success": 1.0}


def test_further_synthetic_modules_are_proved_with_the_installed_ones(tmp_path: Path) -> None:
    there = write_modules(tmp_path, 2, skills=5)
    further = [write_module(tmp_path, number, skills=5) for number in (1000, 1888)]
    report = verify([*there, *further], reference_site_path())
    assert report.conclusion is Conclusion.PROVED
    texts = {path: (path / "ecm.yaml").read_text(encoding="utf-8") for path in (*there, *further)}
    assert all("skill_4:" in text and "skill_5:" not in text for text in texts.values())
    assert "speed <= 100.005 mm/s" in texts[further[0]]


def test_a_site_that_does_not_prove_them_is_refused(tmp_path: Path) -> None:
    site = tmp_path / "slow.yaml"
    text = reference_site_path().read_text(encoding="utf-8")
    site.write_text(text.replace("require: speed <= 500 mm/s", "require: speed <= 5 mm/s"), encoding="utf-8")
    elsewhere = replace(premises(), paths=InputPaths("ecms", str(site)))
    with pytest.raises(MisuseError, match="not proved under this site"), KIND.open(condition(1), elsewhere):
        pass
