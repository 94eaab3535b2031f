"""Kinds of trials: each has a module, and a condition is known by the code of its kind."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.experiments import trial_kinds
from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import digest_of_files
from aeros.experiments.trial_kinds import (
    KINDS,
    PredictsSeries,
    _source_digest,
    comparison_group_of,
    condition_digest,
    kind_of,
    scheduling_group_of,
    scratch_folder,
)
from tests.unit.experiments.support.common import condition

TRIALS = Path(trial_kinds.__file__).parent / "trials"


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_is_there(name: str) -> None:
    assert callable(kind_of(name).open)


def test_a_condition_is_known_by_the_code_of_its_kind() -> None:
    task, swap = (TrialCondition.create(kind, "symbolic", {}) for kind in ("task", "hot_swap"))
    assert condition_digest(task, "a") != task.digest("a")
    assert len({condition_digest(one, premises) for one in (task, swap) for premises in ("a", "b")}) == 4


def test_kinds_that_share_trials_name_their_families() -> None:
    slow, fast = condition(rate="1/10"), condition(rate="9/10")
    assert comparison_group_of(slow)[0] == comparison_group_of(fast)[0]
    assert (comparison_group_of(slow)[1], comparison_group_of(fast)[1]) == (0.1, 0.9)
    assert comparison_group_of(condition(task="fetch_object"))[0] != comparison_group_of(slow)[0]
    assert scheduling_group_of(slow) == scheduling_group_of(fast)


def test_a_condition_of_any_other_kind_is_a_family_of_its_own() -> None:
    one, other = (TrialCondition.create("requests", "symbolic", {"policy": on}) for on in (True, False))
    assert comparison_group_of(one) == ('{"policy":true}', 0.0)
    assert scheduling_group_of(other) == '{"policy":false}'


def test_the_digest_of_a_kind_is_of_its_files() -> None:
    assert _source_digest("requests") == digest_of_files({"requests": TRIALS / "requests.py"})
    whole = {name: TRIALS / f"{name}.py" for name in ("sessions", "inline_module", "thompson")}
    assert _source_digest("sessions") == digest_of_files(whole)
    alone = {name: TRIALS / f"{name}.py" for name in ("kills", "kill_logs")}
    assert _source_digest("kills") != digest_of_files(alone)  # commands of `aeros` decide them, too


def test_a_scratch_folder_has_a_log_and_is_gone_after() -> None:
    with scratch_folder() as (folder, audit):
        audit.append("note", {"event": "x", "details": {}})
        assert (folder / "audit.jsonl").exists()
    assert not folder.exists()


def test_only_sessions_have_series() -> None:
    assert [name for name in KINDS if isinstance(kind_of(name), PredictsSeries)] == ["sessions"]
