"""A record that the log has acknowledged is in the file, in its place, and durable as the site says."""

from __future__ import annotations

from contextlib import nullcontext
from itertools import product
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.audit.checkpoints import CHECKPOINT_INTERVAL
from aeros.runtime.canonical_json import Encoded
from aeros.spec.model.policy import Durability
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_and, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib.loops import loops_of

LOG: Final = "aeros.runtime.audit.log"

_END: Final = 100
_LINE: Final = b"ab"
"""A line of two bytes, which the system may write in one call or in two, after the end of the file."""

# Bytes: `AuditLog._write`.


class _File:
    """The file as the system has it, where every call may fail or be interrupted."""

    def __init__(self, ask: DecideBranch) -> None:
        self._ask = ask
        self.bytes: dict[int, int] = {}
        self.is_synced = True
        self.length: int | None = None

    def _may_fail(self, call: str) -> None:
        if self._ask(f"{call}-fails"):
            raise OSError(28, call)
        if self._ask(f"{call}-is-interrupted"):
            raise KeyboardInterrupt

    def pwrite(self, _: int, data: bytes, at: int) -> int:
        self._may_fail(f"write-{at - _END}")
        count = 1 if len(data) == 1 or self._ask("in-two") else 2
        self.bytes.update(enumerate(data[:count], at))
        self.is_synced = False
        return count

    def ftruncate(self, _: int, length: int) -> None:
        self._may_fail("cut")
        self.length, self.is_synced = length, False

    def fdatasync(self, _: int) -> None:
        self._may_fail("sync")
        self.is_synced = True


_CALLS: Final = ("write-0", "write-1", "cut", "sync")
_FAILURES: Final = tuple(f"{call}-{word}" for call in _CALLS for word in ("fails", "is-interrupted"))


def _log(code: ModuleSource, **parts: Any) -> Any:
    log = object.__new__(code.module(LOG).AuditLog)
    log.path, log._file, log._end = "log", 3, _END
    log._broken, log._unsynced = None, 5
    for name, part in parts.items():
        setattr(log, name, part)
    return log


def _written(code: ModuleSource) -> TheoremObligation:
    module = code.module(LOG)

    def run(ask: DecideBranch) -> str:
        file = _File(ask)
        calls = {name: getattr(file, name) for name in ("pwrite", "ftruncate", "fdatasync")}
        vars(module)["os"] = SimpleNamespace(**calls)
        log = object.__new__(module.AuditLog)
        log.path, log._file, log._end, log._broken, log._unsynced = "log", 3, _END, None, 5
        sync, cut = ask("must-sync"), ask("cuts")
        try:
            log._write(_LINE, sync=sync, cut=cut)
        except (module.AuditError, KeyboardInterrupt):
            return "refused" if log._broken is not None else "wrong"
        is_whole = file.bytes == {_END: _LINE[0], _END + 1: _LINE[1]}
        is_cut = file.length == (_END + 2 if cut else None)
        if not (is_whole and is_cut and log._broken is None and log._end == _END):
            return "wrong"
        counted = log._unsynced == (0 if sync or cut else 6)
        return f"(whole {smt_literal(file.is_synced)})" if counted else "wrong"

    any_failure = [
        "write-0-fails write-0-is-interrupted",
        "(and in-two (or write-1-fails write-1-is-interrupted))",
        "(and cuts (or cut-fails cut-is-interrupted))",
        "(and (or must-sync cuts) (or sync-fails sync-is-interrupted))",
    ]
    return TheoremObligation(
        "`AuditLog._write` returns exactly if the whole line is in the file behind what was there before,\n"
        "the torn bytes are cut off if there were any, and all of it is synced if it must be. After any\n"
        "failure or interruption the log refuses to go on.",
        (
            "(declare-datatypes ((Written 0)) (((whole (synced Bool)) (refused) (wrong))))",
            *(f"(declare-const {flag} Bool)" for flag in (*_FAILURES, "in-two", "must-sync", "cuts")),
            f"(define-fun some-failure () Bool (or {' '.join(any_failure)}))",
        ),
        "(= found (ite some-failure refused (whole (or must-sync cuts))))",
        tables=(SymbolicFunction("found", "Written", execute_symbolically(run)),),
    )


# Records: `AuditLog._append` and `append`.


