"""A faults file is read whole, or refused with every problem at its place."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.sim.faults.faults_file import FaultContext, faults_in, parse_faults, read_faults, shipped_faults
from aeros.sim.faults.model import CameraOpportunity, PersonEntersFault, SkillOpportunity, TimedOpportunity
from aeros.spec.declared.faults import (
    BoxFault,
    CarryFault,
    CommandDelayFault,
    CoveredScannerFault,
    GripForceFault,
    ImpulseFault,
    MisplacedPictureFault,
    MissedPictureFault,
    PadFrictionFault,
    SensorFault,
    SilentScannerFault,
    TorqueFault,
)
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import load_site
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import FOLDERS, shipped_scene

SITE = load_site(reference_site_path(), Diagnostics())
assert SITE is not None
AROUND = FaultContext(SITE.state, ("make_dumplings.wrap",), ("wrapper",), ("mast",), ("fence_west",))

KINDS = """\
schema: aeros/faults/1
faults:
  bumped:
    at: {skill: make_dumplings.wrap, once: holding, after: 500 ms}
    rate: 0.3
    bump: {thing: wrapper, impulse: 0.05 N*s, direction: [0, 2, 0]}
  slippery: {at: {every: 1 s}, rate: 1, at_most: 3, slip: {friction: 0.1, lasts: 500 ms}}
  loose: {at: {every: 1 s}, rate: 1, loosen: {force: 0 N, lasts: 1 s}}
  weak: {at: {every: 1 s}, rate: 1, weaken: {torque: 0.2, lasts: 1 s}}
  late: {at: {every: 1 s}, rate: 1, delay: {by: 100 ms, lasts: 1 s}}
  misread: {at: {every: 1 s}, rate: 1, misread: {of: tool_position, noise: 5 mm, dropout: 0.1, lasts: 1 s}}
  dirty: {at: {every: 1 s}, rate: 1, cover: {scanner: fence_west, share: 0.25, lasts: 1 s}}
  covered: {at: {every: 1 s}, rate: 1, cover: {scanner: fence_west, lasts: 1 s}}
  silent: {at: {every: 1 s}, rate: 1, silence: {scanner: fence_west, lasts: 500 ms}}
  visited: {at: {every: 1 s}, rate: 1, enter: {path: [{at: [2 m, 0 m]}, {at: [1 m, 0 m], speed: 1 m/s}]}}
  missed: {at: {look: mast}, rate: 0.2, bursts: {mean_length: 4}, miss: {}}
  wrong: {at: {look: mast}, rate: 0.2, misplace: {by: 60 mm}}
  hidden: {at: {look: mast, during: make_dumplings.wrap}, rate: 0.2, miss: {}}
