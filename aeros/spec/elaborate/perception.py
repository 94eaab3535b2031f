"""Elaboration of perception: a module's variables and what measures them, a site's cameras, shared variables.

Outside of its module a variable is `kettle.water_hot`, and in the module just `water_hot`.  A module may read
a variable of another if the site shares it and the module requires the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.declared import perception as declared
from aeros.spec.declared import site as declared_site
from aeros.spec.diagnostics.codes import Diagnostics, SpanLabel, did_you_mean
from aeros.spec.elaborate.definitions import adopted_definitions, elaborate_definitions
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.names import (
    check_name_is_free,
    meanings_of_names,
    resolve_models,
    resolve_name,
    resolve_need,
)
from aeros.spec.elaborate.obstacles import elaborate_occupied_space
from aeros.spec.elaborate.quantities import (
    elaborate_memory,
    elaborate_module_variable,
    elaborate_processor_share,
)
from aeros.spec.elaborate.task_parameters import TaskParameters
from aeros.spec.elaborate.vocabulary import SiteVocabulary
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.types import VectorType
from aeros.spec.expr.units import LENGTH, TIME, format_number, format_quantity
from aeros.spec.model.configured import BoundNames
from aeros.spec.model.models import ModuleModel
from aeros.spec.model.perception import MEMORY, Perceiver, PerceptionPolicy, PictureRequest, SiteCamera
from aeros.spec.model.site import Site, enums_of_modules
from aeros.spec.model.task_parameters import OBJECTS
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import ExpressionField, TextField


def elaborate_shared_variables(
    policy: declared.PerceptionPolicy | None, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> dict[str, Declared]:
    """Elaborate the variables of modules that a site shares; those for its invariants join its vocabulary.

    Args:
        policy: declared rights of perceivers; None if the site declares none.
        vocabulary: vocabulary of the site, without faults; receives the variables that Φ may read.
        diagnostics: receives the faults.

    Returns:
        The variables by full name, as the site declares them.
    """
    shared: dict[str, Declared] = {}
    used = dict(vocabulary.used_names)
    for kind in vocabulary.kinds.values():
        used |= dict.fromkeys(kind.parameters, f"a parameter of `{kind.name}`")
    for name, quantity in () if policy is None else policy.shared:
        module = name.value.partition(".")[0]
        if module in used:
            diagnostics.error("AE121", f"`{module}` is already {used[module]}", name.span)
        variable = elaborate_module_variable(name.value, quantity, vocabulary.enums, diagnostics)
        if variable is not None:
            shared[name.value] = replace(variable, span=name.span)
            if quantity.in_invariants is not None and quantity.in_invariants.value:
                vocabulary.state[name.value] = shared[name.value]
    return shared


def elaborate_perception_policy(
    policy: declared.PerceptionPolicy | None, shared: Mapping[str, Declared], diagnostics: Diagnostics
) -> PerceptionPolicy:
    """Elaborate the rights of perceivers.

    Args:
        policy: declared rights; None for the defaults.
        shared: elaborated variables that the site shares, by full name.
        diagnostics: receives the faults.

    Returns:
        The rights, with the default of each field that is not declared.
    """
    usual = PerceptionPolicy()
    if policy is None:
        return usual
    timeout = usual.timeout
    if policy.timeout is not None:
        timeout = elaborate_quantity(policy.timeout, TIME, diagnostics) or timeout
        if not 0 < timeout <= 60:
            diagnostics.error("AE129", "a timeout must be above 0 s and at most 60 s", policy.timeout.span)
    in_invariants = frozenset(
        name.value
        for name, quantity in policy.shared
        if quantity.in_invariants is not None and quantity.in_invariants.value
    )
    memory = (
        usual.memory
        if policy.memory is None
        else elaborate_memory(policy.memory, diagnostics) or usual.memory
    )
    public = policy.public is not None and policy.public.value
    processor = usual.processor
    if policy.processor is not None:
        processor = elaborate_processor_share(policy.processor, Fraction(1), diagnostics) or processor
    rate = usual.rate
    if policy.rate is not None:
        rate = elaborate_quantity(policy.rate, TIME**-1, diagnostics) or rate
        if not 0 < rate <= usual.rate:
            headline = f"a rate is above 0 Hz and at most {format_number(usual.rate)} Hz"
            diagnostics.error("AE129", headline, policy.rate.span)
    return PerceptionPolicy(shared, in_invariants, timeout, memory, public, processor, rate)


def elaborate_cameras(
    site: declared_site.Site, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> dict[str, SiteCamera]:
    """Elaborate the cameras of a site.

    Args:
        site: the declared site.
        vocabulary: its vocabulary; the cameras are members of its enum `cameras`.
        diagnostics: receives the faults.

    Returns:
        The cameras by name.
    """
    enum = vocabulary.enums.get("cameras")
    members = {} if enum is None else dict.fromkeys(enum.members)
    for name, _ in site.cameras:
        if name.value not in members:
            near = did_you_mean(name.value, members)
            all_names = ", ".join(one.value for one, _ in site.cameras)
            diagnostics.error(
                "AE122",
                f"`{name.value}` is not a member of the enum `cameras`",
                name.span,
                help=(
                    f"did you mean `{near}`?" if near else f"write under `enums`: `cameras: [{all_names}]`",
                ),
            )
    for _, camera in site.cameras:
        for volume in camera.sees:
            resolve_name(volume, vocabulary.volumes, "a volume of this site", diagnostics)
    return {
        name.value: SiteCamera(
            camera.sensor.value,
            camera.width.value,
            camera.height.value,
            frozenset(volume.value for volume in camera.sees),
        )
        for name, camera in site.cameras
    }


class ModulePerception:
    """Perception of one module: its variables, what measures them, and the site as its conditions see it.

    Args:
        ecm: the declared module.
        site: site under which it is elaborated, with the things that it needs under its names.
        names: the site's names for these.
        diagnostics: receives the faults.
        public: what the modules that it requires declare as public, by full name.
        models: models of the module by name.

    Attributes:
        state: its own variables by full name.
        perceivers: its perceivers by id.
        definitions: conditions of its predicates that have one, by full name.
        task_parameters: parameters of each task by name, by the task's name.
        site: the site with the state variables by the names that the module's conditions use: the site's own,
            the module's by short and by full name, and those that it may read of modules it requires.
    """

    def __init__(
        self,
        ecm: declared_ecm.Ecm,
        site: Site,
        names: BoundNames,
        diagnostics: Diagnostics,
        public: Mapping[str, Declared],
        models: Mapping[str, ModuleModel],
    ) -> None:
        self._diagnostics = diagnostics
        self._names = names
        self._models = models
        self._module = ecm.id.value
        self._has_memory = any(one.recall is not None for _, one in ecm.things)
        used = meanings_of_names(site)
        own = self._variables(ecm, site, used)
        used |= dict.fromkeys(own, "a state variable of this module")
        parameters = TaskParameters(ecm, site, used, diagnostics)
        self.task_parameters = parameters.by_task
        own |= parameters.variables
        recalled = {name: one for name, one in own.items() if one.is_recalled}
        self._check_recalled(recalled, site)
        required = {name.value for name, _ in ecm.dependencies.modules}
        readable = {**(public if site.perception.public else {}), **site.perception.shared}
        shared = {
            name: one for name, one in readable.items() if name.partition(".")[0] in required - {self._module}
        }
        visible = {name: one for name, one in site.state.items() if "." not in name}
        self.site = site
        if own or shared or len(visible) < len(site.state):
            measured = {name: one for name, one in own.items() if name not in recalled}
            state = {**visible, **shared, **measured, **self._by_full_name(measured)}
            enums = {name: one for name, one in site.enums.items() if "." not in name}
            self.site = replace(
                site,
                state=state,
                enums=enums | enums_of_modules(state),
                recalled_names=frozenset({**recalled, **self._by_full_name(recalled)}),
            )
        adopted = adopted_definitions(ecm, self.site)
        self.site = adopted.site
        if adopted.predicates and not _has_variables(ecm):  # else its name is checked above
            check_name_is_free(ecm.id, meanings_of_names(site), "module", diagnostics)
        written = {name.value: one.definition for name, one in ecm.state if one.definition is not None}
        self.definitions = adopted.definitions | elaborate_definitions(ecm, own, self.site, diagnostics)
        here = dict.fromkeys(name.value for name, _ in ecm.state)
        self.perceivers = {name.value: self._perceiver(name, one, here, site) for name, one in ecm.perceivers}
        own = _with_sensors(ecm, own, written, diagnostics)
        self.state = {**adopted.predicates, **self._by_full_name(own)}
        self._check_shared(ecm, site)

    def _by_full_name(self, own: Mapping[str, Declared]) -> dict[str, Declared]:
        return {f"{self._module}.{name}": one for name, one in own.items()}

    def _variables(self, ecm: declared_ecm.Ecm, site: Site, used: dict[str, str]) -> dict[str, Declared]:
        """Elaborate the module's variables, by short name; `used` receives the names."""
        own: dict[str, Declared] = {}
        if _has_variables(ecm):
            check_name_is_free(ecm.id, used, "module", self._diagnostics)
        used |= {name.value: "a module that this one requires" for name, _ in ecm.dependencies.modules}
        used[self._module] = "the name of this module"
        recalling = [one for _, one in ecm.perceivers if self._recalls(one)]
        recalled = {name.value for one in recalling for name in one.provides}
        for name, quantity in ecm.state:
            is_free = check_name_is_free(name, used, "state variable", self._diagnostics)
            full = f"{self._module}.{name.value}"
            sensor = self._sensor(quantity, site)
            variable = elaborate_module_variable(full, quantity, site.enums, self._diagnostics, sensor)
            if is_free and variable is not None:
                is_public = quantity.public is not None and quantity.public.value
                space = self._occupied_space(quantity, variable, site)
                own[name.value] = replace(
                    variable,
                    span=name.span,
                    is_public=is_public,
                    occupies=space,
                    is_recalled=name.value in recalled,
                )
        return own

    def _recalls(self, perceiver: declared.Perceiver) -> bool:
        """Return True if a perceiver reads the places where things were seen before."""
        return self._has_memory and any(one.value == MEMORY for one in perceiver.readings)

    def _check_recalled(self, recalled: Mapping[str, Declared], site: Site) -> None:
        """Check that what comes from memory is read by this module alone."""
        for name, one in recalled.items():
            if one.is_public or f"{self._module}.{name}" in site.perception.shared:
                self._diagnostics.error(
                    "AE145",
                    f"`{name}` comes from memory, so no other module and no invariant may read it",
                    one.span,
                    help=("share what a perceiver measures without `memory` under its `readings`",),
                )

    def _occupied_space(
        self, quantity: declared.OwnVariable, variable: Declared, site: Site
    ) -> AxisAlignedBox | None:
        """Return the space that the thing at a measured position takes up; None if none is stated."""
        if quantity.occupies is None:
            return None
        if variable.variable.type != VectorType(LENGTH):
            self._diagnostics.error(
                "AE203", "only a position, a `vec3` in m, has a space around it", quantity.occupies.span
            )
            return None
        policy = None if site.motion is None else site.motion.obstacles
        largest = None if policy is None else policy.largest_explained
        return elaborate_occupied_space(quantity.occupies, largest, self._diagnostics)

    def _sensor(self, quantity: declared.OwnVariable, site: Site) -> str | None:
        """Return the site's name of the sensor that measures a variable; None if a perceiver does."""
        if quantity.sensor is None:
            return None
        if quantity.definition is not None:
            self._diagnostics.error(
                "AE120",
                f"`{quantity.sensor.value}` cannot measure what a definition says",
                quantity.sensor.span,
                help=("keep `sensor` or `definition`",),
            )
        known = {name: name for name in site.sensor_names}
        known |= {name: sensors[0] for name, sensors in self._names.sensors.items()}
        sensor = resolve_need(quantity.sensor, known, "sensor", self._diagnostics)
        return quantity.sensor.value if sensor is None else sensor

    def _perceiver(
        self, name: TextField, perceiver: declared.Perceiver, own: Mapping[str, None], site: Site
    ) -> Perceiver:
        timeout = elaborate_quantity(perceiver.timeout, TIME, self._diagnostics) or Fraction(0)
        memory = elaborate_memory(perceiver.memory, self._diagnostics) or 0
        limits = site.perception
        if not 0 < timeout <= limits.timeout:
            allowed = f"{format_number(limits.timeout)} s"
            self._report_limit(f"a perceiver's timeout is above 0 s and at most {allowed}", perceiver.timeout)
        if memory > limits.memory:
            allowed = f"{limits.memory >> 20} MiB"
            self._report_limit(f"this site allows a perceiver at most {allowed}", perceiver.memory)
        processor = limits.processor
        if perceiver.processor is not None:
            share = elaborate_processor_share(perceiver.processor, limits.processor, self._diagnostics)
            processor = share or processor
        rate = None
        if perceiver.rate is not None:
            rate = elaborate_quantity(perceiver.rate, TIME**-1, self._diagnostics)
            if rate is not None and not 0 < rate <= limits.rate:
                allowed = f"{format_number(limits.rate)} Hz"
                self._report_limit(f"a perceiver's rate is above 0 Hz and at most {allowed}", perceiver.rate)
        readings = [one for one in perceiver.readings if not self._is_constant(one.value)]
        if not perceiver.pictures and not readings and not self._recalls(perceiver):
            headline = f"`{name.value}` gets neither pictures nor readings, so it can measure nothing"
            self._diagnostics.error("AE112", headline, name.span, help=("add `pictures` or `readings`",))
        if not perceiver.provides:
            self._diagnostics.error("AE112", f"`{name.value}` provides no variable", name.span)
        pictures = (self._picture(camera, picture, site) for camera, picture in perceiver.pictures)
        read = [
            resolve_name(reading, self.site.state, "a state variable that it may read", self._diagnostics)
            for reading in readings
        ]
        for one in perceiver.provides:
            resolve_name(one, own, "a state variable of this module", self._diagnostics)
        module, _, function = perceiver.entry.value.partition(":")
        return Perceiver(
            id=name.value,
            module_name=module,
            function=function,
            pictures=tuple(pictures),
            read_as={
                reading.value.removeprefix(f"{self._module}."): variable.name
                for reading, variable in zip(readings, read, strict=True)
                if variable is not None
            },
            rate=rate,
            provides=tuple(f"{self._module}.{one.value}" for one in perceiver.provides),
            timeout=timeout,
            memory=memory,
            span=name.span,
            entry_span=perceiver.entry.span,
            processor=processor,
            constants=_parameters_read(perceiver, self._names, self.site),
            models=resolve_models(perceiver.models, self._models, self._diagnostics),
            recalls=self._recalls(perceiver),
        )

    def _is_constant(self, reading: str) -> bool:
        """Return True for a parameter of the module, the table of the site's objects, and the memory."""
        tables = {OBJECTS: bool(self.site.objects), MEMORY: self._has_memory}
        return tables.get(reading, False) or reading in self._names.parameters

    def _report_limit(self, headline: str, at: TextField) -> None:
        self._diagnostics.error("AE129", headline, at.span)

    def _picture(self, camera: TextField, picture: declared.PictureRequest, site: Site) -> PictureRequest:
        known = resolve_need(camera, site.cameras, "camera", self._diagnostics)
        width, height = picture.width.value, picture.height.value
        if known is not None and (width > known.width or height > known.height):
            self._diagnostics.error(
                "AE129",
                f"this site offers pictures of at most {known.width} x {known.height} pixels",
                picture.width.span if width > known.width else picture.height.span,
            )
        depth = picture.depth is not None and picture.depth.value
        name = self._names.site_name(camera.value)
        is_optional = picture.optional is not None and picture.optional.value
        seen_as = "" if name == camera.value else camera.value
        return PictureRequest(name, width, height, depth, seen_as, is_optional)

    def _check_shared(self, ecm: declared_ecm.Ecm, site: Site) -> None:
        """Check that the module declares what the site shares of it, and declares it alike."""
        for full, shared in site.perception.shared.items():
            module, _, name = full.partition(".")
            if module != self._module:
                continue
            mine = self.state.get(full)
            if mine is None and not any(name == one.value for one, _ in ecm.state):
                near = did_you_mean(name, [one.value for one, _ in ecm.state])
                help_ = (
                    f"did you mean `{module}.{near}`?" if near else "declare it under `state` of the module"
                )
                headline = f"the site shares `{full}`, which `{module}` does not declare"
                self._diagnostics.error("AE122", headline, shared.span, help=(help_,))
            elif mine is not None and (difference := _difference(mine, shared)):
                self._diagnostics.error(
                    "AE135",
                    f"`{name}` is declared with {difference} where this site shares it",
                    mine.span,
                    secondary=(SpanLabel(shared.span, "the site's declaration"),),
                    help=("declare it alike: others rely on the site's declaration",),
                )


