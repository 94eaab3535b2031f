"""Resources in the view of `aeros top`: use and limits of modules, and tools with their quotas."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from aeros.spec.model.site import Site


def tools_view(
    site: Site | None, calls: Mapping[str, tuple[int, int]], quotas: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    """Describe the tools of a site, and how often they were called.

    Args:
        site: The site in force; None if its file is not available.
        calls: Number of calls of each tool, and of those that failed.
        quotas: Use and limit of each quota, by its id.

    Returns:
        JSON values by tool; the time limit of a call in seconds.
    """
    declared = (
        {}
        if site is None
        else {name: kind.tool for name, kind in site.kinds.items() if kind.tool is not None}
    )
    limited = {} if site is None else {one.id: one.kinds for one in site.quotas}
    view: dict[str, Any] = {}
    for name in dict.fromkeys([*declared, *calls]):
        made, failed = calls.get(name, (0, 0))
        view[name] = {
            "calls": made,
            "failed": failed,
            "timeout": float(declared[name].timeout) if name in declared else None,
            "quotas": {
                quota: quotas.get(quota, {"used": 0, "at_most": None})
                for quota, kinds in limited.items()
                if name in kinds
            },
        }
    return view


def resource_rows(modules: Any, tools: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Format the use of resources.

    Args:
        modules: Limits and use of each module, as the run has written them; nothing is relied on.
        tools: What `tools_view` returns.

    Yields:
        Name and use of each module, perceiver and tool.
    """
    for name, one in _mapping(modules).items():
        access = [*_texts(one, "devices", "device"), *_texts(one, "channels", "channel")]
        where = [] if _mapping(one).get("is_isolated") is not False else ["in the runtime's own process"]
        yield name, "  ".join([*where, *_code_parts(one), *access])
        for perceiver, use in _mapping(_mapping(one).get("perceivers")).items():
            yield f"{name}.{perceiver}", "  ".join(_code_parts(use))
    for name, one in tools.items():
        parts = [f"{one['calls']} calls, {one['failed']} failed"]
        parts += [] if one["timeout"] is None else [f"each at most {one['timeout']:g} s"]
        parts += [f"quota {quota} {quota_text(use)}" for quota, use in one["quotas"].items()]
        yield f"tool {name}", "  ".join(parts)


def quota_text(quota: Mapping[str, Any]) -> str:
    """Format the use of a quota.

    Args:
        quota: Its use and limit.

    Returns:
        The text, such as `3/60`.
    """
    return str(quota["used"]) + ("" if quota["at_most"] is None else f"/{quota['at_most']}")


def _code_parts(use: Any) -> Iterator[str]:
    """Format memory, answers and processes: the use of each, and its limit if there is one."""
    memory, answer, processes = (
        _mapping(_mapping(use).get(name)) for name in ("memory", "answer", "processes")
    )
    most_memory, most_time = memory.get("at_most"), answer.get("at_most")
    if processes.get("started") == 0:
        limits = [] if most_memory is None else [f"{_mebibytes(most_memory)} MiB"]
        limits += [] if most_time is None else [f"{_number(most_time)} s for an answer"]
        yield "not started" + (f"; at most {', '.join(limits)}" if limits else "")
        return
    if most_memory is not None:
        yield f"memory {_mebibytes(memory.get('used'))} of {_mebibytes(most_memory)} MiB"
    most = " s" if most_time is None else f" of {_number(most_time)} s"
    yield f"longest answer {_number(answer.get('longest'))}{most}"
    counts = (_number(processes.get(name)) for name in ("running", "started"))
    yield "processes {} running, {} started".format(*counts)


def _texts(use: Any, name: str, word: str) -> Iterator[str]:
    listed = _mapping(use).get(name)
    yield from (f"{word} {one}" for one in (listed if type(listed) is list else ()))


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if type(value) is dict else {}


def _number(value: Any) -> str:
    return f"{value:.3g}" if type(value) in (int, float) else "?"


def _mebibytes(size: Any) -> str:
    return f"{size / 2**20:.3g}" if type(size) in (int, float) else "?"
