from __future__ import annotations

import shutil
import subprocess
import sys
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

import aeros.spec.verification.verify as verify_module
from aeros.cli.author.reports.json_report import as_json
from aeros.cli.author.reports.result import VerifyResult
from aeros.experiments.trials.synthetic import write_module, write_modules
from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.digests import text_digest
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.text.files import read_source
from aeros.spec.verification import examine, proof_cache
from aeros.spec.verification.reports import Known, Report
from aeros.spec.verification.verify import Detail, verify
from tests.unit.spec.examining import note_examined

REPOSITORY = Path(__file__).parents[4]
BASE = REPOSITORY / "docs" / "codes" / "base"
SITE = BASE / "site.yaml"
"""A small site, and beside it a small module with a task and a composition: both are proved quickly."""

CORPUS = REPOSITORY / "tests" / "corpus"
TABLE = CORPUS / "site" / "table.yaml"
NEEDING, REQUIRED = "asker", "helper"
"""A module of the corpus, and the one whose skills it runs."""

NO_BYTECODE = shutil.ignore_patterns("__pycache__")


@pytest.fixture
def store(tmp_path: Path) -> AnswerStore:
    return AnswerStore(tmp_path / "answers")


@pytest.fixture
def modules(tmp_path: Path) -> Path:
    """Two modules: one that is changed, and one beside it that is not."""
    folder = tmp_path / "modules"
    for name in ("tidy", "sweep"):
        shutil.copytree(BASE / "tidy", folder / name, ignore=NO_BYTECODE)
    path = folder / "sweep" / "ecm.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(
        text.replace("id: tidy", "id: sweep").replace("[clean, wipe]", "[sweep]"), encoding="utf-8"
    )
    return folder


@pytest.fixture
def module(modules: Path) -> Path:
    return modules / "tidy"


def _output_of(report: Report) -> tuple[str, list[str]]:
    """Everything that a run says and writes: the JSON report and the certificates."""
    locks = [one.certificate.text() for one in report.modules if one.certificate is not None]
    return as_json(VerifyResult(report)), locks


def _brief(folder: Path, store: AnswerStore | None, site: Path = SITE, jobs: int = 1) -> Report:
    return verify([folder], site, store=store, detail=Detail.BRIEF, jobs=jobs)


