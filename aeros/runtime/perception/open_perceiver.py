"""Choice of where a perceiver runs, by the site's policy: in a worker, or in this process."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Final

from aeros.distribution import install_command
from aeros.runtime.isolation.run_factory import NUMPY_MODULES, SkillRunFactory, engine_modules
from aeros.runtime.perception.perceiver_run import (
    InProcessPerceiver,
    IsolatedPerceiver,
    OpenPerceiver,
    PerceiverRun,
)
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.load import certified_code
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Perceiver
from aeros.spec.model.site import Site
from aeros.spec.obligations.skill_syntax.allowed_names import ALLOWED_MODULES

PRELOADED: Final = (
    *sorted(ALLOWED_MODULES),
    *NUMPY_MODULES,
    "aeros.perception",
    "aeros.runtime.isolation.perceiver_worker",
)
"""Modules that zygotes of perceivers import: a worker can open no file and start no thread."""


def open_in_process(_: Site, ecm: Ecm, perceiver: Perceiver) -> PerceiverRun:
    """Open a perceiver in this process; trusts the code with everything this process can reach.

    Args:
        ecm: the module.
        perceiver: the perceiver of it.

    Returns:
        The run.

    Raises:
        SkillRefusedError: the code is not the certified code, or is no perceiver; or NumPy is missing.
    """
    _require_numpy(ecm)
    return InProcessPerceiver(certified_code(ecm, perceiver), perceiver)


def open_by_policy(skills: SkillRunFactory) -> OpenPerceiver:
    """Make a function that opens each perceiver where the site in force requires.

    Args:
        skills: factory of skill runs, which has the pools of zygotes.

    Returns:
        The function.
    """

    def open_perceiver(site: Site, ecm: Ecm, perceiver: Perceiver) -> PerceiverRun:
        if ecm.id in site.isolation.trusted_modules:
            return open_in_process(site, ecm, perceiver)
        _require_numpy(ecm)
        code = certified_code(ecm, perceiver)
        preload = (*PRELOADED, *engine_modules(ecm, perceiver.models))
        pool, layers = skills.pool_and_layers(site, ecm, tuple(dict.fromkeys(preload)))
        return IsolatedPerceiver(pool, layers, code, perceiver, float(site.isolation.answer_timeout_s))

    return open_perceiver


def _require_numpy(ecm: Ecm) -> None:
    if find_spec("numpy") is None:
        raise SkillRefusedError(
            f"the perceivers of module `{ecm.id}` need {install_command('kinematic')} (numpy is missing)"
        )
