"""How the table of the lifecycle, as the registry applies it, decides what a step is prepared of."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.registry.lifecycle import State, Verb
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.theorems.module_copies import Code
from aeros.spec.theorems.smtlib import application, literal
from aeros.spec.theorems.symbolic_execution import Ask, explore
from aeros.spec.theorems.theorem import Obligation, Table
from proofs.lib.revocation import RECORDS, REGISTRY

LIFECYCLE: Final = "aeros.runtime.registry.lifecycle"
PREPARING: Final = "aeros.runtime.execution.prepare"
PROVING: Final = "aeros.runtime.proving"


def _datatype(name: str, members: type[State] | type[Verb]) -> str:
    return f"(declare-datatypes (({name} 0)) (({' '.join(f'({one.value})' for one in members)})))"


def _chosen(ask: Ask, constant: str, members: Any) -> Any:
    """The member that the constant stands for on this run."""
    *most, last = members
    return next((one for one in most if ask(f"(= {constant} {one.value})")), last)


# The table, through the registry.

_MODULE: Final = (
    _datatype("State", State),
    _datatype("Verb", Verb),
    "(declare-datatypes ((Moved 0)) (((to (reached State)) (refused) (moves-another))))",
    "(declare-const state State)",
    "(declare-const verb Verb)",
    "(declare-const was-configured Bool)",
    "(declare-const was-activated Bool)",
    "(define-fun invariant ((s State) (c Bool) (a Bool)) Bool"
    " (and (= a (= s active)) (=> (or a (= s configured)) c) (=> (= s absent) (not c))))",
)
"""A module, and what was done to it: configured and activated, and not since removed or deactivated."""


def _moved(code: Code) -> Table:
    """What `verb` makes of a module, by `install` or `_move`, and that it leaves another as it is."""
    lifecycle = code.module(LIFECYCLE)
    records = code.module(RECORDS, using=(lifecycle,))

    def run(ask: Ask) -> str:
        state = _chosen(ask, "state", lifecycle.State)
        verb = _chosen(ask, "verb", lifecycle.Verb)
        registry = code.module(
            REGISTRY,
            using=(lifecycle, records),
            module_files=lambda _: {},
            bundle_digest=lambda _: "digest",
            keep=lambda *_: "folder",
            sweep=lambda *_: None,
            _read=lambda *_: SimpleNamespace(id="m", version="1"),
            _digests=lambda _: (),
        )
        n = records.Installed.kept("n", "1", "other", _chosen(ask, "state", lifecycle.State))
        kept = {"m": records.Installed.kept("m", "1", "digest", state)} if state.value != "absent" else {}
        made: list[Any] = []

        @contextmanager
        def changing() -> Iterator[Any]:
            yield records.Snapshot(1, "site", {**kept, "n": n}, {})

        one = registry.Registry.__new__(registry.Registry)
        one.folder = _Folder()
        one._changing, one._policy_of = changing, lambda _: None
        one._proved = lambda *_: (None, None)
        one._commit = lambda _, new, *__: made.append(new)
        try:
            if verb.value == "install":
                one.install(_Folder())
            else:
                one._move("m", verb)
        except UserError:
            return "refused"
        (new,) = made
        if new.modules.keys() - {"m"} != {"n"} or new.modules["n"] is not n:
            return "moves-another"
        reached = new.modules["m"].state if "m" in new.modules else lifecycle.State.ABSENT
        return application("to", reached.value)

    return Table("moved", "Moved", explore(run))


class _Folder:
    """A folder of which nothing is read."""

    name = "m"

    def __truediv__(self, _: str) -> _Folder:
        return self


def _history_base(code: Code) -> Obligation:
    return Obligation(
        "Base: a module that was never installed is neither configured nor active.",
        (*_MODULE, f"(define-fun first () State {next(iter(code.module(LIFECYCLE).State)).value})"),
        "(and (= first absent) (invariant first false false))",
    )


def _history_step(code: Code) -> Obligation:
    return Obligation(
        "Step: a module is active exactly where it was activated, after it was configured, and neither was\n"
        "undone since; no verb moves another module, an active module cannot be removed or configured, and\n"
        "what is absent can only be installed.",
        _MODULE,
        "(=> (and (invariant state was-configured was-activated) (not (= moved refused)))"
        " (and ((_ is to) moved) (not (and was-activated (or (= verb remove) (= verb configure))))"
        " (=> (= state absent) (= verb install))"
        " (invariant (reached moved)"
        " (ite (= verb configure) true (ite (= verb remove) false was-configured))"
        " (ite (= verb activate) true"
        " (ite (or (= verb deactivate) (= verb remove)) false was-activated)))))",
        tables=(_moved(code),),
    )


# From the snapshot to the configuration, to a step.


def _in_force(code: Code) -> Obligation:
    lifecycle = code.module(LIFECYCLE)
    records = code.module(RECORDS, using=(lifecycle,))

    def run(ask: Ask) -> str:
        state = _chosen(ask, "state", lifecycle.State)
        ecm = SimpleNamespace(id="m", requires=("n",) if ask("needs-another") else ())
        certificate = SimpleNamespace(obligations={}) if ask("proved") else None
        module = SimpleNamespace(name="m", certificate=certificate, path="m")
        conclusion = Conclusion.PROVED if ask("all-proved") else Conclusion.REJECTED
        report = SimpleNamespace(conclusion=conclusion, modules=[module], subjects=())
        proving = code.module(
            PROVING,
            verify=lambda *_, **__: report,
            default_store=lambda: None,
            load_site=lambda *_: SimpleNamespace(with_blocks=lambda _: "site"),
            load_ecm=lambda *_: SimpleNamespace(ecm=ecm),
            certificate_for=lambda *_: certificate if ask("as-proved") else "another",
            configure=lambda _, modules: SimpleNamespace(
                modules={name: one for name, (one, _) in modules.items()}
            ),
        )
        registry = code.module(
            REGISTRY,
            using=(lifecycle, records, proving),
            module_files=lambda _: {},
            bundle_digest=lambda _: "digest" if ask("as-installed") else "other",
        )
        one = registry.Registry.__new__(registry.Registry)
        one.folder, one._prove = _Folder(), proving.prove
        kept = {
            "m": records.Installed.kept("m", "1", "digest", state),
            "n": records.Installed.kept("n", "1", "digest", _chosen(ask, "needed", lifecycle.State)),
        }
        try:
            configuration, _ = one._proved(records.Snapshot(1, "site", kept, {}), {})
        except UserError:
            return "false"
        return literal("m" in configuration.modules)

    flags = ("needs-another", "proved", "all-proved", "as-proved", "as-installed")
    return Obligation(
        "`Registry._proved` and `prove` put a module in force only where it is active, is the one that was\n"
        "installed, is proved, with all others, as it is then read, and what it needs is active.",
        (
            _datatype("State", State),
            "(declare-const state State)",
            "(declare-const needed State)",
            *(f"(declare-const {one} Bool)" for one in flags),
        ),
        "(=> in-force (and (= state active) proved all-proved as-proved as-installed"
        " (=> needs-another (= needed active))))",
        tables=(Table("in-force", "Bool", explore(run)),),
    )


class Known:
    """A mapping that has what is asked for, or has not."""

    def __init__(self, ask: Ask, question: str, value: Any) -> None:
        self._ask, self._question, self._value = ask, question, value

    def get(self, _: Any) -> Any:
        """What is there, or None."""
        return self._value if self._ask(self._question) else None


def _prepared(code: Code) -> Obligation:
    def run(ask: Ask) -> str:
        preparing = code.module(
            PREPARING,
            needs_of=lambda _: (),
            settle_inputs=lambda *_: {},
            hold_of=lambda *_: None,
            Step=lambda *_: "step",
        )
        skill = SimpleNamespace(id="k", inputs={})
        ecm = SimpleNamespace(id="m", skills=Known(ask, "has-skill", skill))
        configuration = SimpleNamespace(modules=Known(ask, "in-force", ecm), site=None)
        request = SimpleNamespace(
            module="m" if ask("module-is-a-name") else 1,
            skill="k" if ask("skill-is-a-name") else 1,
            inputs={},
        )
        try:
            preparing.prepared(
                request, configuration, SimpleNamespace(lacking=lambda _: None), lambda *_: None
            )
        except preparing.RefusedError:
            return "false"
        return "true"

    names = ("in-force", "has-skill", "module-is-a-name", "skill-is-a-name")
    return Obligation(
        "`prepared` makes a step of a request only where its module is in force and has that skill.",
        tuple(f"(declare-const {name} Bool)" for name in names),
        "(=> starts (and in-force has-skill))",
        tables=(Table("starts", "Bool", explore(run)),),
    )


def table_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """Of one module: from what was done to it to the configuration, and from there to a step."""
    return {
        "history-base": _history_base,
        "history-step": _history_step,
        "in-force": _in_force,
        "prepared": _prepared,
    }
