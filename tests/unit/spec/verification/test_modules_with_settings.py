"""Settings of a module that is not there are found, by a site file and by the operator."""

from __future__ import annotations

import shutil
from contextlib import closing
from pathlib import Path

import pytest

from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.diagnostics.codes import Diagnostic, Severity
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.operator_settings import NO_SETTINGS, OperatorSettings
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.discovery import Surroundings
from aeros.spec.verification.modules_with_settings import absent_module_problems, other_modules
from aeros.spec.verification.verify import Detail, verify
from tests.repo.tree import ROOT

BASE = ROOT / "docs" / "codes" / "base"
SETTINGS = ModuleConfiguration({}, {"most": "12 N"})
PARAMETER = "parameters:\n  most: {type: real, unit: N, range: [0, 20], default: 10 N}\n"


def module(folder: Path, name: str, edit: tuple[str, str] = ("", "")) -> Path:
    """A module that has a parameter, of this name."""
    made = Path(shutil.copytree(BASE / "tidy", folder / name))
    text = (made / "ecm.yaml").read_text("utf-8").replace("id: tidy\n", f"id: {name}\n")
    text = text.replace("capabilities:", f"{PARAMETER}capabilities:", 1).replace(*edit)
    words = ", ".join(f"{name}-{word}" for word in ("clean", "wipe"))
    text = text.replace("[clean, wipe]", f"[{words}]").replace("tidying:", f"{name}ing:")
    (made / "ecm.yaml").write_text(text, "utf-8")
    return made


def site(folder: Path, *names: str) -> Path:
    """The site with settings for these modules."""
    path = folder / "site.yaml"
    text = (BASE / "site.yaml").read_text("utf-8")
    lines = [f"  {name}: {{set: {{most: 12 N}}}}\n" for name in names]
    path.write_text(text + "".join(["modules:\n", *lines]), "utf-8")
    return path


def problems(
    paths: list[Path], site_file: Path, settings: OperatorSettings = NO_SETTINGS
) -> list[Diagnostic]:
    report = verify(paths, site_file, settings=settings)
    return [one for part in report.subjects for one in part.diagnostics if one.code == "AE886"]


def given(*names: str) -> OperatorSettings:
    return OperatorSettings(configurations=dict.fromkeys(names, SETTINGS))


def test_a_site_files_settings_of_an_absent_module_are_a_warning_at_their_place(tmp_path: Path) -> None:
    modules = [module(tmp_path / "modules", name) for name in ("polish", "serve")]
    (found,) = problems(modules, site(tmp_path, "polish", "sreve"))
    assert found.severity is Severity.WARNING
    assert (
        found.headline
        == "the site has settings for `sreve`, which is not in this set, so they have no effect"
    )
    assert found.help == ("did you mean `serve`?",)
    assert found.primary is not None
    assert found.primary.span.text == "sreve"
    assert found.primary.span.source.path == str(tmp_path / "site.yaml")


def test_the_warning_stays_when_the_proofs_are_cached(tmp_path: Path) -> None:
    polish, path = module(tmp_path / "modules", "polish"), site(tmp_path, "polsh")
    with closing(AnswerStore(tmp_path / "answers")) as store:
        for _ in range(2):
            report = verify([polish], path, store=store, detail=Detail.BRIEF)
            assert report.conclusion is Conclusion.PROVED
            assert report.configuration is not None
            (found,) = report.configuration.diagnostics
            assert found.help == ("did you mean `polish`?",)


def test_of_one_module_alone_the_settings_of_modules_next_to_it_are_left_alone(tmp_path: Path) -> None:
    polish = module(tmp_path / "modules", "polish")
    module(tmp_path / "modules", "serve")
    path = site(tmp_path, "polish", "serve", "knead")
    assert [one.help for one in problems([polish], path)] == [("the modules are `polish`, `serve`",)]
    assert problems([], path) == []


def test_settings_of_a_module_that_is_refused_are_not_reported_as_well(tmp_path: Path) -> None:
    refused = module(tmp_path / "modules", "polish", ("risk: low", "risk: none"))
    broken = module(tmp_path / "modules", "serve", ("schema:", "schema"))
    assert problems([refused, broken], site(tmp_path, "polish", "serve"), given("polish", "serve")) == []


def test_settings_of_the_operator_for_an_absent_module_are_an_error(tmp_path: Path) -> None:
    polish = module(tmp_path / "modules", "polish")
    report = verify([polish], BASE / "site.yaml", settings=given("polsh"))
    assert report.conclusion is Conclusion.REJECTED
    assert report.configuration is not None
    (found,) = report.configuration.diagnostics
    assert (found.code, found.severity, found.primary) == ("AE886", Severity.ERROR, None)
    assert found.headline == "settings are given for `polsh`, and there is no such module"
    assert found.help == ("did you mean `polish`?",)
    assert verify([polish], BASE / "site.yaml", settings=given("polish")).conclusion is Conclusion.PROVED


def test_commands_that_prove_nothing_find_the_same(tmp_path: Path) -> None:
    polish = module(tmp_path / "modules", "polish")
    module(tmp_path / "modules", "serve")
    assert absent_module_problems(["polish", "serve"], [polish]) == []
    assert absent_module_problems([], [polish]) == []
    assert absent_module_problems(["polsh"], []) == []
    (found,) = absent_module_problems(["polsh"], [polish])
    assert found.help == ("did you mean `polish`?",)


def test_among_given_modules_none_is_next_to_them(tmp_path: Path) -> None:
    folders = [module(tmp_path / "modules", name) for name in ("polish", "serve")]
    alone = Surroundings((folders[0],))
    assert other_modules(["serve"], [], folders[:1], alone) == frozenset()
    assert other_modules(["serve"], [], folders[:1]) == {"serve"}
    assert other_modules([], folders[:1], folders) == {"polish"}


@pytest.mark.parametrize("name", ["serving", "erve"])
def test_a_name_that_is_part_of_another_is_absent(name: str, tmp_path: Path) -> None:
    polish = module(tmp_path / "modules", "polish")
    module(tmp_path / "modules", "serve")
    assert len(problems([polish], site(tmp_path, name))) == 1
