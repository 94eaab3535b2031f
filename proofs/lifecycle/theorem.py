"""Nothing acts for a module that is not active: theorem 8."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.registry.lifecycle import State, Verb
from aeros.spec.errors import UserError
from aeros.spec.model import Block
from aeros.spec.theorems.exploring import Ask, Symbol, explore
from aeros.spec.theorems.formulas import application, literal
from aeros.spec.theorems.shipped import Code, Mutant
from aeros.spec.theorems.theorem import Obligation, Table, Theorem
from aeros.spec.verdicts import Conclusion
from proofs.changing import GOVERNING, changing_obligations
from proofs.protocol import Do, Way, changed, later, program, variables
from proofs.revocation import LIVE, RECORDS, REGISTRY, revocation_obligations

LIFECYCLE: Final = "aeros.runtime.registry.lifecycle"
EXECUTOR: Final = "aeros.runtime.executor"
PREPARING: Final = "aeros.runtime.preparing"
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
        module = SimpleNamespace(ecm=ecm, certificate="proved" if ask("proved") else None, path="m")
        conclusion = Conclusion.PROVED if ask("all-proved") else Conclusion.REJECTED
        report = SimpleNamespace(conclusion=conclusion, site_model="site", modules=[module], subjects=())
        proving = code.module(
            PROVING,
            verify=lambda *_, **__: report,
            default_store=lambda: None,
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

    flags = ("needs-another", "proved", "all-proved", "as-installed")
    return Obligation(
        "`Registry._proved` and `prove` put a module in force only where it is active, is the one that was\n"
        "installed, is proved, with all others, and what it needs is active.",
        (
            _datatype("State", State),
            "(declare-const state State)",
            "(declare-const needed State)",
            *(f"(declare-const {one} Bool)" for one in flags),
        ),
        "(=> in-force (and (= state active) proved all-proved as-installed"
        " (=> needs-another (= needed active))))",
        tables=(Table("in-force", "Bool", explore(run)),),
    )


class _Known:
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
        ecm = SimpleNamespace(id="m", skills=_Known(ask, "has-skill", skill))
        configuration = SimpleNamespace(modules=_Known(ask, "in-force", ecm), site=None)
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


# The executor.


def _begins(code: Code) -> Obligation:
    def run(ask: Ask) -> str:
        executor = code.module(EXECUTOR)
        began: list[str] = []
        generation = Symbol("latest", ask)

        @contextmanager
        def acting(_: Any) -> Iterator[bool]:
            yield ask("in-force")

        ecm = SimpleNamespace(
            id="m", manifest_digest=Symbol("manifest", ask), code_digest=Symbol("code", ask)
        )
        now = SimpleNamespace(
            manifest_digest=Symbol("manifest-now", ask), code_digest=Symbol("code-now", ask)
        )
        command = executor.Command.STOP if ask("stopped") else executor.Command.RUN
        one = executor.Executor.__new__(executor.Executor)
        one._governor = SimpleNamespace(generation=generation, command=command, acting=acting)
        one._configuration = SimpleNamespace(modules=_Known(ask, "active", now))
        looks = iter(("unheld", "unheld-now"))
        one._acting = None
        one._unheld = lambda _: "ending" if ask(next(looks)) else None
        one._is_held_back = lambda: ask("held-back")
        one._follow = lambda: Symbol("followed", ask)
        one._is_moving = lambda: ask("moving")
        one._act_now = lambda *_: began.append("begins")
        step = SimpleNamespace(ecm=ecm, asked="action" if ask("asked-before") else None)

        def resume(_: Any) -> Any:
            step.asked = "action"

        one._resume = resume
        one._act(step)
        return literal(bool(began))

    flags = (
        "in-force",
        "stopped",
        "active",
        "held-back",
        "moving",
        "asked-before",
        "unheld",
        "unheld-now",
    )
    numbers = ("latest", "followed", "manifest", "manifest-now", "code", "code-now")
    return Obligation(
        "`Executor._act` begins an action only where the module is in force with the same manifest and\n"
        "code, nobody stops it, what it is to be held to is measured, and the configuration followed is the\n"
        "latest: asked while it holds the lock.",
        (
            *(f"(declare-const {one} Bool)" for one in flags),
            *(f"(declare-const {one} Int)" for one in numbers),
        ),
        "(=> begins (and active (= manifest manifest-now) (= code code-now) (not stopped)"
        " (not unheld) (not unheld-now) (ite moving (= followed latest) in-force)))",
        tables=(Table("begins", "Bool", explore(run)),),
    )


def _follows(code: Code) -> Obligation:
    def run(ask: Ask) -> str:
        executor = code.module(EXECUTOR, session_details=lambda _: {}, capacities_of=lambda _: {})
        one = executor.Executor.__new__(executor.Executor)
        new = SimpleNamespace(digest=Symbol("digest-new", ask), site=None)
        one._generation = Symbol("followed", ask) if ask("follows-one") else None
        one._configuration = SimpleNamespace(digest=Symbol("digest-old", ask))
        one._governor = SimpleNamespace(
            generation=Symbol("latest", ask), configuration=lambda: (Symbol("told", ask), new)
        )
        one._is_moving = lambda: ask("moving")
        one._deciding = SimpleNamespace(follow=lambda _: None)
        one._resources = SimpleNamespace(under=lambda _: None)
        one._audit = SimpleNamespace(append=lambda *_: 0)
        followed = one._follow()
        return application("following", followed.term, literal(one._configuration is new))

    return Obligation(
        "`Executor._follow` takes another configuration over only while nothing moves, with the generation\n"
        "that it was told with it; else it goes on with the one that it had.",
        (
            "(declare-datatypes ((Following 0)) (((following (generation Int) (another Bool)))))",
            *(
                f"(declare-const {one} Int)"
                for one in ("followed", "latest", "told", "digest-old", "digest-new")
            ),
            *(f"(declare-const {one} Bool)" for one in ("follows-one", "moving")),
        ),
        "(and (=> (and follows-one moving) (= now (following followed false)))"
        " (=> (another now) (= (generation now) told))"
        " (=> (not (= (generation now) followed)) (or (another now) (= digest-old digest-new))))",
        tables=(Table("now", "Following", explore(run)),),
    )


# The database: a change is kept whole or not at all.

_DISK: Final = {"pc": "Int", "open": "Bool", "pending": "Int", "disk": "Int", "half": "Bool"}
"""`pending`, `disk`: how many writes are in the transaction, and on the disk; `half`: one is there alone."""


def _transaction(code: Code) -> Obligation:
    def run(do: Do) -> str:
        class Database:
            """Tells of each statement; any may fail."""

            def execute(self, statement: str, *_: Any) -> Any:
                kind = statement.split()[0]
                if kind in ("BEGIN", "COMMIT", "DELETE", "INSERT") and do(kind, "done", "fails") == "fails":
                    raise sqlite3.Error
                return SimpleNamespace(fetchone=lambda: (records._VERSION,))

            executemany = execute

            def close(self) -> None:
                do("close")

        records = code.module(
            RECORDS,
            sqlite3=SimpleNamespace(connect=lambda *_, **__: Database(), Error=sqlite3.Error),
            _is_new=lambda _: False,
        )
        path = SimpleNamespace(absolute=lambda: SimpleNamespace(as_uri=lambda: "file"))
        one = records.Records.__new__(records.Records)
        one.path = path
        new = records.Snapshot(2, "site", {}, {"b": Block("b", "why", None, None, None)})
        try:
            one.replace(new)
        except UserError:
            return "refused"
        return "kept"

    replace = program(run)
    (whole,) = {_writes(replace.ways[at]) for at, result in replace.ends.items() if result == "kept"}

    def effect(what: str, answer: str, _: int) -> str:
        state = [one for one in _DISK if one != "pc"]
        if answer == "fails":
            return changed(state, {})
        match what:
            case "BEGIN":
                return changed(state, {"open": "true", "pending": "0"})
            case "COMMIT":
                return changed(state, {"open": "false", "disk": "(ite open pending disk)"})
            case "close":
                return changed(state, {"open": "false", "pending": "0"})
        return changed(state, {"pending": "(ite open (+ pending 1) pending)", "half": "(or half (not open))"})

    def facts(way: Way) -> Iterator[str]:
        done = [what for what, answer in way if answer != "fails"]
        is_open = "BEGIN" in done and not {"COMMIT", "close"} & set(done)
        yield "open" if is_open else "(not open)"
        if is_open:
            yield f"(= pending {_writes(way)})"
        yield f"(= disk {whole if 'COMMIT' in done else 0})"
        yield "(not half)"

    invariant = replace.everywhere("pc", facts)
    return Obligation(
        "`Records.replace`: base and step of an invariant by which, wherever it fails or is killed, all\n"
        "that it writes is on the disk, or nothing; once it returns, all.",
        (
            *variables(_DISK),
            f"(define-fun invariant () Bool {invariant})",
            f"(define-fun invariant-after () Bool {later(invariant, _DISK)})",
            f"(define-fun step () Bool {replace.moves('pc', effect)})",
        ),
        "(and (=> (and (= pc 0) (not open) (= disk 0) (not half)) invariant)"
        " (=> (and invariant step) invariant-after)"
        f" (=> invariant (and (not half) (or (= disk 0) (= disk {whole}))))"
        f" (=> (and invariant {_ended(replace, 'kept')}) (= disk {whole})))",
    )


def _ended(one: Any, result: str) -> str:
    return "(or " + " ".join(f"(= pc {at})" for at, found in one.ends.items() if found == result) + ")"


def _writes(way: Way) -> int:
    return sum(what in ("DELETE", "INSERT") and answer != "fails" for what, answer in way)


THEOREM = Theorem(
    "only skills of active modules are dispatched, and nothing revoked moves once a change has returned",
    {
        "history-base": _history_base,
        "history-step": _history_step,
        "in-force": _in_force,
        "prepared": _prepared,
        "follows": _follows,
        "begins": _begins,
        "transaction": _transaction,
        **changing_obligations(),
        **revocation_obligations(),
    },
    (
        Mutant(
            "removes-what-is-active",
            "history-step",
            LIFECYCLE,
            "(State.INSTALLED, Verb.REMOVE): State.ABSENT,",
            "(State.INSTALLED, Verb.REMOVE): State.ABSENT,\n    (State.ACTIVE, Verb.REMOVE): State.ABSENT,",
        ),
        Mutant(
            "activates-what-is-not-configured",
            "history-step",
            LIFECYCLE,
            "(State.CONFIGURED, Verb.ACTIVATE): State.ACTIVE,",
            "(State.INSTALLED, Verb.ACTIVATE): State.ACTIVE,",
        ),
        Mutant(
            "puts-in-force-what-is-configured",
            "in-force",
            REGISTRY,
            "active = {name for name, one in new.modules.items() if one.state is State.ACTIVE}",
            "active = {name for name, one in new.modules.items() if one.state in before(Verb.REMOVE)"
            " or one.state is State.ACTIVE}",
        ),
        Mutant(
            "begins-what-was-revoked-while-the-skill-computed",
            "begins",
            EXECUTOR,
            "if not in_force or asked is None:",
            "if asked is None:",
        ),
        Mutant(
            "takes-over-under-what-moves",
            "follows",
            EXECUTOR,
            "(followed == self._governor.generation or self._is_moving())",
            "followed == self._governor.generation",
        ),
        Mutant(
            "goes-on-while-a-module-is-kept",
            "goes-on",
            GOVERNING,
            "if one is None or one.state is not State.ACTIVE:",
            "if one is None:",
        ),
        Mutant(
            "keeps-what-it-has-not-recorded",
            "commit",
            REGISTRY,
            "        record_change(self.folder, self._key, old, new, said, configuration.digest)\n",
            "",
        ),
        Mutant(
            "writes-before-the-transaction",
            "transaction",
            RECORDS,
            'database.execute("BEGIN IMMEDIATE")\n            if _is_new(database):\n'
            "                for statement in _SCHEMA:\n                    database.execute(statement)\n",
            'database.execute("DELETE FROM policy")\n            database.execute("BEGIN IMMEDIATE")\n',
        ),
        Mutant(
            "forgets-what-an-unfinished-change-left-moving",
            "agreeing-change",
            REGISTRY,
            "if not is_older_still:",
            "if False:",
        ),
        Mutant(
            "keeps-a-change-before-it-tells-of-it",
            "agreeing-change",
            REGISTRY,
            "            live.publish(new.generation)\n            try:\n"
            "                self._records.replace(new)\n",
            "            try:\n                self._records.replace(new)\n"
            "                live.publish(new.generation)\n",
        ),
        Mutant(
            "follows-what-was-read-while-it-changed",
            "agreeing-claim",
            REGISTRY,
            "if snapshot.generation == live.generation:",
            "if snapshot.generation <= live.generation:",
        ),
        Mutant(
            "looks-before-it-takes-the-lock",
            "agreeing-act",
            LIVE,
            "        fcntl.flock(lock, fcntl.LOCK_SH)\n        try:\n"
            "            yield self.generation == generation\n",
            "        latest = self.generation\n        fcntl.flock(lock, fcntl.LOCK_SH)\n        try:\n"
            "            yield latest == generation\n",
        ),
    ),
)
