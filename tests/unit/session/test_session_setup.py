from __future__ import annotations

from pathlib import Path

import pytest

from aeros.runtime.execution.governor import OperatorCommand
from aeros.session.plant_factory import PlantSetupError
from aeros.session.rendered_errors import rendered_errors
from aeros.session.setup import build_signing, create_output_folder, open_governor, select_task
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UndecidedError, UserError
from tests.repo.tree import ROOT


def test_an_output_folder_is_new_or_empty(tmp_path: Path) -> None:
    assert create_output_folder(tmp_path / "a" / "b", "tidy") == tmp_path / "a" / "b"
    with pytest.raises(PlantSetupError, match="is not empty; give a new folder with --out"):
        create_output_folder(tmp_path / "a", "tidy")
    (tmp_path / "file").touch()
    with pytest.raises(PlantSetupError, match="cannot write to"):
        create_output_folder(tmp_path / "file", "tidy")


def test_without_a_name_the_folder_is_named_for_the_task(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    first, second = (create_output_folder(None, "tidy") for _ in range(2))
    assert first != second
    assert first.parent == Path("runs")
    assert first.name.startswith("tidy-")


def test_the_governor_of_named_modules_obeys_the_operator(tmp_path: Path) -> None:
    governor, configuration, proof = open_governor(tmp_path, ROOT / "ecms" / "clean_table", None)
    with governor:
        assert list(configuration.modules) == ["clean_table"]
        assert [one.name for one in proof.modules] == ["clean_table"]
        assert governor.command is OperatorCommand.RUN
        assert str(select_task("please clean the table", configuration, governor, tmp_path)) == (
            "clean_table.clean_table"
        )


def test_without_a_key_nothing_is_signed() -> None:
    assert build_signing(None, None) is None


def test_a_user_error_gets_its_full_text_and_stays_what_it_is() -> None:
    fault = Diagnostic("AE130", "`x` is no module", help=("give a folder",))
    with pytest.raises(UndecidedError) as raised, rendered_errors():
        raise UndecidedError([fault])
    assert str(raised.value) == "error[AE130] no-module: `x` is no module\nhelp: give a folder\n"
    assert raised.value.diagnostics == (fault,)
    with pytest.raises(UserError) as empty, rendered_errors():
        raise UserError([])
    assert str(empty.value) == ""
