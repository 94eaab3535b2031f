"""A plant of another distribution is found by its entry point, opened for a run, and checked."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from argparse import ArgumentTypeError
from pathlib import Path

import pytest

import aeros
from aeros.cli.main import main
from aeros.cli.plant_argument import plant_name
from aeros.session.plant_provider import PlantProviderError, load_provider, provided_plants
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.runtime.registry.conftest import BASE

SOURCE = Path(__file__).parent / "borrowed_plant"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder into which the wheel of the distribution is installed, as `pip install` does."""
    folder = tmp_path_factory.mktemp("distribution")
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    source = shutil.copytree(SOURCE, folder / "source")
    build = [*pip, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(source)]
    subprocess.run(build, check=True, timeout=120)
    (wheel,) = folder.glob("*.whl")
    site = folder / "site"
    subprocess.run([*pip, "install", "--no-deps", "--target", str(site), str(wheel)], check=True, timeout=120)
    return site


@pytest.fixture
def distribution(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(installed))


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Options of a run of the module `tidy`, whose task ends as soon as the bench is clean."""
    monkeypatch.chdir(tmp_path)
    module = shutil.copytree(BASE / "tidy", tmp_path / "tidy")
    manifest = module / "ecm.yaml"
    text = manifest.read_text()
    rules = text[text.index("      - {unless: cloth_held") : text.index("    initial:")]
    text = text.replace(rules, "      - {unless: bench_clean, do: rest}\n")
    manifest.write_text(text.replace("rested: {}", "rested: {effects: {bench_clean: true}}"))
    site = shutil.copy(BASE / "site.yaml", tmp_path)
    return ["--site", str(site), "--ecms", str(module)]


@pytest.mark.usefixtures("distribution")
def test_a_run_uses_the_plant_of_another_distribution(
    bench: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", "tidy", "--site", "site.yaml"]) == 0
    capsys.readouterr()
    code = main(["run", "clean", "--plant", "borrowed", "--out", "out", *bench])
    shown = capsys.readouterr()
    assert (code, "measured   bench_clean = true (borrowed plant)" in shown.out) == (0, True), shown
    assert main(["run", "clean", "--plant", "broken", *bench]) == 1
    assert (
        "`broken` cannot be opened: ConnectionRefusedError: no robot answers for bench"
        in capsys.readouterr().err
    )


@pytest.mark.usefixtures("distribution")
def test_the_providers_are_listed_and_errors_say_what_to_do(capsys: pytest.CaptureFixture[str]) -> None:
    assert {"borrowed", "broken", "odd"} <= set(provided_plants())
    for name, reason in (
        ("odd", "`borrowed_plant:FACTOR` of borrowed-plant, is of type int, and not"),
        ("borowed", "no plant is called `borowed`: did you mean `borrowed`?"),
    ):
        with pytest.raises(PlantProviderError, match=reason):
            load_provider(name)
        with pytest.raises(ArgumentTypeError, match=reason):
            plant_name(name)
        with pytest.raises(SystemExit):
            main(["run", "clean", "--plant", name])
        assert reason in capsys.readouterr().err
    with (
        pytest.raises(MisuseError, match="no plant `borowed`; did you mean `borrowed`"),
        aeros.open_session("ecms", plant="borowed"),
    ):
        pass


@pytest.mark.usefixtures("distribution")
def test_two_distributions_with_one_name_are_refused(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    metadata = tmp_path / "other-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text("[aeros.plants]\nborrowed = other:PLANT\ngone = other:PLANT\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(PlantProviderError, match="several distributions provide a plant `borrowed`"):
        load_provider("borrowed")
    with pytest.raises(PlantProviderError, match="cannot be imported: ModuleNotFoundError: No module named"):
        load_provider("gone")


@pytest.mark.usefixtures("distribution")
def test_its_promises_are_checked_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--check", "the_clock_never_goes_back", "--check", "stop_ends_everything", "--format", "json"]
    code = main(["check-plant", "borrowed", *asked])
    report = json.loads(capsys.readouterr().out)
    assert [one["check"] for one in report["checks"]] == ["the_clock_never_goes_back", "stop_ends_everything"]
    assert code == int(any(one["failure"] for one in report["checks"]))
    assert main(["check-plant", "broken"]) == 2
    assert "the provider of `broken` states no `subject`" in capsys.readouterr().err
