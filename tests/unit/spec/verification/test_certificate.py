from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import aeros
import aeros.spec.verification.certificate
from aeros.spec.text.digests import text_digest
from aeros.spec.verification.certificate import LOCK, Certificate, LockFile, check_lock, write_lock
from aeros.spec.verification.verify import verify

CORPUS = Path(__file__).parents[3] / "corpus"


def certificate_of(module: Path, site: Path) -> Certificate:
    report = verify([module], site)
    certificate = report.modules[0].certificate
    assert certificate is not None
    return certificate


@pytest.fixture
def site(tmp_path: Path) -> Path:
    return Path(shutil.copy(CORPUS / "site" / "table.yaml", tmp_path))


_MODULE = CORPUS / "accepted" / "left_to_the_gate"


@pytest.fixture(scope="module")
def lock_text() -> str:
    """The certificate of the module as it is in the corpus; a certificate depends on no place."""
    return certificate_of(_MODULE, CORPUS / "site" / "table.yaml").text()


@pytest.fixture
def module(tmp_path: Path, site: Path, lock_text: str) -> Path:
    """A proved module with its certificate."""
    folder = Path(shutil.copytree(_MODULE, tmp_path / "left_to_the_gate"))
    (folder / LOCK).write_text(lock_text, encoding="utf-8")
    return folder


def code_of(module: Path, expected: Certificate) -> str | None:
    found = check_lock(module, expected)
    return None if found is None else found.code


def test_an_untouched_module_keeps_its_certificate(module: Path, site: Path) -> None:
    assert check_lock(module, certificate_of(module, site)) is None


