"""The limits of contact: speed against force, stiffness and mass, and their faults."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as some

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.render import render_text
from aeros.spec.elaborate.contact import transient_speed
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.motion import ContactLimits, DrivingContact, LateTicks
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path

BASE = "    base: {measured_by: base_speed, speed: driving_contact_speed, mass: driven_mass}\n"


def _loaded(tmp_path: Path, *edits: tuple[str, str]) -> tuple[Site | None, list[str]]:
    text = reference_site_path().read_text()
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = tmp_path / "site.yaml"
    path.write_text(text)
    sink = Diagnostics()
    return load_site(path, sink), [render_text(one).splitlines()[0] for one in sink]


def _positive(greatest: int) -> some.SearchStrategy[Fraction]:
    return some.fractions(min_value=Fraction(1, 100), max_value=greatest, max_denominator=1000)


@given(force=_positive(1000), stiffness=_positive(10**6), mass=_positive(1000))
def test_the_speed_is_the_greatest_that_the_force_permits(
    force: Fraction, stiffness: Fraction, mass: Fraction
) -> None:
    speed = transient_speed(force, stiffness, mass)
    assert speed**2 * mass * stiffness <= force**2
    assert (speed + Fraction(1, 10**6)) ** 2 * mass * stiffness > force**2


def test_the_reference_site_names_its_contact_and_late_ticks(tmp_path: Path) -> None:
    site, message = _loaded(tmp_path)
    assert message == []
    assert site is not None
    assert site.motion is not None
    assert site.motion.contact == ContactLimits(
        "human_distance",
        Fraction(12, 10),
        "link_speed",
        Fraction(318, 1000),
        DrivingContact("base_speed", Fraction(114, 1000)),
    )
    assert site.motion.late_ticks == LateTicks(Fraction(5, 1000), 3, Fraction(20, 1000))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("value: 318 mm/s", "value: 319 mm/s", "error[AE612] contact-too-fast: `contact_speed` is 319 mm/s"),
        ("75000, 50000, 60000", "75300, 50000, 60000", "error[AE612]"),
        ("value: 10.3 kg", "value: 10.4 kg", "error[AE612]"),
        ("value: 10.3 kg", "value: 0 kg", "error[AE112]"),
        ("    distance: human_distance\n", "    distance: human\n", "error[AE122]"),
        ("    distance: human_distance\n", "    distance: tool_speed\n", "error[AE203]"),
        ("value: 114 mm/s", "value: 115 mm/s", "error[AE612] contact-too-fast: `driving_contact_speed` is"),
        ("value: 80 kg", "value: 81 kg", "error[AE612] contact-too-fast: `driving_contact_speed` is"),
        ("value: 80 kg", "value: 0 kg", "error[AE112]"),
        (BASE, "", "error[AE612] contact-too-fast: nothing limits the speed"),
        (BASE, BASE.replace("base_speed", "base_position"), "error[AE203]"),
        (BASE, BASE.replace("mass: driven_mass", "mass: region_mass"), "error[AE203]"),
        ("    speed: contact_speed\n", "    speed: robot_mass\n", "error[AE204]"),
        ("    speed: contact_speed\n", "    speed: region_stiffness\n", "error[AE203]"),
        ("    mass: robot_mass\n", "    mass: region_mass\n", "error[AE203]"),
        ("    stiffness: region_stiffness\n", "    stiffness: region_mass\n", "error[AE204]"),
        ("    stiffness: region_stiffness\n", "    stiffness: robot_mass\n", "error[AE203]"),
        ("period: 5 ms, ", "period: 30 ms, ", "error[AE112]"),
        ("period: 5 ms, ", "period: 5 mm, ", "error[AE204]"),
        ("in_a_row: 3, ", "in_a_row: -1, ", "error[AE"),
    ],
)
def test_each_fault_is_reported(tmp_path: Path, old: str, new: str, message: str) -> None:
    site, found = _loaded(tmp_path, (old, new))
    assert site is None
    assert len(found) == 1, found
    assert found[0].startswith(message), found[0]
