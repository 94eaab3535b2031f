"""Modules that wait to be configured: found with those that need them, and returned to `installed`."""

from __future__ import annotations

import pytest

from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.runtime.registry.waiting_modules import find_waiting, require_configured, reset_waiting
from aeros.spec.declared import ecm as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import decode_manifest, load_site
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.site import Site
from tests.unit.runtime.registry.conftest import BASE, Author

OPEN = "needs:\n  surface: {is: volume}\n\ncapabilities:\n"


@pytest.fixture
def site() -> Site:
    found = load_site(BASE / "site.yaml", Diagnostics())
    assert found is not None
    return found


def module(write: Author, name: str, *, is_open: bool = False, needs: str = "") -> declared.Ecm:
    manifest = write(name, id=name) / "ecm.yaml"
    text = manifest.read_text().replace("capabilities:\n", OPEN, 1) if is_open else manifest.read_text()
    manifest.write_text(f"{text}  {needs}\n" if needs else text)
    found = decode_manifest(manifest.parent)
    assert found is not None
    return found


def snapshot(*names: str, state: ModuleState = ModuleState.CONFIGURED, **bound: str) -> RegistrySnapshot:
    configurations = {name: ModuleConfiguration({"surface": one}) for name, one in bound.items()}
    none = ModuleConfiguration()
    return RegistrySnapshot(
        modules={
            name: InstalledModule(name, "1.0.0", "digest", state, configurations.get(name, none))
            for name in names
        }
    )


@pytest.mark.parametrize(
    ("bound", "waiting"), [("", ["base"]), ("bench_top", []), ("nowhere", ["base"]), ("arm", ["base"])]
)
def test_a_module_waits_until_its_need_is_bound_to_something_that_suits(
    write: Author, site: Site, bound: str, waiting: list[str]
) -> None:
    modules = {"base": module(write, "base", is_open=True)}
    given = snapshot("base", base=bound) if bound else snapshot("base")
    found = find_waiting(given, modules, site)
    assert list(found) == waiting
    assert all(one.reason == "open: `surface`" for one in found.values())


def test_a_module_waits_for_the_only_provider_of_a_capability(write: Author, site: Site) -> None:
    needy = module(write, "needy", needs='capabilities: {tidying: ">=1.0"}')
    modules = {"needy": needy, "zeal": module(write, "zeal", is_open=True)}
    # `needy` provides the capability itself here, and what it provides itself is not what it waits for.
    assert list(find_waiting(snapshot("needy", "zeal"), modules, site)) == ["zeal"]
    other = module(write, "other", needs='modules: {zeal: ">=1.0"}')
    found = find_waiting(snapshot("other", "zeal"), {"other": other, "zeal": modules["zeal"]}, site)
    assert list(found) == ["zeal", "other"]
    assert found["other"].reason == "needs `zeal`, which waits to be configured"
    assert found["other"].command == "aeros configure other"


def test_modules_that_need_each_other_are_listed_all_the_same(write: Author, site: Site) -> None:
    first = module(write, "first", is_open=True, needs='modules: {second: ">=1.0"}')
    second = module(write, "second", needs='modules: {first: ">=1.0"}')
    found = find_waiting(snapshot("first", "second"), {"first": first, "second": second}, site)
    assert sorted(found) == ["first", "second"]


def test_a_configured_module_may_not_need_one_that_waits(write: Author, site: Site) -> None:
    modules = {
        "base": module(write, "base", is_open=True),
        "needy": module(write, "needy", needs='modules: {base: ">=1.0"}'),
    }
    for state in (ModuleState.CONFIGURED, ModuleState.ACTIVE):
        given = snapshot("base", "needy", state=state)
        with pytest.raises(UserError, match="AE964"):
            require_configured(given, find_waiting(given, modules, site))
    waiting = snapshot("base", "needy", state=ModuleState.INSTALLED)
    require_configured(waiting, find_waiting(waiting, modules, site))


def test_configured_modules_are_reset_and_active_ones_are_refused(write: Author, site: Site) -> None:
    modules = {"base": module(write, "base", is_open=True), "bound": module(write, "bound", is_open=True)}
    given = snapshot("base", "bound", bound="bench_top")
    reset = reset_waiting(given, find_waiting(given, modules, site), "site.yaml")
    assert {name: one.state for name, one in reset.modules.items()} == {
        "base": ModuleState.INSTALLED,
        "bound": ModuleState.CONFIGURED,
    }
    active = snapshot("base", "bound", state=ModuleState.ACTIVE, bound="bench_top")
    with pytest.raises(UserError) as raised:
        reset_waiting(active, find_waiting(active, modules, site), "site.yaml")
    assert raised.value.diagnostics[0].help[1] == "`aeros deactivate base`"
