"""A gate for programs: the requesting skill is named once, and values need no time stamps."""

from __future__ import annotations

from collections.abc import Mapping
from math import nan
from os import PathLike
from typing import Any, Literal, get_args

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.gate.port import Gate
from aeros.runtime.ports import Reading
from aeros.runtime.proving import prove_configuration
from aeros.session.argument_checks import as_path, require_one_of, require_text
from aeros.session.module_settings import read_module_settings
from aeros.session.rendered_errors import rendered_errors
from aeros.skill import Action, Observation
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.text.discovery import reference_site_path

GateModeName = Literal["compiled", "z3", "checked"]


class SkillGate:
    """Gate that decides actions of the skills of proved modules; `load_gate` makes one.

    Pure: `decide` has no effect, reads no clock and counts nothing, so that the same arguments give the same
    decision.

    Attributes:
        skills: all skills, as `MODULE.SKILL`.

    Example:
        >>> gate = aeros.load_gate("ecms/clean_table", skill="wipe")
        >>> gate.skills[:3]
        ('clean_table.dock', 'clean_table.calibrate', 'clean_table.wipe')
        >>> decision = gate.decide(aeros.act("look", camera="table_top"), {"estop_pressed": True})
        >>> decision.reasons[0].rule
        'emergency-stop'
    """

    def __init__(self, configuration: Configuration, gate: Gate, skill: str | None = None) -> None:
        self._gate = gate
        self._unused = {quota.id: 0 for quota in configuration.site.quotas}
        self.skills: tuple[str, ...] = tuple(
            f"{module}.{one}" for module, ecm in configuration.modules.items() for one in ecm.skills
        )
        self._skill = None if skill is None else self._full_name(skill)

    def decide(
        self,
        action: Action,
        observation: Observation,
        *,
        skill: str | None = None,
        inputs: Mapping[str, Any] | None = None,
        time: float = 0.0,
        ages: Mapping[str, float] | None = None,
        usage: Mapping[str, int] | None = None,
    ) -> Decision:
        """Decide whether a skill may execute `action` now.

        Errors in `action`, `observation` or the numbers are reasons of a denial and raise no exception.

        Args:
            action: The requested action; parameters in SI units.
            observation: Measured values by vocabulary name, in SI units.  An absent name is unknown;
                the action is denied if a rule needs it.
            skill: The requesting skill, as `MODULE.SKILL` or `SKILL`; None for that of `load_gate`.
            inputs: The skill's inputs in SI units; None for none.
            time: Time of the decision, in seconds on the plant's clock.
            ages: Seconds before `time` at which values were measured; 0 for each that is not named.
            usage: Number of actions executed in the window of each quota; 0 for each that is not named.

        Returns:
            The decision.  Its `action` is the one that may be executed: `action`, an attenuated one, or None
            if it is denied; `reasons` has every rule that was violated.

        Raises:
            MisuseError: There is no such skill, or none is named and there are several.
            GateDisagreementError: The compiled gate and Z3 disagree, in mode `checked`; nothing may move.

        Example:
            >>> gate = aeros.load_gate("ecms/make_dumplings", skill="wrap")
            >>> decision = gate.decide(aeros.act("look", camera="overhead"), {"estop_pressed": False})
            >>> decision.action
            Action(kind='look', parameters={'camera': 'overhead'})
        """
        module, _, name = self._asking(skill).partition(".")
        aged = {} if ages is None else ages
        # The gate denies what has another type than declared; so it is passed on as it is.
        readings: Any = observation
        if isinstance(observation, Mapping):
            readings = {
                one: Reading(value, _measured_at(time, aged, one)) for one, value in observation.items()
            }
        caller = Caller(module, name, {} if inputs is None else inputs)
        used: Any = usage
        if usage is None or isinstance(usage, Mapping):
            used = {**self._unused, **(usage or {})}
        return self._gate.decide(caller, readings, action, time, used)

    def _asking(self, skill: str | None) -> str:
        if skill is not None:
            return self._full_name(skill)
        if self._skill is not None:
            return self._skill
        if len(self.skills) == 1:
            return self.skills[0]
        raise MisuseError(f"several skills may ask: name one as `skill`, of {', '.join(self.skills)}")

    def _full_name(self, skill: str) -> str:
        require_text("skill", skill)
        found = [one for one in self.skills if skill in (one, one.partition(".")[2])]
        if len(found) == 1:
            return found[0]
        if found:
            raise MisuseError(f"several modules have a skill `{skill}`: name one of {', '.join(found)}")
        near = did_you_mean(skill, [*self.skills, *(one.partition(".")[2] for one in self.skills)])
        hint = f"did you mean `{near}`?" if near else f"there are {', '.join(self.skills)}"
        raise MisuseError(f"there is no skill `{skill}`; {hint}")


def load_gate(
    modules: str | PathLike[str],
    *,
    skill: str | None = None,
    site: str | PathLike[str] | None = None,
    mode: GateModeName = "compiled",
    bindings: Mapping[str, str] | None = None,
    parameters: Mapping[str, str] | None = None,
) -> SkillGate:
    """Prove modules and compile the gate that decides their actions.

    Results of earlier proofs of the same files are reused.

    Args:
        modules: A module's folder or a folder of modules.
        skill: The requesting skill, as `MODULE.SKILL` or `SKILL`; None to name it in each `decide`.
        site: The site file; None for the reference site, a Panda cell.
        mode: Method of deciding conditions: `compiled`; `z3`, slow; or `checked`, both: a disagreement
            raises an exception.
        bindings: The site's name for what a module needs, by `MODULE.NEED`, as `--bind` gives it.
        parameters: Values of modules' parameters, with their units, by `MODULE.PARAMETER`, as `--set` does.

    Returns:
        The gate.

    Raises:
        UserError: A file is rejected or a claim is refuted; its text has file, line, cause and help.
        UndecidedError: A `UserError` whose only reason is that the solver ran out of its budget.
        MisuseError: There is no such skill or mode, or an argument has a wrong type.

    Example:
        >>> gate = aeros.load_gate("ecms/make_dumplings", skill="wrap")
        >>> gate.decide(aeros.act("look", camera="overhead"), {}).reasons[0].text
        '`estop_pressed` is not measured'
    """
    require_one_of("mode", mode, get_args(GateModeName))
    folder = as_path("modules", modules)
    path = reference_site_path() if site is None else as_path("site", site)
    settings = read_module_settings(bindings, parameters)
    with rendered_errors():
        configuration, _ = prove_configuration([folder], path, certified=False, settings=settings)
    return SkillGate(configuration, CompiledGate(configuration, GateMode(mode)), skill)


def _measured_at(time: float, ages: Mapping[str, float], name: str) -> float:
    """Return the time of a measurement; NaN, which the gate denies, if time or age is no number."""
    try:
        return time - ages.get(name, 0.0)
    except (AttributeError, TypeError):
        return nan
