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


def truths_for(names: Iterable[str], arguments: Mapping[str, Any], module: str) -> dict[str, str]:
    """Select the truths that hold for some values of parameters.

    Args:
        names: names of truths, as `truth_name` makes them: a truth of `kettle.water_hot` depends on
            parameters of `kettle`.
        arguments: value of each parameter, by full name.
        module: id of the module whose parameters a truth without a module depends on.

    Returns:
        The name of the truth of each state variable, by the variable's name.
    """
    found: dict[str, str] = {}
    for name in names:
        variable, _, given = name.removesuffix(")").partition("(")
        owner = variable.rpartition(".")[0] or module
        pairs = (one.split(" = ") for one in given.split(", ")) if given else ()
        if all(str(arguments.get(f"{owner}.{parameter}")) == value for parameter, value in pairs):
            found[variable] = name
    return found
