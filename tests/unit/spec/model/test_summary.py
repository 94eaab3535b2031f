"""Summaries of modules and sites: what they hold, and the way to JSON and back."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import elaborate_source
from aeros.spec.model.configured import BoundNames, ModuleConfiguration
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.perception import PerceptionPolicy
from aeros.spec.model.policy import Access, OperatorOverride
from aeros.spec.model.summary import (
    BlockSummary,
    ComposedScenes,
    TaskPhrase,
    module_summary_from_json,
    site_summary_from_json,
    summarize_module,
    summarize_site,
    summary_to_json,
)
from aeros.spec.model.variables import members_of
from aeros.spec.text.site_layers import read_site
from tests.repo.tree import ROOT
from tests.unit.agent.dumplings import build, outcome, site, skill, state

FILE = Source("a.yaml", "0123456789abcdefghij")
TEA = build(
    Task,
    id="tea",
    trigger_phrases=("brew", "make"),
    object_phrases=("tea", "green tea"),
    word_spans=(FILE.span(1, 2), FILE.span(3, 5)),
    span=FILE.span(0, 6),
    scene="stove",
)
MODULE = build(
    Ecm,
    id="kitchen",
    version="1.2.0",
    manifest_digest="m" * 64,
    code_digest="c" * 64,
    model_digests={"tea.pt": "t" * 64},
    capabilities={"heating": ("boil",), "brewing": ("pour",)},
    skills={
        "boil": skill(
            "boil",
            outcome("hot", {"is_hot": True, "place": "pot"}),
            outcome("warm", {"is_hot": True, "level": Fraction(1, 2)}),
            outcome("spilled", {"is_hot": False}, failure=True),
            replace(outcome("gone", {}, failure=True), probability=Fraction(0)),
        ),
        "pour": skill("pour", outcome("poured", {"place": "cup"})),
    },
    tasks={"tea": TEA},
    required_modules={"pouring": ">=1"},
    requires_spans={"pouring": FILE.span(7, 9)},
    required_aeros_version=">=0.1",
    runtime_span=FILE.span(10, 12),
    span=FILE.span(0, 20),
    state={"kitchen.warm": state("kitchen.warm")},
)
SITE = replace(
    site(),
    id="home",
    digest="5" * 64,
    grants={"kitchen": Access(), "laundry": Access()},
    grant_spans={"kitchen": FILE.span(2, 4)},
    blocks=(
        OperatorOverride("one", "why", "kitchen", None, None, FILE.span(5, 6)),
        OperatorOverride("two", "why", None, None, "wait", FILE.span(6, 7)),
        OperatorOverride("three", "why", "kitchen", "boil", None),
    ),
    span=FILE.span(0, 19),
    perception=PerceptionPolicy({"kettle.hot": replace(state("kettle.hot"), span=FILE.span(8, 9))}),
    configurations={"kitchen": ModuleConfiguration({"pot": "pan"}), "cellar": ModuleConfiguration()},
    policy_spans={"modules/kitchen": FILE.span(11, 13)},
)


def test_a_module_is_summarized_for_others() -> None:
    summary = summarize_module(MODULE)
    assert (summary.id, summary.version, summary.runtime) == ("kitchen", "1.2.0", ">=0.1")
    assert summary.skills == {"boil", "pour"}
    assert summary.capabilities == ("heating", "brewing")
    assert summary.task_phrases == (
        TaskPhrase("tea", "brew", ("tea", "green tea"), FILE.span(1, 2)),
        TaskPhrase("tea", "make", ("tea", "green tea"), FILE.span(3, 5)),
    )
    assert summary.requires == {"pouring": ">=1"}
    assert summary.variables == {"warm": ()}
    assert summary.left_out == ("boil.gone",)
    assert summary.scenes == {"stove": FILE.span(0, 6)}


def test_a_task_that_composes_others_is_summarized_with_their_scenes() -> None:
    (one,) = MODULE.tasks.values()
    composing = replace(one, scene=None, composed={"laundry": one, "cellar": replace(one, scene=None)})
    names = BoundNames(cameras={"top": "mast"})
    summary = summarize_module(replace(MODULE, tasks={"tea": composing}, names=names))
    assert summary.composed_scenes == (ComposedScenes("tea", (("laundry", "stove"),), one.span),)
    assert summary.cameras == {"kitchen": {"top": "mast"}}
    data = json.loads(json.dumps(summary_to_json(summary)))
    assert module_summary_from_json(data, FILE) == summary


def test_effects_are_those_of_successes_of_any_skill() -> None:
    assert summarize_module(MODULE).effect_values == {
        "is_hot": {"True"},
        "place": {"pot", "cup"},
        "level": {"1/2"},
    }


@pytest.mark.parametrize("value", [0.5, None, ("a",)])
def test_an_effect_is_a_truth_a_number_or_a_word(value: Any) -> None:
    broken = replace(MODULE, skills={"boil": skill("boil", outcome("hot", {"is_hot": value}))})
    with pytest.raises(MisuseError, match="no effect has the value"):
        summarize_module(broken)


def test_a_site_is_summarized_by_its_grants_and_the_modules_it_blocks() -> None:
    summary = summarize_site(SITE)
    assert (summary.id, summary.digest) == ("home", "5" * 64)
    assert summary.grants == {"kitchen": FILE.span(2, 4), "laundry": SITE.span}
    assert summary.blocks == (
        BlockSummary("one", "kitchen", None, FILE.span(5, 6)),
        BlockSummary("three", "kitchen", "boil", SITE.span),
    )


def test_a_module_in_json_has_offsets_for_spans_and_sorted_sets() -> None:
    packed = summary_to_json(summarize_module(MODULE))
    assert packed["span"] == [0, 20]
    assert packed["skills"] == ["boil", "pour"]
    assert packed["task_phrases"] == [
        ["tea", "brew", ["tea", "green tea"], 1, 2],
        ["tea", "make", ["tea", "green tea"], 3, 5],
    ]
    assert packed["effect_values"]["place"] == ["cup", "pot"]
    assert packed["requires_spans"] == {"pouring": [7, 9]}


def test_a_site_in_json_has_offsets_for_spans() -> None:
    assert summary_to_json(summarize_site(SITE)) == {
        "variables": {name: list(one) for name, one in members_of(SITE.state).items()},
        "id": "home",
        "digest": "5" * 64,
        "grants": {"kitchen": [2, 4], "laundry": [0, 19]},
        "blocks": [["one", "kitchen", None, 5, 6], ["three", "kitchen", "boil", 0, 19]],
        "shared": {"kettle.hot": [8, 9]},
        "settings": {"kitchen": [11, 13], "cellar": None},
    }


def test_summaries_come_back_from_json_as_they_were() -> None:
    module, home = summarize_module(MODULE), summarize_site(SITE)
    assert module_summary_from_json(json.loads(json.dumps(summary_to_json(module))), FILE) == module
    assert site_summary_from_json(json.loads(json.dumps(summary_to_json(home))), FILE) == home


def test_a_malformed_summary_is_refused() -> None:
    packed = summary_to_json(summarize_module(MODULE))
    with pytest.raises(KeyError):
        module_summary_from_json({name: packed[name] for name in packed if name != "skills"}, FILE)
    with pytest.raises(TypeError):
        module_summary_from_json({**packed, "more": 1}, FILE)
    with pytest.raises(MisuseError):
        module_summary_from_json(packed, Source("a.yaml", "short"))
    with pytest.raises(KeyError):
        site_summary_from_json({"id": "home"}, FILE)


def test_the_places_of_a_site_with_an_overlay_come_back_in_their_own_files() -> None:
    whole = read_site(ROOT / "tests" / "corpus" / "overlay" / "table.yaml")
    site = elaborate_source(whole, Diagnostics())
    assert site is not None
    summary = summarize_site(site)
    assert len({one.source.path for one in (site.span, *summary.grants.values())}) == 2
    assert site_summary_from_json(json.loads(json.dumps(summary_to_json(summary, whole))), whole) == summary
