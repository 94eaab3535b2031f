"""The pre-commit hook and the GitHub Action do, in a scratch repository, what docs/ci.md says.

By default what pre-commit and GitHub would run is run directly.  The whole way through pre-commit
itself, which installs AEROS into an environment of its own, takes a minute and reaches PyPI:

    AEROS_NETWORK=1 pytest tests/repo/test_ci_integration.py     with pre-commit installed
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.repo.tree import ROOT, text_of

_HOOKS = yaml.safe_load(text_of(".pre-commit-hooks.yaml"))
_ACTION = yaml.safe_load(text_of("action.yml"))
_MODULE = ROOT / "tests" / "corpus" / "accepted" / "left_to_the_gate"
_SITE = ROOT / "tests" / "corpus" / "site" / "table.yaml"


def _run(folder: Path, *command: str, **variables: str) -> subprocess.CompletedProcess[str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    variables |= {"PATH": path, "GIT_CONFIG_GLOBAL": os.devnull}
    return subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def _commit(folder: Path) -> None:
    for command in ("init -q", "add -A", "-c user.name=n -c user.email=e@localhost commit -q -m all"):
        done = _run(folder, "git", *command.split())
        assert done.returncode == 0, done.stderr


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A git repository that holds a site and one module, with its certificate."""
    folder = tmp_path / "repository"
    shutil.copytree(_MODULE, folder / "ecms" / "left_to_the_gate")
    shutil.copy(_SITE, folder / "cell.yaml")
    (folder / "README.md").write_text("A robot.\n")
    proved = _run(folder, "aeros", "verify", "ecms", "--site", "cell.yaml")
    assert proved.returncode == 0, proved.stdout + proved.stderr
    _commit(folder)
    return folder


def _hook(name: str = "aeros-verify") -> dict[str, Any]:
    (hook,) = [one for one in _HOOKS if one["id"] == name]
    assert isinstance(hook, dict)
    return hook


