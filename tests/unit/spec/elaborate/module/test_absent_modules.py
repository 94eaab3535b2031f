"""One error about a missing module in place of one for each of its names."""

from __future__ import annotations

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import decode_manifest
from aeros.spec.elaborate.module.absent_modules import blame_missing_modules
from aeros.spec.model.ecm import ForeignNames
from tests.unit.spec.elaborate.module.test_callables import ACCEPTED, loaded

ASKER = ACCEPTED / "steps_of_a_required_module" / "asker"


def headlines(*faults: str, foreign: ForeignNames) -> set[str]:
    declared = decode_manifest(ASKER)
    assert declared is not None
    found = Diagnostics()
    for headline in faults:
        found.error("AE122", headline)
    return {one.headline for one in blame_missing_modules(declared, foreign, found)}


def test_faults_about_names_of_a_missing_module_are_one_error_about_the_module() -> None:
    faults = ("`helper.dirt` is not declared", "`helper.fetch` is missing", "`helped.x` is not declared")
    assert headlines(*faults, foreign=ForeignNames()) == {
        "`asker` needs `helper`, which is missing or cannot be read",
        "`helped.x` is not declared",
    }


def test_other_faults_stay_as_they_are() -> None:
    assert headlines("`tidy` is twice here", foreign=ForeignNames()) == {"`tidy` is twice here"}


def test_a_name_that_a_module_lacks_is_a_fault_of_that_name() -> None:
    helper, _ = loaded(ASKER.parent / "helper")
    assert helper is not None
    found = ForeignNames(modules={"helper": helper})
    assert headlines("`helper.dirt` is not declared", foreign=found) == {"`helper.dirt` is not declared"}


def test_the_count_of_dropped_faults_is_kept() -> None:
    declared = decode_manifest(ASKER)
    assert declared is not None
    found = Diagnostics(limit=1)
    found.error("AE122", "`helper.a` is not declared")
    found.error("AE122", "`helper.b` is not declared")
    assert blame_missing_modules(declared, ForeignNames(), found).dropped == 1
