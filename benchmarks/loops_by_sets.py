"""Compare loops by sets of states with the checker Storm: `python -m benchmarks.loops_by_sets`.

Each loop has more states than `aeros verify` lists.  AEROS and the model checker Storm (`pip install
stormpy`, https://www.stormchecker.org) answer the same question in the same run: from every state before a
plan that can be reached, whichever choices the agent makes, the goal can be reached.  Storm gets the loop as
a program of the PRISM language, made from AEROS's program of places, and builds decision diagrams of it, too.
AEROS's times are given without and with the certificate and Z3's check of it, for which Storm has no
counterpart.
"""

from __future__ import annotations

import importlib
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.symbolic.certificate import CertificateTooLargeError
from aeros.spec.closed_loop.symbolic.program import PLAN, REACHED, Move, Place, all_of
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment
from aeros.spec.expr.types import BOOL, IntegerType, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.ecm import ActionCondition, Outcome, PlanningRule
from aeros.spec.obligations.closed_loop import certificate_obligations
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations
from benchmarks.closed_loop import build_loop
from benchmarks.command import build_parser, print_json

_PROPERTY = 'P<=0 [ F ("plan" & !(P>0 [ F "reached" ])) ]'


def flags_loop(flags: int, *, is_stuck: bool = False) -> TransitionSystem:
    """Build a loop over truth values, which may be any at the start; a failure undoes the step before."""
    ecm, task, site = build_loop(flags)
    done = [one for rule in task.rules if isinstance(one := rule.satisfied_condition, t.Variable)]
    skills, rules = {}, []
    for index, (name, skill) in enumerate(ecm.skills.items()):
        undone = {done[index - 1].name: False} if index else {}
        outcomes = {**skill.outcomes, "upset": Outcome("upset", undone, True, None, None)}
        skills[name] = replace(skill, outcomes=outcomes)
        between = f"step_{index - 1}" if index else None
        rules.append(replace(task.rules[index], retry=2, between_tries=between))
    if is_stuck:
        rules = rules[1:]  # nothing brings the first truth value about
    open_ = replace(task, initial={}, rules=tuple(rules))
    return TransitionSystem(replace(ecm, skills=skills, tasks={open_.id: open_}), open_, site)


def counting_loop(most: int) -> TransitionSystem:
    """Build a loop that makes as many pieces as asked for, from boxes of parts, with a bin that fills up."""
    ecm, task, site = build_loop(1)
    (skill,) = ecm.skills.values()
    measured = next(iter(site.state.values()))
    bounds = {"made": most, "asked": most, "parts": 2 * most, "waste": 5}
    state = {
        name: replace(measured, variable=_number(name), range=(Fraction(0), Fraction(high)))
        for name, high in bounds.items()
    }

    def run(name: str, needed: t.Term | None, *outcomes: Outcome) -> Any:
        condition = None if needed is None else ActionCondition(needed, "", skill.span)
        return replace(
            skill, id=name, inputs={}, precondition=condition, outcomes={one.id: one for one in outcomes}
        )

    one, less = Increment(Fraction(1)), Increment(Fraction(-1))
    able = t.And((_below("made", most), t.Not(_below("parts", 1)), _below("waste", 5)))
    skills = [
        run(
            "make",
            able,
            Outcome("made", {"made": one, "parts": less}, False, None, None),
            Outcome("spoilt", {"waste": one, "parts": less}, True, None, None),
        ),
        run("fetch", None, Outcome("fetched", {"parts": Fraction(2 * most)}, False, None, None), _FAILED),
        run("empty", None, Outcome("emptied", {"waste": Fraction(0)}, False, None, None), _FAILED),
    ]
    enough = t.Compare("<=", _number("asked"), _number("made"))
    rules = [
        PlanningRule(_below("waste", 5), "", "empty", {}, 2, None, None, skill.span),
        PlanningRule(t.Not(_below("parts", 1)), "", "fetch", {}, 2, None, None, skill.span),
        PlanningRule(enough, "", "make", {}, 0, None, None, skill.span),
    ]
    counted = replace(task, goal=enough, rules=tuple(rules), initial={}, invariants=())
    module = replace(ecm, skills={each.id: each for each in skills}, tasks={counted.id: counted})
    return TransitionSystem(module, counted, replace(site, state=state))


_FAILED = Outcome("failed", {}, True, None, None)


def _number(name: str) -> t.Variable:
    return t.Variable(name, IntegerType(), t.VariableRole.STATE)


def _below(name: str, bound: int) -> t.Term:
    return t.Compare("<", _number(name), t.Literal(Fraction(bound), RealType(NUMBER)))


def write_prism(loop: SymbolicLoop) -> str:
    """Write a loop in the PRISM language: a Markov decision process with a variable for the place."""
    program = loop.program
    places = {place: number for number, place in enumerate(program.moves)}
    names = {name: f"v{number}" for number, name in enumerate(program.values)}
    lines = ["mdp", "module loop", f"place : [0..{len(places) - 1}];"]
    for name, values in program.values.items():
        is_flag = program.variables[name].type == BOOL
        lines.append(f"{names[name]} : bool;" if is_flag else f"{names[name]} : [{values[0]}..{values[-1]}];")
    for place, moves in program.moves.items():
        for move in moves:
            lines += _commands(loop, place, move, names)
    lines.append("endmodule")
    free = [f"place={places[PLAN]}", *(f"!{names[bit]}" for bit in program.plan_bits)]
    lines.append(f"init {' & '.join(free)} endinit")
    lines += [f'label "{word}" = place={places[at]};' for word, at in (("plan", PLAN), ("reached", REACHED))]
    return "\n".join(lines) + "\n"


