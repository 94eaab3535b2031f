"""Settings of modules as arguments of the public names: bindings and parameters by `MODULE.NAME`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.session.argument_checks import require_text
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.configured import join_settings, setting_fault, settings_by_module
from aeros.spec.model.operator_settings import OperatorSettings


def read_module_settings(
    bindings: Mapping[str, str] | None, parameters: Mapping[str, str] | None
) -> OperatorSettings:
    """Check the form of settings and sort them by module, as `--bind` and `--set` do.

    Names that no module declares and values that do not suit are found when the modules are proved.

    Args:
        bindings: the site's name for what a module needs, by `MODULE.NEED`; None for none.
        parameters: values with their units, by `MODULE.PARAMETER`; None for none.

    Returns:
        The settings.

    Raises:
        MisuseError: an argument is no mapping of texts, or a name or value has another form.
    """
    bound = _by_module("bindings", "surface", "bench", bindings)
    values = _by_module("parameters", "force", "6 N", parameters)
    return OperatorSettings(configurations=join_settings(bound, values))


def _by_module(argument: str, name: str, value: str, given: Any) -> Mapping[str, Mapping[str, str]]:
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        example = f'{{"clean_pot.{name}": "{value}"}}'
        raise MisuseError(f"`{argument}` is of type `{type(given).__name__}`; give a dict, as in {example}")
    for one, text in given.items():
        require_text(f"a name in {argument}", one)
        require_text(f"{argument}[{one!r}]", text)
        fault = setting_fault(one, text, is_binding=argument == "bindings")
        if fault is not None:
            raise MisuseError(f"`{argument}`: {fault}")
    try:
        return settings_by_module(given)
    except ValueError as error:
        raise MisuseError(f"`{argument}`: {error}") from error
