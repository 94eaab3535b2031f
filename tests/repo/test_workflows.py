"""Workflows run what is configured: each profile, tool, benchmark and target of the Makefile."""

from __future__ import annotations

import re
import tomllib
from typing import Any

import pytest
import yaml

from tests.host_layers import LAYERS, VARIABLE
from tests.hypothesis_profiles import PROFILES
from tests.repo.tree import ROOT, text_of

_FOLDER = ROOT / ".github" / "workflows"
_WORKFLOWS = sorted(path.name for path in _FOLDER.glob("*.yml"))
_MAKEFILE = text_of("Makefile")
_PROJECT: dict[str, Any] = tomllib.loads(text_of("pyproject.toml"))["project"]

_BY_HAND = {"clean", "clips", "help", "schemas", "tools"}
"""Targets that have nothing to check."""

_PART_OF = {"quick": "test"}
"""Targets that do a part of what another does."""


def _text(name: str) -> str:
    return (_FOLDER / name).read_text(encoding="utf-8")


def _jobs(name: str) -> dict[str, Any]:
    jobs = yaml.safe_load(_text(name))["jobs"]
    assert isinstance(jobs, dict)
    return jobs


def _commands() -> str:
    """Everything that workflows run, `.ci/run` included."""
    runs = [
        step["run"]
        for name in _WORKFLOWS
        for job in _jobs(name).values()
        for step in job["steps"]
        if "run" in step
    ]
    return "\n".join([*runs, text_of(".ci/run")])


def _rules() -> dict[str, str]:
    """By target of the Makefile, its prerequisites and recipe."""
    return dict(re.findall(r"^(\w[\w-]*):(?!=)(.*\n(?:\t.*\n)*)", _MAKEFILE, re.MULTILINE))


def _called() -> set[str]:
    return set(re.findall(r"^make (?:\w+=\S+ )*([a-z][a-z-]*)", _commands(), re.MULTILINE))


def _reached() -> dict[str, str]:
    """Rules that workflows run, also by way of other rules."""
    rules, todo = _rules(), list(_called())
    reached: dict[str, str] = {}
    while todo:
        target = todo.pop()
        if target in rules and target not in reached:
            reached[target] = rules[target]
            needed = rules[target].partition("\n")[0].partition("##")[0].split()
            made = [word for line in re.findall(r"\$\(MAKE\)(.*)", rules[target]) for word in line.split()]
            todo += [*needed, *made]
    return reached


@pytest.mark.parametrize("name", _WORKFLOWS)
def test_a_workflow_may_only_read_and_every_job_ends(name: str) -> None:
    assert yaml.safe_load(_text(name))["permissions"] == {"contents": "read"}
    for job in _jobs(name).values():
        assert job["timeout-minutes"] <= 350


@pytest.mark.parametrize("path", [*(f".github/workflows/{name}" for name in _WORKFLOWS), "action.yml"])
def test_actions_are_pinned_by_commit_with_their_version_in_a_comment(path: str) -> None:
    used = re.findall(r"^\s*(?:- )?uses: (.*)$", text_of(path), re.MULTILINE)
    assert used
    for one in used:
        assert re.fullmatch(r"[\w-]+/[\w/-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", one), one


def test_one_action_has_one_commit() -> None:
    texts = [*map(_text, _WORKFLOWS), text_of("action.yml"), text_of("docs/ci.md")]
    pins = set(re.findall(r"uses: ([\w-]+/[\w-]+)\S*@([0-9a-f]{40})", "\n".join(texts)))
    assert len(pins) == len({action for action, _ in pins})


def test_workflows_make_what_the_makefile_has() -> None:
    assert _called() - _rules().keys() == set()


def test_workflows_make_every_target() -> None:
    listed = set(re.findall(r"^([a-z]+):.* ## ", _MAKEFILE, re.MULTILINE))
    assert (
        listed
        - _reached().keys()
        - _BY_HAND
        - {part for part, all_ in _PART_OF.items() if all_ in _reached()}
        == set()
    )


