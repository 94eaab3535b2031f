"""Claims about modules among others, against every instruction, path and name that there can be."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import aeros
from aeros.spec.model.ecm import Ecm, Outcome, Skill, Task
from aeros.spec.model.policy import Access, OperatorOverride
from aeros.spec.model.site import Site
from aeros.spec.model.summary import summarize_module, summarize_site
from aeros.spec.obligations.configuration import configuration_obligations
from aeros.spec.obligations.dependencies import dependency_obligations, runtime_obligations
from tests.property.mix import Mix
from tests.property.test_permissions import bounded
from tests.unit.agent.dumplings import SPAN, build, term

NAMES = ("a", "b", "c")
MATCHING_VERSIONS = {">=1": {1, 2, 3}, ">=2": {2, 3}, "<2": {1}, "==2.*": {2}, ">1,<3": {2}}
"""Versions among 1, 2 and 3 that each specifier admits."""

_ONE = st.fixed_dictionaries(
    {
        "id": st.sampled_from(NAMES),
        "version": st.integers(1, 3),
        "requires": st.dictionaries(
            st.sampled_from(NAMES), st.sampled_from(list(MATCHING_VERSIONS)), max_size=2
        ),
        "words": st.lists(st.sampled_from(["x", "y", "x y", "y x", "z x y", "x y z"]), max_size=2),
        "provides": st.frozensets(st.sampled_from(["tea", "toast"]), max_size=1),
        "leaves": st.lists(st.sampled_from([None, True, False]), max_size=2),
        "skill": st.sampled_from(["s", "t"]),
    }
)


def _ecm(one: dict[str, Any]) -> Ecm:
    outcomes = {
        f"o{number}": Outcome(f"o{number}", {"dumpling_cooked": value}, False, None, None)
        for number, value in enumerate(one["leaves"])
        if value is not None
    }
    task = Task(
        "task", tuple(one["words"]), term("area == pot"), "", (), {}, None, SPAN,
        word_spans=(SPAN,) * len(one["words"]),
    )  # fmt: skip
    return build(
        Ecm,
        id=one["id"],
        version=f"{one['version']}.0",
        required_modules=one["requires"],
        requires_spans=dict.fromkeys(one["requires"], SPAN),
        required_aeros_version=one.get("runtime", ""),
        capabilities=dict.fromkeys(one["provides"], ()),
        skills={one["skill"]: build(Skill, id=one["skill"], outcomes=outcomes, timeout=None)},
        tasks={"task": task},
    )


DEPENDENCIES, CONFIGURATIONS = Mix(), Mix()


def test_a_dependency_is_refused_exactly_where_it_is_not_met_or_leads_back() -> None:
    _dependencies_are_judged()
    DEPENDENCIES.assert_both("AE301", "AE302", "AE303", "AE304")


_RUNTIMES = ["", ">=0", ">=0.1", "<0.1", ">9", "<9,>=0.1", f"=={aeros.__version__}", f"!={aeros.__version__}"]


@bounded
@given(st.lists(_ONE, min_size=1, max_size=3, unique_by=lambda one: one["id"]), st.sampled_from(_RUNTIMES))
def _dependencies_are_judged(ones: list[dict[str, Any]], runtime: str) -> None:
    first = ones[0] | {"runtime": runtime}
    around = {one["id"]: one for one in ones}
    own = summarize_module(_ecm(first))
    others = {name: summarize_module(_ecm(one)) for name, one in around.items()}
    found = {
        str(claim.id).removeprefix("dependencies/"): claim.diagnostic
        for claim in (*runtime_obligations(own), *dependency_obligations(own, others))
    }
    for name, specifier in first["requires"].items():
        diagnostic = found.pop(name)
        there = name in around
        fits = there and around[name]["version"] in MATCHING_VERSIONS[specifier]
        code = "AE302" if there else "AE301"
        assert diagnostic is None or diagnostic.code == code
        DEPENDENCIES.compare(code, proved=diagnostic is None, expected=fits)
        if there:
            DEPENDENCIES.compare(
                "AE301", proved=diagnostic is None or diagnostic.code != "AE301", expected=True
            )
    DEPENDENCIES.compare(
        "AE303", proved=found.pop("acyclic") is None, expected=not _leads_back(first, around)
    )
    numbers = tuple(int(part) for part in aeros.__version__.split(".")[:2])
    is_runtime_matched = {
        ">=0": True, ">=0.1": numbers >= (0, 1), "<0.1": numbers < (0, 1), ">9": numbers > (9,),
        "<9,>=0.1": (0, 1) <= numbers < (9,), "": True,
    }.get(runtime, runtime.startswith("=="))  # fmt: skip
    DEPENDENCIES.compare("AE304", proved=found.pop("runtime") is None, expected=is_runtime_matched)
    assert not found


def _leads_back(first: dict[str, Any], around: Mapping[str, Any]) -> bool:
    """Return true if some chain of modules, each of which requires the next, ends where it starts."""
    others = [name for name in around if name != first["id"]]
    chains = (
        (first["id"], *between, first["id"])
        for size in range(len(others) + 1)
        for between in itertools.permutations(others, size)
    )
    return any(
        all(after in around[before]["requires"] for before, after in itertools.pairwise(chain))
        for chain in chains
    )


def test_modules_are_refused_together_exactly_where_one_could_be_taken_for_another() -> None:
    _configurations_are_judged()
    CONFIGURATIONS.assert_both("AE881", "AE882", "AE883", "AE884", "AE885", "AE886")


_GRANTS = st.frozensets(st.sampled_from(NAMES), max_size=2)
_BLOCKS = st.lists(st.tuples(st.sampled_from([None, *NAMES]), st.sampled_from([None, "s", "t"])), max_size=2)


@bounded
@given(st.lists(_ONE, min_size=2, max_size=3), _GRANTS, _BLOCKS)
def _configurations_are_judged(
    ones: list[dict[str, Any]], grants: frozenset[str], blocks: list[tuple[str | None, str | None]]
) -> None:
    site = build(
        Site,
        grants=dict.fromkeys(grants, Access()),
        span=SPAN,
        blocks=tuple(
            OperatorOverride(f"b{number}", "", module, skill, None)
            for number, (module, skill) in enumerate(blocks)
        ),
        limits=None,
    )
    claims = list(
        configuration_obligations([summarize_module(_ecm(one)) for one in ones], summarize_site(site))
    )
    found = {str(claim.id).removeprefix("configuration/"): claim.diagnostic for claim in claims}
    assert len(found) == len(claims)

    def judge(code: str, claim: str, expected: bool) -> None:
        diagnostic = found.pop(claim)
        assert diagnostic is None or diagnostic.code == code
        CONFIGURATIONS.compare(code, proved=diagnostic is None, expected=expected)

    ids = [one["id"] for one in ones]
    for name in set(ids):
        judge("AE881", f"identity/{name}", ids.count(name) == 1)
    for phrase in {word for one in ones for word in one["words"]}:
        judge("AE882", f"word/{phrase.replace(' ', '-')}", len(_routed(phrase, ones)) == 1)
    for name in {name for one in ones for name in one["provides"]}:
        judge("AE883", f"capability/{name}", sum(name in one["provides"] for one in ones) == 1)
    left = [set(one["leaves"]) - {None} for one in ones]
    opposed = any(a and b and not a & b for a, b in itertools.combinations(left, 2))
    if any(left):
        judge("AE885", "effect/dumpling_cooked", not opposed)
    if len(set(ids)) == len(ids):
        versions = {one["id"]: one["version"] for one in ones}
        for name in {name for one in ones for name in one["requires"]}:
            asked = [MATCHING_VERSIONS[one["requires"][name]] for one in ones if name in one["requires"]]
            met = [name in versions and versions[name] in admitted for admitted in asked]
            # A version that suits nobody is reported for each module by itself.
            judge("AE884", f"dependency/{name}", name in versions and (all(met) or not any(met)))
        skills = {(one["id"], one["skill"]) for one in ones} | {(name, None) for name in ids}
        for name in grants:
            judge("AE886", f"grant/{name}", name in ids)
        for number, (module, skill) in enumerate(blocks):
            if module is not None:
                judge("AE886", f"block/b{number}", (module, skill) in skills)
        assert not found


def _routed(instruction: str, ones: list[dict[str, Any]]) -> set[str]:
    """The modules with a task that some words of the instruction name."""
    spoken = instruction.split()
    phrases = {tuple(spoken[i:j]) for i in range(len(spoken)) for j in range(i + 1, len(spoken) + 1)}
    return {one["id"] for one in ones for word in one["words"] if tuple(word.split()) in phrases}


_ACCESS = st.builds(Access, st.frozensets(st.sampled_from(["arm", "hand"])))


@bounded
@given(st.permutations(NAMES), st.dictionaries(st.sampled_from(NAMES), _ACCESS), _ACCESS)
def test_no_module_reaches_more_because_another_is_added(
    names: list[str], grants: dict[str, Access], everyone: Access
) -> None:
    site = build(Site, access=everyone, grants=grants, span=SPAN, limits=None)
    alone = {name: everyone.merge(grants.get(name, Access())) for name in names}
    for count in range(1, len(names) + 1):
        ecms = [summarize_module(build(Ecm, id=name)) for name in names[:count]]
        claims = {
            str(one.id): one.diagnostic for one in configuration_obligations(ecms, summarize_site(site))
        }
        assert all(claims[f"configuration/identity/{ecm.id}"] is None for ecm in ecms)
        assert {ecm.id: site.access_of(ecm.id) for ecm in ecms} == {n: alone[n] for n in names[:count]}
        # One that is added under a name that is taken would reach what is granted to the first.
        again = [*ecms, summarize_module(build(Ecm, id=names[0]))]
        diagnostic = {
            str(one.id): one.diagnostic for one in configuration_obligations(again, summarize_site(site))
        }
        assert diagnostic[f"configuration/identity/{names[0]}"] is not None


@pytest.mark.parametrize("specifier", MATCHING_VERSIONS)
def test_the_table_of_versions_is_right(specifier: str) -> None:
    from packaging.specifiers import SpecifierSet

    assert {
        number for number in (1, 2, 3) if SpecifierSet(specifier).contains(f"{number}.0")
    } == MATCHING_VERSIONS[specifier]