def _appended(code: ModuleSource) -> TheoremObligation:
    module = code.module(LOG, seal_record=lambda body: (f"line of {body}", f"hash of {body}"))

    def run(ask: DecideBranch) -> str:
        events: list[Any] = []

        def write(line: str, *, cut: bool, sync: str) -> None:
            events.append(("write", line, cut, sync))
            if ask("write-fails"):
                raise module.AuditError(line)

        log = object.__new__(module.AuditLog)
        log.path, log._broken = "log", "closed" if ask("broken") else None
        log._sequence, log._head, log._end, log._id, log._unsigned = 4, "head", _END, "id", 2
        if ask("first"):
            log._sequence = 0
        before = dict(vars(log))
        log._clock = lambda: "clock"
        log._encode_record = lambda event, details, written: f"{event} {details} {written}"
        log._must_sync = lambda event, details: f"as {event} {details} needs"
        log._write = write
        log._listener = (lambda line: events.append(("tell", line))) if ask("listener") else None
        written = "given" if ask("time-given") else None
        body = f"event details {'given' if written else 'clock'}"
        cut = ask("cuts")
        try:
            found = log._append("event", "details", written=written, cut=cut)
        except module.AuditError:
            found = None
        after = {name: getattr(log, name) for name in before}
        one = ("write", f"line of {body}", cut, "as event details needs")
        if found is None:
            expected = [] if ask("broken") else [one]
            return "refused" if after == before and events == expected else "wrong"
        change = {
            "_sequence": before["_sequence"] + 1,
            "_head": f"hash of {body}",
            "_end": _END + len(f"line of {body}"),
            "_unsigned": 3,
            "_id": f"hash of {body}" if ask("first") else "id",
        }
        notices = [("tell", f"line of {body}")] if ask("listener") else []
        is_right = (
            after == {**before, **change} and events == [one, *notices] and found == before["_sequence"]
        )
        return "acknowledged" if is_right else "wrong"

    return TheoremObligation(
        "`AuditLog._append` acknowledges a record exactly if its line was written; then number, hash and\n"
        "end are those after that line, and the listener gets it. A log that cannot go on writes nothing,\n"
        "and a line that was not written changes nothing.",
        (
            "(declare-datatypes ((Appended 0)) (((acknowledged) (refused) (wrong))))",
            *(
                f"(declare-const {flag} Bool)"
                for flag in ("broken", "write-fails", "first", "listener", "time-given", "cuts")
            ),
        ),
        "(= found (ite (or broken write-fails) refused acknowledged))",
        tables=(SymbolicFunction("found", "Appended", execute_symbolically(run)),),
    )


