"""The chain once more by the model checker Storm, in exact arithmetic, where `stormpy` is installed."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from aeros.spec.closed_loop.giving_up import declared_beliefs
from aeros.spec.closed_loop.transition_system import LoopState, TransitionSystem
from tests.differential.reference_cases import REFERENCE, predicted, reference

stormpy: Any = pytest.importorskip("stormpy")


def prism(system: TransitionSystem, start: LoopState, replans: int) -> str:
    """The chain as a PRISM program: a state for each node and number of re-plans, a reward for each step."""
    numbers = {(0, start): 0}
    commands, rewards, reached = [], [], []
    pending = [(0, start)]
    for made, node in pending:
        here = numbers[made, node]
        moves = [move for move in system.transitions(node) if move.probability]
        if moves and node.phase == "plan" and made > replans and moves[0].target.phase != "reached":
            moves = []
        targets = []
        for move in moves:
            key = (made + (move.target.phase == "plan"), move.target)
            if key not in numbers:
                numbers[key] = len(numbers)
                pending.append(key)
            targets.append(f"{move.probability}:(s'={numbers[key]})")
        if moves and moves[0].role is not None:
            rewards.append(f"s={here}:1;")
        stays = [f"1:(s'={here})"]
        commands.append(f"[] s={here} -> {' + '.join(targets or stays)};")
        reached += [f"s={here}"] if node.phase == "reached" else []
    body = "\n".join(commands)
    counted = "\n".join(rewards)
    return (
        f"dtmc\nmodule loop\ns:[0..{len(numbers)}] init 0;\n{body}\nendmodule\n"
        f'label "reached" = {"|".join(reached)};\nrewards "steps"\n{counted}\nendrewards\n'
    )


@pytest.mark.parametrize("replans", [0, 2])
@pytest.mark.parametrize("name", REFERENCE)
def test_storm_finds_the_same_probability_and_work(name: str, replans: int, tmp_path: Path) -> None:
    case = reference(name, replans)
    system = TransitionSystem(case.ecm, case.task, case.site, declared_beliefs(case.ecm))
    file = tmp_path / "loop.prism"
    start = LoopState("plan", system.start(case.start))
    file.write_text(prism(system, start, replans), encoding="utf-8")
    program = stormpy.parse_prism_program(str(file))
    asked = stormpy.parse_properties('P=? [F "reached"]; R{"steps"}=? [C]', program)
    model = stormpy.build_model[stormpy.Rational](program, asked)
    (first,) = model.initial_states
    found = [stormpy.model_checking(model, one).get_value(first) for one in asked]
    exact = predicted(case)
    assert [Fraction(str(value)) for value in found] == [exact.success, exact.invocations]
