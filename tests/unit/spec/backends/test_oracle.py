from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.backends import oracle as oracle_module
from aeros.spec.backends.answer_store import AnswerStore, default_store
from aeros.spec.backends.oracle import Oracle, PosedQuestion
from aeros.spec.backends.solver_process import SolverProcess
from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, RealType
from aeros.spec.expr.units import LENGTH

REPOSITORY = Path(__file__).parents[4]
X = t.Variable("x", RealType(LENGTH), t.VariableRole.STATE)
B = t.Variable("b", BOOL, t.VariableRole.STATE)
E = t.Variable("e", EnumType("side", ("left", "right")), t.VariableRole.STATE)
SAT = SolverAnswer(SatResult.SAT, {"x": Fraction(1)})
RANGES = {"x": (Fraction(0), Fraction(10))}


def _above(bound: Fraction) -> t.Term:
    return t.Compare("<", t.Literal(bound, X.type), X)  # type: ignore[arg-type]


def _forbid_solving(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> SolverAnswer:
        raise AssertionError("the solver was asked")

    monkeypatch.setattr(SolverProcess, "check_sat", refuse)
    monkeypatch.setattr(SolverProcess, "check_together", refuse)


def test_a_question_is_put_to_the_solver_once(monkeypatch: pytest.MonkeyPatch) -> None:
    oracle = Oracle()
    first = oracle.check_sat([X], RANGES, [_above(Fraction(3))])
    _forbid_solving(monkeypatch)
    assert oracle.check_sat([X], RANGES, [_above(Fraction(3))]) == first
    with pytest.raises(AssertionError, match="was asked"):
        oracle.check_sat([X], RANGES, [_above(Fraction(4))])


def test_every_question_is_asked_in_a_process_that_can_be_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    late = SolverAnswer(SatResult.UNKNOWN, {}, "no answer within 3 s")
    asked: list[tuple[int, float]] = []

    def answer(_: object, __: object, ___: object, ____: object, rlimit: int, seconds: float) -> SolverAnswer:
        asked.append((rlimit, seconds))
        return late

    monkeypatch.setattr(SolverProcess, "check_sat", answer)
    oracle = Oracle(1000, seconds=3.0)
    assert oracle.check_sat([X], RANGES, [_above(Fraction(3))]) == late
    assert oracle.with_reduced_budget(10).check_sat([X], RANGES, [_above(Fraction(4))]) == late
    assert asked == [(1000, 3.0), (100, 3.0)]


def test_after_some_questions_without_an_answer_no_other_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = ["no answer within 3 s", "canceled", "no answer within 3 s"]
    monkeypatch.setattr(
        SolverProcess, "check_sat", lambda *_: SolverAnswer(SatResult.UNKNOWN, {}, answers.pop(0))
    )
    oracle = Oracle(seconds=3.0, max_timeouts=2)
    given = [oracle.check_sat([X], RANGES, [_above(Fraction(bound))]).reason for bound in range(3)]
    given.append(oracle.with_reduced_budget(10).check_sat([X], RANGES, [_above(Fraction(3))]).reason)
    assert given == [
        "no answer within 3 s",
        "canceled",
        "no answer within 3 s",
        "not asked, as 2 questions had no answer within 3 s",
    ]


@pytest.mark.parametrize(
    "other",
    [
        ([X], {"x": (Fraction(0), Fraction(2))}, [_above(Fraction(3))]),
        ([X, B], RANGES, [_above(Fraction(3))]),
        ([X], RANGES, [_above(Fraction(3)), _above(Fraction(11))]),
    ],
)
def test_a_question_that_differs_is_another_question(
    other: tuple[list[t.Variable], dict[str, tuple[Fraction, Fraction]], list[t.Term]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    oracle = Oracle()
    oracle.check_sat([X], RANGES, [_above(Fraction(3))])
    _forbid_solving(monkeypatch)
    with pytest.raises(AssertionError, match="was asked"):
        oracle.check_sat(*other)


def _posed(*bounds: int, is_shown: bool = False) -> list[PosedQuestion]:
    terms = [_above(Fraction(bound)) for bound in bounds]
    return [PosedQuestion(Question([X], RANGES, [term]), "a claim", is_shown) for term in terms]


def test_questions_asked_together_have_the_answers_of_each_alone() -> None:
    answers = Oracle().check_together(_posed(3, 11, 9, 3))
    assert [one.result for one in answers] == [
        SatResult.SAT, SatResult.UNSAT, SatResult.SAT, SatResult.SAT
    ]  # fmt: skip
    for answer, bound in ((answers[0], 3), (answers[2], 9)):
        value = answer.model["x"]
        assert isinstance(value, Fraction)
        assert bound < value <= 10


def test_a_model_that_is_shown_is_that_of_the_question_alone() -> None:
    alone = Oracle().check_sat([X], RANGES, [_above(Fraction(3))])
    assert Oracle().check_together(_posed(9, 3, 11, is_shown=True))[1] == alone


def test_a_question_that_a_group_leaves_open_is_asked_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SolverProcess, "check_together", lambda *given: [None] * len(given[1]))
    oracle = Oracle(recording=True)
    answers = oracle.check_together(_posed(3, 11))
    assert [one.result for one in answers] == [SatResult.SAT, SatResult.UNSAT]
    assert [one.answer for one in oracle.asked.values()] == answers


def test_a_group_is_found_in_the_store_and_another_group_is_asked(
    open_store: Callable[[], AnswerStore], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = Oracle(store=open_store())
    alone = first.check_sat([X], RANGES, [_above(Fraction(7))])
    answers = first.check_together(_posed(3, 11))
    first.save_answers()
    _forbid_solving(monkeypatch)
    assert Oracle(store=open_store()).check_sat([X], RANGES, [_above(Fraction(7))]) == alone
    assert Oracle(store=open_store()).check_together(_posed(3, 11)) == answers
    with pytest.raises(AssertionError, match="was asked"):
        Oracle(store=open_store()).check_together(_posed(3, 9))


def test_after_too_many_timeouts_no_group_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    _forbid_solving(monkeypatch)
    answers = Oracle(max_timeouts=0).check_together(_posed(3, 11))
    unasked = SolverAnswer(SatResult.UNKNOWN, {}, "not asked, as 0 questions had no answer within 10 s")
    assert answers == [unasked] * 2
    assert Oracle(max_timeouts=0).with_reduced_budget(2).check_together(_posed(3, 11)) == [unasked] * 2


def test_a_smaller_budget_is_at_least_1_and_shares_what_is_known_and_recorded(
    open_store: Callable[[], AnswerStore], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = Oracle(1000, open_store(), recording=True)
    reduced = first.with_reduced_budget(300)
    assert (reduced.rlimit, first.with_reduced_budget(5000).rlimit) == (3, 1)
    monkeypatch.setattr(SolverProcess, "check_sat", lambda *_: SAT)
    for bound in (3, 4):
        reduced.check_sat([X], RANGES, [_above(Fraction(bound))], f"repair {bound}")
        first.save_answers()
    assert [one.description for one in first.asked.values()] == ["repair 3", "repair 4"]
    _forbid_solving(monkeypatch)
    again = Oracle(1000, open_store()).with_reduced_budget(300)
    for bound in (3, 4):
        assert again.check_sat([X], RANGES, [_above(Fraction(bound))]) == SAT
    assert again.asked == {}


def test_a_term_that_questions_share_is_hashed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    hashed: list[str] = []
    find = oracle_module._hash

    def noted(text: str) -> str:
        hashed.append(text)
        return find(text)

    monkeypatch.setattr(oracle_module, "_hash", noted)
    monkeypatch.setattr(SolverProcess, "check_sat", lambda *_: SAT)
    oracle, shared = Oracle(), t.And((_above(Fraction(3)), B))
    for other in (t.TRUE, t.FALSE, B):
        oracle.check_sat([X, B], RANGES, [shared, t.Or((t.Not(shared), other))])
    for term in (X, B, shared.operands[0], t.TRUE, t.FALSE):
        assert hashed.count(repr(term)) == 1, term
    assert not any(repr(shared) in text for text in hashed), "only parts of it are written"


@pytest.fixture
def open_store(tmp_path: Path) -> Iterator[Callable[[], AnswerStore]]:
    with ExitStack() as stack:
        yield lambda: stack.enter_context(closing(AnswerStore(tmp_path / "answers")))


def test_a_later_run_finds_the_same_answer_in_the_store(
    open_store: Callable[[], AnswerStore], monkeypatch: pytest.MonkeyPatch
) -> None:
    question = [_above(Fraction(1, 3)), B, t.Compare("==", E, t.Literal("right", E.type))]  # type: ignore[arg-type]
    first = Oracle(store=open_store())
    answer = first.check_sat([X, B, E], RANGES, question)
    never = first.check_sat([X], RANGES, [_above(Fraction(10))])
    first.save_answers()
    _forbid_solving(monkeypatch)
    second = Oracle(store=open_store())
    assert second.check_sat([X, B, E], RANGES, question) == answer
    assert answer.model["b"] is True
    assert answer.model["e"] == "right"
    assert second.check_sat([X], RANGES, [_above(Fraction(10))]) == never == SolverAnswer(SatResult.UNSAT, {})


def test_questions_asked_after_saving_are_saved_too(
    open_store: Callable[[], AnswerStore], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = Oracle(store=open_store())
    for bound in (3, 4):
        first.check_sat([X], RANGES, [_above(Fraction(bound))])
        first.save_answers()
    _forbid_solving(monkeypatch)
    second = Oracle(store=open_store())
    assert second.check_sat([X], RANGES, [_above(Fraction(4))]).result is SatResult.SAT


def test_another_budget_another_solver_or_other_code_asks_again(
    open_store: Callable[[], AnswerStore], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = Oracle(store=open_store())
    first.check_sat([X], RANGES, [_above(Fraction(3))])
    first.save_answers()
    _forbid_solving(monkeypatch)
    with pytest.raises(AssertionError, match="was asked"):
        Oracle(7_000_000, open_store()).check_sat([X], RANGES, [_above(Fraction(3))])
    monkeypatch.setattr(oracle_module, "_solver_fingerprint", lambda: "another solver")
    with pytest.raises(AssertionError, match="was asked"):
        Oracle(store=open_store()).check_sat([X], RANGES, [_above(Fraction(3))])


def test_unknown_is_not_stored(open_store: Callable[[], AnswerStore]) -> None:
    store = open_store()
    store.put({"k": SolverAnswer(SatResult.UNKNOWN, {}, "out of budget")})
    assert store.get("k") is None


@pytest.mark.parametrize("content", ["", "null", "{}", '{"result": "maybe", "model": {}}', "[1", "0"])
def test_an_unreadable_entry_counts_as_missing(content: str, open_store: Callable[[], AnswerStore]) -> None:
    store = open_store()
    store._database.execute("INSERT INTO answers VALUES ('k', ?)", (content,))
    assert store.get("k") is None


def test_a_deleted_store_changes_no_answer(open_store: Callable[[], AnswerStore]) -> None:
    store = open_store()
    store.close()
    store.close()
    oracle = Oracle(store=store)
    assert oracle.check_sat([X], RANGES, [_above(Fraction(3))]).result is SatResult.SAT
    oracle.save_answers()


def test_an_environment_variable_sets_the_place_of_the_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AEROS_CACHE", "off")
    assert default_store() is None
    monkeypatch.setenv("AEROS_CACHE", str(tmp_path / "file" / "below"))
    (tmp_path / "file").write_text("")
    assert default_store() is None
    monkeypatch.setenv("AEROS_CACHE", str(tmp_path / "cache"))
    assert default_store() is not None
    assert (tmp_path / "cache" / "aeros" / "answers.sqlite3").exists()


def test_by_default_answers_are_in_the_users_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AEROS_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert default_store() is not None
    assert (tmp_path / ".cache" / "aeros" / "answers.sqlite3").exists()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "elsewhere"))
    assert default_store() is not None
    assert (tmp_path / "elsewhere" / "aeros" / "answers.sqlite3").exists()


def test_the_store_is_private_and_unused_if_it_belongs_to_another_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AEROS_CACHE", str(tmp_path))
    assert default_store() is not None
    assert default_store() is not None  # a later run finds the folder
    assert (tmp_path / "aeros").stat().st_mode & 0o077 == 0
    monkeypatch.setattr(os, "getuid", lambda: (tmp_path / "aeros").stat().st_uid + 1)
    assert default_store() is None


def test_an_unchanged_module_is_verified_without_the_solver(tmp_path: Path) -> None:
    probe = (
        "import sys; from aeros.cli.main import main; "
        "from aeros.spec.backends.solver_process import SOLVER_PROCESS; "
        "code = main(['verify', 'ecms/make_dumplings', '--no-lock', '--format', 'json']); "
        "print(SOLVER_PROCESS._process is not None, 'z3' in sys.modules, file=sys.stderr); sys.exit(code)"
    )

    def verified() -> tuple[str, str]:
        environment = {**os.environ, "AEROS_CACHE": str(tmp_path)}
        done = subprocess.run(
            [sys.executable, "-c", probe],
            cwd=REPOSITORY,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout, done.stderr.strip()

    cold, warm = verified(), verified()
    assert (cold[1], warm[1]) == ("True False", "False False")
    assert cold[0] == warm[0]


def test_answers_belong_to_the_solver_and_to_the_code_that_gives_terms_their_meaning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("backends/network/a.py", "expr/b.py", "obligations/c.py", "expr/d.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("before")
    monkeypatch.setattr(oracle_module, "_SPEC_FOLDER", tmp_path)
    fingerprint = oracle_module._solver_fingerprint.__wrapped__
    known = [fingerprint()]
    assert fingerprint() == known[0]
    for name, matters in (
        ("backends/network/a.py", True), ("expr/b.py", True), ("obligations/c.py", False),
        ("expr/d.txt", False),
    ):  # fmt: skip
        (tmp_path / name).write_text("after")
        assert (fingerprint() not in known) is matters, name
        known.append(fingerprint())
    monkeypatch.setattr(oracle_module, "z3_version", lambda: "another")
    assert fingerprint() not in known


def test_the_answers_of_a_group_are_asked_for_once_and_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    oracle = Oracle(recording=True)
    posed = _posed(3, 11, 5)
    unsat = SolverAnswer(SatResult.UNSAT, {})
    groups: list[object] = []

    def answer(_: object, questions: object, rlimit: int, seconds: float) -> list[SolverAnswer | None]:
        groups.append((questions, rlimit, seconds))
        return [None, unsat, SAT]

    monkeypatch.setattr(SolverProcess, "check_together", answer)

    def answer_alone(*given: object) -> SolverAnswer:
        alone.append(given[3])
        return SAT

    monkeypatch.setattr(SolverProcess, "check_sat", answer_alone)
    alone: list[object] = []
    for _ in range(2):
        assert oracle.check_together(posed) == [SAT, unsat, SAT]
    assert alone == [(posed[0].question.terms)]
    assert len(groups) == 2  # as one question was left open
    assert groups[0] == ([one.question for one in posed], oracle.rlimit, oracle._seconds)
    assert [(one.description, one.question, one.answer) for one in oracle.asked.values()] == [
        ("a claim", posed[0].question, SAT),
        ("a claim", posed[1].question, unsat),
        ("a claim", posed[2].question, SAT),
    ]


def test_only_models_that_are_shown_are_asked_for_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    unsat, own = SolverAnswer(SatResult.UNSAT, {}), SolverAnswer(SatResult.SAT, {"x": Fraction(7)})
    posed = [*_posed(3, 11, is_shown=True), *_posed(5)]
    monkeypatch.setattr(SolverProcess, "check_together", lambda *_: [SAT, unsat, SAT])
    alone: list[object] = []

    def answer_alone(*given: object) -> SolverAnswer:
        alone.append(given[3])
        return own

    monkeypatch.setattr(SolverProcess, "check_sat", answer_alone)
    oracle = Oracle()
    assert oracle.check_together(posed) == [own, unsat, SAT]
    assert alone == [posed[0].question.terms]
    oracle.save_answers()  # without a store, nothing happens


def test_one_question_alone_is_no_group(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SolverProcess, "check_together", lambda *_: pytest.fail("a group of one"))
    answers = Oracle().check_together(_posed(3, 3))
    assert [one.result for one in answers] == [SatResult.SAT] * 2
    assert Oracle().check_together([]) == []


def test_a_question_is_known_by_what_it_says_and_not_by_its_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    oracle = Oracle()
    parts = _above(Fraction(3)), B
    shapes: list[Callable[[], t.Term]] = [
        lambda: t.And(tuple(parts)),
        lambda: t.Or(tuple(parts)),
        lambda: t.And(tuple(reversed(parts))),
        lambda: t.Not(t.And(tuple(parts))),
        lambda: t.Not(parts[1]),
        lambda: t.And((t.Or(tuple(parts)),)),
        lambda: parts[0],
    ]
    asked: list[t.Term] = []

    def answer(_: object, __: object, ___: object, terms: Sequence[t.Term], *____: object) -> SolverAnswer:
        asked.extend(terms)
        return SAT

    monkeypatch.setattr(SolverProcess, "check_sat", answer)
    for _ in range(2):
        for make in shapes:
            oracle.check_sat([X, B], RANGES, [make()])
    assert asked == [make() for make in shapes]


def test_a_group_has_an_answer_for_each_question(monkeypatch: pytest.MonkeyPatch) -> None:
    for count in (1, 3):
        monkeypatch.setattr(SolverProcess, "check_together", lambda *_, count=count: [None] * count)
        with pytest.raises(ValueError, match="argument 2 is"):
            Oracle().check_together(_posed(3, 11))