def _with_sensors(
    ecm: declared_ecm.Ecm,
    own: Mapping[str, Declared],
    defined: Mapping[str, ExpressionField],
    diagnostics: Diagnostics,
) -> dict[str, Declared]:
    """Name the perceiver of each variable; each has exactly one, or a definition."""
    by_variable: dict[str, tuple[TextField, TextField]] = {}
    for perceiver, declaration in ecm.perceivers:
        for name in declaration.provides:
            if name.value in own and (sensor := own[name.value].sensor) is not None:
                headline = f"`{sensor}` measures `{name.value}`, and `{perceiver.value}` provides it, too"
                diagnostics.error("AE120", headline, name.span, help=("keep one of them",))
            if name.value in defined:
                diagnostics.error(
                    "AE120",
                    f"`{name.value}` has a definition, and `{perceiver.value}` provides it, too",
                    name.span,
                    secondary=(SpanLabel(defined[name.value].span, "defined here"),),
                    help=("keep one of them",),
                )
            if name.value in by_variable:
                first, place = by_variable[name.value]
                diagnostics.error(
                    "AE120",
                    f"`{name.value}` is provided twice, by `{first.value}` and by `{perceiver.value}`",
                    name.span,
                    secondary=(SpanLabel(place.span, "provided here"),),
                    help=("let one perceiver provide it",),
                )
            by_variable.setdefault(name.value, (perceiver, name))
    measured: dict[str, Declared] = {}
    for short, one in own.items():
        if one.sensor is not None:
            measured[short] = one
            continue
        if short in defined:
            measured[short] = replace(one, sensor=f"{ecm.id.value}.{short}")
            continue
        if short in by_variable:
            measured[short] = replace(one, sensor=f"{ecm.id.value}.{by_variable[short][0].value}")
            continue
        help_ = "add it to `provides` of a perceiver, or give it a `definition` or a `sensor`"
        diagnostics.error("AE122", f"no perceiver provides `{short}`", one.span, help=(help_,))
    return measured