def test_a_cached_proof_gives_the_same_report_without_proving(
    modules: Path, store: AnswerStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_full = _output_of(verify([modules], SITE))
    cold = _output_of(_brief(modules, store))
    examined = note_examined(monkeypatch)
    assert _output_of(_brief(modules, store)) == cold == in_full
    assert examined == []
    assert len(cold[1]) == 2


def test_the_digest_that_is_kept_is_that_of_the_certificate(modules: Path, store: AnswerStore) -> None:
    cold, warm = _brief(modules, store), _brief(modules, store)
    for one, again in zip(cold.modules, warm.modules, strict=True):
        assert one.lock is not None
        assert again.lock is not None
        assert again.lock._known == one.lock.digest == text_digest(again.lock.certificate.text())


@pytest.mark.parametrize("kind", ["modules", "requiring"])
def test_a_run_that_finds_everything_imports_nothing_that_proves(
    kind: str, store: AnswerStore, request: pytest.FixtureRequest
) -> None:
    modules, site = request.getfixturevalue(kind), {"modules": SITE, "requiring": TABLE}[kind]
    _brief(modules, store, site)
    answers = modules.parent / "answers"
    program = f"""\
import sys
from pathlib import Path
from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.verification.verify import Detail, verify
store = AnswerStore(Path({str(answers)!r}))
report = verify([Path({str(modules)!r})], Path({str(site)!r}), store=store, detail=Detail.BRIEF)
print(report.conclusion.value, *sorted({{"yaml", "z3", "networkx", "packaging"}} & set(sys.modules)))
proving = ("aeros.spec.elaborate", "aeros.spec.expr", "aeros.spec.verification.examine")
print(*sorted(name for name in sys.modules if name.startswith(proving)))
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=REPOSITORY
    )
    # A version of a required module is compared each time.
    compared = {"modules": "proved", "requiring": "proved packaging"}[kind]
    assert done.stdout.split("\n") == [compared, "", ""]


def _edit(name: str, old: str, new: str) -> Callable[[Path], object]:
    def edit(folder: Path) -> None:
        path = folder / name
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), encoding="utf-8")

    return edit


@pytest.mark.parametrize(
    "change",
    [
        _edit("ecm.yaml", "version: 1.0.0", "version: 1.0.1"),
        _edit("ecm.yaml", "# The module", "# A module"),
        _edit("skills.py", "Close the fingers", "Close both fingers"),
        lambda folder: (folder / "more.py").write_text("", encoding="utf-8"),
    ],
    ids=["version", "comment", "code", "new file of code"],
)
def test_a_change_of_the_module_is_examined(
    change: Callable[[Path], object], modules: Path, store: AnswerStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    _brief(modules, store)
    change(modules / "tidy")
    examined = note_examined(monkeypatch)
    report = _brief(modules, store)
    assert examined == ["tidy"]
    assert _output_of(report) == _output_of(verify([modules], SITE))


def test_another_site_budget_override_or_program_is_examined(
    modules: Path, store: AnswerStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _brief(modules, store)
    examined = note_examined(monkeypatch)
    site = tmp_path / "site.yaml"
    site.write_text(SITE.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
    _brief(modules, store, site)
    verify([modules], SITE, 7, store=store, detail=Detail.BRIEF)
    block = OperatorOverride("no_welder", "it is being repaired", "welder", None, None)
    for one in (block, replace(block, reason="it was repaired badly"), block):
        settings = OperatorSettings((one,))
        report = verify([modules], SITE, store=store, settings=settings, detail=Detail.BRIEF)
        assert _output_of(report) == _output_of(verify([modules], SITE, settings=settings))
    found_in_full = 3 * ["tidy", "sweep"]
    assert len(examined) == 8 + len(found_in_full)
    monkeypatch.setattr(proof_cache, "_program_digest", lambda: "another program")
    _brief(modules, store)
    assert len(examined) == 10 + len(found_in_full)


def test_a_copy_in_another_folder_is_found_and_reported_there(
    modules: Path, store: AnswerStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _brief(modules, store)
    copy = shutil.copytree(modules, tmp_path / "copy")
    in_full = _output_of(verify([copy], SITE))
    examined = note_examined(monkeypatch)
    assert _output_of(_brief(copy, store)) == in_full
    assert examined == []


def test_a_file_that_the_module_needs_is_looked_for_each_time(module: Path, store: AnswerStore) -> None:
    (module / "net.onnx").write_bytes(b"weights")
    _edit(
        "ecm.yaml",
        "tasks:\n",
        "models:\n  net: {description: a net, kind: file, file: net.onnx}\n\ntasks:\n",
    )(module)
    assert _brief(module, store).conclusion is Conclusion.PROVED
    assert _brief(module, store).conclusion is Conclusion.PROVED
    (module / "net.onnx").unlink()
    assert {one.code for one in _brief(module, store).modules[0].diagnostics} == {"AE131"}


def test_claims_about_other_modules_are_never_cached(tmp_path: Path, store: AnswerStore) -> None:
    needed = write_module(tmp_path / "modules", 8, skills=5)
    write_module(tmp_path / "modules", 9, skills=5)
    assert _brief(tmp_path / "modules", store, reference_site_path()).conclusion is Conclusion.PROVED
    shutil.rmtree(needed)
    report = _brief(tmp_path / "modules", store, reference_site_path())
    assert {one.code for one in report.modules[0].diagnostics} == {"AE301"}
    assert report.modules[0].certificate is None


@pytest.fixture
def requiring(tmp_path: Path) -> Path:
    """A module whose steps are those of another one next to it, and that one."""
    return shutil.copytree(CORPUS / "accepted" / "steps_of_a_required_module", tmp_path / "requiring")


def test_a_module_that_requires_another_is_found_as_long_as_both_are_as_they_were(
    requiring: Path, store: AnswerStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    cold = _output_of(_brief(requiring, store, TABLE))
    examined = note_examined(monkeypatch)
    assert _output_of(_brief(requiring, store, TABLE)) == cold
    assert examined == []


def _add_a_module(folder: Path) -> Path:
    return shutil.copytree(CORPUS / "accepted" / "waits_less_than_allowed", folder.parent / "another")


def _add_a_rival(folder: Path) -> None:
    _edit("ecm.yaml", "id: waits_less_than_allowed", f"id: {REQUIRED}")(_add_a_module(folder))


@pytest.mark.parametrize(
    "change",
    [
        _edit("ecm.yaml", "schema: ", "# A comment.\nschema: "),
        _edit("skills.py", "duration=1.0", "duration=2.0"),
        lambda folder: (folder / "table.csv").write_text("1\n", encoding="utf-8"),
        _add_a_rival,
    ],
    ids=["manifest", "code", "file", "another module of that name"],
)
def test_a_change_of_what_a_module_may_require_is_examined_with_it(
    change: Callable[[Path], object], requiring: Path, store: AnswerStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    _brief(requiring, store, TABLE)
    change(requiring / REQUIRED)
    examined = note_examined(monkeypatch)
    report = _brief(requiring, store, TABLE)
    assert NEEDING in examined
    assert _output_of(report) == _output_of(verify([requiring], TABLE))


def test_a_change_of_a_module_that_provides_nothing_required_leaves_the_proof(
    requiring: Path, store: AnswerStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    _brief(requiring, store, TABLE)
    other = _add_a_module(requiring / REQUIRED)
    examined = note_examined(monkeypatch)
    for change in (lambda _: None, _edit("ecm.yaml", "version: 1.0.0", "version: 1.0.1")):
        change(other)
        examined.clear()
        report = _brief(requiring, store, TABLE)
        assert examined == [other.name]
        assert _output_of(report) == _output_of(verify([requiring], TABLE))


def test_a_module_that_is_active_or_not_is_another_surrounding(
    requiring: Path, store: AnswerStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(*active: str) -> Report:
        at = [requiring / name for name in active]
        return verify([requiring], TABLE, store=store, detail=Detail.BRIEF, active=at)

    run(NEEDING, REQUIRED)
    examined = note_examined(monkeypatch)
    run(NEEDING, REQUIRED)
    assert examined == []
    run(NEEDING)
    assert examined == [NEEDING]


def test_a_required_module_that_changes_while_it_is_proved_leaves_no_proof(
    requiring: Path, store: AnswerStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = proof_cache.ProofCache(store, read_source(TABLE), DEFAULT_RLIMIT)
    cache.find([requiring / NEEDING, requiring / REQUIRED])
    _edit("skills.py", "duration=1.0", "duration=2.0")(requiring / REQUIRED)
    report = verify([requiring], TABLE)
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    findings = {one.path: examine.examine_module(one.path, site, Oracle()) for one in report.modules}
    cache.keep(report, Known(None, findings))
    _edit("skills.py", "duration=2.0", "duration=1.0")(requiring / REQUIRED)
    assert not proof_cache.ProofCache(store, read_source(TABLE), DEFAULT_RLIMIT).find(findings).modules


def test_a_module_with_diagnostics_is_not_cached(
    modules: Path, store: AnswerStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    _edit("ecm.yaml", "grip: force <= 10 N", "grip: force <= 10 N and force >= 11 N")(modules / "tidy")
    first = _output_of(_brief(modules, store))
    examined = note_examined(monkeypatch)
    second = _brief(modules, store)
    assert second.conclusion is Conclusion.REJECTED
    assert examined == ["tidy"]
    assert _output_of(second) == first


@pytest.mark.parametrize("content", ["", "null", "{}", "[1", '{"presence": {}, "tally": [], "lock": ""}'])
def test_a_proof_that_cannot_be_read_is_not_there(content: str, module: Path, store: AnswerStore) -> None:
    _brief(module, store)
    store._database.execute("UPDATE proofs SET head = ?", (content,))
    assert _output_of(_brief(module, store)) == _output_of(verify([module], SITE))


@pytest.mark.parametrize("content", [b"", b"{}", zlib.compress(b"[[],[]]")], ids=["none", "text", "others"])
def test_a_proof_whose_claims_are_not_those_that_were_kept_is_not_there(
    content: bytes, module: Path, store: AnswerStore
) -> None:
    _brief(module, store)
    store._database.execute("UPDATE proofs SET claims = ?", (content,))
    assert _output_of(_brief(module, store)) == _output_of(verify([module], SITE))


def test_a_report_on_other_bytes_is_not_believed(module: Path, store: AnswerStore) -> None:
    _brief(module, store)
    cache = proof_cache.ProofCache(store, read_source(SITE), DEFAULT_RLIMIT)
    kept = cache.find_module(module)
    assert kept is not None
    assert kept.summary is not None
    assert kept.lock_digest is not None
    forged = replace(kept, summary=replace(kept.summary, code_digest="0" * 64))
    key = cache._digest("module", kept.summary.manifest_digest, kept.summary.code_digest)
    cache.put_module(module, forged, kept.lock_digest)
    store.put_proofs({key: next(iter(cache._new.values()))})
    assert cache.find_module(module) is None


def test_several_processes_give_the_same_report_in_the_same_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verify_module, "MIN_MODULES_FOR_POOL", 2)
    modules = write_modules(tmp_path / "modules", 3, skills=5)
    (modules[2] / "ecm.yaml").write_text("nonsense: true\n", encoding="utf-8")
    _edit("ecm.yaml", "force <= 15 N", "force <= 1 N")(modules[1])
    alone = _brief(tmp_path / "modules", None, reference_site_path())
    assert alone.conclusion is Conclusion.REJECTED
    assert _output_of(_brief(tmp_path / "modules", None, reference_site_path(), jobs=2)) == _output_of(alone)
    assert _output_of(verify([tmp_path / "modules"], reference_site_path())) == _output_of(alone)


def test_a_cached_site_gives_the_same_report_without_queries(
    modules: Path, store: AnswerStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    cold = _output_of(_brief(modules, store))

    def asked(*_: object) -> object:
        raise AssertionError("the site was examined")

    monkeypatch.setattr(examine, "examine_site", asked)
    assert _output_of(_brief(modules, store)) == cold
    store._database.execute("UPDATE proofs SET head = '[[1]]'")
    with pytest.raises(AssertionError, match="was examined"):
        _brief(modules, store)
