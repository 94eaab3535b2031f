"""Read-only resources of the MCP server: manifests, site, newest records, world, plan.

Reading a resource moves nothing and changes nothing.  Each returns what is in force: a manifest's text is the
text that was proved, which the file may no longer hold.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from aeros.apps.mcp.tools import Tools
from aeros.spec.model.policy import ModuleLimits
from aeros.spec.model.site import Site

_JSON: Final = "application/json"
_YAML: Final = "application/yaml"

_READER: Final = "a client that reads resources"
_RECORDS: Final = 50
_MAX_RECORDS: Final = 500
_TAIL_BYTES: Final = 4_000_000
"""Bytes at the end of the audit log that are read at most."""


class ResourceError(Exception):
    """A resource that does not exist; the message says which ones do."""


@dataclass(frozen=True, slots=True)
class ResourceEntry:
    """Entry of the list of resources or templates.

    Attributes:
        uri: Address; of a template with a name in braces.
        name: Name for people.
        description: Text for people and language models.
        media_type: Media type of the content.
    """

    uri: str
    name: str
    description: str
    media_type: str


RESOURCES: Final = (
    ResourceEntry("aeros://site", "site", "the site file in force, as written", _YAML),
    ResourceEntry("aeros://policy", "policy", "policy in force: limits, quotas, blocks, rights", _JSON),
    ResourceEntry("aeros://modules", "modules", "active modules with digests, skills and tasks", _JSON),
    ResourceEntry("aeros://world", "world", "current measurements, as the tool `state` returns", _JSON),
    ResourceEntry("aeros://plan", "plan", "the plan in execution or the latest one; null for none", _JSON),
    ResourceEntry("aeros://records", "records", f"the newest {_RECORDS} records of the audit log", _JSON),
)
TEMPLATES: Final = (
    ResourceEntry(
        "aeros://modules/{module}", "manifest", "the manifest of an active module, as it was proved", _YAML
    ),
    ResourceEntry(
        "aeros://records/{count}", "newest-records", f"the newest records, {_MAX_RECORDS} at most", _JSON
    ),
)


class Resources:
    """Content of all resources.

    Args:
        tools: Tools of the server, which know site, modules and state.
        log: The audit log's file.
    """

    def __init__(self, tools: Tools, log: Path) -> None:
        self._tools = tools
        self._log = log

    def entries(self) -> tuple[ResourceEntry, ...]:
        """List the resources, with one for each active module.

        Returns:
            The entries.
        """
        manifests = (
            ResourceEntry(f"aeros://modules/{name}", f"manifest of {name}", TEMPLATES[0].description, _YAML)
            for name in self._tools.modules
        )
        return (*RESOURCES, *manifests)

    def read(self, uri: str) -> tuple[str, str]:
        """Read a resource.

        Args:
            uri: Its address.

        Returns:
            Media type and text.

        Raises:
            ResourceError: There is no such resource.
        """
        kind, rest = self.check_address(uri)
        match kind, rest:
            case "site", "":
                return _YAML, self._tools.site.span.source.text
            case "modules", name if name:
                return _YAML, self._tools.modules[name].span.source.text
            case "records", count:
                return _JSON, _json(self._newest_records(int(count or _RECORDS)))
        answers = {"policy": self._policy, "modules": self._modules, "world": self._world, "plan": self._plan}
        return _JSON, _json(answers[kind]())

    def check_address(self, uri: str) -> tuple[str, str]:
        """Check that a resource exists.

        Args:
            uri: Its address.

        Returns:
            The two parts of its path; the second one may be empty.

        Raises:
            ResourceError: There is no such resource.
        """
        kind, _, rest = uri.removeprefix("aeros://").partition("/")
        is_count = rest.isascii() and rest.isdigit() and len(rest) < 5
        is_known = (
            uri in {one.uri for one in RESOURCES}
            or (kind == "modules" and rest in self._tools.modules)
            or (kind == "records" and is_count)
        )
        if not uri.startswith("aeros://") or not is_known:
            raise ResourceError(_unknown(uri))
        return kind, rest

    def states(self) -> dict[str, Any]:
        """Return a state of each resource that can change; it differs once the content may.

        Reading them measures nothing, as a client that reads a resource again at each change would otherwise
        cause the next one.

        Returns:
            The states, comparable, by the resource's address.
        """
        running = self._tools.robot.running
        plan = () if running is None else (running.plan, running.progress, running.ended.is_set())
        ticked_at, _ = self._tools.measurements.last()
        try:
            size = self._log.stat().st_size
        except OSError:
            size = 0
        return {
            "aeros://world": (plan, self._tools.command(), ticked_at),
            "aeros://plan": plan,
            "aeros://records": size,
        }

    def _policy(self) -> Any:
        return _policy_to_json(self._tools.site)

    def _modules(self) -> Any:
        return {
            name: {
                "version": ecm.version,
                "manifest_digest": ecm.manifest_digest,
                "code_digest": ecm.code_digest,
                "skills": list(ecm.skills),
                "tasks": list(ecm.tasks),
                "capabilities": list(ecm.capabilities),
                "manifest": f"aeros://modules/{name}",
            }
            for name, ecm in self._tools.modules.items()
        }

    def _world(self) -> Any:
        return self._tools.call("state", {}, _READER)

    def _plan(self) -> Any:
        return self._tools.call("state", {}, _READER)["running"]

    def _newest_records(self, count: int) -> list[Any]:
        with self._log.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(max(0, size - _TAIL_BYTES))
            lines = file.read().splitlines()
        if size > _TAIL_BYTES:
            del lines[0]  # its beginning was not read
        wanted = lines[-min(count, _MAX_RECORDS) :] if count else []
        return [record for line in wanted if (record := _record(line)) is not None]


def _record(line: bytes) -> Any:
    """Return a record; None for one whose end is not written yet."""
    try:
        return json.loads(line)
    except ValueError:
        return None


def _policy_to_json(site: Site) -> Mapping[str, Any]:
    skills = site.mcp.skills
    return {
        "site": site.id,
        "digest": site.digest,
        "mcp": {
            "execute": site.mcp.execute.value,
            "most_steps": site.mcp.max_steps,
            "skills": None if skills is None else sorted(skills),
        },
        "risk_ceiling": site.risk_ceiling.name.lower(),
        "limits": _limits_to_json(site.limits),
        "quotas": [
            {
                "id": quota.id,
                "actions": sorted(quota.kinds),
                "at_most": quota.max_count,
                "within_s": float(quota.window_s),
            }
            for quota in site.quotas
        ],
        "blocks": [{"id": one.id, "reason": one.reason, "blocks": one.scope} for one in site.blocks],
        "invariants": [
            {
                "id": rule.id,
                "actions": sorted(rule.terms),
                "require": rule.text,
                "rationale": rule.rationale,
            }
            for rule in site.rules
        ],
        "resources": dict(site.resources),
        "access": str(site.access),
        "grants": {module: str(access) for module, access in site.grants.items()},
    }


def _limits_to_json(limits: ModuleLimits) -> Mapping[str, Any]:
    return {
        "skill_timeout_s": float(limits.skill_timeout),
        "retries": limits.retries,
        "replans": limits.replans,
        "planning_s": float(limits.planning),
    }


def _json(value: Any) -> str:
    return json.dumps(value, indent=1, default=str)


def _unknown(uri: str) -> str:
    known = ", ".join(one.uri for one in (*RESOURCES, *TEMPLATES))
    return f"there is no resource `{uri[:200]}`; there are {known}"