def _difference(mine: Declared, shared: Declared) -> str:
    """Return what a module's declaration of a shared variable must not leave open; nothing if it fits."""
    if mine.variable != shared.variable:
        return f"the type {shared.variable.type}"
    if mine.range != shared.range and shared.range is not None:
        ends = (format_quantity(end, shared.unit) for end in shared.range)
        return "the range " + " to ".join(ends)
    if mine.max_age != shared.max_age and shared.max_age is not None:
        return f"`max_age: {format_number(shared.max_age)} s`"
    if shared.uncertainty is not None and (mine.uncertainty or 0) > shared.uncertainty:
        return f"an uncertainty of at most {format_quantity(shared.uncertainty, shared.unit)}"
    return ""


def _parameters_read(perceiver: declared.Perceiver, names: BoundNames, site: Site) -> dict[str, Any]:
    """Return each constant that a perceiver lists under its readings: parameters (SI), and the objects."""
    read = [one.value for one in perceiver.readings]
    constants = to_doubles(
        {
            one: evaluate(site.constants[one], {})
            for one in read
            if one in names.parameters and one in site.constants
        }
    )
    if OBJECTS in read and site.objects:
        constants[OBJECTS] = {name: kind.for_perceivers() for name, kind in site.objects.items()}
    return constants


def _has_variables(ecm: declared_ecm.Ecm) -> bool:
    return bool(ecm.state) or any(one.parameters for _, one in ecm.tasks)
