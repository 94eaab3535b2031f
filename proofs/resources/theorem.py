"""A step acts only while it holds all its resources; no resource is held more often than the site has it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_and, smt_literal, smt_or
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib.loops import loops_of

RESOURCES: Final = "aeros.runtime.execution.resources"
SCHEDULER: Final = "aeros.runtime.execution.scheduler"
CLEAN_UP: Final = "aeros.runtime.execution.clean_up"
STEP: Final = "aeros.runtime.execution.step"

_NAMES: Final = ("r", "s")
"""Two resources, of which each step needs any."""

_HOLDER: Final = 7
_WAITING: Final = (1, 2, 3)
"""A step that holds resources, and steps that wait, in the order in which they asked."""

# The queue.


class _Needs(frozenset[str]):
    """Names in order: a set's own order differs from run to run."""

    def __iter__(self) -> Iterator[str]:
        return iter([name for name in _NAMES if name in self])


def _needs(ask: DecideBranch, step: int) -> frozenset[str]:
    return _Needs(name for name in _NAMES if ask(f"needs.{step}.{name}"))


def _queue(code: ModuleSource, ask: DecideBranch) -> Any:
    """A queue in any state: of each resource any number, one step that holds some, three that wait."""
    capacities = {name: SymbolicValue(f"capacity.{name}", ask) for name in _NAMES}
    queue = code.module(RESOURCES).ResourceQueue(capacities)
    queue._held[_HOLDER] = _needs(ask, _HOLDER)
    queue.waiting = {step: _needs(ask, step) for step in _WAITING}
    return queue


_QUEUE_DECLARATIONS: Final = (
    "(declare-datatypes ((Grant 0)) (((grant (g.1 Bool) (g.2 Bool) (g.3 Bool)) (wrong))))",
    *(f"(declare-const capacity.{name} Int)" for name in _NAMES),
    *(f"(declare-const needs.{step}.{name} Bool)" for step in (_HOLDER, *_WAITING) for name in _NAMES),
    *(f"(define-fun held.{name} () Int (ite needs.{_HOLDER}.{name} 1 0))" for name in _NAMES),
)


