from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path

import pytest

from aeros.models.interface import ValueInterface
from aeros.models.onnx_session import OnnxSession
from aeros.spec.backends.network.bound_search import BoundSearch
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.site import Site
from aeros.spec.obligations import models
from aeros.spec.obligations.models import model_obligations
from aeros.spec.obligations.verdicts import StaticClaim, Verdict
from tests.reports_in_full import claim_lines, compare_with_file
from tests.unit.spec.backends.network.networks import TENT, content_of, random_layers

CORPUS = Path(__file__).parents[3] / "corpus"


@pytest.fixture(scope="module")
def site() -> Site:
    found = load_site(CORPUS / "site" / "table.yaml", Diagnostics())
    assert found is not None
    return found


@pytest.fixture
def module(tmp_path: Path) -> Path:
    return Path(shutil.copytree(CORPUS / "accepted" / "models_with_an_interface", tmp_path / "module"))


def claims(module: Path, site: Site, old: str = "", new: str = "") -> dict[str, StaticClaim]:
    """Claims about the module's models, with one text in its manifest changed."""
    manifest = module / "ecm.yaml"
    assert old in manifest.read_text()
    manifest.write_text(manifest.read_text().replace(old, new))
    found = Diagnostics()
    loaded = load_ecm(module, site, found)
    assert loaded is not None, [one.headline for one in found]
    return {str(claim.id): claim for claim in model_obligations(loaded.ecm)}


def problem(found: dict[str, StaticClaim], claim: str) -> Diagnostic:
    diagnostic = found[claim].diagnostic
    assert diagnostic is not None
    return diagnostic


def test_bounds_are_proved_by_a_named_engine_or_left_to_run_time(module: Path, site: Site) -> None:
    found = claims(module, site)
    assert {claim: one.verdict for claim, one in found.items()} == {
        "models/patience/interface": Verdict.PROVED,
        "models/patience/bound/short-while-clean": Verdict.PROVED,
        "models/tent/interface": Verdict.PROVED,
        "models/tent/bound/below-the-top": Verdict.PROVED,
        "models/tent/bound/at-the-top": Verdict.UNKNOWN,
    }
    assert found["models/tent/bound/below-the-top"].engine.endswith("bounds by intervals")
    assert found["models/tent/bound/at-the-top"].runtime_checked_rule == "at-the-top"
    assert all(one.diagnostic is None for one in found.values())


def test_a_violation_that_is_checked_at_each_call_is_no_error(module: Path, site: Site) -> None:
    found = claims(module, site, "then: {y: {upper: [1]}}", "then: {y: {upper: [0.7]}}")
    claim = found["models/tent/bound/at-the-top"]
    assert (claim.diagnostic, claim.runtime_checked_rule) == (None, "at-the-top")


