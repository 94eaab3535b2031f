"""Concurrent actions obey Φ and the joint rules, given that each part obeys Φ: theorem 11."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import product
from types import SimpleNamespace
from typing import Any, Final, cast

from aeros.agent.memory.posterior import SuccessRecord
from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.skill import Action
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.ecm import Alternative
from aeros.spec.model.step_graph import Fallback, If, Par, RetriedPart, Seq
from aeros.spec.model.variables import Declared
from aeros.spec.theorems.module_copies import ModuleSource, Mutant, install_stubs
from aeros.spec.theorems.smtlib import smt_and, smt_apply, smt_implies, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.composition.alternatives import ALTERNATIVES, PROGRESS, alternatives_in_order
from proofs.composition.executor_motions import CLEAN_UP, SCHEDULER, STEP, motions_match_plant
from proofs.composition.stops import PART_STOPS, PLAN_EXECUTOR, held_parts, timed_parts
from proofs.lib.loops import loops_of

JOINT_RULES: Final = "aeros.runtime.gate.joint_rules"
DECISION_PIPELINE: Final = "aeros.runtime.execution.decision_pipeline"
GATE: Final = "aeros.runtime.gate.gate"
JOINT: Final = "aeros.spec.obligations.joint"
DISPATCHER: Final = "aeros.agent.execution.dispatcher"
COMPOSITION: Final = "aeros.spec.model.composition"
PARALLEL: Final = "aeros.spec.obligations.parallel"

# At work: each action is decided beside those under way.

_OTHERS: Final = ("first", "second")
_JOINT_RULES: Final = {"rule.ab": ("a", "b"), "rule.aa": ("a", "a")}


def _joint_rule_obligation(code: ModuleSource) -> TheoremObligation:
    """With what one rule says of one pair put aside."""
    joint_rules = code.module(JOINT_RULES)

    def run(ask: DecideBranch) -> str:
        def active_action(name: str) -> Any:
            return SimpleNamespace(
                name=name, action=SimpleNamespace(kind="a" if ask(f"{name}.is-a") else "b")
            )

        def rule(name: str, kinds: tuple[str, str]) -> Any:
            def objections(roles: Any, _: Any, __: Any) -> Iterator[Reason]:
                if not ask(smt_apply(name, *(one.name for one in roles))):
                    yield Reason("AE751", name, "")

            return SimpleNamespace(kinds=kinds, objections=objections)

        rules = object.__new__(joint_rules.JointRules)
        rules._rules = [rule(name, kinds) for name, kinds in _JOINT_RULES.items()]
        rules._shared_actuators = lambda one, other: iter(
            (Reason("AE752", "", ""),) if ask(f"(share-actuators {one.name} {other.name})") else ()
        )
        rules._grip_conflicts = lambda one, other: iter(
            (Reason("AE764", "", ""),) if ask(f"(grips-while-moving {one.name} {other.name})") else ()
        )
        return smt_literal(
            not list(rules.objections(active_action("one"), [active_action(name) for name in _OTHERS]))
        )

    def obeyed(other: str) -> Iterator[str]:
        yield f"(not (share-actuators one {other}))"
        yield f"(not (grips-while-moving one {other}))"
        for name, kinds in _JOINT_RULES.items():
            for roles in (("one", other), (other, "one")):
                fits = [
                    f"(= {role}.is-a {smt_literal(kind == 'a')})"
                    for role, kind in zip(roles, kinds, strict=True)
                ]
                yield smt_implies(smt_and(fits), smt_apply(name, *roles))

    claims = [claim for other in _OTHERS for claim in obeyed(other)]
    return TheoremObligation(
        "`JointRules.objections` yields nothing exactly where an action shares no actuator with any under\n"
        "way, neither grips while the other moves, and every joint rule holds of it and each of them, in\n"
        "either order of the roles.",
        (
            "(declare-sort Begun 0)",
            *(f"(declare-const {name} Begun)" for name in ("one", *_OTHERS)),
            *(f"(declare-const {name}.is-a Bool)" for name in ("one", *_OTHERS)),
            *(
                f"(declare-fun {name} (Begun Begun) Bool)"
                for name in ("share-actuators", "grips-while-moving", *_JOINT_RULES)
            ),
        ),
        f"(= nothing {smt_and(claims)})",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
    )


def _joint_decision_obligation(code: ModuleSource) -> TheoremObligation:
    gate = code.module(GATE)

    def run(ask: DecideBranch) -> str:
        decider = object.__new__(gate._Decider)
        found = [] if ask("nothing-objects") else [Reason("AE751", "rule", "")]
        decider._joint = SimpleNamespace(objections=lambda *_: iter(found))
        action = Action("a", {}) if ask("forwarded") else None
        kind = DecisionKind.ATTENUATE if ask("attenuated") else DecisionKind.ALLOW
        given = Decision(kind if action else DecisionKind.DENY, action, ())
        decided = decider.decide_jointly(given, {}, 0.0, [])
        if decided.action is None:
            return "deny" if decided.kind is DecisionKind.DENY else "wrong"
        return "same" if decided == given else "wrong"

    return TheoremObligation(
        "`_Decider.decide_jointly` forwards what was to be forwarded where nothing objects, and else\n"
        "nothing.",
        (
            "(declare-datatypes ((Beside 0)) (((same) (deny) (wrong))))",
            "(declare-const nothing-objects Bool)",
            "(declare-const forwarded Bool)",
            "(declare-const attenuated Bool)",
        ),
        "(= decided (ite (and forwarded nothing-objects) same deny))",
        tables=(SymbolicFunction("decided", "Beside", execute_symbolically(run)),),
    )


def _active_motion_obligation(code: ModuleSource) -> TheoremObligation:
    """With the gate, the motions and what is measured put aside; each is explored elsewhere."""
    deciding = code.module(DECISION_PIPELINE, concurrent_motions=lambda *_: (), denial_causes=lambda *_: ())
    action = Action("a", {})
    allowed, reduced = (Decision(kind, action, ()) for kind in (DecisionKind.ALLOW, DecisionKind.ATTENUATE))
    denied = Decision(DecisionKind.DENY, None, (Reason("AE751", "rule", ""),))

    def run(ask: DecideBranch) -> str:
        recorded: list[Any] = []

        def decide_jointly(given: Decision, _: Any, __: Any, others: Sequence[str]) -> Decision:
            obeys = all(ask(f"obeys.{other.record_number}") for other in cast("Any", others))
            return given if obeys else denied

        def decide_motion(gated: Decision, *_: Any) -> Any:
            return gated if gated.action is None or ask("motion-obeys") else denied, None, {}

        def append(_: str, made: Any) -> int:
            recorded.append(made)
            return 1

        one = object.__new__(deciding.DecisionPipeline)
        one._plant = SimpleNamespace(observe=dict, now=lambda: 0.0)
        one._histories = SimpleNamespace(names={"was"}, update=lambda measured, _: measured)
        one._configuration = SimpleNamespace(digest="")
        one._encoder = SimpleNamespace(encode=lambda made: made)
        one._audit = SimpleNamespace(append=append)
        one._gate = SimpleNamespace(decide_jointly=decide_jointly)
        forwarded = reduced if ask("is-attenuated") else allowed
        one._decide_alone = lambda *_: (forwarded if ask("obeys-alone") else denied, {})
        one._decide_motion = decide_motion
        one._is_protective = lambda gated: gated.action is not None and ask("is-protective")
        others = [
            SimpleNamespace(
                active_action=SimpleNamespace(record_number=name),
                plan=None,
                is_halting=ask(f"{name}.is-halting"),
            )
            for name in _OTHERS
        ]
        found = one.decide(cast("Any", None), Action("a", {}), others)
        (made,) = recorded
        concurrent = [] if found.is_protective_stop or ask("is-protective") else list(_OTHERS)
        if made.decision is not found.decision or (
            found.active_action is not None and made.concurrent_records != concurrent
        ):
            return "wrong"
        if found.active_action is None:
            return "nothing"
        return "ends-others" if found.is_protective_stop else "begins"

    obeyed = smt_and(("obeys-alone", "motion-obeys", *(f"obeys.{name}" for name in _OTHERS)))
    names = ("obeys-alone", "motion-obeys", "is-protective", *(f"obeys.{name}" for name in _OTHERS))
    return TheoremObligation(
        "`DecisionPipeline.decide` begins an action only if it obeys by itself, beside all that is under\n"
        "way, those that come to rest included, and in its motion; or it is a protective stop,"
        " which ends the others.",
        (
            "(declare-datatypes ((Begins 0)) (((begins) (ends-others) (nothing) (wrong))))",
            *(f"(declare-const {name} Bool)" for name in (*names, "is-attenuated")),
            *(f"(declare-const {name}.is-halting Bool)" for name in _OTHERS),
        ),
        "(= found (ite (and is-protective obeys-alone motion-obeys) ends-others"
        f" (ite (and (not is-protective) {obeyed}) begins nothing)))",
        tables=(SymbolicFunction("found", "Begins", execute_symbolically(run)),),
    )


# At install: what is proved of parallel branches.


def _apply_uninterpreted(name: str, *variables: str) -> t.Term:
    """An uninterpreted condition on variables, which survives that they are renamed."""
    parameters = tuple(t.Variable(one, BOOL, t.VariableRole.STATE) for one in variables)
    return t.Implies(t.Variable(f"{name}!", BOOL, t.VariableRole.STATE), t.And(parameters))


_VALUES: Final = {"s": "now", "x.pa": "of-a", "x.s": "a-began", "y.pb": "of-b", "y.s": "b-began"}
"""For what each variable of an obligation stands: a proof is about all values, so about these."""


def _formula(term: t.Term) -> str:
    match term:
        case t.Implies(premise=t.Variable(name=name), conclusion=t.And(operands=operands)):
            arguments = [_VALUES[part.name] for part in operands if isinstance(part, t.Variable)]
            return smt_apply(name.removesuffix("!"), *arguments)
        case t.And(operands=operands):
            return smt_and(map(_formula, operands))
        case _:
            raise AssertionError(f"nothing here makes such a term: {term}")


def _declared(name: str, role: t.VariableRole) -> Declared:
    return Declared(t.Variable(name, BOOL, role), cast("Any", None))


def _proved_obligations(code: ModuleSource) -> TheoremObligation:
    """Made of the obligations, each taken as what its proof says: that it holds of all values."""
    joint = code.module(JOINT)
    kinds = {
        kind: SimpleNamespace(parameters={f"p{kind}": _declared(f"p{kind}", t.VariableRole.PARAMETER)})
        for kind in "ab"
    }
    rule = SimpleNamespace(
        id="rule",
        roles=(("x", "a"), ("y", "b")),
        term=_apply_uninterpreted("joint", "s", "x.pa", "y.pb"),
        require_span=None,
        text="",
        rationale="",
        conjuncts=(),
    )
    state = {"s": _declared("s", t.VariableRole.STATE)}
    site = SimpleNamespace(
        state=state,
        observed_variables=state,
        kinds=kinds,
        joint_rules=(rule,),
        rules_for_kind=lambda kind: (
            SimpleNamespace(terms={kind: _apply_uninterpreted(f"phi.{kind}", "s", f"p{kind}")}),
        ),
    )

    def running(name: str) -> Any:
        envelope = {
            kind: SimpleNamespace(term=_apply_uninterpreted(f"{name}.may-{kind}", "s", f"p{kind}"), span=None)
            for kind in "ab"
        }
        skill = SimpleNamespace(envelope=envelope)
        return SimpleNamespace(
            name=name,
            step=SimpleNamespace(id=name, span=None),
            skill=skill,
            arguments=SimpleNamespace(variables=(), terms={}),
        )

    install_stubs(joint, {"SpanLabel": lambda *_: None})
    made = list(joint.joint_obligations("c", 1, site, running("one"), running("other")))
    proved = {}
    for number, obligation in enumerate(made):
        premise = smt_and(map(_formula, obligation.space.assumptions))
        proved[f"obligation.{number}"] = smt_implies(premise, _formula(obligation.conclusion))
    pairs = (("one", "other"), ("other", "one"))
    return TheoremObligation(
        "Where `joint_obligations` are proved of two steps, every action of kind a of either and of kind b\n"
        "of the other obey the joint rule: each in its envelope when it began, both obeying Φ now.",
        (
            "(declare-sort Value 0)",
            *(f"(declare-const {name} Value)" for name in ("now", "of-a", "a-began", "of-b", "b-began")),
            "(declare-fun joint (Value Value Value) Bool)",
            *(f"(declare-fun phi.{kind} (Value Value) Bool)" for kind in "ab"),
            *(
                f"(declare-fun {name}.may-{kind} (Value Value) Bool)"
                for name in ("one", "other")
                for kind in "ab"
            ),
        ),
        smt_and(
            f"(=> (and ({x}.may-a a-began of-a) ({y}.may-b b-began of-b) (phi.a now of-a) (phi.b now of-b))"
            " (joint now of-a of-b))"
            for x, y in pairs
        ),
        assumptions=proved,
    )


_STEPS: Final = ("s1", "s2", "s3", "s4")


def _branch_pair_obligations(code: ModuleSource) -> TheoremObligation:
    """Of all shapes of two branches, each of two steps, one with handlers."""
    model = code.module(COMPOSITION)
    parallel = code.module(PARALLEL, using=(model,))

    def step(name: str, between: str | None = None, last: str | None = None) -> Any:
        return model.Step(name, name, {}, {}, 0, between, last, None)

    def settled(*_: Any) -> Iterator[Any]:
        """Yield nothing: claims that need no solver are left out."""
        return iter(())

    parallel._BranchPairClaims.resources = parallel._BranchPairClaims.shared_use_claims = settled

    def run(ask: DecideBranch) -> str:
        handlers = {"h": step("h"), "l": step("l")}

        def branch(which: str, one: Any, two: Any) -> Any:
            if ask(f"{which}.is-seq"):
                return Seq((one, two))
            if ask(f"{which}.is-if"):
                return If(t.TRUE, "", one, two, cast("Any", None))
            if ask(f"{which}.is-any"):
                return Fallback((one, RetriedPart(two, 1, cast("Any", None))), cast("Any", None))
            return Par((one, two), cast("Any", None))

        asked = (("h", "handled"), ("l", "handled-last"))
        names = [name if ask(given) else None for name, given in asked]
        s1, s2, s3, s4 = step("s1", *names), *map(step, _STEPS[1:])
        inner = branch("left", s1, s2), branch("right", s3, s4)
        par = Par(inner, cast("Any", None))
        met: set[frozenset[str]] = set()

        def joint_obligations(_: str, __: int, ___: Any, a: Any, b: Any) -> Sequence[Any]:
            met.add(frozenset((a.step.id, b.step.id)))
            return ()

        install_stubs(
            parallel,
            {"joint_obligations": joint_obligations, "step_arguments": lambda *_: None},
        )
        composition = SimpleNamespace(id="c", body=par, handlers=handlers)
        skills = dict.fromkeys((*_STEPS, "h", "l"))
        ecm = SimpleNamespace(callable_skills=skills)
        list(parallel.parallel_obligations(composition, ecm, SimpleNamespace()))
        return smt_literal(_concurrent_steps(inner, [name for name in names if name]) <= met)

    return TheoremObligation(
        "`parallel_obligations` puts every two steps that may be under way together to `joint_obligations`,\n"
        "handlers among them, whatever is nested in the branches.",
        (
            *(
                f"(declare-const {side}.is-{shape} Bool)"
                for side in ("left", "right")
                for shape in ("seq", "if", "any")
            ),
            "(declare-const handled Bool)",
            "(declare-const handled-last Bool)",
        ),
        "every-pair-is-met",
        tables=(SymbolicFunction("every-pair-is-met", "Bool", execute_symbolically(run)),),
    )


def _owner_obligation(code: ModuleSource) -> TheoremObligation:
    """With what memory says, and what is measured, put aside."""
    dispatching = code.module(DISPATCHER, evidence_context=lambda *_: "", _with_defaults=lambda *_: {})
    record, recent = (
        SuccessRecord(0, 0),
        SimpleNamespace(successes=0, failures=0, mean=0.5, sample=lambda _: 0.5),
    )
    alternatives = tuple(Alternative(name) for name in ("own", "b.lent"))

    def run(ask: DecideBranch) -> str:
        modules = {
            "a": SimpleNamespace(
                id="a", behaviour_digest="", skills={"own": SimpleNamespace(id="own", inputs={}, wear=0)}
            ),
            "b": SimpleNamespace(
                id="b", behaviour_digest="", skills={"lent": SimpleNamespace(id="lent", inputs={}, wear=0)}
            ),
        }
        caller = modules["a"]
        caller.callable_skills = {"own": None, "b.lent": None}
        named = {"own": alternatives[:1], "b.lent": alternatives[1:], "either": alternatives}
        name = "own" if ask("names-own") else "b.lent" if ask("names-lent") else "either"
        caller.alternatives = named.__getitem__
        if not ask("b.is-active"):
            del modules["b"]
        problem = dispatching.Cause("precondition", "", "")
        install_stubs(
            dispatching,
            {"_problem": lambda of, skill, *_: None if ask(f"{skill.id}.can-start") else problem},
        )
        one = object.__new__(dispatching.Dispatcher)
        one._runtime = SimpleNamespace(active_modules=lambda: modules)
        one._memory = SimpleNamespace(
            success_record=lambda *_: record,
            recent_records=lambda contexts: dict.fromkeys(contexts, recent),
            typical_duration=lambda *_: None,
            recent_duration=lambda *_: None,
            latest_episode=lambda: 0,
        )
        one._task, one._seed, one.denied = "", 0, set()
        one._explorations = Counter()
        try:
            dispatch = one.dispatch("a", name, {}, None)
        except dispatching.DispatchError:
            return "nothing"
        except ValueError:
            return "another"
        request = dispatch.request
        owner = modules.get(request.module)
        is_own = owner is not None and owner.skills.get(request.skill) is dispatch.skill
        return request.module if is_own else "another"

    lent = "(and b.is-active lent.can-start)"
    return TheoremObligation(
        "`Dispatcher.dispatch` requests a skill from the module that owns it, whichever names it, and only\n"
        "where that module is active and the skill can start.",
        (
            "(declare-datatypes ((Owner 0)) (((a) (b) (another) (nothing))))",
            *(
                f"(declare-const {name} Bool)"
                for name in ("names-own", "names-lent", "b.is-active", "own.can-start", "lent.can-start")
            ),
        ),
        "(and (not (= requested another))"
        " (=> (= requested a) (and own.can-start (or names-own (not names-lent))))"
        f" (=> (= requested b) (and {lent} (not names-own)))"
        f" (=> (= requested nothing) (and (or (not own.can-start) (and (not names-own) names-lent))"
        f" (or (not {lent}) names-own))))",
        tables=(SymbolicFunction("requested", "Owner", execute_symbolically(run)),),
    )


def _concurrent_steps(branches: tuple[Any, Any], handlers: Sequence[str]) -> set[frozenset[str]]:
    """Steps that may be under way together: of both branches, and of one that is parallel itself."""
    left, right = {"s1", "s2", *handlers}, {"s3", "s4"}
    found = {frozenset(pair) for pair in product(left, right)}
    for branch, steps in zip(branches, (left, right), strict=True):
        if isinstance(branch, Par):
            last = "s2" if steps is left else "s4"
            found |= {frozenset((one, last)) for one in steps - {last}}
    return found


_LOOPS: Final = loops_of(
    "aeros.runtime.gate.gate",
    "aeros.runtime.gate.joint_rules",
    "aeros.runtime.execution.scheduler",
    "aeros.runtime.execution.clean_up",
    "aeros.runtime.execution.step",
    "aeros.runtime.execution.decision_pipeline",
    "aeros.agent.execution.dispatcher",
    "aeros.agent.execution.alternatives",
    "aeros.agent.execution.part_stops",
    ("aeros.spec.obligations.joint", ("joint_obligations",)),
    (
        "aeros.spec.obligations.parallel",
        (
            "_BranchPairClaims.joint_rule_claims",
            "_BranchPairClaims._actuators",
        ),
    ),
    (
        "aeros.spec.model.composition",
        (
            "handlers_of",
            "steps_of",
        ),
    ),
)

THEOREM = Theorem(
    "parallel actions obey Φ individually and the joint rules together; seq and cond need no joint check; a "
    "step that calls another module runs as that module",
    {
        "beside": _joint_rule_obligation,
        "decided-beside": _joint_decision_obligation,
        "under-way": _active_motion_obligation,
        "tells-all": motions_match_plant,
        "proved-joint": _proved_obligations,
        "pairs": _branch_pair_obligations,
        "owner": _owner_obligation,
        "alternatives": alternatives_in_order,
        "held": held_parts,
        "timed": timed_parts,
        "loops": _LOOPS,
    },
    (
        Mutant(
            "looks-at-the-latest-motion-alone",
            "beside",
            JOINT_RULES,
            "        for other in active_actions:\n",
            "        for other in [*active_actions][-1:]:\n",
        ),
        Mutant(
            "looks-at-roles-in-one-order",
            "beside",
            JOINT_RULES,
            "for roles in ((action, active_action), (active_action, action)):",
            "for roles in ((action, active_action),):",
        ),
        Mutant(
            "forwards-what-was-allowed-by-itself",
            "decided-beside",
            GATE,
            "if reasons else decision\n",
            "if not reasons else decision\n",
        ),
        Mutant(
            "forwards-what-was-reduced-without-joint-rules",
            "decided-beside",
            GATE,
            "        if decision.action is None:\n            return decision\n        reasons",
            "        if decision.kind is not DecisionKind.ALLOW:\n            return decision\n        "
            "reasons",
        ),
        Mutant(
            "asks-nothing-of-what-was-reduced",
            "under-way",
            DECISION_PIPELINE,
            "            if others:\n                gated = self._gate",
            "            if others and gated.kind is DecisionKind.ALLOW:\n                gated = self._gate",
        ),
        Mutant(
            "overlooks-what-comes-to-rest",
            "under-way",
            DECISION_PIPELINE,
            "[other.active_action for other in others]",
            "[other.active_action for other in others if not other.is_halting]",
        ),
        Mutant(
            "tells-nothing-of-what-comes-to-rest",
            "tells-all",
            STEP,
            "[step.active_motion for step in self.steps.values() if step.active_motion is not None]",
            "[one for step in self.steps.values() if (one := step.active_motion) and not one.is_halting]",
        ),
        Mutant(
            "forgets-a-step-that-still-moves",
            "tells-all",
            CLEAN_UP,
            ("        if step.active_motion is None:\n            step.result = ending\n"),
            "        if step.active_motion is None or step.result is None:\n"
            "            step.result = ending\n",
        ),
        Mutant(
            "takes-all-to-have-ended",
            "tells-all",
            SCHEDULER,
            "end_motions(self._table, landed, self._pipeline.monitors, self._followed)",
            "end_motions(self._table, moving if landed else (), self._pipeline.monitors, self._followed)",
        ),
        Mutant(
            "takes-an-envelope-to-hold-now",
            "proved-joint",
            JOINT,
            "    names = {**site.kinds[kind].parameters, **site.state}\n",
            "    names = {**site.kinds[kind].parameters}\n",
        ),
        Mutant(
            "forgets-handlers",
            "pairs",
            PARALLEL,
            "steps = (step, *handlers_of(step, self.composition.handlers))",
            "steps = (step,)",
        ),
        Mutant(
            "forgets-what-follows-the-last-try",
            "pairs",
            COMPOSITION,
            "names = (self.between_tries, self.last_handler)",
            "names = (self.between_tries,)",
        ),
        Mutant(
            "goes-on-after-any-failure",
            "alternatives",
            ALTERNATIVES,
            "if not failure.is_declared or is_cancelled():",
            "if is_cancelled():",
        ),
        Mutant(
            "goes-on-after-a-cancellation",
            "alternatives",
            ALTERNATIVES,
            "if not failure.is_declared or is_cancelled():",
            "if not failure.is_declared:",
        ),
        Mutant(
            "forgets-which-alternative-has-failed",
            "alternatives",
            PROGRESS,
            "self.set_branch((*at, -1 - number), False)",
            "self.on_change()",
        ),
        Mutant(
            "begins-what-is-not-held",
            "held",
            PART_STOPS,
            "        if scope.cancel_reason is None and scope.is_due_to_stop(self._holds, self._is_due):\n"
            "            return",
            "        if scope.cancel_reason is None and scope.is_due_to_stop(lambda _: True, self._is_due):\n"
            "            return",
        ),
        Mutant(
            "measures-no-condition-after-a-step",
            "held",
            PART_STOPS,
            "scope.scope_to_stop(self._holds, self._is_past, result.lost_hold)",
            "scope.scope_to_stop(lambda _: True, self._is_past, result.lost_hold)",
        ),
        Mutant(
            "forgets-that-a-condition-was-lost",
            "held",
            PART_STOPS,
            "if number == lost_hold:",
            "if lost_hold is not None and number > lost_hold:",
        ),
        Mutant(
            "holds-nothing-while-a-step-runs",
            "held",
            PLAN_EXECUTOR,
            "started = self._attempts.start(role, step.module, step.skill, inputs, scope.held)",
            "started = self._attempts.start(role, step.module, step.skill, inputs, ())",
        ),
        Mutant(
            "hides-an-end-that-no-plan-provides-for",
            "held",
            PART_STOPS,
            "if scope.stop is not None and (failure is None or failure.is_declared or failure.is_stop):",
            "if scope.stop is not None:",
        ),
        Mutant(
            "lets-a-step-run-on-after-its-time",
            "timed",
            PART_STOPS,
            "            self._attempts.cancel(handle, reason)\n",
            "            self._attempts.waiting\n",
        ),
        Mutant(
            "hides-an-end-after-its-time",
            "timed",
            PART_STOPS,
            "if scope.stop is not None and (failure is None or failure.is_declared or failure.is_stop):",
            "if scope.stop is not None:",
        ),
        Mutant(
            "requests-from-the-caller",
            "owner",
            DISPATCHER,
            "StepRequest(owner.id, skill.id, _with_defaults(skill, inputs)),",
            "StepRequest(module, skill.id, _with_defaults(skill, inputs)),",
        ),
        Mutant(
            "chooses-what-is-not-active",
            "owner",
            DISPATCHER,
            ', "" if one in preferred else _unavailable_reason(one.problem))\n',
            ', "")\n',
        ),
        Mutant(
            "looks-at-two-motions-only",
            "loops",
            "aeros.runtime.gate.joint_rules",
            "for other in active_actions:",
            "for other in active_actions[:2]:",
        ),
    ),
)
