"""Whatever is changed in an audit log, its checker finds: theorem 12."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.exploring import Ask, Diagram, Symbol, explore
from aeros.spec.theorems.formulas import application, literal
from aeros.spec.theorems.shipped import Code, Mutant, put_in_place
from aeros.spec.theorems.theorem import Obligation, Table, Theorem

CHECK: Final = "aeros.runtime.audit_check"
CHECKPOINTS: Final = "aeros.runtime.audit_checkpoints"

# One record after another.


def _log(name: str) -> tuple[str, ...]:
    """A log that is being read: what came before, and the record that comes next."""
    return (
        f"(declare-const {name}.place Int)",
        f"(declare-const {name}.head Hash)",
        f"(declare-const {name}.body Body)",
        f"(declare-const {name}.ends-with-its-hash Bool)",
    )


_RECORDS: Final = (
    "(declare-sort Hash 0)",
    "(declare-sort Body 0)",
    "(declare-fun hash (Body) Hash)",
    "(declare-fun is-record (Body) Bool)",
    "(declare-fun sequence (Body) Int)",
    "(declare-fun previous (Body) Hash)",
    "(declare-datatypes ((Read 0)) (((sound (records Int) (head Hash)) (bad))))",
)


class _Line:
    """A line of a log: a body, and behind it what should be its hash."""

    def __init__(self, name: str, ask: Ask) -> None:
        self._name, self._ask = name, ask

    def __getitem__(self, _: slice) -> _Line:
        return self

    def __add__(self, _: bytes) -> Symbol:
        return Symbol(f"{self._name}.body", self._ask)

    def __ne__(self, expected: object) -> bool:
        return not self._ask(f"{self._name}.ends-with-its-hash")

    def __len__(self) -> int:
        return 1


def _explore_check(code: Code, name: str) -> Diagram:
    """What `_check` makes of the next record of the log `name`: a term of sort Read."""

    def end_record(body: Symbol) -> tuple[bytes, Symbol]:
        return b"", Symbol(application("hash", body.term), body.ask)

    def parse(body: Symbol) -> dict[str, Any] | None:
        if not body.ask(application("is-record", body.term)):
            return None
        fields = {one: Symbol(application(one, body.term), body.ask) for one in ("sequence", "previous")}
        return {**fields, "event": "any", "details": {}}

    check = code.module(CHECK, end_record=end_record, _parse=parse)

    def run(ask: Ask) -> str:
        head = Symbol(f"{name}.head", ask)
        before = check.Scan(Symbol(f"{name}.place", ask), head, head, 0, check.DecisionCounts())
        found = check._check(_Line(name, ask), before, None)
        if found.problem is not None:
            return "bad"
        return f"(sound {found.records.term} {found.head.term})"

    return explore(run)


def _link(code: Code) -> Obligation:
    return Obligation(
        "`_check` takes a line exactly where it ends with the hash of its body, which is a record, has the\n"
        "number of its place, and the hash of the record before it; the head is then its own hash.",
        (*_RECORDS, *_log("log")),
        "(= read (ite (and log.ends-with-its-hash (is-record log.body) (= (sequence log.body) log.place)"
        " (= (previous log.body) log.head)) (sound (+ log.place 1) (hash log.body)) bad))",
        tables=(Table("read", "Read", _explore_check(code, "log")),),
    )


def _same(code: Code) -> Obligation:
    return Obligation(
        "Two logs that are sound so far, of one length and with one head, end with the same record and\n"
        "had one\n"
        "head before it: by induction they are the same log.",
        (*_RECORDS, *_log("one"), *_log("other")),
        "(=> (and (not (= read.one bad)) (= read.one read.other))"
        " (and (= one.body other.body) (= one.head other.head) (= one.place other.place)))",
        tables=(
            Table("read.one", "Read", _explore_check(code, "one")),
            Table("read.other", "Read", _explore_check(code, "other")),
        ),
        assumptions={
            "no-collision": "(=> (= (hash one.body) (hash other.body)) (= one.body other.body))",
        },
    )


_LINES: Final = ("first", "second")


def _whole(code: Code) -> Obligation:
    check = code.module(CHECK)

    def run(ask: Ask) -> str:
        class Line:
            def __init__(self, name: str) -> None:
                self.name = name

            def endswith(self, _: bytes) -> bool:
                return ask(f"{self.name}.is-ended")

            def __contains__(self, _: bytes) -> bool:
                return ask(f"{self.name}.has-a-hole")

            def __len__(self) -> int:
                return 1

        class File:
            def seek(self, _: int) -> None:
                """It is read from its start."""

            def fileno(self) -> int:
                return 0

            def __iter__(self) -> Any:
                return iter([Line(name) for name in _LINES])

        read: list[str] = []

        def check_line(line: Any, before: Any, _: Any) -> Any:
            read.append(line.name)
            if ask(f"{line.name}.follows"):
                return check.replace(before, records=before.records + 1, end=before.end + 1)
            return check.replace(before, problem="it does not follow")

        files = SimpleNamespace(fstat=lambda _: SimpleNamespace(st_size=len(_LINES)))
        put_in_place(check, {"_check": check_line, "os": files})
        found = check.scan(File())
        return literal(found.problem is None)

    return Obligation(
        "`scan` finds a log sound only if every line is whole and follows those before it.",
        tuple(
            f"(declare-const {line}.{what} Bool)"
            for line in _LINES
            for what in ("is-ended", "has-a-hole", "follows")
        ),
        "(=> sound (and first.is-ended first.follows second.is-ended"
        " second.follows (not second.has-a-hole)))",
        tables=(Table("sound", "Bool", explore(run)),),
    )


# The anchor.


class _Checkpoint:
    """A checkpoint of which only fields are known, as symbols."""

    def __init__(self, name: str, ask: Ask) -> None:
        self._name, self._ask = name, ask
        self.closing = False

    def __getattr__(self, field: str) -> Symbol:
        return Symbol(f"({field}-of {self._name})", self._ask)

    def __eq__(self, other: object) -> Any:
        return isinstance(other, _Checkpoint) and self._ask(f"(= {self._name} {other._name})")

    __hash__ = None  # type: ignore[assignment]

    def is_signed_by(self, _: Any) -> bool:
        return self._ask(f"{self._name}.signed")


_ANCHORED: Final = (
    "(declare-sort Hash 0)",
    "(declare-datatypes ((Checkpoint 0)) (((checkpoint (log-of Hash) (sequence-of Int) (head-of Hash)"
    " (time-of Real) (key-of Hash)))))",
    "(declare-const found Checkpoint)",
    "(declare-const anchor Checkpoint)",
    "(declare-const found.signed Bool)",
    "(declare-const place Int)",
    *(f"(declare-const {name} Hash)" for name in ("previous", "own", "log")),
    "(declare-const written Real)",
    *(
        f"(declare-const {name} Bool)"
        for name in ("event-is-checkpoint", "is-one", "is-note", "long-unsigned", "signed-before")
    ),
)


def _anchored(code: Code) -> Obligation:
    checkpoints = code.module(CHECKPOINTS, repr=lambda value: value)

    def run(ask: Ask) -> str:
        found = _Checkpoint("found", ask)
        put_in_place(checkpoints, {"checkpoint_of": lambda _: found if ask("is-one") else None})
        watch = checkpoints.CheckpointWatch(None, _Checkpoint("anchor", ask))
        watch.log = Symbol("log", ask)
        watch.signed = 1 if ask("signed-before") else 0
        watch._bare = checkpoints.EVERY if ask("long-unsigned") else 0
        other = checkpoints.TAIL_MENDED if ask("is-note") else "any"
        record: dict[str, Any] = {
            "sequence": Symbol("place", ask),
            "previous": Symbol("previous", ask),
            "written": Symbol("written", ask),
            "event": checkpoints.CHECKPOINT if ask("event-is-checkpoint") else other,
            "details": {},
        }
        return literal(watch(record, Symbol("own", ask)) is None)

    return Obligation(
        "Where the anchor's record stands in a log that passes, it is the anchor's checkpoint, signed with\n"
        "the key, and the head of the records before it is the one that the anchor holds.",
        _ANCHORED,
        "(=> (and passes (= (sequence-of anchor) place))"
        " (and event-is-checkpoint is-one found.signed (= found anchor) (= previous (head-of anchor))))",
        tables=(Table("passes", "Bool", explore(run)),),
    )


def _uncut(code: Code) -> Obligation:
    checkpoints = code.module(CHECKPOINTS)

    def run(ask: Ask) -> str:
        anchor = SimpleNamespace(sequence=Symbol("anchored", ask)) if ask("has-anchor") else None
        watch = checkpoints.CheckpointWatch(None, anchor)
        return literal(watch.missing(Symbol("records", ask)) is None)

    return Obligation(
        "`CheckpointWatch.missing` misses nothing exactly where the log reaches beyond the anchor's record.",
        (
            "(declare-const has-anchor Bool)",
            "(declare-const anchored Int)",
            "(declare-const records Int)",
        ),
        "(= whole (or (not has-anchor) (< anchored records)))",
        tables=(Table("whole", "Bool", explore(run)),),
    )


THEOREM = Theorem(
    "an audit log that passes is the one that was written, up to its anchor: nothing edited, cut or moved",
    {"link": _link, "same-log": _same, "whole": _whole, "anchored": _anchored, "uncut": _uncut},
    (
        Mutant(
            "does-not-look-at-the-record-before",
            "link",
            CHECK,
            'if record["previous"] != before.head:',
            'if record["previous"] != record["previous"]:',
        ),
        Mutant(
            "takes-any-hash",
            "same-log",
            CHECK,
            "    return Scan(place + 1, first, own, before.end + len(line), decisions)\n",
            "    return Scan(place + 1, first, before.head, before.end + len(line), decisions)\n",
        ),
        Mutant(
            "stops-at-the-first-record",
            "whole",
            CHECK,
            "        sound = checked\n    return sound\n",
            "        return checked\n    return sound\n",
        ),
        Mutant(
            "takes-any-checkpoint-for-the-anchors",
            "anchored",
            CHECKPOINTS,
            "and found != self._anchor:",
            "and found is None:",
        ),
        Mutant(
            "lets-the-anchors-record-be-cut",
            "uncut",
            CHECKPOINTS,
            "self._anchor.sequence < records",
            "self._anchor.sequence <= records",
        ),
    ),
)