def _encoded(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        log = _log(code, _sequence=4, _head="0123", _id="id")
        details = {"a": 1, "b": "ü"}
        given: Any = Encoded('{"a":1,"b":"\\u00fc"}', 2) if ask("as-text") else details
        line = (
            b'{"details":{"a":1,"b":"\\u00fc"},"event":"it \\"is\\"","previous":"0123"'
            b',"sequence":4,"written":2.5}'
        )
        return smt_literal(log._encode_record('it "is"', given, 2.5) == line)

    return TheoremObligation(
        "`AuditLog._encode_record` writes a record with the number and the hash that come next, the event,\n"
        "the time and the details, whether these are values or text.",
        ("(declare-const as-text Bool)",),
        "exactly",
        tables=(SymbolicFunction("exactly", "Bool", execute_symbolically(run)),),
    )


_DURABILITIES: Final = tuple(Durability)
_EVENTS: Final = ("decision", "checkpoint", "other")


def _durable(code: ModuleSource) -> TheoremObligation:
    module = code.module(LOG)
    least = str(module.SYNC_BATCH)

    def run(ask: DecideBranch) -> str:
        log = object.__new__(module.AuditLog)
        log._durability = next(
            (one for one in _DURABILITIES[:-1] if ask(f"is.{one.name}")), _DURABILITIES[-1]
        )
        log._unsynced = SymbolicValue("unsynced", ask)
        event = next((one for one in _EVENTS[:2] if ask(f"event.{one}")), "other")
        details: Any = {"verdict": "DENY" if ask("denial") else "ALLOW"}
        if ask("as-text"):
            details = Encoded("{}", 0)
        return smt_literal(bool(log._must_sync(event, details)))

    names = [one.name for one in _DURABILITIES]
    flags = [*(f"is.{name}" for name in names[:-1]), *(f"event.{one}" for one in _EVENTS[:-1])]
    apart = [
        f"(not (and {one} {other}))"
        for one, other in product(flags, flags)
        if one < other and one.partition(".")[0] == other.partition(".")[0]
    ]
    batched = f"(<= {least} (+ unsynced 1))"
    return TheoremObligation(
        "`AuditLog._must_sync`: every record if the site says so; every checkpoint; before motion, every\n"
        "decision that is not known as a denial; in batches, no later than the last record of a batch.",
        (
            *(f"(declare-const {flag} Bool)" for flag in (*flags, "denial", "as-text")),
            "(declare-const unsynced Int)",
        ),
        "(= syncs (or event.checkpoint is.EVERY_RECORD"
        " (ite is.BEFORE_MOTION (and event.decision (or as-text (not denial)))"
        f" {batched})))",
        tables=(SymbolicFunction("syncs", "Bool", execute_symbolically(run)),),
        assumptions={"one-of-each": smt_and(apart)},
    )


# Checkpoints: `append`, `_sign` and `close`.


def _signs(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        events: list[Any] = []
        log = _log(code, _lock=nullcontext(), _signing="key" if ask("signing") else None)
        log._unsigned = SymbolicValue("unsigned", ask)

        def append(event: str, details: str) -> int:
            events.append((event, details))
            return 9

        log._append = append
        log._sign = lambda signing, *, closing: events.append((signing, closing))
        found = log.append("event", "details")
        signed = events[1:] == [("key", False)]
        is_right = found == 9 and events[0] == ("event", "details") and (signed or len(events) == 1)
        return smt_literal(signed) if is_right else "(not signs.expected)"

    return TheoremObligation(
        "`AuditLog.append` signs a checkpoint after the record exactly if the log is signed and as many\n"
        "records as the interval are not.",
        (
            "(declare-const signing Bool)",
            "(declare-const unsigned Int)",
            f"(define-fun signs.expected () Bool (and signing (<= {CHECKPOINT_INTERVAL} unsigned)))",
        ),
        "(= signs signs.expected)",
        tables=(SymbolicFunction("signs", "Bool", execute_symbolically(run)),),
    )


def _signed(code: ModuleSource) -> TheoremObligation:
    module = code.module(LOG)

    def run(ask: DecideBranch) -> str:
        events: list[Any] = []

        def checkpoint(*parts: Any) -> Any:
            signed = SimpleNamespace(details=lambda: ("signed", parts))
            return SimpleNamespace(sign=lambda key: signed if key is the_key else None)

        def write_anchor(anchor: str, one: Any) -> None:
            events.append((anchor, one.details()))
            if ask(f"{anchor}-fails"):
                raise OSError(28, anchor)

        vars(module).update(AuditCheckpoint=checkpoint, write_anchor=write_anchor)
        the_key = SimpleNamespace(public=SimpleNamespace(id="key"))
        log = object.__new__(module.AuditLog)
        log.path, log._broken, log._unsigned = "log", None, 64
        log._id, log._sequence, log._head, log._clock = "id", 4, "head", lambda: 2.5
        log._append = lambda event, details, *, written: events.append((event, details, written))
        closing = ask("closing")
        signing = SimpleNamespace(key=the_key, anchors=("one", "two"))
        details = ("signed", ("id", 4, "head", 2.5, closing, "key"))
        try:
            log._sign(signing, closing=closing)
        except module.AuditError:
            last = next(name for name in ("one", "two") if ask(f"{name}-fails"))
            copies = [(name, details) for name in ("one", "two")][: 1 if last == "one" else 2]
            is_right = log._broken is not None
        except OSError:
            return "false"
        else:
            copies = [(name, details) for name in ("one", "two")]
            is_right = log._broken is None and not ask("one-fails") and not ask("two-fails")
        is_right &= events == [("checkpoint", details, 2.5), *copies] and log._unsigned == 0
        return smt_literal(is_right)

    return TheoremObligation(
        "`AuditLog._sign` appends a checkpoint of the number of records and the hash of the last one,\n"
        "signed with the log's key, and copies it to each anchor after that. If a copy fails, the log\n"
        "refuses to go on.",
        tuple(f"(declare-const {flag} Bool)" for flag in ("closing", "one-fails", "two-fails")),
        "exactly",
        tables=(SymbolicFunction("exactly", "Bool", execute_symbolically(run)),),
    )


def _closes(code: ModuleSource) -> TheoremObligation:
    module = code.module(LOG)

    def run(ask: DecideBranch) -> str:
        events: list[Any] = []

        def fails(event: str) -> None:
            events.append(event)
            if event != "close" and ask(f"{event}-fails"):
                raise module.AuditError(event)

        vars(module)["os"] = SimpleNamespace(close=lambda _: fails("close"))
        log = object.__new__(module.AuditLog)
        log._lock, log._file = nullcontext(), 3 if ask("open") else -1
        log._broken = "why" if ask("broken") else None
        log._signing, log._unsynced = "key" if ask("signing") else None, 5 if ask("unsynced") else 0
        log._sign = lambda _, *, closing: fails(
            "sign" if closing else "sign a checkpoint that does not close"
        )
        log._write = lambda line, *, sync: fails("sync" if sync and not line else "write")
        try:
            log.close()
        except module.AuditError:
            events.append("raised")
        if not ask("open"):
            return smt_literal(not events)
        last = [] if ask("broken") else ["sign"] if ask("signing") else ["sync"] if ask("unsynced") else []
        raised = [one for one in last if ask(f"{one}-fails")]
        expected = [*last, "close", *(["raised"] if raised else [])]
        return smt_literal(events == expected and log._file == -1 and log._broken is not None)

    return TheoremObligation(
        "`AuditLog.close` signs a closing checkpoint, or syncs what is not synced, and then closes the\n"
        "file, whatever fails; nothing can be appended any more. A second time it does no more.",
        tuple(
            f"(declare-const {flag} Bool)"
            for flag in ("open", "broken", "signing", "unsynced", "sign-fails", "sync-fails")
        ),
        "exactly",
        tables=(SymbolicFunction("exactly", "Bool", execute_symbolically(run)),),
    )


THEOREM = Theorem(
    "what the audit log has acknowledged is in the file, in its place, and durable as the site says",
    {
        "written": _written,
        "appended": _appended,
        "encoded": _encoded,
        "durable": _durable,
        "signs": _signs,
        "signed": _signed,
        "closes": _closes,
        "loops": loops_of(LOG),
    },
    (
        Mutant(
            "takes-a-part-for-the-line",
            "written",
            LOG,
            "            while written < len(line):\n",
            "            if written < len(line):\n",
        ),
        Mutant(
            "goes-on-after-a-failure",
            "written",
            LOG,
            "            self._broken = str(failure)\n",
            "            self._broken = None\n",
        ),
        Mutant("forgets-to-sync", "written", LOG, "            if sync or cut:\n", "            if cut:\n"),
        Mutant(
            "goes-on-after-an-interruption",
            "written",
            LOG,
            '        self._broken = "an earlier record was not written"\n',
            "",
        ),
        Mutant(
            "counts-a-record-that-was-not-written",
            "appended",
            LOG,
            "        self._write(line, cut=cut, sync=self._must_sync(event, details))\n",
            "        self._sequence += 1\n"
            "        self._write(line, cut=cut, sync=self._must_sync(event, details))\n"
            "        self._sequence -= 1\n",
        ),
        Mutant(
            "tells-of-a-record-before-it-is-safe",
            "appended",
            LOG,
            "        line, head = seal_record(body)\n",
            "        line, head = seal_record(body)\n        if self._listener is not None:\n"
            "            self._listener(line)\n",
        ),
        Mutant(
            "writes-the-number-before",
            "encoded",
            LOG,
            "sequence, previous = self._sequence, self._head",
            "sequence, previous = self._sequence - 1, self._head",
        ),
        Mutant(
            "moves-before-the-decision-is-durable",
            "durable",
            LOG,
            'return event == "decision" and not is_denial',
            'return event == "decision" and is_denial',
        ),
        Mutant(
            "syncs-a-record-late",
            "durable",
            LOG,
            "self._unsynced + 1 >= SYNC_BATCH",
            "self._unsynced >= SYNC_BATCH",
        ),
        Mutant(
            "signs-a-record-late",
            "signs",
            LOG,
            "self._unsigned >= CHECKPOINT_INTERVAL",
            "self._unsigned > CHECKPOINT_INTERVAL",
        ),
        Mutant(
            "copies-a-checkpoint-before-it-is-in-the-log",
            "signed",
            LOG,
            "        self._append(CHECKPOINT, checkpoint.details(), written=now)\n",
            "        write_anchor(signing.anchors[0], checkpoint)\n"
            "        self._append(CHECKPOINT, checkpoint.details(), written=now)\n",
        ),
        Mutant(
            "leaves-records-unsynced-when-it-closes",
            "closes",
            LOG,
            "elif self._broken is None and self._unsynced:",
            "elif self._broken is None and not self._unsynced:",
        ),
        Mutant(
            "copies-to-two-anchors-only",
            "loops",
            LOG,
            "for anchor in signing.anchors:",
            "for anchor in signing.anchors[:2]:",
        ),
    ),
)