def test_long_checks_run_nightly_and_newest_versions_weekly() -> None:
    for name, day in (("nightly.yml", "*"), ("weekly.yml", "1")):
        # YAML reads the key `on` as true.
        (schedule,) = yaml.safe_load(_text(name))[True]["schedule"]
        assert schedule["cron"].split()[-1] == day
    assert "make lock\n" in _commands()


def test_every_hypothesis_profile_is_run() -> None:
    chosen = set(re.findall(r"AEROS_HYPOTHESIS=(\w+)", "".join(_reached().values())))
    assert PROFILES.keys() == chosen | {"ci"}


@pytest.mark.parametrize("variable", ["AEROS_KILLS", "AEROS_NETWORK"])
def test_tests_that_ask_for_a_variable_are_run_with_it(variable: str) -> None:
    assert variable in "".join(_reached().values()) + "".join(map(_text, _WORKFLOWS))


def test_jobs_that_run_tests_expect_every_isolation_layer_that_their_machines_have() -> None:
    """A runner that loses a layer, or a test that no longer asks for one, makes the job fail."""
    tested = {"make test", "make pytest", "make deep", ".ci/run"}
    for name in _WORKFLOWS:
        for job in _jobs(name).values():
            runs = [step.get("run", "") for step in job["steps"]]
            if not any(run.startswith(tuple(tested)) for run in runs):
                continue
            # An ordinary user of GitHub's machines may make no control groups.
            assert job["env"][VARIABLE].split(",") == [layer for layer in LAYERS if layer != "cgroups"]
            assert runs.index(_BUBBLEWRAP) < min(
                runs.index(run) for run in runs if run.startswith(tuple(tested))
            )


_BUBBLEWRAP = """sudo apt-get install --yes bubblewrap
sudo sysctl -w kernel.apparmor_restrict_unprivileged_userns=0
"""


def test_every_benchmark_is_run() -> None:
    has_main = {
        path.stem
        for path in (ROOT / "benchmarks").glob("*.py")
        if "__main__" in path.read_text(encoding="utf-8")
    }
    matrix = _jobs("nightly.yml")["benchmarks"]["strategy"]["matrix"]["benchmark"]
    assert set(matrix) == has_main


def test_every_extra_is_installed_by_what_is_run() -> None:
    extras: dict[str, list[str]] = _PROJECT["optional-dependencies"]
    recipes = "".join(_reached().values()) + _MAKEFILE.partition("$(VENV)/.installed")[2]
    todo = set(re.findall(r"'\.\[([\w-]+)\]'", recipes)) | {"test"}
    installed: set[str] = set()
    while todo - installed:
        extra = (todo - installed).pop()
        installed.add(extra)
        for requirement in extras[extra]:
            if within := re.match(r"aeros-robot\[([\w,]+)\]", requirement):
                todo |= set(within[1].split(","))
    assert extras.keys() - installed == {"dev"}  # which is `test`
    assert extras["dev"] == ["aeros-robot[test]"]


def test_every_classified_python_is_tried() -> None:
    classified = {
        one.rpartition(" ")[2] for one in _PROJECT["classifiers"] if re.search(r"Python :: 3\.\d+$", one)
    }
    jobs = _jobs("ci.yml")
    assert classified == {"3.11", *jobs["python"]["strategy"]["matrix"]["version"]}
    assert 'python-version: "3.11"' in _text("ci.yml")


def test_hooks_of_this_repository_run_what_is_installed_here() -> None:
    (repository,) = yaml.safe_load(text_of(".pre-commit-config.yaml"))["repos"]
    assert repository["repo"] == "local"
    for hook in repository["hooks"]:
        assert hook["entry"].startswith(".venv/bin/")
        assert hook["language"] == "system"


def test_tests_that_coverage_runs_exist() -> None:
    paths = text_of("tests/coverage.txt").split()
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_code_that_coverage_measures_exists() -> None:
    (parts,) = re.findall(r"^COVERED := (.*)$", _MAKEFILE, re.MULTILINE)
    for part in parts.split():
        floor, _, patterns = part.partition(":")
        assert 0 < float(floor) <= 100
        for pattern in patterns.split(","):
            assert list(ROOT.glob(pattern)), pattern