def _commands(loop: SymbolicLoop, place: Place, move: Move, names: dict[str, str]) -> list[str]:
    """Write one move; branches with several ends have a command for each combination of these."""
    branches = move.branches
    if any(branch.opened or not branch.is_likely for branch in branches):
        raise SystemExit("this comparison has no open variables and no impossible outcomes")
    commands = []
    sets, places = loop.fixpoints.sets, {place: number for number, place in enumerate(loop.program.moves)}
    ends = [[end for end in branch.ends if end.guard != t.FALSE] for branch in branches]
    for chosen in product(*ends):
        guards = [*(one.guard for one in branches), *(one.guard for one in chosen)]
        guard = all_of(move.guard, *guards)
        if sets.where(guard) & sets.valid == sets.none:
            continue
        updates = [
            " & ".join(
                [f"(place'={places[end.target]})"]
                + [f"({names[name]}'={_text(term, names)})" for name, term in branch.updates.items()]
            )
            for branch, end in zip(branches, chosen, strict=True)
        ]
        shares = " + ".join(f"1/{len(updates)} : {one}" for one in updates)
        commands.append(f"[] place={places[place]} & {_text(guard, names)} -> {shares};")
    return commands


def _text(term: t.Term, names: dict[str, str]) -> str:
    match term:
        case t.Literal(value=bool(value)):
            return str(value).lower()
        case t.Literal(value=value):
            return str(value)
        case t.Variable(name=name):
            return names[name]
        case t.Not(operand=operand):
            return f"!({_text(operand, names)})"
        case t.And(operands=operands):
            return "(" + " & ".join(_text(one, names) for one in operands) + ")"
        case t.Or(operands=operands):
            return "(" + " | ".join(_text(one, names) for one in operands) + ")"
        case t.Compare(op=op, left=left, right=right):
            return f"({_text(left, names)} {'=' if op == '==' else op} {_text(right, names)})"
        case t.Add(left=left, right=right):
            return f"({_text(left, names)} + {_text(right, names)})"
        case _:
            raise SystemExit(f"no PRISM text for {term}")


def measure_aeros(system: TransitionSystem) -> dict[str, Any]:
    """Measure the seconds for the verdict alone, and with the certificate; and the verdict."""
    started = time.perf_counter()
    loop = SymbolicLoop(system)
    holds = loop.dead_end() is None
    decided = time.perf_counter() - started
    certified = None
    if holds:
        try:
            claims = list(certificate_obligations(system.task, loop.certificate()))
        except CertificateTooLargeError:
            claims = []
        if any(one.verdict is not Verdict.PROVED for one in discharge_obligations(claims)):
            raise SystemExit("the certificate was not confirmed")
        certified = time.perf_counter() - started if claims else None
    return {"holds": holds, "decided": decided, "certified": certified}


def measure_storm(system: TransitionSystem, stormpy: Any) -> dict[str, Any]:
    """Measure the seconds for the verdict by Storm, from the text of the program on; and the verdict."""
    text = write_prism(SymbolicLoop(system))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "loop.prism"
        file.write_text(text, encoding="utf-8")
        started = time.perf_counter()
        program = stormpy.parse_prism_program(str(file))
        asked = stormpy.parse_properties(_PROPERTY, program)
        model = stormpy.build_symbolic_model(program, asked)
        result = stormpy.model_checking(model, asked[0])
        result.filter(stormpy.create_filter_initial_states(model))
        return {"holds": bool(result.forall_true()), "decided": time.perf_counter() - started}


def main() -> None:
    """Measure each loop and print times as JSON or a table."""
    given = build_parser(__doc__, "each loop once").parse_args()
    runs = 1 if given.quick else 3
    try:
        stormpy = importlib.import_module("stormpy")
    except ImportError:
        stormpy = None
        print("stormpy is not installed: AEROS alone", file=sys.stderr)
    loops: dict[str, Callable[[], TransitionSystem]] = {
        "15 flags": lambda: flags_loop(15),
        "40 flags": lambda: flags_loop(40),
        "40 flags, stuck": lambda: flags_loop(40, is_stuck=True),
        "12 pieces": lambda: counting_loop(12),
        "30 pieces": lambda: counting_loop(30),
    }
    found: dict[str, dict[str, Any]] = {}
    for name, build in loops.items():
        ours = [measure_aeros(build()) for _ in range(runs)]
        found[name] = {"holds": ours[0]["holds"], "decided": _median(ours, "decided")}
        if ours[0]["certified"] is not None:
            found[name]["certified"] = _median(ours, "certified")
        if stormpy is not None:
            theirs = [measure_storm(build(), stormpy) for _ in range(runs)]
            if theirs[0]["holds"] is not ours[0]["holds"]:
                raise SystemExit(f"AEROS and Storm disagree on {name}")
            found[name]["storm"] = _median(theirs, "decided")
    if given.format == "json":
        print_json(found)
        return
    for name, row in found.items():
        print(
            name,
            *(f"{key} {value:.3f}" if key != "holds" else f"{key} {value}" for key, value in row.items()),
        )


def _median(rows: list[dict[str, Any]], key: str) -> float:
    return float(statistics.median(row[key] for row in rows))


if __name__ == "__main__":
    main()