"""


def read(text: str) -> list[tuple[str, str]]:
    """Codes and headlines of what is wrong with a file."""
    with pytest.raises(UserError) as refused:
        parse_faults(Source("faults.yaml", text), AROUND)
    assert all(one.primary is not None for one in refused.value.diagnostics)
    return [(one.code, one.headline) for one in refused.value.diagnostics]


def one(at: str = "{every: 1 s}", rate: str = "0.5", rest: str = "slip: {friction: 0, lasts: 1 s}") -> str:
    return f"schema: aeros/faults/1\nfaults:\n  it:\n    at: {at}\n    rate: {rate}\n    {rest}\n"


def test_every_kind_is_read_into_si_and_ticks() -> None:
    found = {fault.name: fault for fault in parse_faults(Source("faults.yaml", KINDS), AROUND)}
    assert found["bumped"].opportunity == SkillOpportunity("make_dumplings.wrap", 120, from_first_grip=True)
    assert found["bumped"].kind == ImpulseFault("wrapper", 0.05, 12, (0.0, 1.0, 0.0))
    assert found["bumped"].process.rate == pytest.approx(0.3)
    assert found["slippery"].opportunity == TimedOpportunity(240)
    assert found["hidden"].opportunity == CameraOpportunity("mast", "make_dumplings.wrap")
    assert found["slippery"].max_count == 3
    assert found["slippery"].kind == PadFrictionFault(0.1, 120)
    assert found["loose"].kind == GripForceFault(0.0, 240)
    assert found["weak"].kind == TorqueFault(0.2, 240)
    assert found["late"].kind == CommandDelayFault(24, 240)
    assert found["misread"].kind == SensorFault("tool_position", 240, noise=0.005, dropout=0.1)
    assert found["dirty"].kind == CoveredScannerFault("fence_west", 240, 0.25)
    assert found["covered"].kind == CoveredScannerFault("fence_west", 240)
    assert found["silent"].kind == SilentScannerFault("fence_west", 120)
    assert isinstance(found["visited"].kind, PersonEntersFault)
    assert found["missed"].opportunity == CameraOpportunity("mast")
    assert found["missed"].kind == MissedPictureFault()
    assert found["missed"].process.bad_to_good == pytest.approx(0.25)
    assert found["missed"].process.rate == pytest.approx(0.2)
    assert found["wrong"].kind == MisplacedPictureFault(0.06, None)


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        (one(rest="teleport: {}"), "AE101", "unknown field `teleport` in `it`"),
        (one(rest="description: nothing"), "AE208", "`it` needs exactly one of `bump`"),
        (one(rest="slip: {friction: 0, lasts: 1 s}\n    miss: {}"), "AE208", "it has `slip` and `miss`"),
        (one(rate="1.5"), "AE111", "`1.5` is outside its bounds"),
        (one(rate="often"), "AE108", "expected a number"),
        (one(at="{}"), "AE208", "`at` needs exactly one of `skill`, `look`, `every`; it has none"),
        (one(at="{every: 1 s, look: mast}"), "AE208", "it has `look` and `every`"),
        (one(at="{every: 1 s, once: holding}"), "AE208", "`once` and `after` are only valid with `skill`"),
        (one(at="{every: 1 s, during: make_dumplings.wrap}"), "AE208", "`during` is only valid with `look`"),
        (one(at="{look: mast, during: it}", rest="miss: {}"), "AE122", "`it` is not a skill"),
        (one(at="{every: 1 ms}"), "AE111", "`1 ms` is shorter than a control tick"),
        (one(at="{every: 1 m}"), "AE204", "expected a value in s, found m"),
        (one(at="{skill: make_dumplings.warp}"), "AE122", "`make_dumplings.warp` is not a skill"),
        (one(at="{look: roof}", rest="miss: {}"), "AE122", "`roof` is not a camera of the scene"),
        (one(at="{look: mast}"), "AE208", "`slip` is only valid with `skill` or `every`"),
        (one(rest="miss: {}"), "AE208", "`miss` is only valid with `look`"),
        (one(rest="bump: {thing: table, impulse: 1 N*s}"), "AE122", "`table` is not a scene object"),
        (one(rest="bump: {thing: wrapper, impulse: 1 N}"), "AE204", "found N"),
        (one(rest="bump: {thing: wrapper, impulse: -1 N*s}"), "AE111", "`-1 N*s` is outside its bounds"),
        (
            one(rest="bump: {thing: wrapper, impulse: 1 N*s, direction: [0, 0, 0]}"),
            "AE208",
            "the direction vector is zero",
        ),
        (one(rest="weaken: {torque: 0.2, lasts: 2 h}"), "AE111", "`2 h` is outside its bounds"),
        (one(rest="silence: {scanner: roof, lasts: 1 s}"), "AE122", "`roof` is not a safety laser scanner"),
        (one(rest="cover: {scanner: roof, lasts: 1 s}"), "AE122", "`roof` is not a safety laser scanner"),
        (one(rest="misread: {of: torch, lasts: 1 s, dropout: 1}"), "AE122", "`torch` is not a quantity"),
        (one(rest="misread: {of: holding, lasts: 1 s, noise: 1 mm}"), "AE208", "cannot have noise"),
        (one(rest="misread: {of: holding, lasts: 1 s}"), "AE208", "needs `noise`, `latency` or `dropout`"),
        (
            one(rest="enter: {path: [{at: [0 m, 0 m], speed: 1 m/s}]}"),
            "AE208",
            "it has neither `speed` nor `arrive`",
        ),
        (
            one(rest="bursts: {mean_length: 1}\n    slip: {friction: 0, lasts: 1 s}", rate="0.7"),
            "AE208",
            "bursts of 1 are too short for this rate",
        ),
        (
            one(rest="bursts: {mean_length: 3, within: 0.4}\n    slip: {friction: 0, lasts: 1 s}"),
            "AE208",
            "rate 0.5 is impossible with in-burst rate 0.4 and base rate 0",
        ),
        ("schema: aeros/faults/1\nfaults: {}\n", "AE112", "0 entries are not allowed here"),
        ("schema: aeros/faults/2\nfaults: {}\n", "AE114", "`aeros/faults/2` was written by a newer AEROS"),
        (one() + "  it: {}\n", "AE001", "the key `it` is written twice"),
    ],
)
def test_an_invalid_declaration_is_reported_at_its_place(text: str, code: str, message: str) -> None:
    problems = read(text)
    assert any(found == code and message in headline for found, headline in problems), problems


def test_all_problems_of_a_file_are_reported_together() -> None:
    text = one(at="{look: roof}", rest="bump: {thing: table, impulse: 1 N}")
    assert [code for code, _ in read(text)] == ["AE122", "AE122", "AE204"]


FILES = {name: path for folder in FOLDERS for name, path in faults_in(folder).items()}


@pytest.mark.parametrize("name", [*shipped_faults(), *FILES])
def test_a_shipped_file_fits_one_of_the_scenes(name: str) -> None:
    fitting = []
    for scene in ("dumpling_bench", "table", "fetch"):
        built = shipped_scene(scene)
        skills = (
            *(f"make_dumplings.{skill}" for skill in ("prepare", "wrap", "boil")),
            *(f"clean_table.{skill}" for skill in ("wipe", "organize")),
            *(f"fetch_object.{skill}" for skill in ("navigate", "grasp", "deliver")),
        )
        assert SITE is not None
        assert SITE.area_scanners is not None
        try:
            scanners = [one.name for one in SITE.area_scanners.scanners]
            around = FaultContext(SITE.state, skills, built.movable, built.cameras, scanners, FILES)
            assert read_faults(name, around)
        except UserError:
            continue
        fitting.append(scene)
    assert fitting


def test_a_misspelt_shipped_name_is_suggested() -> None:
    with pytest.raises(UserError) as refused:
        read_faults("wraper_bumped", replace(AROUND, files=FILES))
    (problem,) = refused.value.diagnostics
    assert problem.code == "AE002"
    assert problem.help == ("did you mean `wrapper_bumped`?",)


CARRIED = "carry: {thing: wrapper, to: [40 cm, -0.1 m, 2 cm], of: table, turn: 90 deg, over: 1 s}"


def test_a_carried_thing_has_a_place_which_may_count_from_a_body() -> None:
    known = replace(AROUND, bodies=("table", "wrapper"))
    (fault,) = parse_faults(Source("faults.yaml", one(rest=CARRIED)), known)
    assert isinstance(fault.kind, CarryFault)
    assert (fault.kind.to, fault.kind.of, fault.kind.over) == ((0.4, -0.1, 0.02), "table", 240)
    assert fault.kind.turn == pytest.approx(1.5708, abs=1e-4)
    assert [
        code for code, _ in read(one(rest=CARRIED.replace("of: table, ", "").replace("40 cm", "40 kg")))
    ] == ["AE204"]
    assert [code for code, _ in read(one(rest=CARRIED))] == ["AE122"]


PUT = "put: {box: [8 cm, 6 cm, 25 cm], to: [40 cm, -0.1 m, 2 cm], mass: 5 kg}"


def test_a_box_that_is_put_down_has_edges_a_place_and_a_mass() -> None:
    (fault,) = parse_faults(Source("faults.yaml", one(rest=PUT)), AROUND)
    assert fault.kind == BoxFault((0.08, 0.06, 0.25), (0.4, -0.1, 0.02), mass=5.0)


def test_the_least_and_the_greatest_edge_of_a_box_may_be_written() -> None:
    (fault,) = parse_faults(Source("faults.yaml", one(rest=PUT.replace("8 cm, 6 cm", "10 mm, 2 m"))), AROUND)
    assert isinstance(fault.kind, BoxFault)
    assert fault.kind.box[:2] == (0.01, 2.0)


@pytest.mark.parametrize(
    ("part", "other", "code"),
    [
        ("8 cm", "8 mm", "AE111"),
        ("25 cm", "-25 cm", "AE111"),
        ("5 kg", "5 m", "AE204"),
        ("5 kg", "51 kg", "AE111"),
    ],
)
def test_a_box_that_nobody_could_put_down_is_refused(part: str, other: str, code: str) -> None:
    assert [found for found, _ in read(one(rest=PUT.replace(part, other)))] == [code]
