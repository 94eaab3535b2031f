"""Where a module's code runs, as the site decides: isolated, or in this process if the site trusts it."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from typing import Any, Final, Self

from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.layers import PUT_ON, Layer
from aeros.runtime.isolation.zygote_pool import Nursery, ZygoteError
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.runtime.skills.in_process_run import Run, run_in_process
from aeros.runtime.skills.load import certified_code, certified_files
from aeros.spec.model.model import Ecm, Isolation, Site, Skill
from aeros.spec.obligations.forbidden_access import HARMLESS

_NUMPY: Final = ("numpy", "numpy.fft", "numpy.linalg", "numpy.polynomial", "numpy.random")
"""NumPy imports these when they are first used, which is too late in a worker."""


class SkillRuns:
    """Opens runs of skills (`skill_run.OpenRun`), each where the site that governs then wants it.

    Probes this host when made, if any of `modules` is to be isolated under `site`.  Close it to end its
    processes.  nursery: makes zygotes that have these modules imported.
    """

    def __init__(
        self, site: Site, modules: Iterable[Ecm], nursery: Callable[[Sequence[str]], Nursery] | None = None
    ) -> None:
        self._policy = site.isolation
        self._make = nursery or Nursery
        self._nurseries: dict[tuple[str, ...], Nursery] = {}
        self._isolated = [ecm for ecm in modules if ecm.id not in self._policy.trusted]
        # What a host lacks is the same in each of them.
        self._missing: Mapping[Layer, str | None] = {}
        try:
            for ecm in self._isolated:
                self._nursery_for(ecm)
        except BaseException:
            self.close()
            raise

    def __call__(self, site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> Run:
        """A run of `skill`; raises `SkillRefusedError`."""
        policy = site.isolation
        if ecm.id in policy.trusted:
            return run_in_process(site, ecm, skill, inputs)
        code = certified_code(ecm, skill)
        nursery = self._nursery_for(ecm)
        lacking = self._lacking(policy)
        if lacking and policy.refuses:
            raise SkillRefusedError(_spell_refusal([ecm.id], lacking))
        layers = [layer for layer in PUT_ON if nursery.missing[layer] is None]
        return IsolatedRun(nursery, layers, code, inputs, float(policy.answer_within))

    @property
    def refusal(self) -> str | None:
        """Why no isolated module may run here under the site that was given; None if they may."""
        lacking = self._lacking(self._policy)
        return _spell_refusal(self._names, lacking) if lacking and self._policy.refuses else None

    @property
    def warning(self) -> str | None:
        """What is weaker here than that site requires, where it lets modules run all the same."""
        lacking = self._lacking(self._policy)
        if not lacking or self._policy.refuses:
            return None
        return f"skill code is isolated less than the site requires ({_spell(lacking)})"

    def details(self) -> dict[str, Any]:
        """What the record says: where each module runs, and behind what."""
        return {
            "isolated": self._names,
            "trusted": sorted(self._policy.trusted),
            "layers": {
                layer.value: "in place" if missing is None else f"missing: {missing}"
                for layer, missing in self._missing.items()
            },
            "required": sorted(self._policy.require),
            "missing": "refuse" if self._policy.refuses else "warn",
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
    def _names(self) -> list[str]:
        return sorted(ecm.id for ecm in self._isolated)

    def _nursery_for(self, ecm: Ecm) -> Nursery:
        preload = _preloaded(ecm)
        if preload not in self._nurseries:
            try:
                self._nurseries[preload] = self._make(preload)
            except (ZygoteError, OSError) as failure:
                raise SkillRefusedError(f"module `{ecm.id}` cannot be isolated here: {failure}") from failure
        self._missing = self._nurseries[preload].missing
        return self._nurseries[preload]

    def _lacking(self, policy: Isolation) -> dict[str, str]:
        """The layers that `policy` requires and this host lacks, each with the reason."""
        why = {layer.value: missing for layer, missing in self._missing.items() if missing is not None}
        return {name: why[name] for name in sorted(policy.require) if name in why}


def _spell(lacking: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {reason}" for name, reason in lacking.items())


def _spell_refusal(modules: Iterable[str], lacking: Mapping[str, str]) -> str:
    names = ", ".join(f"`{name}`" for name in modules)
    return (
        f"{names} may not run here: the site requires isolation that this host lacks ({_spell(lacking)}); "
        "run it where there is more, or let the site trust it (`policy.isolation.trusted`) or only warn "
        "(`policy.isolation.missing: warn`)"
    )


def _preloaded(ecm: Ecm) -> tuple[str, ...]:
    """What the code of `ecm` may import: a worker can open no file, so it is all there before."""
    wants_numpy = find_spec("numpy") is not None and _imports_numpy(ecm)
    return (*sorted(HARMLESS), *(_NUMPY if wants_numpy else ()))


def _imports_numpy(ecm: Ecm) -> bool:
    try:
        return any(_names_numpy(content) for content in certified_files(ecm).values())
    except (SkillRefusedError, SyntaxError, ValueError):
        return False  # it will be refused when it is to run


@lru_cache(maxsize=256)  # asked again whenever a skill starts
def _names_numpy(content: bytes) -> bool:
    return any(
        (isinstance(node, ast.Import) and any(_is_numpy(one.name) for one in node.names))
        or (isinstance(node, ast.ImportFrom) and _is_numpy(node.module or ""))
        for node in ast.walk(ast.parse(content))
    )


def _is_numpy(module: str) -> bool:
    return module.partition(".")[0] == "numpy"
