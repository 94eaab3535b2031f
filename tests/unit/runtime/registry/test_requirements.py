"""The needs of a module are named before it is installed, with the modules that would provide them."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.runtime.registry.requirements import require_installed
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import decode_manifest

ACCEPTED = Path(__file__).parents[3] / "corpus" / "accepted"
TWO, STEPS = ACCEPTED / "capability_that_two_modules_provide", ACCEPTED / "steps_of_a_required_module"


def refused(case: Path, *installed: str) -> list[tuple[str, tuple[str, ...]]]:
    module = decode_manifest(case / "asker")
    assert module is not None
    try:
        require_installed(module, [case / name for name in installed], case / "asker")
    except UserError as error:
        return [(one.code, one.help) for one in error.diagnostics]
    return []


def test_a_module_that_is_missing_is_named_with_the_folder_that_has_it() -> None:
    cure = f"`aeros install {(STEPS / 'helper').resolve()}` provides it"
    assert refused(STEPS) == [("AE301", (cure,))]
    assert refused(STEPS, "helper") == []


def test_a_capability_is_provided_by_any_module_in_the_range() -> None:
    cures = tuple(f"`aeros install {(TWO / name).resolve()}` provides it" for name in ("one", "two"))
    assert refused(TWO) == [("AE305", cures)]
    assert refused(TWO, "old") == [("AE306", cures)]
    assert refused(TWO, "two") == refused(TWO, "one", "old") == []


def test_where_no_module_nearby_provides_it_a_cure_is_given_all_the_same(tmp_path: Path) -> None:
    module = decode_manifest(TWO / "asker")
    assert module is not None
    with pytest.raises(UserError) as caught:
        require_installed(module, [], tmp_path / "asker")
    assert [one.help for one in caught.value.diagnostics] == [("install a module that provides it",)]
