"""Where a module's code runs, as the site decides: isolated, or in this process if the site trusts it."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from typing import Any, Final, Self

from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.layers import APPLY_LAYER, IsolationLayer
from aeros.runtime.isolation.zygote_pool import ZygoteError, ZygotePool
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import SkillRunProtocol, run_in_process
from aeros.runtime.skills.load import certified_code, certified_files
from aeros.spec.model.model import Ecm, IsolationPolicy, Site, Skill
from aeros.spec.obligations.forbidden_access import ALLOWED_MODULES

_NUMPY: Final = ("numpy", "numpy.fft", "numpy.linalg", "numpy.polynomial", "numpy.random")
"""NumPy imports these when they are first used, which is too late in a worker."""


class SkillRunFactory:
    """Opens runs of skills (`skill_run.OpenRun`), each where the site that governs then wants it.

    Probes this host when made, if any of `modules` is to be isolated under `site`.  Close it to end its
    processes.  nursery: makes zygotes that have these modules imported.
    """

    def __init__(
        self, site: Site, modules: Iterable[Ecm], nursery: Callable[[Sequence[str]], ZygotePool] | None = None
    ) -> None:
        self._policy = site.isolation
        self._make = nursery or ZygotePool
        self._nurseries: dict[tuple[str, ...], ZygotePool] = {}
        self._isolated = [ecm for ecm in modules if ecm.id not in self._policy.trusted_modules]
        # What a host lacks is the same in each of them.
        self._missing: Mapping[IsolationLayer, str | None] = {}
        try:
            for ecm in self._isolated:
                self._pool_for(ecm)
        except BaseException:
            self.close()
            raise

    def __call__(self, site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        """A run of `skill`; raises `SkillRefusedError`."""
        policy = site.isolation
        if ecm.id in policy.trusted_modules:
            return run_in_process(site, ecm, skill, inputs)
        code = certified_code(ecm, skill)
        nursery = self._pool_for(ecm)
        lacking = self._missing_layers(policy)
        if lacking and policy.refuses_missing:
            raise SkillRefusedError(_format_unavailable([ecm.id], lacking))
        layers = [layer for layer in APPLY_LAYER if nursery.missing[layer] is None]
        return IsolatedRun(nursery, layers, code, inputs, float(policy.answer_timeout_s))

    @property
    def unavailable_reason(self) -> str | None:
        """Why no isolated module may run here under the site that was given; None if they may."""
        lacking = self._missing_layers(self._policy)
        return (
            _format_unavailable(self._isolated_modules, lacking)
            if lacking and self._policy.refuses_missing
            else None
        )

    @property
    def weakness_warning(self) -> str | None:
        """What is weaker here than that site requires, where it lets modules run all the same."""
        lacking = self._missing_layers(self._policy)
        if not lacking or self._policy.refuses_missing:
            return None
        return f"skill code is isolated less than the site requires ({_format_missing_layers(lacking)})"

    def audit_details(self) -> dict[str, Any]:
        """What the record says: where each module runs, and behind what."""
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
        for nursery in self._nurseries.values():
            nursery.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # Inside.

    @property
    def _isolated_modules(self) -> list[str]:
        return sorted(ecm.id for ecm in self._isolated)

    def _pool_for(self, ecm: Ecm) -> ZygotePool:
        preload = _preload_modules(ecm)
        if preload not in self._nurseries:
            try:
                self._nurseries[preload] = self._make(preload)
            except (ZygoteError, OSError) as failure:
                raise SkillRefusedError(f"module `{ecm.id}` cannot be isolated here: {failure}") from failure
        self._missing = self._nurseries[preload].missing
        return self._nurseries[preload]

    def _missing_layers(self, policy: IsolationPolicy) -> dict[str, str]:
        """The layers that `policy` requires and this host lacks, each with the reason."""
        why = {layer.value: missing for layer, missing in self._missing.items() if missing is not None}
        return {name: why[name] for name in sorted(policy.required_layers) if name in why}


def _format_missing_layers(lacking: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {reason}" for name, reason in lacking.items())


def _format_unavailable(modules: Iterable[str], lacking: Mapping[str, str]) -> str:
    names = ", ".join(f"`{name}`" for name in modules)
    return (
        f"{names} may not run here: the site requires isolation that this host lacks ({_format_missing_layers(lacking)}); "
        "run it where there is more, or let the site trust it (`policy.isolation.trusted_modules`) or only warn "
        "(`policy.isolation.missing: warn`)"
    )


def _preload_modules(ecm: Ecm) -> tuple[str, ...]:
    """What the code of `ecm` may import: a worker can open no file, so it is all there before."""
    wants_numpy = find_spec("numpy") is not None and _imports_numpy(ecm)
    return (*sorted(ALLOWED_MODULES), *(_NUMPY if wants_numpy else ()))


def _imports_numpy(ecm: Ecm) -> bool:
    try:
        return any(_mentions_numpy(content) for content in certified_files(ecm).values())
    except (SkillRefusedError, SyntaxError, ValueError):
        return False  # it will be refused when it is to run


@lru_cache(maxsize=256)  # asked again whenever a skill starts
def _mentions_numpy(content: bytes) -> bool:
    return any(
        (isinstance(node, ast.Import) and any(_is_numpy(one.name) for one in node.names))
        or (isinstance(node, ast.ImportFrom) and _is_numpy(node.module or ""))
        for node in ast.walk(ast.parse(content))
    )


def _is_numpy(module: str) -> bool:
    return module.partition(".")[0] == "numpy"
