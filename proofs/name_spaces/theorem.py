"""What a module measures changes no decision on another's action or Φ unless the site shares or allows it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any, Final, cast

from aeros.runtime.gate.decision import Reason
from aeros.runtime.gate.value_check import value_checkers
from aeros.runtime.ports import ColumnNames, Reading
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.syntax import Name, TextRange
from aeros.spec.expr.types import BOOL
from aeros.spec.model.configured import BoundNames
from aeros.spec.model.variables import Declared
from aeros.spec.theorems.module_copies import ModuleSource, Mutant, install_stubs
from aeros.spec.theorems.smtlib import smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib import symbolic_requests as requests
from proofs.lib.loops import loops_of

_REQUEST_CHECK: Final = "aeros.runtime.gate.request_check"
_FAST_PATH: Final = "aeros.runtime.gate.compiled.fast_path"
_CODEGEN: Final = "aeros.runtime.gate.compiled.codegen"
_MONITOR: Final = "aeros.runtime.monitor.monitor"
_PERCEPTION: Final = "aeros.spec.elaborate.perception"
_SITE: Final = "aeros.spec.model.site"
_DEFINITIONS: Final = "aeros.spec.elaborate.definitions"
_NAME_RESOLUTION: Final = "aeros.spec.expr.typecheck.name_resolution"
_STEP: Final = "aeros.runtime.execution.step"

_OWN: Final = "kettle.hot"
"""A variable of a module, whose value may be anything."""
_INACTIVE: Final = "pot.hot"
"""A variable of a module that is not active."""
_MODULE_VARIABLES: Final = frozenset((_OWN,))


def _bools(*names: str) -> tuple[str, ...]:
    return tuple(f"(declare-const {name} Bool)" for name in names)


def _same(
    says: str,
    declarations: Iterable[str],
    run: Callable[[bool, DecideBranch], str],
    sort: str = "Bool",
    **assumptions: str,
) -> TheoremObligation:
    """That `run` gives the same, with the modules' values and without."""
    return TheoremObligation(
        says,
        tuple(declarations),
        "(= found.with found.without)",
        tables=tuple(
            SymbolicFunction(f"found.{name}", sort, execute_symbolically(partial(run, given)))
            for name, given in (("with", True), ("without", False))
        ),
        assumptions=assumptions,
    )


# Readings one by one, on the full way.


def _unpack_readings(
    code: ModuleSource, ask: DecideBranch, names: Iterable[str], required: frozenset[str]
) -> list[Reason]:
    """Objections of `unpack_readings`; what a form says of a value or its time is put aside."""

    def check_freshness(form: Any, *_: Any) -> Reason | None:
        return None if ask(f"fresh.{form.name}") else Reason("AE706", form.name, "")

    def checker(name: str) -> Any:
        def unpack(*_: Any) -> Reason | None:
            return None if ask(f"formed.{name}") else Reason("AE704", name, "")

        return SimpleNamespace(name=name, unpack=unpack, declared=SimpleNamespace(name=name))

    def is_reading(reading: Any) -> bool:
        return ask(f"is-reading.{reading.value}")

    check = code.module(_REQUEST_CHECK, check_freshness=check_freshness, is_reading=is_reading)
    readings = {name: Reading(name, 0.0) for name in names if ask(f"has.{name}")}
    checkers = {name: checker(name) for name in ("near", _OWN)}
    return list(
        check.unpack_readings(checkers, readings, 0.0, required, {}, module_variables=_MODULE_VARIABLES)
    )


_OF_READINGS: Final = _bools(
    *(
        f"{what}.{name}"
        for name in ("near", _OWN, _INACTIVE)
        for what in ("has", "is-reading", "fresh", "formed")
    )
)


