"""A change of an audit record is detected: theorem 12."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.audit.check import TAIL_REPAIRED, AuditReport, DecisionCounts
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.theorems.module_copies import ModuleSource, Mutant, install_stubs
from aeros.spec.theorems.smtlib import smt_and, smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import (
    DecideBranch,
    DecisionDiagram,
    SymbolicValue,
    execute_symbolically,
)
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib.loops import loops_of

CANONICAL_JSON: Final = "aeros.runtime.canonical_json"
CHECK: Final = "aeros.runtime.audit.check"
CHECKPOINTS: Final = "aeros.runtime.audit.checkpoints"


def _constants(sort: str, names: Iterable[str]) -> tuple[str, ...]:
    return tuple(f"(declare-const {name} {sort})" for name in names)


class _SymbolicText(SymbolicValue):
    """Bytes or text of which only a formula speaks, of the sort String."""

    __slots__ = ()

    def __getitem__(self, part: slice) -> _SymbolicText:
        if part.start is not None or part.step is not None or part.stop >= 0:
            raise InternalError(f"the code takes {part} of a line, of which nothing here speaks")
        return _SymbolicText(f"(str.substr {self.term} 0 (- (str.len {self.term}) {-part.stop}))", self.ask)

    def __add__(self, other: Any) -> _SymbolicText:
        more = other.term if isinstance(other, SymbolicValue) else _quoted(other)
        return _SymbolicText(smt_apply("str.++", self.term, more), self.ask)

    def encode(self, _: str) -> _SymbolicText:
        """As `str.encode`: hexadecimal digits are ASCII."""
        return self


def _quoted(text: bytes) -> str:
    plain = text.decode("ascii").replace('"', '""').replace("\n", "\\u{a}")
    return f'"{plain}"'


# `_check`: a record after those before it.

_CHECKED: Final = (
    "(declare-datatypes ((Checked 0)) (((sound (head String) (records Int)) (refused))))",
    "(declare-fun hash (String) String)",
    "(declare-fun hashed (String) String)",
    "(declare-fun is-record (String) Bool)",
    "(declare-fun sequence (String) Int)",
    "(declare-fun previous (String) String)",
    "(declare-fun is-decision (String) Bool)",
    *_constants("String", (f"{log}.{what}" for log in "ab" for what in ("line", "head"))),
    *_constants("Int", (f"{log}.place" for log in "ab")),
    *_constants("Bool", (f"{log}.{what}" for log in "ab" for what in ("watched", "watch-objects"))),
)
"""Result of checking a line in two logs, `a` and `b`; a record's fields depend on its text alone."""


def _execute_check(code: ModuleSource, log: str) -> DecisionDiagram:
    """Execute `_check` on `line` in this log, after `place` records up to the hash `head`."""
    # Neither module keeps anything between two paths: they are loaded once, and only the stubs are of a path.
    canonical_json = code.module(CANONICAL_JSON)
    check = code.module(CHECK, using=(canonical_json,), len=lambda _: 0)

    def run(ask: DecideBranch) -> str:
        def sha256(body: Any) -> SimpleNamespace:
            return SimpleNamespace(hexdigest=lambda: _SymbolicText(f"(hash {body.term})", ask))

        install_stubs(canonical_json, {"hashlib": SimpleNamespace(sha256=sha256)})
        install_stubs(check, {"_parse": lambda body: _record(body.term, ask)})
        head = _SymbolicText(f"{log}.head", ask)
        before = check.LogPrefix(SymbolicValue(f"{log}.place", ask), head, head, 0, _UnusedCounts())

        def watch(*_: Any) -> str | None:
            return "wrong" if ask(f"{log}.watch-objects") else None

        found = check._check(
            _SymbolicText(f"{log}.line", ask), before, watch if ask(f"{log}.watched") else None
        )
        if found.problem is not None:
            return "refused"
        return smt_apply("sound", found.head.term, found.records.term)

    return execute_symbolically(run)


class _UnusedCounts:
    """Counts of decisions, which no claim of this theorem reads."""

    def with_decision(self, _: Any) -> _UnusedCounts:
        """These and one more."""
        return self