def test_a_module_that_was_moved_keeps_its_certificate(module: Path, site: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    module.rename(elsewhere)
    assert check_lock(elsewhere, certificate_of(elsewhere, site)) is None


@pytest.mark.parametrize(
    ("file", "field"), [("ecm.yaml", "manifest"), ("skills.py", "code"), ("../table.yaml", "site")]
)
def test_a_comment_added_anywhere_makes_it_stale(module: Path, site: Path, file: str, field: str) -> None:
    with (module / file).open("a", encoding="utf-8") as opened:
        opened.write("# later\n")
    found = check_lock(module, certificate_of(module, site))
    assert found is not None
    assert found.code == "AE902"
    assert found.headline == f"the certificate of `left_to_the_gate` is stale: {field} differs"


@pytest.mark.parametrize(("file", "counts"), [(None, True), ("ecm.yaml", False), ("skills.py", False)])
def test_one_of_another_site_counts_for_a_run_if_the_files_are_the_same(
    module: Path, site: Path, file: str | None, counts: bool
) -> None:
    for changed in (site, *([module / file] if file else [])):
        with changed.open("a", encoding="utf-8") as opened:
            opened.write("# later\n")
    expected = certificate_of(module, site)
    assert (check_lock(module, expected, accepts_other_setup=True) is None) is counts
    assert code_of(module, expected) == "AE902"
    lock = module / LOCK
    lock.write_text(lock.read_text().replace("PROVED", "GUARDED"))
    altered = check_lock(module, expected, accepts_other_setup=True)
    assert altered is not None
    assert altered.code == "AE903"


def test_one_with_other_settings_counts_for_a_run(module: Path, site: Path) -> None:
    expected = replace(certificate_of(module, site), configuration={"speed": "0.3 m/s"})
    assert check_lock(module, expected, accepts_other_setup=True) is None
    assert code_of(module, expected) == "AE902"
    of_other_verdicts = replace(certificate_of(module, site), obligations={})
    found = check_lock(module, of_other_verdicts, accepts_other_setup=True)
    assert found is not None
    assert found.code == "AE902"


def test_it_states_the_limits_that_the_module_declares(module: Path, site: Path) -> None:
    assert not certificate_of(module, site).resources
    assert "resources" not in certificate_of(module, site).text()
    manifest = module / "ecm.yaml"
    asked = "permissions:\n  worker: {memory: 64 MiB, processor: 25 %}\n"
    manifest.write_text(manifest.read_text().replace("permissions:\n", asked))
    expected = {
        "skills.memory": "64 MiB",
        "skills.answer_within": "5 s",
        "skills.processor": "25 %",
    }
    for _ in range(2):  # the second is from the cache
        certificate = certificate_of(module, site)
        assert certificate.resources == expected
        assert json.loads(certificate.text())["resources"] == expected


def test_line_ends_rewritten_make_it_stale(module: Path, site: Path) -> None:
    code = module / "skills.py"
    code.write_bytes(code.read_bytes().replace(b"\n", b"\r\n"))
    assert code_of(module, certificate_of(module, site)) == "AE902"


@pytest.mark.parametrize("name", ["more.py", "below/more.py", "__init__.py"])
def test_a_file_of_code_added_makes_it_stale(module: Path, site: Path, name: str) -> None:
    (module / name).parent.mkdir(exist_ok=True)
    (module / name).touch()
    assert code_of(module, certificate_of(module, site)) == "AE902"


def test_a_file_of_code_renamed_makes_it_stale(module: Path, site: Path) -> None:
    (module / "helper.py").write_text("ONE = 1\n")
    (module / LOCK).write_text(certificate_of(module, site).text())
    (module / "helper.py").rename(module / "helpers.py")
    assert code_of(module, certificate_of(module, site)) == "AE902"


@pytest.mark.parametrize("field", ["schema", "module", "version", "verifier", "solver"])
def test_each_field_is_compared(module: Path, site: Path, field: str) -> None:
    changed: dict[str, Any] = {field: "another"}
    expected = replace(certificate_of(module, site), **changed)
    found = check_lock(module, expected)
    assert found is not None
    assert found.code == "AE902"
    assert found.headline.endswith(f"is stale: {field} differs")


def test_another_version_of_aeros_makes_it_stale(
    module: Path, site: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(aeros, "__version__", "0.1.1")
    assert code_of(module, certificate_of(module, site)) == "AE902"


def test_no_lock_is_missing(module: Path, site: Path) -> None:
    (module / LOCK).unlink()
    assert code_of(module, certificate_of(module, site)) == "AE901"


def _edited(text: str, change: Callable[[dict[str, object]], object]) -> str:
    body = json.loads(text)
    change(body)
    return json.dumps(body, indent=1, sort_keys=True) + "\n"


def _proved_instead_of_guarded(body: dict[str, object]) -> None:
    obligations = body["obligations"]
    assert isinstance(obligations, dict)
    assert obligations["safety/tidy/approach/slow-near-person"] == "GUARDED"
    obligations["safety/tidy/approach/slow-near-person"] = "PROVED"


@pytest.mark.parametrize(
    "change",
    [
        _proved_instead_of_guarded,
        lambda body: body.update(code="0" * 64),
        lambda body: body.update(digest="0" * 64),
        lambda body: body.pop("digest"),
        lambda body: body.pop("site"),
        lambda body: body.update(more=1),
    ],
    ids=["a verdict", "a digest of code", "its own digest", "no digest", "no site", "a field more"],
)
def test_an_edited_lock_is_noticed(
    module: Path, site: Path, change: Callable[[dict[str, object]], object]
) -> None:
    lock = module / LOCK
    lock.write_text(_edited(lock.read_text(), change))
    assert code_of(module, certificate_of(module, site)) == "AE903"


def test_a_lock_edited_with_a_new_digest_is_not_the_one_expected(module: Path, site: Path) -> None:
    # Anybody can compute a digest, so what decides is that the proof is made again.
    lock = module / LOCK
    body = json.loads(lock.read_text())
    _proved_instead_of_guarded(body)
    del body["digest"]
    body["digest"] = aeros.spec.verification.certificate._digest(body)
    lock.write_text(json.dumps(body, indent=1, sort_keys=True) + "\n")
    found = check_lock(module, certificate_of(module, site))
    assert found is not None
    assert found.headline == "the certificate of `left_to_the_gate` is stale: obligations differs"


def test_the_same_contents_in_another_layout_are_stale(module: Path, site: Path) -> None:
    lock = module / LOCK
    lock.write_text(json.dumps(json.loads(lock.read_text()), sort_keys=True))
    found = check_lock(module, certificate_of(module, site))
    assert found is not None
    assert found.headline.endswith("is stale: its layout differs")


@pytest.mark.parametrize(
    "content",
    [b"", b"{}", b"[]", b"null", b"{", b"\xff", b"[" * 100_000, b"1" * 5_000, b'{"digest": NaN}', b"\0"],
    ids=["empty", "{}", "[]", "null", "cut", "no UTF-8", "deep", "long", "NaN", "NUL"],
)
def test_a_damaged_lock_is_reported_without_an_exception(module: Path, site: Path, content: bytes) -> None:
    (module / LOCK).write_bytes(content)
    assert code_of(module, certificate_of(module, site)) == "AE903"


def test_a_certificate_is_kept_by_the_digest_of_its_text_alone(module: Path, site: Path) -> None:
    one = certificate_of(module, site)
    other = replace(one, version="9.9.9")
    for _ in range(2):  # a digest that is not of its text keeps nothing
        assert LockFile(lambda: other, text_digest(one.text())).certificate is other
    assert LockFile(lambda: one, text_digest(one.text())).certificate is one
    assert LockFile(lambda: other, text_digest(one.text())).certificate is one


def test_a_folder_for_a_lock_is_no_certificate(module: Path, site: Path) -> None:
    (module / LOCK).unlink()
    (module / LOCK).mkdir()
    assert code_of(module, certificate_of(module, site)) == "AE903"


@pytest.mark.parametrize("kind", ["link", "link to itself", "pipe"])
def test_a_lock_that_is_not_a_regular_file_is_refused_and_replaced(
    module: Path, site: Path, kind: str
) -> None:
    expected, lock, elsewhere = certificate_of(module, site), module / LOCK, module.parent / "elsewhere"
    elsewhere.write_text(lock.read_text())  # the right certificate, in the wrong place
    lock.unlink()
    if kind == "pipe":
        os.mkfifo(lock)
    else:
        lock.symlink_to(elsewhere if kind == "link" else lock)
    assert code_of(module, expected) == "AE903"
    before = elsewhere.read_text()
    write_lock(module, replace(expected, version="2.0.0"))
    assert elsewhere.read_text() == before
    assert lock.is_file()
    assert not lock.is_symlink()


def test_a_link_in_the_place_of_the_unfinished_lock_is_not_written_through(
    module: Path, site: Path, tmp_path: Path
) -> None:
    target = tmp_path / "target"
    (module / f".{LOCK}.{os.getpid()}").symlink_to(target)
    with pytest.raises(FileExistsError):
        write_lock(module, replace(certificate_of(module, site), version="2.0.0"))
    assert not target.exists()
    assert check_lock(module, certificate_of(module, site)) is None


@pytest.fixture
def with_model(module: Path, site: Path) -> Path:
    """The module with a model that its certificate covers."""
    manifest = module / "ecm.yaml"
    manifest.write_text(
        manifest.read_text()
        + "\nmodels:\n  finder: {description: finds dirt, kind: file, file: weights/dirt.bin}\n"
    )
    (module / "weights").mkdir()
    (module / "weights" / "dirt.bin").write_bytes(bytes(range(256)) * 20_000)
    write_lock(module, certificate_of(module, site))
    assert code_of(module, certificate_of(module, site)) is None
    return module


def test_a_model_with_one_bit_changed_makes_it_stale(with_model: Path, site: Path) -> None:
    model = with_model / "weights" / "dirt.bin"
    content = bytearray(model.read_bytes())
    content[-1] ^= 1
    model.write_bytes(content)
    found = check_lock(with_model, certificate_of(with_model, site))
    assert found is not None
    assert found.headline.endswith("is stale: models differs")


@pytest.mark.parametrize("kind", ["a link", "a link on the way", "a pipe", "a folder"])
def test_a_model_that_is_no_file_of_the_module_is_refused(
    with_model: Path, site: Path, tmp_path: Path, kind: str
) -> None:
    weights, model = with_model / "weights", with_model / "weights" / "dirt.bin"
    outside = tmp_path / "outside"
    shutil.copytree(weights, outside)
    model.unlink()
    if kind == "a link":
        model.symlink_to(outside / "dirt.bin")
    elif kind == "a link on the way":
        weights.rmdir()
        weights.symlink_to(outside)
    elif kind == "a pipe":
        os.mkfifo(model)
    else:
        model.mkdir()
    (found,) = verify([with_model], site).modules
    assert [one.code for one in found.diagnostics] == ["AE131"]
    assert found.diagnostics[0].primary is not None
    assert found.diagnostics[0].primary.text == (
        "it is reached through a link" if "link" in kind else "it is not a regular file"
    )


def test_the_text_is_canonical(module: Path, site: Path) -> None:
    first, second = certificate_of(module, site), certificate_of(module, site)
    assert first.text() == second.text()
    backwards = replace(first, obligations=dict(reversed(list(first.obligations.items()))))
    assert backwards.text() == first.text()
    assert first.text().isascii()


def test_guarded_names_the_rules_of_one_skill_and_kind(module: Path, site: Path) -> None:
    certificate = certificate_of(module, site)
    assert certificate.runtime_checked_rules("tidy", "approach") == {"slow-near-person", "stop-button"}
    assert certificate.runtime_checked_rules("tidy", "wait") == frozenset()
    assert certificate.runtime_checked_rules("tid", "approach") == frozenset()
    assert certificate.runtime_checked_rules("tidy", "appr") == frozenset()


def test_a_rejected_module_has_no_certificate(tmp_path: Path, site: Path) -> None:
    case = CORPUS / "rejected" / "safety" / "fast_near_a_person"
    assert verify([case], site).modules[0].certificate is None


def test_no_certificate_holds_a_verdict_that_is_neither_proved_nor_guarded(module: Path, site: Path) -> None:
    assert set(certificate_of(module, site).obligations.values()) == {"PROVED", "GUARDED"}
