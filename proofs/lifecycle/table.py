"""The lifecycle table, as the registry applies it, decides which modules a step may be prepared from."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.registry.lifecycle import LifecycleAction, ModuleState
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lifecycle.revocation import REGISTRY_STORE

INSTALLED: Final = "aeros.runtime.registry.installed"
LIFECYCLE: Final = "aeros.runtime.registry.lifecycle"
PREPARE: Final = "aeros.runtime.execution.prepare"
PROOF_MEMORY: Final = "aeros.runtime.registry.proof_memory"
PROVING: Final = "aeros.runtime.proving"
REGISTRY: Final = "aeros.runtime.registry.registry"
WAITING: Final = "aeros.runtime.registry.waiting_modules"


def _datatype(name: str, members: type[ModuleState] | type[LifecycleAction]) -> str:
    return f"(declare-datatypes (({name} 0)) (({' '.join(f'({one.value})' for one in members)})))"


def _choose_member(ask: DecideBranch, constant: str, members: Any) -> Any:
    """The member that the constant stands for on this run."""
    *most, last = members
    return next((one for one in most if ask(f"(= {constant} {one.value})")), last)


# The table, through the registry.

_MODULE: Final = (
    _datatype("State", ModuleState),
    _datatype("Verb", LifecycleAction),
    "(declare-datatypes ((Moved 0))"
    " (((to (reached State) (is-withdrawn Bool)) (refused) (moves-another) (half-done))))",
    "(declare-const state State)",
    "(declare-const verb Verb)",
    "(declare-const was-configured Bool)",
    "(declare-const was-activated Bool)",
    "(declare-const waits Bool)",
    "(declare-const was-withdrawn Bool)",
    "(declare-const other-withdrawn Bool)",
    "(define-fun invariant ((s State) (c Bool) (a Bool)) Bool"
    " (and (= a (= s active)) (= c (or a (= s configured)))))",
)
"""A module, and what was done to it: configured and activated, and not since removed or deactivated."""


def _transition_obligation(code: ModuleSource) -> SymbolicFunction:
    """State the effect of `verb` on a module, by `install` or `_change_state`, and none on another module."""
    lifecycle = code.module(LIFECYCLE)
    records = code.module(REGISTRY_STORE, using=(lifecycle,))

    def run(ask: DecideBranch) -> str:
        state = _choose_member(ask, "state", lifecycle.ModuleState)
        verb = _choose_member(ask, "verb", lifecycle.LifecycleAction)
        registry = code.module(
            REGISTRY,
            using=(lifecycle, records),
            module_files=lambda _: {},
            bundle_digest=lambda _: "digest",
            stored_bundle=lambda *_: nullcontext("folder"),
            shown_as=lambda *_: nullcontext(),
            _declared_id=lambda *_: "m",
            _read_stored=lambda *_: (
                SimpleNamespace(id=SimpleNamespace(value="m"), version=SimpleNamespace(value="1")),
                "settings",
                "command" if ask("waits") else "",
            ),
        )
        n = records.InstalledModule("n", "1", "other", _choose_member(ask, "state", lifecycle.ModuleState))
        kept = {"m": records.InstalledModule("m", "1", "digest", state)} if state.value != "absent" else {}
        made: list[Any] = []
        flags = {"m": ask("was-withdrawn"), "n": ask("other-withdrawn")}
        withdrawn = frozenset(name for name, is_withdrawn in flags.items() if is_withdrawn)

        @contextmanager
        def changing() -> Iterator[Any]:
            yield records.RegistrySnapshot(1, "site", {**kept, "n": n}, {}, withdrawn=withdrawn)

        one = registry.Registry.__new__(registry.Registry)
        one.folder = _FolderStub()
        one._site_of = lambda _: None
        one._folders = lambda _: {}
        one._modules_that_need = lambda *_: ["n"] if ask("needed") else []
        one._prove_snapshot = lambda *_: (None, None)
        one._transactions = SimpleNamespace(change_lock=changing, commit=lambda _, new, *__: made.append(new))
        try:
            if verb.value == "install":
                one._find_waiting = lambda _: {}
                active = None if not ask("at-once") else "settings" if ask("bound") else ""
                one.install(_FolderStub(), active=active)
            elif verb.value == "configure":
                one._find_waiting = lambda _: {"m": None} if ask("waits") else {}
                one._change_state("m", verb, resets=ask("resets"))
            else:
                one._change_state("m", verb)
        except UserError:
            return "half-done" if made else "refused"
        if len(made) != 1:
            return "half-done"
        (new,) = made
        if new.modules.keys() - {"m"} != {"n"} or new.modules["n"] is not n:
            return "moves-another"
        if new.withdrawn - {"m"} != withdrawn - {"m"}:
            return "moves-another"
        reached = new.modules["m"].state if "m" in new.modules else lifecycle.ModuleState.ABSENT
        return smt_apply("to", reached.value, smt_literal("m" in new.withdrawn))

    return SymbolicFunction("moved", "Moved", execute_symbolically(run))


def _policy_obligation(code: ModuleSource) -> SymbolicFunction:
    """State the effect of a new policy on a module, which may wait under it, and none on another module."""
    lifecycle = code.module(LIFECYCLE)
    records = code.module(REGISTRY_STORE, using=(lifecycle,))
    waiting_modules = code.module(WAITING, using=(lifecycle, records))

    def run(ask: DecideBranch) -> str:
        state = _choose_member(ask, "state", lifecycle.ModuleState)
        registry = code.module(
            REGISTRY,
            using=(lifecycle, records, waiting_modules),
            read_policy=lambda _: b"",
            policy_file=lambda _: "site",
            file_digest=lambda _: "digest",
            shown_as=lambda *_: nullcontext(),
        )
        n = records.InstalledModule("n", "1", "other", _choose_member(ask, "other", lifecycle.ModuleState))
        kept = {"m": records.InstalledModule("m", "1", "digest", state)} if state.value != "absent" else {}
        made: list[Any] = []
        withdrawn = frozenset({"m"}) if ask("was-withdrawn") else frozenset()
        waiting = SimpleNamespace(name="m", reason="", command="")

        @contextmanager
        def changing() -> Iterator[Any]:
            yield records.RegistrySnapshot(1, "site", {**kept, "n": n}, {}, withdrawn=withdrawn)

        one = registry.Registry.__new__(registry.Registry)
        one._find_waiting = lambda _: {"m": waiting} if kept and ask("waits") else {}
        one._prove_snapshot = lambda *_: (None, None)
        one._transactions = SimpleNamespace(
            change_lock=changing,
            commit=lambda _, new, *__: made.append(new),
            stored_policy=lambda *_: nullcontext("path"),
        )
        try:
            one.set_policy(_FolderStub())
        except UserError:
            return "refused"
        (new,) = made
        if new.modules.keys() != {*kept, "n"} or new.modules["n"] is not n or new.withdrawn != withdrawn:
            return "moves-another"
        reached = new.modules["m"].state if kept else lifecycle.ModuleState.ABSENT
        return smt_apply("to", reached.value, smt_literal("m" in new.withdrawn))

    return SymbolicFunction("moved", "Moved", execute_symbolically(run))


class _FolderStub:
    """A folder of which nothing is read."""

    def __init__(self, name: str = "m") -> None:
        self.name = name

    def __truediv__(self, _: str) -> _FolderStub:
        return self


def _history_base(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Base: a module that was never installed is neither configured nor active.",
        (*_MODULE, f"(define-fun first () State {next(iter(code.module(LIFECYCLE).ModuleState)).value})"),
        "(and (= first absent) (invariant first false false))",
    )


def _history_step(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Step: a module is active exactly where it was activated, after it was configured, and neither was\n"
        "undone since; no verb moves another module, an active module cannot be removed, configured or\n"
        "reset, and what is absent can only be installed. A version that waits, and a reset, undo that it\n"
        "was configured. It is withdrawn exactly where it was deactivated or removed, not activated since.\n"
        "An installation that also activates leaves it configured and active, or nothing is changed; it\n"
        "does not configure an active one. Each verb is one change, and one that is refused is none.",
        (
            *_MODULE,
            *(f"(declare-const {one} Bool)" for one in ("resets", "needed", "at-once", "bound")),
            "(define-fun activates () Bool (or (= verb activate) (and (= verb install) at-once)))",
        ),
        "(=> (and (invariant state was-configured was-activated) (not (= moved refused)))"
        " (and ((_ is to) moved) (not (and was-activated"
        " (or (= verb remove) (= verb configure) (= verb reset)"
        " (and (= verb install) (or waits (and at-once bound))))))"
        " (not (and (= verb install) at-once waits))"
        " (=> (= state absent) (= verb install))"
        " (= (is-withdrawn moved)"
        " (or (= verb deactivate) (= verb remove) (and was-withdrawn (not activates))))"
        " (invariant (reached moved)"
        " (ite (= verb configure) (not (and resets waits))"
        " (ite (or (= verb remove) (= verb reset) (and (= verb install) waits)) false"
        " (or was-configured (and (= verb install) at-once))))"
        " (ite activates true"
        " (ite (or (= verb deactivate) (= verb remove)) false was-activated)))))",
        tables=(_transition_obligation(code),),
    )


def _history_policy(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "A new policy moves a module only where it waits under the policy: it is configured no longer, and\n"
        "is then installed. An active module that would wait is not moved: the policy is refused.",
        (*_MODULE, "(declare-const other State)"),
        "(=> (and (invariant state was-configured was-activated) (not (= moved refused)))"
        " (and ((_ is to) moved) (not (and was-activated waits)) (= (is-withdrawn moved) was-withdrawn)"
        " (invariant (reached moved) (and was-configured (not waits)) was-activated)"
        " (=> (not (and (= state configured) waits)) (= (reached moved) state))))",
        tables=(_policy_obligation(code),),
    )


# From the snapshot to the configuration, to a step.


def _in_force_obligation(code: ModuleSource) -> TheoremObligation:
    lifecycle = code.module(LIFECYCLE)
    records = code.module(REGISTRY_STORE, using=(lifecycle,))

    def run(ask: DecideBranch) -> str:
        state = _choose_member(ask, "state", lifecycle.ModuleState)
        needed = ("n",) if ask("needs-another") else ()
        ecm = SimpleNamespace(id="m", required_modules=needed, required_capabilities={})
        certificate = SimpleNamespace(obligations={}, engines={}) if ask("proved") else None
        module = SimpleNamespace(name="m", certificate=certificate, path="m")
        conclusion = Conclusion.PROVED if ask("all-proved") else Conclusion.REJECTED
        report = SimpleNamespace(conclusion=conclusion, modules=[module], subjects=())
        proving = code.module(
            PROVING,
            verify=lambda *_, **__: report,
            open_default_store=nullcontext,
            load_site=lambda *_: SimpleNamespace(
                with_overrides=lambda _: SimpleNamespace(with_configurations=lambda _: "site")
            ),
            load_ecm=lambda *_: SimpleNamespace(ecm=ecm),
            certificate_for=lambda *_: certificate if ask("as-proved") else "another",
            make_configuration=lambda _, modules: SimpleNamespace(
                modules={name: one for name, (one, _) in modules.items()}
            ),
        )
        memory = code.module(PROOF_MEMORY, using=(proving,), _premises=lambda _: "digests")
        installed = code.module(
            INSTALLED,
            using=(lifecycle, records, proving, memory),
            require_configured=lambda *_: None,
            module_files=lambda _: {},
            bundle_digest=lambda _: "digest" if ask("as-installed") else "other",
        )
        one = installed.InstalledModules.__new__(installed.InstalledModules)
        one.folder, one._proofs = _FolderStub(), memory.ProofMemory(proving.prove_configuration)
        one._folders = lambda snapshot: {name: _FolderStub(name) for name in snapshot.modules}
        one.site_file = lambda _: "site"
        one._find_waiting = lambda _: {"m": None} if ask("waits") else {}
        kept = {
            "m": records.InstalledModule("m", "1", "digest", state),
            "n": records.InstalledModule(
                "n", "1", "digest", _choose_member(ask, "needed", lifecycle.ModuleState)
            ),
        }
        try:
            configuration, _ = one._prove_snapshot(records.RegistrySnapshot(1, "site", kept, {}))
        except UserError:
            return "false"
        return smt_literal("m" in configuration.modules)

    flags = ("needs-another", "proved", "all-proved", "as-proved", "as-installed")
    return TheoremObligation(
        "`InstalledModules._prove_snapshot` and `prove_configuration`, which the memory of proofs calls for\n"
        "what it does not know, put a module in force only where it\n"
        "is active, is the one that was installed, is proved, with all others, as it is then read,"
        " and what it needs is active.",
        (
            _datatype("State", ModuleState),
            "(declare-const state State)",
            "(declare-const needed State)",
            *(f"(declare-const {one} Bool)" for one in flags),
        ),
        "(=> in-force (and (= state active) proved all-proved as-proved as-installed"
        " (=> needs-another (= needed active))))",
        tables=(SymbolicFunction("in-force", "Bool", execute_symbolically(run)),),
    )


class SymbolicMapping:
    """A mapping that has what is asked for, or has not."""

    def __init__(self, ask: DecideBranch, question: str, value: Any) -> None:
        self._ask, self._question, self._value = ask, question, value

    def get(self, _: Any) -> Any:
        """Return the value, or None if there is none."""
        return self._value if self._ask(self._question) else None


def _prepare_obligation(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        preparing = code.module(
            PREPARE,
            required_resources=lambda _: (),
            check_inputs=lambda *_: {},
            hold_conditions_for=lambda *_: (),
            ActiveStep=lambda *_: "step",
        )
        skill = SimpleNamespace(id="k", inputs={})
        ecm = SimpleNamespace(id="m", skills=SymbolicMapping(ask, "has-skill", skill))
        configuration = SimpleNamespace(modules=SymbolicMapping(ask, "in-force", ecm), site=None)
        request = SimpleNamespace(
            module="m" if ask("module-is-a-name") else 1,
            skill="k" if ask("skill-is-a-name") else 1,
            inputs={},
            held=(),
        )
        try:
            preparing.prepare_step(
                request, configuration, SimpleNamespace(never_available=lambda _: None), lambda *_: None
            )
        except preparing.StepRefusedError:
            return "false"
        return "true"

    names = ("in-force", "has-skill", "module-is-a-name", "skill-is-a-name")
    return TheoremObligation(
        "`prepare_step` makes a step of a request only where its module is in force and has that skill.",
        tuple(f"(declare-const {name} Bool)" for name in names),
        "(=> starts (and in-force has-skill))",
        tables=(SymbolicFunction("starts", "Bool", execute_symbolically(run)),),
    )


def table_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Of one module: from what was done to it to the configuration, and from there to a step."""
    return {
        "history-base": _history_base,
        "history-step": _history_step,
        "history-policy": _history_policy,
        "in-force": _in_force_obligation,
        "prepared": _prepare_obligation,
    }
