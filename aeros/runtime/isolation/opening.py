"""Where a module's code runs, as the site decides: isolated, or in this process if the site trusts it."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from types import TracebackType
from typing import Any, Final, Self

from aeros.runtime.isolation.isolated_run import IsolatedRun
from aeros.runtime.isolation.lockdown import PUT_ON
from aeros.runtime.isolation.nursery import Nursery
from aeros.runtime.skill_code import SkillRefusedError
from aeros.runtime.skill_run import Run, run_in_process
from aeros.runtime.skills import certified_code, certified_files
from aeros.spec.model import Ecm, Isolation, Site, Skill
from aeros.spec.obligations.skill_reach import HARMLESS

_NUMPY: Final = ("numpy", "numpy.fft", "numpy.linalg", "numpy.polynomial", "numpy.random")
"""NumPy imports these when they are first used, which is too late in a worker."""


class SkillRuns:
    """Opens runs of skills (`skill_run.OpenRun`), each where the site wants it.

    Probes this host when made, if any of `modules` is to be isolated.  Close it to end its processes.
    """

    def __init__(self, site: Site, modules: Iterable[Ecm], nursery: Nursery | None = None) -> None:
        self._policy: Isolation = site.isolation
        self._isolated = [ecm for ecm in modules if ecm.id not in self._policy.trusted]
        self._nursery = nursery
        if self._nursery is None and self._isolated:
            self._nursery = Nursery(_preloaded(self._isolated))
        self._missing = {} if self._nursery is None else self._nursery.missing

    def __call__(self, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> Run:
        """A run of `skill`; raises `SkillRefusedError`."""
        if ecm.id in self._policy.trusted:
            return run_in_process(ecm, skill, inputs)
        refusal = self.refusal
        if refusal is not None or self._nursery is None:
            raise SkillRefusedError(refusal or "no module was to be isolated when this was opened")
        layers = [layer for layer in PUT_ON if self._missing[layer] is None]
        code = certified_code(ecm, skill)
        return IsolatedRun(self._nursery, layers, code, inputs, float(self._policy.answer_within))

    @property
    def lacking(self) -> Mapping[str, str]:
        """The layers that the site requires and this host lacks, each with the reason."""
        why = {layer.value: missing for layer, missing in self._missing.items() if missing is not None}
        return {name: why[name] for name in sorted(self._policy.require) if name in why}

    @property
    def refusal(self) -> str | None:
        """Why no isolated module may run here; None if they may."""
        if not self.lacking or not self._policy.refuses:
            return None
        names = ", ".join(f"`{ecm.id}`" for ecm in self._isolated)
        why = "; ".join(f"{name}: {reason}" for name, reason in self.lacking.items())
        return (
            f"{names} may not run here: the site requires isolation that this host lacks ({why}); run it "
            "where there is more, or let the site trust it (`policy.isolation.trusted`) or only warn "
            "(`policy.isolation.missing: warn`)"
        )

    @property
    def warning(self) -> str | None:
        """What is weaker here than the site requires, where it lets modules run all the same."""
        if not self.lacking or self._policy.refuses:
            return None
        why = "; ".join(f"{name}: {reason}" for name, reason in self.lacking.items())
        return f"skill code is isolated less than the site requires ({why})"

    def details(self) -> dict[str, Any]:
        """What the record says: where each module runs, and behind what."""
        return {
            "isolated": sorted(ecm.id for ecm in self._isolated),
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
        if self._nursery is not None:
            self._nursery.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _preloaded(modules: Iterable[Ecm]) -> list[str]:
    """What the code of `modules` may import: a worker can open no file, so it is all there before."""
    wants_numpy = find_spec("numpy") is not None and any(_imports_numpy(ecm) for ecm in modules)
    return [*sorted(HARMLESS), *(_NUMPY if wants_numpy else ())]


def _imports_numpy(ecm: Ecm) -> bool:
    try:
        trees = [ast.parse(content) for content in certified_files(ecm).values()]
    except (SkillRefusedError, SyntaxError, ValueError):
        return False  # it will be refused when it is to run
    return any(
        (isinstance(node, ast.Import) and any(_is_numpy(one.name) for one in node.names))
        or (isinstance(node, ast.ImportFrom) and _is_numpy(node.module or ""))
        for tree in trees
        for node in ast.walk(tree)
    )


def _is_numpy(module: str) -> bool:
    return module.partition(".")[0] == "numpy"