def _hooked(repository: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the pre-commit hook, without file names, as the hook asks for none."""
    assert _hook()["pass_filenames"] is False
    return _run(repository, *shlex.split(_hook()["entry"]), *(arguments or _hook()["args"]))


def test_the_hook_passes_what_is_proved_and_changes_nothing(repository: Path) -> None:
    done = _hooked(repository, "--check", "ecms", "--site", "cell.yaml")
    assert done.returncode == 0, done.stdout + done.stderr
    assert _run(repository, "git", "status", "--porcelain").stdout == ""


def test_the_hook_refuses_a_stale_certificate_and_a_manifest_that_is_not_safe(repository: Path) -> None:
    arguments = ("--check", "ecms", "--site", "cell.yaml")
    skills = repository / "ecms" / "left_to_the_gate" / "skills.py"
    skills.write_text(skills.read_text() + "\n")
    done = _hooked(repository, *arguments)
    assert (done.returncode, "error[AE902]" in done.stdout) == (1, True)
    manifest = skills.with_name("ecm.yaml")
    manifest.write_text(manifest.read_text().replace("    gated: [slow-near-person]\n", ""))
    done = _hooked(repository, *arguments)
    assert (done.returncode, "error[AE501]" in done.stdout) == (1, True)


def test_the_hook_by_default_verifies_every_module_under_the_reference_site(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "ecms" / "make_dumplings", tmp_path / "deep" / "make_dumplings")
    done = _hooked(tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "make_dumplings  proved" in done.stdout


def test_the_hook_of_layouts_writes_files_of_aeros_alone(repository: Path) -> None:
    hook, other = _hook("aeros-fmt"), repository / "workflow.yaml"
    other.write_text("on:   push\n")
    site = (repository / "cell.yaml").read_text()
    (repository / "cell.yaml").write_text(site.replace(": ", ":   "))
    assert hook["pass_filenames"] is False
    done = _run(repository, *shlex.split(hook["entry"]), *hook["args"])
    assert (done.returncode, "formatted cell.yaml" in done.stdout) == (0, True)
    assert other.read_text() == "on:   push\n"
    assert [bool(re.search(hook["files"], path)) for path in ("a.yaml", "b.yml", "c.py")] == [
        True,
        True,
        False,
    ]


@pytest.mark.parametrize(
    ("path", "matters"),
    [
        ("ecms/wrap/ecm.yaml", True),
        ("ecms/wrap/ecm.lock", True),
        ("ecms/wrap/skills.py", True),
        ("cell.yaml", True),
        ("cell.yml", True),
        ("README.md", False),
        ("notes/yaml", False),
        ("ecms/wrap/skills.pyc", False),
    ],
)
def test_the_hook_runs_where_a_change_can_matter(path: str, matters: bool) -> None:
    assert bool(re.search(_hook()["files"], path)) == matters


@pytest.mark.skipif(os.environ.get("AEROS_NETWORK") != "1", reason="installs from PyPI: set AEROS_NETWORK=1")
def test_pre_commit_itself_runs_the_hook(repository: Path, tmp_path: Path) -> None:
    source = tmp_path / "aeros"
    shutil.copytree(ROOT / "aeros", source / "aeros", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE", ".pre-commit-hooks.yaml"):
        shutil.copy(ROOT / name, source / name)
    shutil.copytree(ROOT / "docs", source / "docs")
    _commit(source)
    revision = _run(source, "git", "rev-parse", "HEAD").stdout.strip()
    hook = {"id": "aeros-verify", "args": ["--check", "ecms", "--site", "cell.yaml"]}
    config = {"repos": [{"repo": str(source), "rev": revision, "hooks": [hook]}]}
    (repository / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config))
    _run(repository, "git", "add", "-A")
    home = {"PRE_COMMIT_HOME": str(tmp_path / "home")}
    done = _run(repository, "pre-commit", "run", "--all-files", **home)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"^aeros verify\.+Passed$", done.stdout, re.MULTILINE)
    manifest = repository / "ecms" / "left_to_the_gate" / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("    gated: [slow-near-person]\n", ""))
    _run(repository, "git", "add", "-A")
    done = _run(repository, "pre-commit", "run", **home)
    assert done.returncode == 1
    assert "error[AE501]" in done.stdout


def _step(name: str) -> dict[str, Any]:
    (step,) = (step for step in _ACTION["runs"]["steps"] if step.get("name") == name)
    assert isinstance(step, dict)
    return step


def _run_action(repository: Path, **inputs: str) -> tuple[subprocess.CompletedProcess[str], str]:
    """Run the step `verify` of the action; return the run of its script and its outputs."""
    sarif, outputs = repository.parent / "aeros.sarif", repository.parent / "outputs"
    sarif.unlink(missing_ok=True)
    outputs.write_text("")
    given = {name: str(one["default"]) for name, one in _ACTION["inputs"].items()} | inputs
    variables = {"PATHS": given["paths"], "SITE": given["site"], "CHECK": given["check"], "SARIF": str(sarif)}
    variables |= {"UPLOAD": given["upload"], "ANNOTATIONS": str(repository.parent / "aeros.annotations")}
    assert variables.keys() == _step("verify")["env"].keys()
    script = ("bash", "--noprofile", "--norc", "-e", "-o", "pipefail", "-c", _step("verify")["run"])
    return _run(repository, *script, **variables, GITHUB_OUTPUT=str(outputs)), outputs.read_text()


def _acted(repository: Path, **inputs: str) -> tuple[int, str, dict[str, Any] | None]:
    """Run the step `verify` of the action; return exit code, its outputs, and the SARIF log."""
    done, outputs = _run_action(repository, **inputs)
    sarif = repository.parent / "aeros.sarif"
    log = json.loads(sarif.read_text()) if sarif.exists() else None
    return done.returncode, outputs, log


def test_the_action_verifies_and_leaves_a_log_to_upload(repository: Path) -> None:
    status, outputs, log = _acted(repository, paths="ecms", site="cell.yaml")
    assert status == 0
    assert outputs == f"sarif={repository.parent / 'aeros.sarif'}\n"
    assert log is not None
    assert log["runs"][0]["results"] == []


def test_the_action_fails_and_still_leaves_its_log(repository: Path) -> None:
    manifest = repository / "ecms" / "left_to_the_gate" / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("    gated: [slow-near-person]\n", ""))
    status, outputs, log = _acted(repository, paths="ecms", site="cell.yaml", check="false")
    assert status == 1
    assert outputs
    assert log is not None
    (result,) = log["runs"][0]["results"]
    place = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert (result["ruleId"], place) == ("AE501", "ecms/left_to_the_gate/ecm.yaml")


def test_the_action_does_not_upload_what_was_not_written(repository: Path) -> None:
    assert _acted(repository, paths="nowhere") == (2, "", None)
    assert "steps.verify.outputs.sarif != ''" in _step("upload")["if"]


def test_the_action_prints_annotations_if_it_does_not_upload(repository: Path) -> None:
    manifest = repository / "ecms" / "left_to_the_gate" / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("    gated: [slow-near-person]\n", ""))
    done, outputs = _run_action(repository, paths="ecms", site="cell.yaml", check="false", upload="false")
    assert (done.returncode, outputs) == (1, "")
    lines = done.stdout.splitlines()
    assert lines[0].startswith("error[AE501] ")
    assert lines[-1].startswith("::error file=ecms/left_to_the_gate/ecm.yaml,line=")


def test_the_action_is_well_formed() -> None:
    assert _ACTION.keys() == {"name", "description", "inputs", "runs"}
    assert _ACTION["runs"]["using"] == "composite"
    for name, one in _ACTION["inputs"].items():
        assert one.keys() == {"description", "default"}, name
        assert isinstance(one["default"], str), name
    for step in _ACTION["runs"]["steps"]:
        assert ("uses" in step) != ("run" in step)
        if "run" in step:
            assert step["shell"] == "bash"
            assert "${{" not in step["run"], "an input in a script is code: pass it by `env`"
        else:
            assert re.fullmatch(r"[\w-]+/[\w/-]+@[0-9a-f]{40}", step["uses"]), "pinned by commit"
    named = set(re.findall(r"\binputs\.(\w+)", text_of("action.yml")))
    assert named == set(_ACTION["inputs"])


def test_the_page_names_inputs_and_hooks_that_exist() -> None:
    page = text_of("docs/ci.md")
    for hook in _HOOKS:
        assert f"- id: {hook['id']}\n" in page
        assert f"default: [{', '.join(hook['args'])}]" in page
    for name in _ACTION["inputs"]:
        assert f"{name}:" in page