def _record(body: str, ask: DecideBranch) -> dict[str, Any] | None:
    if not ask(f"(is-record {body})"):
        return None
    return {
        "sequence": SymbolicValue(f"(sequence {body})", ask),
        "previous": _SymbolicText(f"(previous {body})", ask),
        "event": "decision" if ask(f"(is-decision {body})") else "other",
        "details": {"verdict": "DENY"},
    }


def _two_log_tables(code: ModuleSource) -> tuple[SymbolicFunction, ...]:
    return tuple(SymbolicFunction(f"in-{log}", "Checked", _execute_check(code, log)) for log in "ab")


_BOTH_ACCEPTED: Final = "(and ((_ is sound) in-a) ((_ is sound) in-b))"


def _same_line(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Base of the induction, from a record backwards: a line that `_check` accepts in two logs stands in\n"
        "both at one place and after one hash, and leaves one.",
        _CHECKED,
        f"(=> (and {_BOTH_ACCEPTED} (= a.line b.line))"
        " (and (= a.place b.place) (= a.head b.head) (= in-a in-b)))",
        tables=_two_log_tables(code),
    )


def _same_hash(code: ModuleSource) -> TheoremObligation:
    # No two bodies have one hash, as there is a function that gives back the body.
    body = "(str.++ (str.substr {0}.line 0 (- (str.len {0}.line) {1})) {2})"
    ending, close = code.module(CANONICAL_JSON).HASH_SUFFIX_LENGTH, _quoted(b"}")
    return TheoremObligation(
        "Step of the induction: two lines that `_check` accepts and that leave one hash are one line, at\n"
        "one place, after one hash; and a hash is that of a record at the place before.",
        _CHECKED,
        f"(=> {_BOTH_ACCEPTED} (and (= (records in-a) (+ a.place 1)) (=> (= (head in-a) (head in-b))"
        " (and (= a.line b.line) (= a.place b.place) (= a.head b.head)))))",
        tables=_two_log_tables(code),
        assumptions={
            f"no-collision.{log}": f"(= (hashed (hash {one})) {one})"
            for log in "ab"
            for one in (body.format(log, ending, close),)
        },
    )


# What follows of the induction.


def _tampering_detected(_: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Of the induction: a log in which a record was edited, deleted, inserted or moved, and any record\n"
        "of the old log stands after that, is not accepted.  The old log is `b`.",
        (
            "(declare-sort Line 0)",
            "(declare-fun a (Int) Line)",
            "(declare-fun b (Int) Line)",
            *_constants("Int", ("i", "k", "j")),
            *_constants("Bool", ("accepted",)),
        ),
        "(=> (and (<= 0 i) (< i k)) (not (and accepted (or"
        " (and (not (= (a i) (b i))) (= j k) (= (a k) (b j)))"  # edited
        " (and (= j (+ k 1)) (= (a k) (b j)))"  # deleted: all from i on moves up
        " (and (= j (- k 1)) (= (a k) (b j)))"  # inserted: all from i on moves down
        " (and (not (= j k)) (= (a k) (b j)))))))",  # moved
        assumptions={
            "by-induction": "(=> (and accepted (= (a k) (b j)))"
            " (and (= k j) (=> (<= 0 i k) (= (a i) (b i)))))"
        },
    )


# `read_prefix` and `verify_log`: all lines in turn.

_LINES: Final = 3
_SCAN_DECLARATIONS: Final = (
    *_constants("Bool", (f"there.{n}" for n in range(_LINES))),
    *_constants("Bool", (f"whole.{n}" for n in range(_LINES))),
    *_constants("Bool", (f"half-written.{n}" for n in range(_LINES))),
    *_constants("Bool", (f"follows.{n}" for n in range(_LINES))),
)


class _SymbolicLine:
    """A line of a file: `_check` accepts it after the one before, where `follows.N`."""

    def __init__(self, ask: DecideBranch, place: int) -> None:
        self._ask, self.place = ask, place

    def endswith(self, _: bytes) -> bool:
        return self._ask(f"whole.{self.place}")

    def __contains__(self, _: bytes) -> bool:
        return self._ask(f"half-written.{self.place}")

    def __len__(self) -> int:
        return 1