def test_a_bound_that_boxes_leave_open_is_put_to_marabou(
    module: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(models, "marabou_version", lambda: "maraboupy 2.0.0")
    monkeypatch.setattr(models, "decide_with_marabou", lambda *_: BoundSearch(True, None, 2))
    claim = claims(module, site, "        runtime_checked: true\n", "")["models/tent/bound/at-the-top"]
    assert (claim.verdict, claim.engine) == (Verdict.PROVED, "maraboupy 2.0.0")


def test_a_network_with_an_unknown_operator_has_no_bound(module: Path, site: Site) -> None:
    content = content_of(TENT).replace(b"Relu", b"Selu")
    (module / "tent.onnx").write_bytes(content)
    found = problem(claims(module, site), "models/tent/bound/below-the-top")
    assert found.code == "AE509"
    assert "the operator `Selu`" in found.notes[0]


@pytest.mark.parametrize(
    ("ends", "verdict"),
    [
        ("{lower: [500], upper: [2000]}", Verdict.PROVED),
        ("{lower: [500.5], upper: [2000]}", Verdict.REFUTED),
        ("{lower: [500], upper: [1999.5]}", Verdict.REFUTED),
    ],
)
def test_a_table_whose_extremes_are_the_ends_of_a_bound_keeps_it(
    module: Path, site: Site, ends: str, verdict: Verdict
) -> None:
    table = module / "patience.csv"
    table.write_text(table.read_text().replace("duration [ms]", "duration"))
    manifest = (module / "ecm.yaml").read_text().replace("unit: ms, range: [0, 9000]", "range: [500, 8000]")
    (module / "ecm.yaml").write_text(manifest)
    found = claims(module, site, "{upper: [2001]}", ends)
    assert found["models/patience/bound/short-while-clean"].verdict is verdict


@pytest.mark.parametrize(("upper", "code"), [("1250.001", None), ("1250", "AE509"), ("1249.999", "AE511")])
def test_an_extreme_inside_of_a_cell_is_decided_unless_it_is_within_rounding_of_the_bound(
    module: Path, site: Site, upper: str, code: str | None
) -> None:
    table = module / "patience.csv"
    table.write_text(table.read_text().replace("duration [ms]", "duration"))
    manifest = (module / "ecm.yaml").read_text().replace("unit: ms, range: [0, 9000]", "range: [500, 8000]")
    (module / "ecm.yaml").write_text(manifest.replace("upper: [2001]", f"upper: [{upper}]"))
    claim = claims(module, site, "upper: [50]", "upper: [25]")["models/patience/bound/short-while-clean"]
    assert (claim.diagnostic and claim.diagnostic.code) == code


def test_a_number_that_is_rounded_beyond_a_bound_violates_it(module: Path, site: Site) -> None:
    """0.1 as a double is above a tenth, and 0.375 is exact."""
    manifest = (module / "ecm.yaml").read_text().replace("unit: ms, range: [0, 9000]", "range: [0, 1]")
    (module / "ecm.yaml").write_text(manifest)
    for number, old, code in (("0.1", "2001", "AE511"), ("0.375", "0.1", None)):
        (module / "patience.csv").write_text(f"dirt [%],duration\n0,0\n50,{number}\n100,1\n")
        found = claims(module, site, f"upper: [{old}]", f"upper: [{number}]")
        claim = found["models/patience/bound/short-while-clean"]
        assert (claim.diagnostic and claim.diagnostic.code) == code


CHANGES = {
    "another shape": ("AE142", "shape: [1]}\n    outputs", "shape: [2]}\n    outputs"),
    "another input": ("AE142", "      x: {range: [0, 2]", "      z: {range: [0, 2]"),
    "no network": ("AE142", "file: tent.onnx", "file: patience.csv"),
    "a narrower column": ("AE142", "range: [0, 9000]", "range: [0, 7000]"),
    "a bound of the table": ("AE511", "upper: [2001]", "upper: [1999]"),
    "a bound that units miss": ("AE511", "upper: [2001]", "upper: [2000]"),
    "a bound of the network": ("AE511", "upper: [1.1]", "upper: [0.5]"),
    "an open bound": ("AE509", "        runtime_checked: true\n", ""),
    "a needless check": ("AE505", "then: {y: {upper: [1]}}", "then: {y: {upper: [1.2]}}"),
}


SEVERAL = (
    ("unit: ms, range: [0, 9000]", "range: [0, 7000]"),
    ("x: {range: [0, 2], shape: [1]}", "x: {range: [0, 2], shape: [2]}"),
    ("y: {range: [-1, 2], shape: [1]}", "y: {range: [-1, 2], shape: [2]}"),
    ("then: {y: {lower: [-0.1], upper: [1.1]}}", "then: {y: {lower: [-1, -1], upper: [0, 1]}}"),
    ("given: {x: {lower: [0.5], upper: [1.5]}}", "given: {x: {lower: [0.5, 0.5]}}"),
    ("then: {y: {upper: [1]}}", "then: {y: {upper: [1, 1]}}"),
)


def test_the_reports_on_models_in_full(
    module: Path, site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(models, "marabou_version", lambda: None)
    lines = []
    for name, (code, old, new) in CHANGES.items():
        folder = Path(shutil.copytree(module, tmp_path / name))
        if name == "another input":
            manifest = (folder / "ecm.yaml").read_text()
            box = "given: {x: {lower: [0.5], upper: [1.5]}}"
            (folder / "ecm.yaml").write_text(manifest.replace(box, "given: {}"))
        lines += ["", f"# {name}"]
        found = claims(folder, site, old, new).values()
        assert {one.diagnostic.code for one in found if one.diagnostic is not None} == {code}
        lines += [line for one in found for line in claim_lines(one)]
    folder = Path(shutil.copytree(module, tmp_path / "whole numbers"))
    float32, int64 = b"\x08\x01\x12", b"\x08\x07\x12"  # the type of an input or output, and its shape
    (folder / "tent.onnx").write_bytes(content_of(TENT).replace(float32, int64))
    lines += ["", "# whole numbers"]
    lines += [line for one in claims(folder, site).values() for line in claim_lines(one)]
    given, hidden = b"Z\x13\n\x01x", b"j\x13\n\x01x"  # an input of the graph, and a mere value in it
    content = content_of(TENT)
    assert given in content
    (folder / "tent.onnx").write_bytes(content.replace(given, hidden))
    lines += ["", "# a network without inputs"]
    lines += [line for one in claims(folder, site).values() for line in claim_lines(one)]
    folder = Path(shutil.copytree(module, tmp_path / "several"))
    (folder / "tent.onnx").write_bytes(content_of(random_layers(1, (2, 6, 6, 2))))
    (folder / "patience.csv").write_text("dirt [%],duration\n0,500\n100,8000\n")
    manifest = (folder / "ecm.yaml").read_text()
    for old, new in SEVERAL:
        assert old in manifest
        manifest = manifest.replace(old, new)
    (folder / "ecm.yaml").write_text(manifest)
    lines += ["", "# several numbers, and a column without a unit"]
    lines += [line for one in claims(folder, site).values() for line in claim_lines(one)]
    monkeypatch.setattr(models, "marabou_version", lambda: "maraboupy 2.0.0")
    monkeypatch.setattr(models, "decide_with_marabou", lambda *_: BoundSearch(False, None, 2))
    folder = Path(shutil.copytree(module, tmp_path / "open"))
    lines += ["", "# a bound that Marabou leaves open, too"]
    _, *change = CHANGES["an open bound"]
    lines += [line for one in claims(folder, site, *change).values() for line in claim_lines(one)]
    (folder / "tent.onnx").write_bytes(content_of(TENT).replace(b"Relu", b"Selu"))
    lines += ["", "# an operator that is not understood"]
    lines += [line for one in claims(folder, site).values() for line in claim_lines(one)]
    missing = Path(shutil.copytree(module, tmp_path / "missing"))
    loaded = load_ecm(missing, site, Diagnostics())
    assert loaded is not None
    (missing / "tent.onnx").unlink()
    (missing / "patience.csv").write_text("dirt,duration")
    lines += ["", "# files that change after they were read"]
    lines += [line for one in model_obligations(loaded.ecm) for line in claim_lines(one)]
    compare_with_file(Path(__file__).with_name("data") / "model_reports.txt", "\n".join(lines[1:]) + "\n")


def test_a_file_that_changes_while_it_is_read_is_refused(
    module: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(models, "model_content", lambda *_: b"dirt,duration")
    assert problem(claims(module, site), "models/patience/interface").code == "AE131"


def test_a_bound_is_refused_exactly_where_some_input_violates_it(
    module: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    """AE511 with a violation, no diagnostic without one, and AE509 only within rounding of the extreme."""
    monkeypatch.setattr(models, "marabou_version", lambda: None)
    value = {"x": ValueInterface((1,), 1.0, "1", 0, 2)}, {"y": ValueInterface((1,), 1.0, "1", -9, 9)}
    codes: Counter[str | None] = Counter()
    for seed in range(24):
        layers = random_layers(seed, (1, 6, 6, 1))
        (module / "tent.onnx").write_bytes(content_of(layers))
        session = OnnxSession("tent.onnx", content_of(layers), *value)
        greatest = max(session.evaluate({"x": (at / 200,)})["y"][0] for at in range(401))
        upper = round(greatest + (-0.02, 0.02, 0.3)[seed % 3], 6)
        bound = f"then: {{y: {{upper: [{upper}]}}}}"
        text = (CORPUS / "accepted" / "models_with_an_interface" / "ecm.yaml").read_text()
        text = text.replace("then: {y: {lower: [-0.1], upper: [1.1]}}", bound).replace(
            "range: [-1, 2]", "range: [-9, 9]"
        )
        (module / "ecm.yaml").write_text(text)
        diagnostic = claims(module, site)["models/tent/bound/below-the-top"].diagnostic
        code = None if diagnostic is None else diagnostic.code
        codes[code] += 1
        assert code == ("AE511" if upper < greatest else None), (seed, upper, greatest)
    assert codes["AE511"] == 8
    assert codes[None] == 16
