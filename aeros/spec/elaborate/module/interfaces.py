"""Elaboration of interfaces: inputs and outputs of skills, and what capabilities promise."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from aeros.spec.declared import capability as declared
from aeros.spec.declared.ecm import Ecm, Input
from aeros.spec.declared.quantity import Quantity
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.module.action_conditions import elaborate_action_condition
from aeros.spec.elaborate.names import check_name_is_free
from aeros.spec.elaborate.quantities import elaborate_variable
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.elaborate.values import elaborate_value
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import CapabilityInterface
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import TextField


def elaborate_inputs(
    entries: Iterable[tuple[TextField, Quantity]], site: Site, diagnostics: Diagnostics
) -> dict[str, Declared]:
    """Elaborate declared inputs.

    Args:
        entries: inputs with their names.
        site: site under which the module is elaborated.
        diagnostics: receives the faults.

    Returns:
        The inputs without faults by name, each with its default if it has one.
    """
    inputs: dict[str, Declared] = {}
    for name, one in entries:
        if not check_name_is_free(name, {}, "input", diagnostics):
            continue
        variable = _variable(f"inputs.{name.value}", one, site, diagnostics)
        if variable is None:
            continue
        if isinstance(one, Input) and one.default is not None:
            default = elaborate_value(one.default, variable, site, diagnostics)
            variable = replace(variable, default_value=default)
        inputs[name.value] = variable
    return inputs


def elaborate_outputs(
    entries: Iterable[tuple[TextField, Quantity]], site: Site, diagnostics: Diagnostics
) -> dict[str, Declared]:
    """Elaborate declared outputs.

    Args:
        entries: outputs with their names.
        site: site under which the module is elaborated.
        diagnostics: receives the faults.

    Returns:
        The outputs without faults, by name.
    """
    variables = {name.value: _variable(name.value, one, site, diagnostics) for name, one in entries}
    return {name: variable for name, variable in variables.items() if variable is not None}


def elaborate_interfaces(ecm: Ecm, site: Site, diagnostics: Diagnostics) -> dict[str, CapabilityInterface]:
    """Elaborate the interfaces of the capabilities that a module provides or requires.

    Args:
        ecm: the declared module.
        site: site under which the module is elaborated, with all variables that the module may read.
        diagnostics: receives the faults.

    Returns:
        The interfaces by name of the capability; none of a capability without one.
    """
    listed = (*ecm.capabilities, *ecm.dependencies.required_capabilities)
    return {
        name.value: _interface(one.interface, site, diagnostics)
        for name, one in listed
        if one.interface is not None
    }


def _interface(one: declared.Interface, site: Site, diagnostics: Diagnostics) -> CapabilityInterface:
    inputs = elaborate_inputs(one.inputs, site, diagnostics)
    outputs = elaborate_outputs(one.outputs, site, diagnostics)
    precondition = achieves = None
    if one.precondition is not None:
        precondition = elaborate_action_condition(one.precondition, state_scope(site, inputs), diagnostics)
    if one.achieves is not None:
        achieves = elaborate_action_condition(one.achieves, state_scope(site), diagnostics)
    if not (one.inputs.items or one.outputs.items or one.precondition or one.achieves):
        diagnostics.error("AE112", "an interface promises something", one.span)
    return CapabilityInterface(inputs, outputs, precondition, achieves, one.span)


def _variable(name: str, quantity: Quantity, site: Site, diagnostics: Diagnostics) -> Declared | None:
    return elaborate_variable(name, quantity, t.VariableRole.INPUT, site.enums, diagnostics)
