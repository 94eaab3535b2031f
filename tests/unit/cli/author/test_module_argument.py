"""Arguments that name a module, and a task or composition in it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from aeros.cli.author.module_argument import read_module, select_declared
from aeros.exit_codes import UsageError
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.configured import ModuleConfiguration
from tests.repo.tree import ROOT
from tests.unit.agent.dumplings import DUMPLING, module

BASE = ROOT / "docs" / "codes" / "base"
CORPUS = ROOT / "tests" / "corpus"
SHARING = CORPUS / "accepted" / "reads_what_another_shares"
SITE = CORPUS / "site" / "table.yaml"
DECLARED = {"clean_up": 1, "serve": 2}


def test_a_module_is_read_under_the_site_that_is_given() -> None:
    ecm, site = read_module(BASE / "tidy", (), BASE / "site.yaml", {})
    assert (ecm.id, site.id) == ("tidy", "bench")


def test_without_a_site_it_is_the_reference_site() -> None:
    ecm, site = read_module(ROOT / "ecms" / "clean_table", (), None, {})
    assert (ecm.id, site.id) == ("clean_table", "panda_cell")


def test_a_folder_of_several_modules_names_none() -> None:
    with pytest.raises(UsageError, match=r"ecms` holds several modules; name one"):
        read_module(ROOT / "ecms", (), None, {})


def test_required_modules_are_found_in_the_folders_that_are_given(tmp_path: Path) -> None:
    alone = shutil.copytree(SHARING / "reader", tmp_path / "reader")
    without, _ = read_module(alone, (), SITE, {})
    found, site = read_module(alone, (SHARING / "gauge",), SITE, {})
    assert (list(without.foreign.owners), list(found.foreign.owners)) == ([], ["gauge"])
    assert "gauge.dial_green" in site.state


def test_a_folder_without_required_modules_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="AE130"):
        read_module(BASE / "tidy", (tmp_path,), BASE / "site.yaml", {})


def test_a_folder_without_a_module_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="AE130"):
        read_module(tmp_path, (), BASE / "site.yaml", {})


def test_a_site_that_cannot_be_read_is_refused_before_the_module(tmp_path: Path) -> None:
    (tmp_path / "site.yaml").write_text("id: x\n")
    with pytest.raises(UserError) as refused:
        read_module(tmp_path / "nowhere", (), tmp_path / "site.yaml", {})
    assert {problem.code for problem in refused.value.diagnostics} == {"AE102"}


def test_settings_of_another_module_are_refused() -> None:
    settings = {"tidi": ModuleConfiguration({"surface": "bench"})}
    with pytest.raises(UserError) as refused:
        read_module(BASE / "tidy", (), BASE / "site.yaml", settings)
    (problem,) = refused.value.diagnostics
    assert (problem.code, problem.help) == ("AE886", ("did you mean `tidy`?",))


@pytest.mark.parametrize(("name", "found"), [(None, 1), ("clean_up", 1), ("serve", 2)])
def test_the_one_named_is_selected_or_else_the_first(name: str | None, found: int) -> None:
    assert select_declared(DUMPLING, "task", DECLARED, name) == found


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("clean", "`dumpling` has no task `clean`; did you mean `clean_up`?"),
        ("zzz", "`dumpling` has no task `zzz`; it has clean_up, serve"),
        ("\x1b[2J", "`dumpling` has no task `\\x1b[2J`; it has clean_up, serve"),
    ],
)
def test_an_undeclared_name_is_reported_with_the_declared_names(name: str, message: str) -> None:
    with pytest.raises(UsageError) as refused:
        select_declared(DUMPLING, "task", DECLARED, name)
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("name", "message"), [(None, "`m` has no task"), ("x", "`m` has no task `x`; it has none")]
)
def test_a_module_that_declares_none_says_so(name: str | None, message: str) -> None:
    with pytest.raises(UsageError) as refused:
        select_declared(module("m", ()), "task", {}, name)
    assert str(refused.value) == message
