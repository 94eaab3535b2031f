"""The learned module of this repository: its policy, the gate as its shield, and exchanged weights."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from aeros.cli.main import main
from aeros.models.onnx_writer import Layer, write_onnx
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.load import certified_code
from aeros.spec.backends.network.onnx_file import read_onnx
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.text.discovery import reference_site_path
from tools.train_hold_sponge import (
    LARGEST_STEP,
    MODULE,
    RUNS,
    SEED,
    holds_sponge,
    record,
    run_skill,
    sample,
    train,
)

DOWNWARDS = Layer([[0.0] * 3] * 3, [0.0, 0.0, -LARGEST_STEP], clip=(-LARGEST_STEP, LARGEST_STEP))
"""Always straight down, into whatever is there; it keeps the bound that the manifest declares."""


@pytest.fixture
def adversary(tmp_path: Path) -> Path:
    folder = Path(shutil.copytree(MODULE, tmp_path / "hold_sponge"))
    (folder / "policy.onnx").write_bytes(write_onnx("down", ("offset", 3), "step", [DOWNWARDS]))
    return folder


def test_the_policy_takes_the_sponge_in_truth_and_under_the_gate() -> None:
    result, _, scene = run_skill(MODULE, "take", 0)
    assert result.status is StepStatus.FINISHED
    assert holds_sponge(scene)


@pytest.mark.deep
def test_the_policy_takes_the_sponge_on_nine_of_ten_layouts() -> None:
    held = [holds_sponge(run_skill(MODULE, "take", seed)[2]) for seed in range(50)]
    assert sum(held) >= 45


@pytest.mark.deep
def test_the_same_seeds_give_the_same_policy_up_to_rounding() -> None:
    draw = np.random.default_rng(SEED)
    layers = train(*sample([record(seed) for seed in RUNS], draw), draw)
    shipped = read_onnx((MODULE / "policy.onnx").read_bytes())
    for number, layer in enumerate(layers):
        # Another processor may add up in another order.
        assert np.ravel(layer.weights) == pytest.approx(shipped.constants[f"w{number}"].numbers, abs=0.05)


def test_exchanged_weights_are_noticed_and_never_loaded(
    adversary: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", str(adversary), "--check"]) != 0
    assert "is stale: models differs" in "".join(capsys.readouterr())
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    exchanged = load_ecm(adversary, site, Diagnostics())
    assert exchanged is not None
    shutil.copy(MODULE / "policy.onnx", adversary)
    with pytest.raises(SkillRefusedError, match="the model `policy` of module `hold_sponge` does not match"):
        certified_code(exchanged.ecm, exchanged.ecm.skills["take"])


def test_adversarial_weights_hit_the_bench_without_the_gate_and_not_with_it(adversary: Path) -> None:
    hit, plant, _ = run_skill(adversary, "take", 0, gated=False)
    assert "the hand presses down with" in hit.reason
    assert plant.observe()["tool_position"].value[2] < 0.0
    denied, plant, _ = run_skill(adversary, "take", 0)
    assert denied.status is StepStatus.DENIED
    assert plant.observe()["tool_position"].value[2] > 0.1