def _scan(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        there = 0
        while there < _LINES and ask(f"there.{there}"):
            there += 1

        def check(line: _SymbolicLine, before: Any, watch: Any) -> Any:
            if before.records != line.place or before.head != f"hash {line.place}" or watch != "watch":
                raise InternalError("a line is not held against what is before it")
            problem = None if ask(f"follows.{line.place}") else "bad"
            records = line.place + (problem is None)
            return module.LogPrefix(records, "first", f"hash {records}", records, None, problem)

        module = code.module(
            CHECK,
            _check=check,
            os=_FakeOs(there),
            GENESIS="hash 0",
            open_regular=lambda _: nullcontext(_SymbolicFile(ask, there)),
            ClosedLogCheck=lambda watch: watch,
        )
        report = module.verify_log("path", "watch")
        return smt_apply("scanned", smt_literal(bool(report.is_sound)), smt_literal(report.records))

    each = [f"(=> there.{n} (and whole.{n} follows.{n}))" for n in range(_LINES)]
    before = [smt_and(f"there.{m}" for m in range(n)) for n in range(_LINES)]
    fine = smt_and(f"(=> {there} {one})" for there, one in zip(before, each, strict=True))
    return TheoremObligation(
        "`verify_log` calls a log sound only where each line is whole and follows those before it, from\n"
        "`GENESIS` on, and has counted them all.  Three lines stand for any number.",
        ("(declare-datatypes ((Scanned 0)) (((scanned (is-sound Bool) (count Int)))))", *_SCAN_DECLARATIONS),
        f"(=> (is-sound verified) (and {fine}"
        " (= (count verified) (ite there.0 (ite there.1 (ite there.2 3 2) 1) 0))))",
        tables=(SymbolicFunction("verified", "Scanned", execute_symbolically(run)),),
    )


class _SymbolicFile:
    """A file of that many lines."""

    def __init__(self, ask: DecideBranch, lines: int) -> None:
        self._lines = [_SymbolicLine(ask, place) for place in range(lines)]

    def __iter__(self) -> Any:
        return iter(self._lines)

    def seek(self, _: int) -> None:
        return None

    def fileno(self) -> int:
        return 0


class _FakeOs:
    """Stands for `os`: how long the file is."""

    def __init__(self, size: int) -> None:
        self._size = size

    def fstat(self, _: int) -> Any:
        return SimpleNamespace(st_size=self._size)


# `CheckpointVerifier`: what signatures and the anchor add.

_STATEMENT_FIELDS: Final = ("log", "sequence", "head", "time", "closing", "key", "signature")
_SORTS: Final = {"sequence": "Int", "closing": "Bool", "time": "Real"}
_VERIFIER_SORTS: Final = (
    "(declare-datatypes ((Watched 0)) (((watched (log-after String) (ended-after Bool)) (objects))))",
    *(
        f"(declare-const {whose}.{name} {_SORTS.get(name, 'String')})"
        for whose in ("found", "anchor")
        for name in _STATEMENT_FIELDS
    ),
    *_constants(
        "Bool", ("anchored", "is-checkpoint", "is-mended", "well-formed", "signed", "many-bare", "ended")
    ),
    *_constants("String", ("own", "previous", "log", "key-id")),
    *_constants("Int", ("place",)),
    *_constants("Real", ("written",)),
    "(declare-fun spelt (Real) String)",
    "(declare-fun message (String Int String Real Bool String) String)",
    "(declare-fun has-signed (String String) Bool)",
)
"""A record that is watched, and the log so far: `log` is the hash of its first record."""


def _checkpoint_terms(module: Any, whose: str, ask: DecideBranch) -> Any:
    return module.AuditCheckpoint(*(SymbolicValue(f"{whose}.{name}", ask) for name in _STATEMENT_FIELDS))


def _execute_checkpoint_verifier(code: ModuleSource) -> DecisionDiagram:
    # It keeps nothing between two paths: it is loaded once, and only the stubs are of a path.
    module = code.module(CHECKPOINTS)

    def run(ask: DecideBranch) -> str:
        def canonical(details: dict[str, Any]) -> SymbolicValue:
            return SymbolicValue(
                smt_apply("message", *(details[name].term for name in _STATEMENT_FIELDS[:-1])), ask
            )

        def checkpoint_of(_: Any) -> Any:
            return _checkpoint_terms(module, "found", ask) if ask("well-formed") else None

        stubs = {
            "to_canonical_json": canonical,
            "parse_checkpoint": checkpoint_of,
            "repr": lambda value: SymbolicValue(f"(spelt {value.term})", ask),
        }
        install_stubs(module, stubs)
        key = SimpleNamespace(
            id=SymbolicValue("key-id", ask),
            verify=lambda signature, message: ask(f"(has-signed {signature.term} {message.term})"),
        )
        watch = module.CheckpointVerifier(
            key, (_checkpoint_terms(module, "anchor", ask),) if ask("anchored") else ()
        )
        watch.log = SymbolicValue("log", ask)
        watch.signed = int(ask("signed"))
        watch._bare = module.CHECKPOINT_INTERVAL if ask("many-bare") else 0
        watch._is_ended = ask("ended")
        event = module.CHECKPOINT if ask("is-checkpoint") else "other"
        details: dict[str, Any] = {}
        if event == "other" and ask("is-mended"):
            event, details = TAIL_REPAIRED, {"bytes": 1, "sha256": "0" * 64}
        record: dict[str, Any] = {
            "sequence": SymbolicValue("place", ask),
            "previous": SymbolicValue("previous", ask),
            "written": SymbolicValue("written", ask),
            "event": event,
            "details": details,
        }
        if watch(record, SymbolicValue("own", ask)) is not None:
            return "objects"
        ended = watch._is_ended
        return smt_apply(
            "watched", watch.log.term, smt_literal(ended) if isinstance(ended, bool) else ended.term
        )

    return execute_symbolically(run)


def _signature(code: ModuleSource) -> TheoremObligation:
    message = smt_apply("message", *(f"found.{name}" for name in _STATEMENT_FIELDS[:-1]))
    return TheoremObligation(
        "A checkpoint that `CheckpointVerifier` lets pass stands where the writer's chain had the hash\n"
        "that it has before it: `hash-at` is that of the writer's log, which has the id `log-id`.",
        (
            *_VERIFIER_SORTS,
            "(declare-fun hash-at (Int) String)",
            "(declare-const log-id String)",
            "(define-fun known () String (ite (= place 0) own log))",
        ),
        "(=> (and ((_ is watched) after) is-checkpoint (= known log-id)) (= previous (hash-at place)))",
        tables=(SymbolicFunction("after", "Watched", _execute_checkpoint_verifier(code)),),
        assumptions={
            "no-forgery": f"(=> (and (has-signed found.signature {message}) (= found.log log-id))"
            " (= found.head (hash-at found.sequence)))",
        },
    )


def _anchor(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "With an anchor, `CheckpointVerifier` lets pass at its place only a record that comes after the\n"
        "hash that the anchor has, in a log with the anchor's first record; and the first record"
        " stays known.",
        _VERIFIER_SORTS,
        "(=> (and ((_ is watched) after) anchored) (and"
        " (=> (= place 0) (= own anchor.log))"
        " (= (log-after after) (ite (= place 0) own log))"
        " (=> (= place anchor.sequence) (= previous anchor.head))))",
        tables=(SymbolicFunction("after", "Watched", _execute_checkpoint_verifier(code)),),
    )


def _closed(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "After a closing checkpoint, `CheckpointVerifier` lets pass only checkpoints and notes of a repair,\n"
        "until a checkpoint that is not closing.",
        _VERIFIER_SORTS,
        "(=> ((_ is watched) after) (and"
        " (=> ended (or is-checkpoint is-mended))"
        " (= (ended-after after) (ite is-checkpoint found.closing ended))))",
        tables=(SymbolicFunction("after", "Watched", _execute_checkpoint_verifier(code)),),
    )


def _verify_signed(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        anchor = SimpleNamespace(sequence=SymbolicValue("anchor.sequence", ask))

        class Watch(shipped):  # type: ignore[misc]
            """The real one, of a log that was read: `signed` is what it found."""

            def __init__(self, key: Any, anchors: Any) -> None:
                super().__init__(key, anchors)
                self.signed = int(ask("signed"))

        def verify_log(_: Any, watch: Any) -> AuditReport:
            if not isinstance(watch, Watch) or watch._anchors not in ((), (anchor,)):
                raise InternalError("the log is not watched")
            records: Any = SymbolicValue("records", ask)
            return AuditReport(records, "head", None if ask("chain-sound") else 0, "", DecisionCounts())

        stubs = {
            "CheckpointVerifier": Watch,
            "verify_log": verify_log,
            "read_anchor": lambda *_: anchor if ask("anchor-found") else None,
        }
        install_stubs(module, stubs)
        try:
            report = module.verify_signed("log", "key", *(["anchor"] if ask("anchored") else []))
        except module.AnchorError:
            return "false"
        return smt_literal(bool(report.chain.is_sound))

    module = code.module(CHECKPOINTS)
    shipped: Any = module.CheckpointVerifier
    return TheoremObligation(
        "`verify_signed` calls a log sound only where the chain is, something is signed, and the log\n"
        "reaches beyond the place of the anchor.",
        (
            *_constants("Bool", ("anchored", "anchor-found", "chain-sound", "signed")),
            *_constants("Int", ("records", "anchor.sequence")),
        ),
        "(=> verified (and chain-sound signed (=> anchored (< anchor.sequence records))))",
        tables=(SymbolicFunction("verified", "Bool", execute_symbolically(run)),),
    )


_LOOPS: Final = loops_of(
    "aeros.runtime.audit.check",
    "aeros.runtime.audit.checkpoints",
)

THEOREM = Theorem(
    "edited, deleted, inserted and moved audit records are detected; with an anchor, also cuts and rewrites",
    {
        "same-line": _same_line,
        "same-hash": _same_hash,
        "tampering": _tampering_detected,
        "scan": _scan,
        "signature": _signature,
        "anchor": _anchor,
        "closed": _closed,
        "verify-signed": _verify_signed,
        "loops": _LOOPS,
    },
    (
        Mutant(
            "overlooks-the-number-of-a-record",
            "same-line",
            CHECK,
            'if record["sequence"] != place:',
            'if record["sequence"] > place:',
        ),
        Mutant(
            "overlooks-the-hash-before-a-record",
            "same-hash",
            CHECK,
            'if record["previous"] != before.head:',
            'if place == 0 and record["previous"] != before.head:',
        ),
        Mutant(
            "believes-the-hash-that-stands-in-the-line",
            "same-hash",
            CHECK,
            "if line != expected:",
            "if not line != expected:",
        ),
        Mutant(
            "forgives-the-last-line",
            "scan",
            CHECK,
            'if b"\\0" in line and sound.end + len(line) == size:',
            "if sound.end + len(line) == size:\n            return sound\n        if False:",
        ),
        Mutant(
            "believes-a-checkpoint-of-another-place",
            "signature",
            CHECKPOINTS,
            'if claimed != (self.log, place, record["previous"], repr(record["written"])):',
            "if claimed[:2] != (self.log, place):",
        ),
        Mutant(
            "takes-any-checkpoint-for-the-anchored-one",
            "anchor",
            CHECKPOINTS,
            "anchor.sequence == place and found != anchor for",
            "anchor.sequence == place and found is None for",
        ),
        Mutant(
            "takes-a-record-after-the-closing-checkpoint",
            "closed",
            CHECKPOINTS,
            "if self._is_ended and not is_repair_note(record):",
            "if self._is_ended and self._bare and not is_repair_note(record):",
        ),
        Mutant(
            "forgets-that-the-log-was-closed",
            "closed",
            CHECKPOINTS,
            "self._is_ended, self._bare = place + 1, found.closing, found.closing, 0",
            "self._is_ended, self._bare = place + 1, found.closing, False, 0",
        ),
        Mutant(
            "overlooks-that-a-tail-was-cut",
            "verify-signed",
            CHECKPOINTS,
            "why = watch.missing_tail(chain.records) or unsigned",
            "why = unsigned",
        ),
        Mutant(
            "looks-at-two-anchors-only",
            "loops",
            "aeros.runtime.audit.checkpoints",
            "for anchor in self._anchors:",
            "for anchor in self._anchors[:2]:",
        ),
    ),
)
