"""Obstacles of a site, and the space of measured objects: what they become, and how they may be at fault."""

from __future__ import annotations

import shutil
from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.render import render_text
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT


def _loaded(tmp_path: Path, *edits: tuple[str, str]) -> tuple[Site | None, list[str]]:
    text = reference_site_path().read_text()
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = tmp_path / "site.yaml"
    path.write_text(text)
    sink = Diagnostics()
    return load_site(path, sink), [render_text(one).splitlines()[0] for one in sink]


def test_obstacles_are_looked_for_in_volumes_with_a_surface(tmp_path: Path) -> None:
    site, message = _loaded(tmp_path)
    assert message == []
    assert site is not None
    assert site.motion is not None
    policy = site.motion.obstacles
    assert policy is not None
    assert [one.name for one in policy.volumes] == ["over_bench", "over_table", "stands", "aisle_floor"]
    stands, aisle = policy.volumes[2:]
    assert (stands.surface, stands.least_height) == (Fraction(-3, 10), Fraction(7, 100))
    assert stands.box == site.volumes["stands"]
    assert (stands.greatest_height, aisle.greatest_height) == (None, Fraction(24, 100))
    assert policy.base == site.volumes["carriage"]
    assert (policy.margin, policy.explained_within) == (Fraction(15, 1000), Fraction(30, 1000))
    assert policy.largest_explained == (Fraction(2, 5), Fraction(3, 5), Fraction(1, 2))


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (
            ("over_table: {surface: 0 mm,", "over_shelf: {surface: 0 mm,"),
            "error[AE122] unknown-reference: `over_shelf` is not a volume",
        ),
        (
            (
                "stands: {surface: -300 mm, least_height: 70 mm}",
                "stands: {surface: -300 mm, least_height: 0 mm}",
            ),
            "error[AE208] malformed-declaration: `least_height` is above 0",
        ),
        (
            ("greatest_height: 240 mm", "greatest_height: 40 mm"),
            "error[AE208] malformed-declaration: `greatest_height` is above `least_height`",
        ),
        (
            ("    base: carriage\n", "    base: cart\n"),
            "error[AE122] unknown-reference: `cart` is not a volume",
        ),
        (("margin: 15 mm #", "margin: -1 mm #"), "error[AE208] malformed-declaration: `margin` is above 0"),
        (
            ("explained_within: 30 mm", "explained_within: 30 s"),
            "error[AE204] unit-mismatch: ",
        ),
        (
            ("largest_explained: [40 cm, 60 cm, 50 cm]", "largest_explained: [40 cm, 60 cm]"),
            "error[AE112] wrong-length: `largest_explained` has three lengths, along x, y and z",
        ),
    ],
)
def test_obstacles_with_a_fault_are_refused(edit: tuple[str, str], message: str, tmp_path: Path) -> None:
    site, found = _loaded(tmp_path, edit)
    assert site is None
    assert [one.startswith(message) for one in found] == [True], found


def test_a_space_is_no_larger_than_the_site_lets_a_module_explain(tmp_path: Path) -> None:
    reference = load_site(reference_site_path(), Diagnostics())
    assert reference is not None
    folder = Path(shutil.copytree(ROOT / "ecms" / "fetch_object", tmp_path / "fetch_object"))
    manifest = folder / "ecm.yaml"
    text = manifest.read_text()
    fits = "occupies: {lower: [-6 cm, -6 cm, -5 cm], upper: [6 cm, 6 cm, 5 cm]}"
    assert fits in text
    manifest.write_text(
        text.replace(fits, "occupies: {lower: [-6 cm, -6 cm, -50 cm], upper: [6 cm, 6 cm, 5 cm]}")
    )
    sink = Diagnostics()
    assert load_ecm(folder, reference, sink) is None
    (message,) = [one.headline for one in sink]
    assert (
        message == "`occupies` is 120 x 120 x 550 mm large; the site lets a module explain 400 x 600 x 500 mm"
    )
