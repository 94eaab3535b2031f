"""Choice of where a module's code runs, by the site's policy: isolated, or in this process."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, Self

from aeros.distribution import install_command
from aeros.models.load import modules_to_preload
from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.zygote_pool import ZygoteError, ZygotePool
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import SkillRunProtocol, run_in_process
from aeros.runtime.skills.load import certified_code, certified_files
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.policy import IsolationPolicy, WorkerLimits
from aeros.spec.model.site import Site
from aeros.spec.obligations.skill_syntax.allowed_names import ALLOWED_MODULES

NUMPY_MODULES: Final = (
    "numpy",
    "numpy.fft",
    "numpy.linalg",
    "numpy.ma",
    "numpy.polynomial",
    "numpy.random",
)
"""Submodules that NumPy imports on first use, which is too late in a worker."""


class SkillRunFactory:
    """Opens runs of skills (`in_process_run.OpenRun`), each where the site in force at that time requires.

    Probes this host when created, if any module is to be isolated. Close it to end its processes.

    Args:
        site: the site in force at first.
        modules: active modules.
        make_pool: makes a pool of zygotes that have the given Python modules imported.

    Raises:
        SkillRefusedError: a module cannot be isolated here.
    """

    def __init__(
        self,
        site: Site,
        modules: Iterable[Ecm],
        make_pool: Callable[[Sequence[str]], ZygotePool] | None = None,
    ) -> None:
        self._policy = site.isolation
        modules = tuple(modules)
        self._make_pool = make_pool or ZygotePool
        self._pools: dict[tuple[str, ...], ZygotePool] = {}
        self._isolated = [ecm for ecm in modules if ecm.id not in self._policy.trusted_modules]
        # The same for every pool, because it depends on the host.
        self._missing: Mapping[IsolationLayer, str | None] = {}
        try:
            for ecm in self._isolated:
                self._pool_for(ecm, _preload_modules(ecm))
        except BaseException:
            self.close()
            raise

    def __call__(self, site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        """Implement `OpenRun`.

        Raises:
            SkillRefusedError: the host lacks a required isolation layer, or a device.
        """
        require_devices(site, ecm)
        if ecm.id in site.isolation.trusted_modules:
            return run_in_process(site, ecm, skill, inputs)
        code = certified_code(ecm, skill)
        pool, layers = self.pool_and_layers(site, ecm, _preload_modules(ecm))
        asked = limits_in_force(site, ecm)
        limits = ProcessLimits(asked.memory, float(asked.processor))
        return IsolatedRun(pool, layers, code, inputs, float(asked.answer_within), limits)

    def pool_and_layers(
        self, site: Site, ecm: Ecm, preload: tuple[str, ...]
    ) -> tuple[ZygotePool, list[IsolationLayer]]:
        """Return a pool for code of a module that the site does not trust, and the layers to apply.

        Args:
            site: the site in force.
            ecm: the module.
            preload: modules that the zygotes import.

        Returns:
            The pool, and the layers of this host that a worker applies to itself.

        Raises:
            SkillRefusedError: the host lacks a required isolation layer, or there are no zygotes.
        """
        pool = self._pool_for(ecm, preload)
        lacking = self._missing_layers(site.isolation)
        if lacking and site.isolation.refuses_missing:
            raise SkillRefusedError(_format_unavailable([ecm.id], lacking))
        return pool, [layer for layer in APPLY_LAYER if pool.missing[layer] is None]

    @property
    def unavailable_reason(self) -> str | None:
        """Reason why no isolated module may run here under the given site; None if they may."""
        lacking = self._missing_layers(self._policy)
        return (
            _format_unavailable(self._isolated_modules, lacking)
            if lacking and self._policy.refuses_missing
            else None
        )

    @property
    def weakness_warning(self) -> str | None:
        """Warning that isolation is weaker than the site requires, if it lets modules run nevertheless."""
        lacking = self._missing_layers(self._policy)
        if not lacking or self._policy.refuses_missing:
            return None
        return f"skill code is isolated less than the site requires ({_format_missing_layers(lacking)})"

    def audit_details(self) -> dict[str, Any]:
        """Describe for the audit log where each module runs and which layers are in place.

        Returns:
            JSON-encodable details.
        """
        return {
            "isolated": self._isolated_modules,
            "trusted": sorted(self._policy.trusted_modules),
            "layers": {
                layer.value: "in place" if missing is None else f"missing: {missing}"
                for layer, missing in self._missing.items()
            },
            "required": sorted(self._policy.required_layers),
            "missing": "refuse" if self._policy.refuses_missing else "warn",
        }

    def close(self) -> None:
        """End every process that was started; safe to call twice."""
        for pool in self._pools.values():
            pool.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def _isolated_modules(self) -> list[str]:
        return sorted(ecm.id for ecm in self._isolated)

    def _pool_for(self, ecm: Ecm, preload: tuple[str, ...]) -> ZygotePool:
        if preload not in self._pools:
            try:
                self._pools[preload] = self._make_pool(preload)
            except (ZygoteError, OSError) as failure:
                raise SkillRefusedError(f"module `{ecm.id}` cannot be isolated here: {failure}") from failure
        self._missing = self._pools[preload].missing
        return self._pools[preload]

    def _missing_layers(self, policy: IsolationPolicy) -> dict[str, str]:
        """Return the layers that `policy` requires and this host lacks, each with the reason."""
        why = {layer.value: missing for layer, missing in self._missing.items() if missing is not None}
        return {name: why[name] for name in sorted(policy.required_layers) if name in why}


def limits_in_force(site: Site, ecm: Ecm) -> WorkerLimits:
    """Return the limits on the processes of a module's skills.

    Args:
        site: the site in force.
        ecm: the module.

    Returns:
        The module's own limits, as far as the site allows them; else those of the site.
    """
    policy = site.isolation
    limits = ecm.worker or WorkerLimits(policy.memory, policy.answer_timeout_s, policy.processor)
    return WorkerLimits(
        min(limits.memory, policy.memory),
        min(limits.answer_within, policy.answer_timeout_s),
        min(limits.processor, policy.processor),
    )


def require_devices(site: Site, ecm: Ecm) -> None:
    """Require that this computer has every computing device that a module asks for.

    Args:
        site: the site, which says how a device shows.
        ecm: the module.

    Raises:
        SkillRefusedError: the site does not know a device, or its file is missing here.
    """
    for name in sorted(ecm.requested_access.compute):
        file = site.devices.get(name)
        if file is None or not Path(file).exists():
            where = "the site declares no such device" if file is None else f"this computer has no `{file}`"
            raise SkillRefusedError(f"module `{ecm.id}` needs `{name}`, and {where}")


def _format_missing_layers(lacking: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {reason}" for name, reason in lacking.items())


def _format_unavailable(modules: Iterable[str], lacking: Mapping[str, str]) -> str:
    names = ", ".join(f"`{name}`" for name in modules)
    return (
        f"{names} may not run here: the site requires isolation that this host lacks "
        f"({_format_missing_layers(lacking)}); use another host, or let the site trust it "
        "(`policy.isolation.trusted`) or only warn (`policy.isolation.missing: warn`)"
    )


def engine_modules(ecm: Ecm, models: Iterable[str]) -> tuple[str, ...]:
    """List the Python modules that a worker imports before it can open no file, to load some models.

    Args:
        ecm: the module.
        models: names of the models.

    Returns:
        Names of Python modules.

    Raises:
        SkillRefusedError: a library that the models need is not installed.
    """
    engines = modules_to_preload(ecm.models[name].kind for name in models)
    missing = [name for name in engines if find_spec(name.partition(".")[0]) is None]
    if missing:
        lacks = f"module `{ecm.id}` has networks and `{missing[0]}` is not installed"
        raise SkillRefusedError(f"{lacks}: {install_command('learned')}")
    return engines


def _preload_modules(ecm: Ecm) -> tuple[str, ...]:
    """Return the modules that a worker for `ecm` may need: it can open no file to import them.

    Raises:
        SkillRefusedError: a library that its models need is not installed.
    """
    wants_numpy = find_spec("numpy") is not None and _imports_numpy(ecm)
    engines = engine_modules(ecm, (name for skill in ecm.skills.values() for name in skill.models))
    names = (*sorted(ALLOWED_MODULES), *(NUMPY_MODULES if wants_numpy else ()), *engines)
    return tuple(dict.fromkeys(names))


def _imports_numpy(ecm: Ecm) -> bool:
    """Return True if the code of a skill imports NumPy, or a file of the module that it imports does."""
    try:
        files = certified_files(ecm)
        left = {f"{skill.module_name}.py" for skill in ecm.skills.values()} & files.keys()
        read = set(left)
        while left:
            has_numpy, neighbours = _imports_of(files[left.pop()])
            if has_numpy:
                return True
            left |= neighbours & files.keys() - read
            read |= left
    except (SkillRefusedError, SyntaxError, ValueError):
        pass  # it is refused when it is to run
    return False


@lru_cache(maxsize=256)  # called whenever a skill starts
def _imports_of(content: bytes) -> tuple[bool, frozenset[str]]:
    """Tell if a file imports NumPy, and which files of its module it imports, wherever the statement is."""
    has_numpy, neighbours = False, set[str]()
    for node in ast.walk(ast.parse(content)):
        if isinstance(node, ast.Import):
            has_numpy |= any(_is_numpy(alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            has_numpy |= _is_numpy(node.module or "")
        elif isinstance(node, ast.ImportFrom):
            named = [node.module] if node.module else [alias.name for alias in node.names]
            neighbours.update(f"{name}.py" for name in named)
    return has_numpy, frozenset(neighbours)


def _is_numpy(module: str) -> bool:
    return module.partition(".")[0] == "numpy"