def _readings(code: ModuleSource) -> TheoremObligation:
    def run(given: bool, ask: DecideBranch) -> str:
        names = ("near", _OWN, _INACTIVE) if given else ("near",)
        return smt_literal(not _unpack_readings(code, ask, names, frozenset(("near",))))

    return _same(
        "`unpack_readings` objects to the same, whatever is measured of a module's variable that no\n"
        "condition of the decision reads, and of a module that is not active.",
        _OF_READINGS,
        run,
    )


def _own_reading(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        return smt_literal(not _unpack_readings(code, ask, (_OWN,), frozenset((_OWN,))))

    return TheoremObligation(
        "Where a condition reads a module's variable, `unpack_readings` has no objection exactly where it\n"
        "is measured, fresh and of its form.",
        _OF_READINGS,
        f"(= nothing (and has.{_OWN} is-reading.{_OWN} fresh.{_OWN} formed.{_OWN}))",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
    )


# Readings one by one, on the short way.


def _declared(name: str) -> Declared:
    # Where it is written is nothing that a form looks at.
    variable = t.Variable(name, BOOL, t.VariableRole.STATE)
    return Declared(variable, cast("Any", None), max_age=requests.MAX_AGE)


def _read_each(code: ModuleSource) -> TheoremObligation:
    fast_path = code.module(_FAST_PATH, using=(code.module(_CODEGEN),))
    state = value_checkers({"near": requests.STATE["near"], _OWN: _declared(_OWN)})
    take = fast_path.compile_read_each(state, frozenset(("near",)), _MODULE_VARIABLES)
    take.__globals__.update(requests.STUBS)

    def run(given: bool, ask: DecideBranch) -> str:
        def own() -> Any:
            if not ask(f"is-reading.{_OWN}"):
                return requests.UndeclaredValue()
            return Reading(requests.UndeclaredValue(), cast("float", requests.GivenValue("lit.time", ask)))

        request = requests.SymbolicRequest(ask)
        values: dict[str, Callable[[], Any]] = {"near": lambda: request.readings["near"]}
        values |= {_OWN: own} if given else {}
        readings = requests.NamedValues("readings", ask, values)
        try:
            found = take(readings, request.now, request.now.as_double())
        except (AttributeError, IndexError, KeyError):
            return "silent"  # as the function that calls it
        if found is None:
            return "silent"
        (near,) = found
        requests.check_scalars({"near": near})
        return "taken"

    return _same(
        "The reader that `compile_read_each` writes takes the same, whatever is measured of a module's\n"
        "variable that no condition of the decision reads.",
        (
            *requests.DECLARATIONS,
            *_bools(f"has.{_OWN}", f"is-reading.{_OWN}"),
            "(declare-datatypes ((Taken 0)) (((taken) (silent))))",
        ),
        run,
        "Taken",
    )


# Readings of one moment.


class _Value:
    """A value that was measured, or its scalar."""

    def __init__(self, of: str, when: str) -> None:
        self.of, self.time = of, when


def _unpack_snapshot(
    code: ModuleSource, ask: DecideBranch, names: tuple[str, ...]
) -> Mapping[str, _Value] | None:
    """Scalars of a snapshot, whatever the cache has kept of an earlier one."""

    def is_not(value: _Value, _: _Value) -> bool:
        return not ask(f"same.{value.of}")

    def type_(value: Any) -> Any:
        return list if isinstance(value, _Value) and ask(f"list.{value.of}") else type(value)

    def unpack(name: str, _: _Value) -> Mapping[str, _Value] | None:
        return {name: _Value(name, "current")} if ask(f"formed.{name}") else None

    snapshots = code.module(_FAST_PATH, is_not=is_not, type=type_)
    cache = snapshots.SnapshotCache({}, _MODULE_VARIABLES)
    cache._checkers = {name: SimpleNamespace(names=(name,)) for name in names}
    cache._unpackers = {name: partial(unpack, name) for name in names}
    order = ColumnNames(names)
    column = tuple(_Value(name, "measured") for name in order.names)
    if ask("keeps-one"):
        kept = {name: _Value(name, "kept") for name in names if name == "near" or ask(f"was-taken.{name}")}
        earlier = tuple(_Value(name, "earlier") for name in order.names)
        cache._cached = snapshots._CachedColumn(order, earlier, kept)
    found: Mapping[str, _Value] | None = cache.scalars(SimpleNamespace(order=order, column=column))
    return found


_OF_SNAPSHOTS: Final = _bools(
    "keeps-one",
    *(f"{what}.{name}" for name in ("near", _OWN) for what in ("same", "list", "formed", "was-taken")),
)
_KEPT_STAYS: Final = {
    f"what-was-kept-stays.{name}": f"(=> (and keeps-one same.{name})"
    f" (= was-taken.{name} (and (not list.{name}) formed.{name})))"
    for name in ("near", _OWN)
}
"""The very same object is as it was; nothing of a list is kept."""


def _snapshot(code: ModuleSource) -> TheoremObligation:
    def run(given: bool, ask: DecideBranch) -> str:
        found = _unpack_snapshot(code, ask, ("near", _OWN) if given else ("near",))
        if found is None:
            return "refused"
        return found["near"].time if "near" in found else "absent"

    return _same(
        "`SnapshotCache.scalars` gives the same of the site's variables, whatever a snapshot has of a\n"
        "module's variable.",
        (*_OF_SNAPSHOTS, "(declare-datatypes ((Answer 0)) (((refused) (absent) (current) (kept))))"),
        run,
        "Answer",
        **_KEPT_STAYS,
    )


def _own_snapshot(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        found = _unpack_snapshot(code, ask, (_OWN,))
        return smt_literal(found is not None and _OWN in found)

    return TheoremObligation(
        "`SnapshotCache.scalars` has a module's variable exactly where its value is of its form and no\n"
        "list: nothing older stands for it.",
        _OF_SNAPSHOTS,
        f"(= known (and (not list.{_OWN}) formed.{_OWN}))",
        tables=(SymbolicFunction("known", "Bool", execute_symbolically(run)),),
        assumptions=_KEPT_STAYS,
    )


# The monitor.


def _monitor(code: ModuleSource) -> TheoremObligation:
    monitor = code.module(_MONITOR).RuntimeMonitor

    def run(given: bool, ask: DecideBranch) -> str:
        # What the tick before left, where the fast check had it: all that was measured then.
        before = [name for name in ("near", _OWN) if ask(f"{name}.was-measured")]
        watched = SimpleNamespace(
            _measured=frozenset(before),
            _checked_values={},
            _is_usable=lambda name, *_: ask(f"formed.{name}"),
        )
        watches = [SimpleNamespace(rules=SimpleNamespace(reads=("near",)))]
        names = ("near", _OWN) if given else ("near",)
        measured = {name: name for name in names if ask(f"has.{name}")}
        return smt_literal(monitor._measurement_fault(watched, 0.0, measured, watches) is None)

    return _same(
        "`RuntimeMonitor._measurement_fault` finds the same at each tick, whatever is measured of a\n"
        "module's variable that no rule under watch reads, and whether it was measured before.",
        _bools(
            *(
                name
                for one in ("near", _OWN)
                for name in (f"{one}.was-measured", f"formed.{one}", f"has.{one}")
            )
        ),
        run,
    )


# Names.


def _scope(code: ModuleSource) -> TheoremObligation:
    perception = _perception_module(code)

    def run(ask: DecideBranch) -> str:
        shared = {_OWN: "declared"} if ask("shared") else {}
        public = {_OWN: "declared"} if ask("public") else {}
        required = [(SimpleNamespace(value="kettle"), None)] if ask("required") else []
        site = SimpleNamespace(
            state={"near": "declared", **shared, **({_OWN: "declared"} if ask("installed") else {})},
            perception=SimpleNamespace(shared=shared, public=ask("allowed")),
            **{vocabulary: {} for vocabulary in ("enums", "constants", "volumes", "kinds", "definitions")},
            joint_rules=(),
        )
        ecm = SimpleNamespace(
            id=SimpleNamespace(value="m"),
            state=(),
            tasks=(),
            perceivers=(),
            things=(),
            dependencies=SimpleNamespace(modules=required),
        )
        found = perception.ModulePerception(ecm, site, BoundNames(), None, public, {}).site
        return smt_literal(_OWN in found.state)

    return TheoremObligation(
        "`ModulePerception` lets the conditions of a module name a variable of another exactly where the\n"
        "module requires the other, and the site shares it, or allows public ones and it is public.",
        _bools("shared", "required", "installed", "public", "allowed"),
        "(= named (and required (or shared (and public allowed))))",
        tables=(SymbolicFunction("named", "Bool", execute_symbolically(run)),),
    )


_READS_BOTH: Final = t.And(tuple(t.Variable(name, BOOL, t.VariableRole.STATE) for name in ("near", _OWN)))
"""Condition of a definition of the site, `busy`."""


def _adoption(code: ModuleSource) -> TheoremObligation:
    definitions = code.module(_DEFINITIONS, replace=lambda site, state: site)

    def run(ask: DecideBranch) -> str:
        install_stubs(definitions, {"_texts": lambda _: ["busy"] if ask("mentioned") else []})
        readable = {"near": False, **({_OWN: ask("recalled")} if ask("readable") else {})}
        site = SimpleNamespace(
            state={
                name: SimpleNamespace(name=name, is_recalled=is_recalled, max_age=1)
                for name, is_recalled in readable.items()
            },
            definitions={"busy": SimpleNamespace(term=_READS_BOTH, span=None)},
        )
        ecm = SimpleNamespace(id=SimpleNamespace(value="m"))
        return smt_literal("m.busy" in definitions.adopted_definitions(ecm, site).predicates)

    return TheoremObligation(
        "`adopted_definitions` makes a predicate of a module out of a definition of the site exactly where\n"
        "the module mentions it, and may read all that the definition reads, and none of it is from memory.",
        _bools("mentioned", "readable", "recalled"),
        "(= adopted (and mentioned readable (not recalled)))",
        tables=(SymbolicFunction("adopted", "Bool", execute_symbolically(run)),),
    )


def _definition(code: ModuleSource) -> TheoremObligation:
    resolution = code.module(_NAME_RESOLUTION)

    def run(ask: DecideBranch) -> str:
        names = ("near", *((_OWN,) if ask("readable") else ()))
        scope = SimpleNamespace(
            variables={f"as {name}": SimpleNamespace(name=name) for name in names},
            constants={},
            definitions={"busy": _READS_BOTH},
        )
        try:
            found, _ = resolution.resolve_name(Name("busy", TextRange(0, 4)), scope, {}, None)
        except ExpressionTypeError:
            return "false"
        return smt_literal(found is _READS_BOTH)

    return TheoremObligation(
        "`resolve_name` puts the condition of a definition of the site for its name exactly where all that\n"
        "it reads may be read, so in Φ exactly where Φ may read that.",
        _bools("readable"),
        "(= named readable)",
        tables=(SymbolicFunction("named", "Bool", execute_symbolically(run)),),
    )


def _observation(code: ModuleSource) -> TheoremObligation:
    names_for = code.module(_STEP)._names_for

    def run(ask: DecideBranch) -> str:
        shared = frozenset((_OWN,) if ask("shared") else ())
        site = SimpleNamespace(perception=SimpleNamespace(shared=shared, public=ask("allowed")))
        required = ("kettle",) if ask("required") else ()
        ecm = SimpleNamespace(
            id="kettle" if ask("own") else "m",
            required_modules=required,
            requested_access=SimpleNamespace(sensors=("scale",) if ask("permitted") else ()),
        )
        sensor = "scale" if ask("sensed") else "kettle.view"
        declared = SimpleNamespace(sensor=sensor, is_public=ask("public"))
        return smt_literal(bool(names_for(ecm, site, _OWN, declared)))

    return TheoremObligation(
        "`ObservationFilter` hands a skill a module's variable exactly where it is its own, or where its\n"
        "module requires the other, and the site shares it, or allows public ones and it is public; and\n"
        "one that a sensor of the site measures only where its module may use the sensor.",
        _bools("shared", "required", "own", "public", "allowed", "sensed", "permitted"),
        "(= handed (and (=> sensed permitted) (or own (and required (or shared (and public allowed))))))",
        tables=(SymbolicFunction("handed", "Bool", execute_symbolically(run)),),
    )


def _bound_observation(code: ModuleSource) -> TheoremObligation:
    names_for = code.module(_STEP)._names_for

    def run(ask: DecideBranch) -> str:
        bound = {"mine": "near"} if ask("bound") else {}
        shadowed = {"near": "far"} if ask("shadowed") else {}
        sensors = frozenset(("scanner",) if ask("permitted") else ())
        ecm = SimpleNamespace(
            requested_access=SimpleNamespace(sensors=sensors),
            names=BoundNames(variables={**bound, **shadowed}),
        )
        names = names_for(ecm, None, "near", SimpleNamespace(sensor="scanner"))
        return f"(handed {smt_literal('mine' in names)} {smt_literal('near' in names)})"

    return TheoremObligation(
        "`ObservationFilter` hands a skill a variable of the site, under any name, only where its module\n"
        "may use the sensor; under the module's name exactly where it is bound, and under the site's name\n"
        "unless the module means another variable by it.",
        (
            "(declare-datatypes ((Names 0)) (((handed (as-bound Bool) (as-named Bool)))))",
            *_bools("bound", "shadowed", "permitted"),
        ),
        "(and (= (as-bound seen) (and permitted bound)) (= (as-named seen) (and permitted (not shadowed))))",
        tables=(SymbolicFunction("seen", "Names", execute_symbolically(run)),),
    )


def _perception_module(code: ModuleSource) -> ModuleType:
    def replaced(_: Any, **changed: Any) -> Any:
        return SimpleNamespace(**changed)

    return code.module(
        _PERCEPTION,
        replace=replaced,
        elaborate_module_variable=lambda *_: SimpleNamespace(),
        enums_of_modules=_no_enums,
        adopted_definitions=lambda _, site: SimpleNamespace(predicates={}, definitions={}, site=site),
    )


def _no_enums(_: Mapping[str, Any]) -> dict[str, Any]:
    """Stand for the enums that modules declare; no name of a variable is one."""
    return {}


def _invariants(code: ModuleSource) -> TheoremObligation:
    perception = _perception_module(code)

    def run(ask: DecideBranch) -> str:
        stated = SimpleNamespace(value=ask("value")) if ask("stated") else None
        name = SimpleNamespace(value=_OWN, span=None)
        policy = SimpleNamespace(
            shared=[(name, SimpleNamespace(in_invariants=stated))] if ask("shared") else []
        )
        vocabulary = SimpleNamespace(used_names={}, enums={}, state={}, kinds={})
        perception.elaborate_shared_variables(policy, vocabulary, None)
        return smt_literal(_OWN in vocabulary.state)

    return TheoremObligation(
        "`elaborate_shared_variables` lets Φ name a module's variable exactly where the site shares it with\n"
        "`in_invariants: true`.",
        _bools("shared", "stated", "value"),
        "(= named (and shared stated value))",
        tables=(SymbolicFunction("named", "Bool", execute_symbolically(run)),),
    )


def _declarations(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        def replaced(_: Any, *, state: Mapping[str, str], enums: Mapping[str, Any]) -> Any:
            return SimpleNamespace(state=state, enums=enums)

        site = code.module(_SITE, replace=replaced, enums_of_modules=_no_enums).Site
        shared = {_OWN: "the site's"} if ask("shared") else {}
        before = {_INACTIVE: "pot's"} if ask("installed") else {}
        this = SimpleNamespace(
            state={"near": "the site's", **shared, **before},
            enums={},
            perception=SimpleNamespace(shared=shared),
        )
        state = site.with_modules(this, [SimpleNamespace(state={_OWN: "kettle's"})]).state
        whose = "the site's" if shared else "kettle's"
        return smt_literal(state == {"near": "the site's", _OWN: whose})

    return TheoremObligation(
        "`Site.with_modules` leaves every declaration of the site as it is, those of shared variables too,\n"
        "and has further variables of these modules only.",
        _bools("shared", "installed"),
        "right",
        tables=(SymbolicFunction("right", "Bool", execute_symbolically(run)),),
    )


def _rule_variables(code: ModuleSource) -> TheoremObligation:
    site = code.module(_SITE).Site

    def run(ask: DecideBranch) -> str:
        name = _OWN if ask("of-module") else "near"
        this = SimpleNamespace(
            state={name: None},
            observed_variables={name: None},
            perception=SimpleNamespace(in_invariants=frozenset((name,) if ask("in-invariants") else ())),
        )
        this.module_variables = site.module_variables.func(this)
        return smt_literal(name in site.rule_variables.func(this))

    return TheoremObligation(
        "`Site.rule_variables`, by which the monitor compiles Φ, has a module's variable exactly where Φ\n"
        "may read it.",
        _bools("of-module", "in-invariants"),
        "(= has (=> of-module in-invariants))",
        tables=(SymbolicFunction("has", "Bool", execute_symbolically(run)),),
    )


_LOOPS: Final = loops_of(
    "aeros.runtime.execution.step",
    "aeros.runtime.gate.compiled.fast_path",
    "aeros.runtime.monitor.monitor",
    "aeros.runtime.gate.request_check",
)

THEOREM = Theorem(
    "what a module measures changes no decision on another's action or Φ unless the site shares or allows it",
    {
        "readings": _readings,
        "own-reading": _own_reading,
        "short-way-readings": _read_each,
        "snapshot": _snapshot,
        "own-snapshot": _own_snapshot,
        "monitor": _monitor,
        "scope": _scope,
        "adoption": _adoption,
        "definition": _definition,
        "observation": _observation,
        "bound-observation": _bound_observation,
        "invariants": _invariants,
        "declarations": _declarations,
        "rule-variables": _rule_variables,
        "loops": _LOOPS,
    },
    (
        Mutant(
            "objects-to-what-no-condition-reads",
            "readings",
            _REQUEST_CHECK,
            "if name in module_variables and name not in required:",
            "if name in module_variables & required:",
        ),
        Mutant(
            "objects-to-a-module-that-is-not-active",
            "readings",
            _REQUEST_CHECK,
            "if form is None and is_module_variable(name):",
            "if form is not None and is_module_variable(name):",
        ),
        Mutant(
            "never-looks-at-a-modules-variable",
            "own-reading",
            _REQUEST_CHECK,
            "if name in module_variables and name not in required:",
            "if name in module_variables:",
        ),
        Mutant(
            "counts-a-modules-variable-as-strange",
            "short-way-readings",
            _FAST_PATH,
            "for name in sorted(module_variables - required):",
            "for name in sorted(module_variables & required):",
        ),
        Mutant(
            "checks-the-form-of-what-no-condition-reads",
            "short-way-readings",
            _FAST_PATH,
            "checkers.keys() - required - module_variables",
            "checkers.keys() - required",
        ),
        Mutant(
            "refuses-a-moment-for-a-modules-value",
            "snapshot",
            _FAST_PATH,
            "if type(name) is not str or name not in self._module_variables:",
            "if type(name) is not str or name in self._module_variables:",
        ),
        Mutant(
            "keeps-what-a-module-measured-before",
            "own-snapshot",
            _FAST_PATH,
            "scalars.pop(scalar, None)",
            "scalars.get(scalar)",
        ),
        Mutant(
            "stops-where-a-modules-value-is-missing",
            "monitor",
            _MONITOR,
            "[one for one in self._measured - measured.keys() if not _is_unread(one, watches)]",
            "[*(self._measured - measured.keys())]",
        ),
        Mutant(
            "stops-for-the-form-of-what-no-rule-reads",
            "monitor",
            _MONITOR,
            "if not self._is_usable(name, value, now) and not _is_unread(name, watches):",
            "if not self._is_usable(name, value, now):",
        ),
        Mutant(
            "adopts-what-reads-another-module",
            "adoption",
            _DEFINITIONS,
            "read = t.variables_of(definition.term)",
            "read = {one: None for one in t.variables_of(definition.term) if one in readable}",
        ),
        Mutant(
            "adopts-what-reads-the-memory",
            "adoption",
            _DEFINITIONS,
            "for one in site.state.values() if not one.is_recalled}",
            "for one in site.state.values()}",
        ),
        Mutant(
            "names-what-reads-another-module",
            "definition",
            _NAME_RESOLUTION,
            "hidden = [name for name in t.variables_of(term) if name not in readable]",
            "hidden = [] if t.variables_of(term).keys() & readable else [*t.variables_of(term)]",
        ),
        Mutant(
            "reads-what-is-shared-with-others",
            "scope",
            _PERCEPTION,
            'if name.partition(".")[0] in required - {self._module}',
            'if name.partition(".")[0] != self._module',
        ),
        Mutant(
            "reads-what-is-public-where-the-site-does-not-allow-it",
            "scope",
            _PERCEPTION,
            "(public if site.perception.public else {})",
            "public",
        ),
        Mutant(
            "reads-whatever-is-installed",
            "scope",
            _PERCEPTION,
            'for name, one in site.state.items() if "." not in name}',
            "for name, one in site.state.items()}",
        ),
        Mutant(
            "shows-a-skill-what-is-not-shared",
            "observation",
            _STEP,
            "if is_readable and module in ecm.required_modules",
            "if module in ecm.required_modules",
        ),
        Mutant(
            "shows-a-skill-what-is-public-where-the-site-does-not-allow-it",
            "observation",
            _STEP,
            "(site.perception.public and declared.is_public)",
            "declared.is_public",
        ),
        Mutant(
            "shows-a-skill-what-is-private",
            "observation",
            _STEP,
            "(site.perception.public and declared.is_public)",
            "site.perception.public",
        ),
        Mutant(
            "shows-its-own-variable-without-its-sensor",
            "observation",
            _STEP,
            "if (not dot or is_measured) and declared.sensor",
            "if not dot and declared.sensor",
        ),
        Mutant(
            "shows-what-is-bound-without-its-sensor",
            "bound-observation",
            _STEP,
            "declared.sensor not in ecm.requested_access.sensors:",
            "declared.sensor not in ecm.requested_access.sensors and not ecm.names.variables:",
        ),
        Mutant(
            "shows-another-variable-of-a-bound-name",
            "bound-observation",
            _STEP,
            "return own if name in ecm.names.variables else (*own, name)",
            "return (*own, name)",
        ),
        Mutant(
            "lets-invariants-read-all-that-is-shared",
            "invariants",
            _PERCEPTION,
            "if quantity.in_invariants is not None and quantity.in_invariants.value:",
            "if quantity.in_invariants is None or quantity.in_invariants.value:",
        ),
        Mutant(
            "takes-the-modules-word-for-what-is-shared",
            "declarations",
            _SITE,
            "for name, one in module.state.items() if name not in shared}",
            "for name, one in module.state.items()}",
        ),
        Mutant(
            "watches-every-variable",
            "rule-variables",
            _SITE,
            'for name in self.state if "." in name)',
            'for name in self.state if "/" in name)',
        ),
        Mutant(
            "evaluates-two-watches-only",
            "loops",
            "aeros.runtime.monitor.monitor",
            "        for watch in self._watches:\n            violation",
            "        for watch in self._watches[:2]:\n            violation",
        ),
    ),
)
