"""Shipped scenes define the truth of what a goal can name, but for what only a camera can say."""

from __future__ import annotations

from typing import Final

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.scenes.load import load_scene
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT

SCENES: Final = {
    "clean_table": "table",
    "fetch_object": "fetch",
    "inspect_table": "inspection",
    "make_dumplings": "dumpling_bench",
}

ONLY_SEEN: Final = {
    "clean_table": {
        # of pictures: what they show or hide, and where the robot takes its camera to be
        "sponge_seen",
        "overhead_off",
        # of a hand: room around a thing, and what it can grip
        "clutter_free_across",
        "clutter_ungraspable",
        "sponge_overturned",
        "sponge_covered",
        "rest_taken",
        "rest_blocked",
    },
    "fetch_object": {
        "object_detected",
        "robot_at_target",  # where it was seen
        "object_out_of_reach",
        "object_fits",
        "delivery_taken",
    },
    "inspect_table": set(),
    "make_dumplings": {
        "bench_hidden",
        "filling_free_across",
        "fillings_suffice",  # of those that a hand can grip
        "wrappers_suffice",
        "place_covered",
    },
}
"""Public variables that are true or false by pictures, or by room for a hand, and by no pose alone."""


@pytest.mark.parametrize("module", SCENES)
def test_each_public_truth_value_is_refereed_but_what_only_a_picture_decides(module: str) -> None:
    diagnostics = Diagnostics()
    site = load_site(reference_site_path(), diagnostics)
    assert site is not None
    loaded = load_ecm(ROOT / "ecms" / module, site, diagnostics)
    assert loaded is not None
    public = {
        name.rpartition(".")[2]
        for name, one in loaded.ecm.state.items()
        if one.is_public and str(one.variable.type) == "bool"
    }
    path = ROOT / "ecms" / module / "scenes" / f"{SCENES[module]}.yaml"
    scene = load_scene(str(path), [ROOT / "ecms" / one for one in SCENES])
    refereed = {name.partition("(")[0].removeprefix(f"{module}.") for name in scene.truth}
    assert public - refereed == ONLY_SEEN[module]