def _granted(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        queue = _queue(code, ask)
        asked, held = dict(queue.waiting), dict(queue._held)
        granted = queue.grant_ready()
        expected_held = {**held, **{step: asked[step] for step in granted}}
        left = {step: needs for step, needs in asked.items() if step not in granted}
        in_order = granted == [step for step in _WAITING if step in granted]
        is_whole = queue._held == expected_held and list(queue.waiting.items()) == list(left.items())
        if not (in_order and is_whole):
            return "wrong"
        return f"(grant {' '.join(smt_literal(step in granted) for step in _WAITING)})"

    def given(step: int) -> str:
        return f"(g.{step} found)"

    def after(name: str) -> str:
        units = (f"(ite (and {given(step)} needs.{step}.{name}) 1 0)" for step in _WAITING)
        return f"(+ held.{name} {' '.join(units)})"

    def common(one: int, other: int) -> str:
        return smt_or(f"(and needs.{one}.{name} needs.{other}.{name})" for name in _NAMES)

    kept = [
        f"(<= {after(name)} (ite (<= held.{name} capacity.{name}) capacity.{name} held.{name}))"
        for name in _NAMES
    ]
    in_turn = [
        f"(=> (and (not {given(first)}) {given(second)}) (not {common(first, second)}))"
        for first, second in combinations(_WAITING, 2)
    ]
    needed = []
    for step in _WAITING:
        lacking = (f"(and needs.{step}.{name} (<= capacity.{name} {after(name)}))" for name in _NAMES)
        awaited = (
            f"(and (not {given(earlier)}) {common(earlier, step)})" for earlier in _WAITING if earlier < step
        )
        needed.append(f"(=> (not {given(step)}) {smt_or((*lacking, *awaited))})")
    return TheoremObligation(
        "`ResourceQueue.grant_ready` gives a waiting step all that it needs or leaves it as it was. No\n"
        "resource is held more often than there is of it, or than before; no step gets one that a step that\n"
        "asked earlier still waits for; and who goes on waiting lacks one, or waits behind such a step.",
        _QUEUE_DECLARATIONS,
        smt_and(["((_ is grant) found)", *kept, *in_turn, *needed]),
        tables=(SymbolicFunction("found", "Grant", execute_symbolically(run)),),
    )


def _released(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        queue = _queue(code, ask)
        step = next((one for one in _WAITING if ask(f"(= step {one})")), _HOLDER)
        held, waiting = dict(queue._held), dict(queue.waiting)
        queue.release(step)
        queue.release(step)
        others = ({n: one for n, one in each.items() if n != step} for each in (held, waiting))
        return smt_literal((queue._held, queue.waiting) == tuple(others))

    return TheoremObligation(
        "`ResourceQueue.release` takes exactly this step from those that hold and those that wait; a second\n"
        "time changes no more.",
        (*_QUEUE_DECLARATIONS, "(declare-const step Int)"),
        "released",
        tables=(SymbolicFunction("released", "Bool", execute_symbolically(run)),),
    )


def _enqueued(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        queue = _queue(code, ask)
        step = next((one for one in (*_WAITING, _HOLDER) if ask(f"(= step {one})")), 9)
        held, waiting, needs = dict(queue._held), list(queue.waiting.items()), _needs(ask, 9)
        try:
            queue.enqueue(step, [*needs])
        except MisuseError:
            is_same = queue._held == held and list(queue.waiting.items()) == waiting
            return "refused" if is_same else "changed"
        is_last = queue._held == held and list(queue.waiting.items()) == [*waiting, (step, needs)]
        return "last" if is_last else "changed"

    return TheoremObligation(
        "`ResourceQueue.enqueue` puts a step with exactly its needs behind all that wait; one that waits or\n"
        "holds something is refused.",
        (
            *_QUEUE_DECLARATIONS,
            *(f"(declare-const needs.9.{name} Bool)" for name in _NAMES),
            "(declare-datatypes ((Place 0)) (((refused) (last) (changed))))",
            "(declare-const step Int)",
        ),
        f"(= place (ite {smt_or(f'(= step {one})' for one in (*_WAITING, _HOLDER))} refused last))",
        tables=(SymbolicFunction("place", "Place", execute_symbolically(run)),),
    )


# What a step needs, and what a site has.


def _needed(code: ModuleSource) -> TheoremObligation:
    steps = code.module(STEP)
    flags = [f"{whose}.{name}" for whose in ("skill", "site") for name in ("arm", "hand")]

    def run(ask: DecideBranch) -> str:
        moved = [frozenset({name}) for name in ("arm", "hand") if ask(f"site.{name}")]
        kinds = {str(number): SimpleNamespace(actuators=one) for number, one in enumerate(moved)}
        site = SimpleNamespace(kinds=kinds, resources={"arm": 5, "tray": 2})
        used = frozenset(name for name in ("arm", "hand") if ask(f"skill.{name}"))
        needs = steps.required_resources(
            SimpleNamespace(resources=frozenset({"arm", "tray"}), actuators=used)
        )
        found = steps.resource_capacities(site)
        actuators = [name for one in moved for name in one]
        expected = {"arm": 5, "tray": 2, **{f"actuator {name}": 1 for name in actuators}}
        return smt_literal(
            found == expected and needs == {"arm", "tray", *(f"actuator {name}" for name in used)}
        )

    return TheoremObligation(
        "`resource_capacities` has each declared resource as often as the site says, and each actuator\n"
        "once; `required_resources` has one of each that the skill declares, and each of its actuators. A\n"
        "resource with the name of an actuator is another one.",
        [f"(declare-const {flag} Bool)" for flag in flags],
        "exactly",
        tables=(SymbolicFunction("exactly", "Bool", execute_symbolically(run)),),
    )


# The executor: a step acts from the grant to the release.


def _begins(code: ModuleSource) -> TheoremObligation:
    scheduler = code.module(
        SCHEDULER,
        caller_details=lambda _: {},
        required_resources=lambda skill: skill.needs,
        StepHandle=lambda number: number,
    )

    def run(ask: DecideBranch) -> str:
        ready = [step for step in _WAITING if ask(f"granted.{step}")]
        queue = SimpleNamespace(
            waiting=ask("some-wait"),
            grant_ready=lambda: ready if ask("some-wait") else [],
            never_available=lambda _: None,
            enqueue=lambda handle, needs: asked.append((handle, needs)),
        )
        asked: list[tuple[int, Any]] = []
        made = object.__new__(scheduler.Scheduler)
        made._resources, made._plant = queue, SimpleNamespace(now=lambda: 0.0, skill_began=lambda _: None)
        made._audit = SimpleNamespace(append=lambda *_: 0)
        made._steps = {number: _waiting_step(number) for number in _WAITING}
        made._table = SimpleNamespace(add=lambda _: 4)
        made._begin_ready_steps()
        running = [number for number, step in made._steps.items() if step.is_running]
        handle = made.enqueue(_waiting_step(4))
        fits = running == (ready if ask("some-wait") else []) and (handle, asked) == (4, [(4, "needs of 4")])
        return smt_literal(fits)

    return TheoremObligation(
        "`Scheduler._begin_ready_steps` has exactly those steps act that were granted their resources, and\n"
        "`Scheduler.enqueue` asks for all that the step's skill requires, under the step's number.",
        ["(declare-const some-wait Bool)", *(f"(declare-const granted.{step} Bool)" for step in _WAITING)],
        "exactly",
        tables=(SymbolicFunction("exactly", "Bool", execute_symbolically(run)),),
    )


def _waiting_step(number: int) -> Any:
    skill = SimpleNamespace(timeout=1.0, needs=f"needs of {number}")
    return SimpleNamespace(skill=skill, caller=None, name="", is_running=False, deadline=0.0)


def _ends(code: ModuleSource) -> TheoremObligation:
    """Build the obligation about the end of a step, in which anything may fail."""
    clean_up = code.module(CLEAN_UP)

    def run(ask: DecideBranch) -> str:
        events: list[str] = []

        def note(event: str) -> Any:
            def happens(*_: Any, **__: Any) -> None:
                events.append(event)
                if event != "release" and ask(f"{event}-fails"):
                    raise RuntimeError(event)

            return happens

        made = object.__new__(clean_up.CleanUp)
        made._resources = SimpleNamespace(release=note("release"))
        made._plant = SimpleNamespace(skill_ended=note("notify"))
        step = SimpleNamespace(
            is_running=ask("running"), name="", is_finished=False, close_skill=note("close")
        )
        try:
            made._clean_up_step(4, step)
        except RuntimeError:
            events.append("raised")
        expected = [*_expected_events(ask)]
        return smt_literal(events == expected)

    return TheoremObligation(
        "`CleanUp._clean_up_step` closes the skill, notifies the plant of a step that has begun, and then\n"
        "releases the step's resources, whichever of these fails; a failure is not hidden.",
        [f"(declare-const {flag} Bool)" for flag in ("running", "close-fails", "notify-fails")],
        "exactly",
        tables=(SymbolicFunction("exactly", "Bool", execute_symbolically(run)),),
    )


def _expected_events(ask: DecideBranch) -> Iterator[str]:
    yield "close"
    fails = ask("close-fails")
    if ask("running"):
        yield "notify"
        fails |= ask("notify-fails")
    yield "release"
    if fails:
        yield "raised"


THEOREM = Theorem(
    "a step acts only while it holds all its resources, and nothing is held more often than the site has it",
    {
        "granted": _granted,
        "released": _released,
        "enqueued": _enqueued,
        "needed": _needed,
        "begins": _begins,
        "ends": _ends,
        "loops": loops_of(RESOURCES, SCHEDULER, CLEAN_UP, STEP),
    },
    (
        Mutant(
            "gives-one-unit-too-many",
            "granted",
            RESOURCES,
            "any(free[name] < 1 for name in needs)",
            "any(free[name] < 0 for name in needs)",
        ),
        Mutant(
            "lets-later-steps-overtake",
            "granted",
            RESOURCES,
            "                awaited |= needs\n",
            "",
        ),
        Mutant("forgets-what-it-has-given", "granted", RESOURCES, "            free.subtract(needs)\n", ""),
        Mutant(
            "ends-at-the-first-that-has-to-wait",
            "granted",
            RESOURCES,
            "                continue\n",
            "                break\n",
        ),
        Mutant("keeps-what-a-step-held", "released", RESOURCES, "        self._held.pop(step, None)\n", ""),
        Mutant(
            "lets-a-step-ask-twice",
            "enqueued",
            RESOURCES,
            "if step in self._held or step in self.waiting:",
            "if step in self._held:",
        ),
        Mutant(
            "has-two-of-each-actuator", "needed", STEP, "{_actuator(name): 1 for", "{_actuator(name): 2 for"
        ),
        Mutant(
            "takes-an-actuator-for-a-resource-of-its-name",
            "needed",
            STEP,
            'return f"actuator {name}"',
            "return name",
        ),
        Mutant(
            "has-only-the-first-begin",
            "begins",
            SCHEDULER,
            "            self._plant.skill_began(step.name)\n",
            "            self._plant.skill_began(step.name)\n            break\n",
        ),
        Mutant(
            "keeps-resources-of-a-skill-that-fails-at-its-end",
            "ends",
            CLEAN_UP,
            "            stack.callback(self._resources.release, handle)\n",
            "",
        ),
        Mutant(
            "looks-at-two-waiting-steps-only",
            "loops",
            RESOURCES,
            "for step, needs in list(self.waiting.items()):",
            "for step, needs in list(self.waiting.items())[:2]:",
        ),
    ),
)
