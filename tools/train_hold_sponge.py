#!/usr/bin/env python3
"""Train the policy of `learned/hold_sponge` by behaviour cloning, in NumPy: the same seeds, the same file.

    python tools/train_hold_sponge.py                 records, trains, writes learned/hold_sponge/policy.onnx
    python tools/train_hold_sponge.py --measure 60    takes the sponge on 60 layouts, with and without the
    gate

Recipe: `clean_table.wipe` runs under the gate on the kinematic plant, on the layouts of `RUNS` seeds, until
it has gripped the sponge.  Its motions are straight lines.  Along them, points are drawn, and moved a little
off the line.  The label of a point is the step to where the demonstration is `LOOKAHEAD` further on.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from aeros.experiments.open_gate import OpenGate, without_policy
from aeros.files import temporary_folder
from aeros.models.onnx_writer import Layer, write_onnx
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import StepRequest, StepResult, StepStatus
from aeros.runtime.proving import prove_configuration
from aeros.runtime.skills.in_process_run import SkillRunProtocol, SkillRunResult, run_in_process
from aeros.session.assembly import build_executor
from aeros.sim.kinematic.plant import KinematicPlant
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.skill import Action, Observation
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.scene import BodyPart
from aeros.spec.model.site import Site
from aeros.spec.scenes.load import load_scene
from aeros.spec.text.discovery import reference_site_path

ROOT: Final = Path(__file__).resolve().parent.parent
MODULE: Final = ROOT / "learned" / "hold_sponge"

RUNS: Final = range(1000, 1012)
"""Seeds of the layouts of the demonstrations."""

SEED: Final = 7
"""Seed of the points, of the first weights and of the batches."""

LOOKAHEAD: Final = 0.05
"""Length of a step, m."""

LARGEST_STEP: Final = 60.0
"""Every output of the network is clipped to this, mm."""

SPONGE_GRASP: Final = 0.032
"""Height of the grasp above the foam's middle, m: as in both modules."""

HIDDEN: Final = (24, 24)
POINTS_PER_METRE: Final = 600
STEPS: Final = 12_000
BATCH: Final = 256

Array = NDArray[np.float64]


class Demonstration:
    """Observed skill run; implements `SkillRunProtocol` and ends when the hand has closed on the sponge."""

    def __init__(self, run: SkillRunProtocol) -> None:
        self._run = run
        self.corners: list[Sequence[float]] = []
        self.grasp: Sequence[float] = ()
        self._grips = 0

    def resume(self, observation: Observation, seconds: float, denial: str = "") -> Action | SkillRunResult:
        """Implements `SkillRunProtocol.resume`."""
        if self._grips == 2:
            return SkillRunResult(StepStatus.FINISHED, "")
        action = self._run.resume(observation, seconds, denial)
        if isinstance(action, SkillRunResult):
            return action
        if action.kind == "grip":
            self._grips += 1
            if self._grips == 1:  # the hand opens, and the demonstration begins
                x, y, z = observation["sponge_position"]
                self.grasp = (x, y, z + SPONGE_GRASP)
                self.corners = [observation["tool_position"]]
        elif action.kind == "move_tool" and self._grips == 1:
            self.corners.append(action.parameters["target"])
        return action

    def close(self) -> str | None:
        """Implements `SkillRunProtocol.close`."""
        return self._run.close()


def run_skill(
    module: Path,
    skill: str,
    seed: int,
    open_run: Callable[[Site, Ecm, Skill, Mapping[str, Any]], SkillRunProtocol] = run_in_process,
    *,
    gated: bool = True,
) -> tuple[StepResult, KinematicPlant, DeclaredScene]:
    """Run one skill on the kinematic plant.

    Args:
        module: folder of the module.
        skill: name of the skill.
        seed: seed of the layout.
        open_run: opens the run of the skill.
        gated: False to let every action through, as without AEROS.

    Returns:
        The result, and the plant and its scene after the run.
    """
    configuration, _ = prove_configuration([module], reference_site_path(), certified=False)
    cameras = {"clean_table": configuration.modules[module.name].names.cameras}
    scene = DeclaredScene(load_scene("table", [ROOT / "ecms" / "clean_table"], cameras))
    plant = KinematicPlant(scene, seed)
    if gated:
        gate: CompiledGate | OpenGate = CompiledGate(configuration, GateMode.COMPILED)
    else:
        configuration = without_policy(configuration)
        gate = OpenGate(configuration)
    with (
        temporary_folder() as folder,
        AuditLog(folder / "a.jsonl") as log,
        build_executor(configuration, plant, log, open_run, gate=gate) as executor,
    ):
        result = executor.run_step(StepRequest(module.name, skill, {}))
    return result, plant, scene


