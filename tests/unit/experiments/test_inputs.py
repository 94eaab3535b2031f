"""Inputs of trials: tasks by name, and digests of what decides their findings."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping
from pathlib import Path

import pytest

from aeros.experiments.environment import package_versions
from aeros.experiments.inputs import (
    InputPaths,
    _source_files,
    code_digest,
    digest_of_files,
    load_inputs,
    scene_digest,
)
from aeros.spec.diagnostics.errors import UserError
from tests.unit.experiments.support.common import ROOT, WHERE, premises


def test_a_task_is_found_with_its_module() -> None:
    routed = premises().routed("clean_table")
    assert (routed.module, routed.task.id) == ("clean_table", "clean_table")


@pytest.mark.parametrize(
    ("name", "help_"),
    [
        ("clean_tabel", "did you mean `clean_table`?"),
        ("fly", "there are clean_table, fetch_object, inspect_table, make_dumplings, serve_table"),
    ],
)
def test_a_task_that_no_module_has_is_refused(name: str, help_: str) -> None:
    with pytest.raises(UserError, match=f"no module has the task `{name}`") as refused:
        premises().routed(name)
    (problem,) = refused.value.diagnostics
    assert (problem.code, problem.help) == ("AE130", (help_,))


def test_inputs_are_loaded_once_and_known_by_configuration_code_and_releases() -> None:
    found = load_inputs(WHERE)
    assert load_inputs(InputPaths(WHERE.modules_folder)) is found
    scenes = scene_digest(found.paths.modules_folder)
    sources = f"{found.configuration.digest} {code_digest()} {scenes}"
    assert found.sources_digest == hashlib.sha256(sources.encode()).hexdigest()
    whole = f"{found.sources_digest} {package_versions()}"
    assert found.digest == hashlib.sha256(whole.encode()).hexdigest()
    assert set(found.configuration.modules) == {
        *("clean_table", "fetch_object", "inspect_table", "make_dumplings", "serve_table")
    }


def test_modules_without_certificates_are_refused(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "ecms" / "clean_table", tmp_path / "clean_table")
    (tmp_path / "clean_table" / "ecm.lock").unlink()
    with pytest.raises(UserError, match="AE901"):
        load_inputs(InputPaths(str(tmp_path)))


def test_a_scene_and_its_models_are_digested(tmp_path: Path) -> None:
    (folder := tmp_path / "module" / "scenes" / "models").mkdir(parents=True)
    (folder / "can.urdf").write_text("a")
    before = scene_digest(str(tmp_path))
    (tmp_path / "module" / "skills.py").write_text("")
    assert scene_digest(str(tmp_path)) == before
    (folder / "can.urdf").write_text("b")
    assert scene_digest(str(tmp_path)) != before


def test_a_digest_is_of_names_and_contents(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"one")
    (tmp_path / "b").write_bytes(b"two")
    found = digest_of_files({"y": tmp_path / "b", "x": tmp_path / "a"})
    assert found == hashlib.sha256(b"x 3\noney 3\ntwo").hexdigest()
    assert found == digest_of_files({"x": tmp_path / "a", "y": tmp_path / "b"})
    assert found != digest_of_files({"x": tmp_path / "b", "y": tmp_path / "a"})
    assert digest_of_files({}) == hashlib.sha256(b"").hexdigest()


def test_caches_are_no_source(tmp_path: Path) -> None:
    for name in ("a.py", "deep/b.py", "__pycache__/a.pyc", "deep/__pycache__/b.pyc"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    assert sorted(str(one.relative_to(tmp_path)) for one in _source_files(tmp_path)) == ["a.py", "deep/b.py"]
    assert list(_source_files(tmp_path / "a.py")) == [tmp_path / "a.py"]
    assert list(_source_files(tmp_path / "__pycache__")) == []  # each folder beside it is given by itself


def test_code_that_shows_or_asks_decides_no_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []

    def keep(files: Mapping[str, Path]) -> str:
        seen.extend(files)
        return "d"

    monkeypatch.setattr("aeros.experiments.inputs.digest_of_files", keep)
    assert code_digest.__wrapped__() == "d"
    parts = {Path(one).parts[0] for one in seen}
    assert not parts & {"cli", "docs", "api.py", "apps", "franka", "gym", "ros2_control"}
    assert {"agent", "runtime", "spec", "sim", "skill.py"} <= parts
    experiments = {Path(one).parts[1] for one in seen if Path(one).parts[0] == "experiments"}
    assert {"architectures", "trial_context.py", "open_gate.py"} <= experiments
    assert not experiments & {"report", "trials", "data", "catalogue.py"}
