"""Names of truths that depend on what an instruction says, such as `washed(pot = small)`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any


def truth_name(variable: str, arguments: Mapping[str, Any]) -> str:
    """Name the truth of a state variable for some values of parameters.

    Args:
        variable: name of the state variable.
        arguments: values of the parameters on which the truth depends, by the parameter's name.

    Returns:
        The name; that of the variable if the truth depends on none.
    """
    if not arguments:
        return variable
    given = ", ".join(f"{name} = {value}" for name, value in sorted(arguments.items()))
    return f"{variable}({given})"


def truths_for(names: Iterable[str], arguments: Mapping[str, Any]) -> dict[str, str]:
    """Select the truths that hold for some values of parameters.

    Args:
        names: names of truths, as `truth_name` makes them.
        arguments: value of each parameter, by name.

    Returns:
        The name of the truth of each state variable, by the variable's name.
    """
    stated = {f"{name} = {value}" for name, value in arguments.items()}
    found: dict[str, str] = {}
    for name in names:
        variable, _, given = name.removesuffix(")").partition("(")
        if not given or stated >= set(given.split(", ")):
            found[variable] = name
    return found
