"""Selection of the modules whose perceivers run; the others are idle, cost no time and report no failure."""

from __future__ import annotations

from aeros.runtime.gate.configuration import Configuration


def needed_modules(configuration: Configuration, attended: frozenset[str] | None) -> frozenset[str]:
    """Collect the modules that may provide or read a value that matters to some modules.

    These are the attended ones; those that they require, at any depth; those that provide a capability that
    one of them provides or requires, as a step may run there; and those with variables that the site shares.

    Args:
        configuration: site and active modules.
        attended: ids of modules; None for all.

    Returns:
        Ids of active modules.
    """
    modules = configuration.modules
    if attended is None:
        return frozenset(modules)
    perception = configuration.site.perception
    shared = {name.partition(".")[0] for name in (*perception.shared, *perception.in_invariants)}
    pending: set[str] = {*attended, *shared} & modules.keys()
    found: set[str] = set()
    while pending:
        found |= pending
        required = {name for one in pending for name in modules[one].required_modules}
        capabilities = {
            name
            for one in pending
            for name in (*modules[one].capabilities, *modules[one].required_capabilities)
        }
        providers = {name for name, one in modules.items() if capabilities & one.capabilities.keys()}
        pending = ((required | providers) & modules.keys()) - found
    return frozenset(found)