def record(seed: int) -> tuple[Array, Array]:
    """Record one demonstration.

    Args:
        seed: seed of the layout.

    Returns:
        Corners of the hand's way relative to the grasp, m, shape (n, 3); and the length of the way up to
        each.
    """
    runs: list[Demonstration] = []

    def watch(site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        runs.append(Demonstration(run_in_process(site, ecm, skill, inputs)))
        return runs[-1]

    run_skill(ROOT / "ecms" / "clean_table", "wipe", seed, watch)
    corners = np.array(runs[0].corners) - np.array(runs[0].grasp)
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    return corners, lengths


def sample(demonstrations: Sequence[tuple[Array, Array]], draw: np.random.Generator) -> tuple[Array, Array]:
    """Draw training data along demonstrations.

    Args:
        demonstrations: corners and lengths, as `record` returns them.
        draw: random numbers.

    Returns:
        Offsets from the tool to the grasp, m, and steps, mm; each of shape (n, 3).
    """
    offsets, steps = [], []
    for corners, lengths in demonstrations:
        whole = lengths[-1]
        along = draw.uniform(0.0, whole, int(whole * POINTS_PER_METRE))
        along = np.concatenate([along, whole - 0.04 * draw.uniform(0.0, 1.0, len(along) // 2) ** 2])
        on_way, ahead = (
            np.stack([np.interp(one, lengths, corners[:, axis]) for axis in range(3)], axis=1)
            for one in (along, np.minimum(along + LOOKAHEAD, whole))
        )
        # Near the grasp the hand is led more exactly than far from it.
        spread = np.minimum(0.03, 0.002 + 0.1 * (whole - along))[:, None]
        place = on_way + spread * draw.normal(size=on_way.shape)
        offsets.append(-place)
        steps.append((ahead - place) * 1000.0)
    return np.concatenate(offsets), np.clip(np.concatenate(steps), -LARGEST_STEP, LARGEST_STEP)


def train(offsets: Array, steps: Array, draw: np.random.Generator) -> list[Layer]:
    """Fit a network with two hidden layers by Adam on the mean squared error.

    Args:
        offsets: inputs, m, shape (n, 3).
        steps: labels, mm, shape (n, 3).
        draw: random numbers.

    Returns:
        The layers.
    """
    sizes = (3, *HIDDEN, 3)
    weights = [draw.normal(size=(b, a)) * np.sqrt(2.0 / a) for a, b in pairwise(sizes)]
    biases = [np.zeros(size) for size in sizes[1:]]
    scale_in, scale_out = 5.0, LARGEST_STEP  # of about 1 inside the network
    averages = [[np.zeros_like(one), np.zeros_like(one)] for one in (*weights, *biases)]
    for number in range(1, STEPS + 1):
        chosen = draw.integers(0, len(offsets), BATCH)
        values = [offsets[chosen] * scale_in]
        for layer, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
            after = values[-1] @ weight.T + bias
            values.append(np.maximum(after, 0.0) if layer < len(weights) - 1 else after)
        slope = 2.0 * (values[-1] - steps[chosen] / scale_out) / BATCH
        gradients: list[Array] = []
        for layer in reversed(range(len(weights))):
            gradients = [slope.T @ values[layer], slope.sum(axis=0), *gradients]
            slope = (slope @ weights[layer]) * (values[layer] > 0.0)
        rate = 3e-3 * 0.5 * (1.0 + np.cos(np.pi * number / STEPS))
        ordered = [*gradients[0::2], *gradients[1::2]]
        for one, gradient, average in zip((*weights, *biases), ordered, averages, strict=True):
            average[0] = 0.9 * average[0] + 0.1 * gradient
            average[1] = 0.999 * average[1] + 0.001 * gradient**2
            first, second = average[0] / (1 - 0.9**number), average[1] / (1 - 0.999**number)
            one -= rate * first / (np.sqrt(second) + 1e-8)
    weights[0] = weights[0] * scale_in
    weights[-1], biases[-1] = weights[-1] * scale_out, biases[-1] * scale_out
    last = len(weights) - 1
    return [
        Layer(
            weight.astype(np.float32).tolist(),
            bias.astype(np.float32).tolist(),
            "" if layer == last else "Relu",
            (-LARGEST_STEP, LARGEST_STEP) if layer == last else None,
        )
        for layer, (weight, bias) in enumerate(zip(weights, biases, strict=True))
    ]


def holds_sponge(scene: DeclaredScene) -> bool:
    """Tell by the simulator's truth whether the hand holds the sponge, at least 50 mm above where it lay."""
    return scene.is_carried("sponge") and scene.pose_of(BodyPart("sponge")).position[2] > 0.05


def measure(count: int) -> None:
    """Take the sponge on layouts that were not trained on, and print how often it was held in truth.

    Args:
        count: number of layouts.
    """
    if importlib.util.find_spec("onnxruntime") is None:
        raise SystemExit("onnxruntime evaluates the policy: pip install '.[learned]'")
    for gated in (True, False):
        began, held = time.perf_counter(), 0
        for seed in range(count):
            _, _, scene = run_skill(MODULE, "take", seed, gated=gated)
            held += holds_sponge(scene)
        word = "with the gate" if gated else "without the gate"
        print(f"{word}: {held} of {count} layouts, {time.perf_counter() - began:.0f} s")


def main() -> None:
    """Train the policy, or measure it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--measure", type=int, metavar="LAYOUTS", help="measure the policy on that many layouts"
    )
    arguments = parser.parse_args()
    if arguments.measure is not None:
        measure(arguments.measure)
        return
    began = time.perf_counter()
    draw = np.random.default_rng(SEED)
    offsets, steps = sample([record(seed) for seed in RUNS], draw)
    recorded = time.perf_counter()
    layers = train(offsets, steps, draw)
    content = write_onnx("hold_sponge", ("offset", 3), "step", layers)
    (MODULE / "policy.onnx").write_bytes(content)
    print(
        f"{len(offsets)} points of {len(RUNS)} runs in {recorded - began:.0f} s, trained in "
        f"{time.perf_counter() - recorded:.0f} s, {len(content)} bytes"
    )


if __name__ == "__main__":
    main()
