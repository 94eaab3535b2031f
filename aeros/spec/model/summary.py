"""What other modules, and all modules together, have to know of a module: as much as fits a line of JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import Source, SourceSpan

if TYPE_CHECKING:
    from aeros.spec.model.model import Ecm, Site


@dataclass(frozen=True)
class TaskPhrase:
    """A word that routes to a task, casefolded, and where it is written."""

    task: str
    word: str
    span: SourceSpan


@dataclass(frozen=True)
class ModuleSummary:
    """A module as others see it.

    manifest_digest, code_digest, model_digests: as in its model.
    skills, capabilities: their names.
    ways: every word that routes to one of its tasks.
    written: by state variable, the values that some skill leaves it with on success, as text.
    """

    id: str
    version: str
    manifest_digest: str
    code_digest: str
    span: SourceSpan
    skills: frozenset[str]
    capabilities: tuple[str, ...]
    task_phrases: tuple[TaskPhrase, ...]
    effect_values: Mapping[str, frozenset[str]]
    requires: Mapping[str, str]
    requires_spans: Mapping[str, SourceSpan]
    runtime: str
    runtime_span: SourceSpan
    model_digests: Mapping[str, str]


@dataclass(frozen=True)
class BlockSummary:
    """A module, or a skill of it, that an operator override names, and where that is written."""

    id: str
    module: str
    skill: str | None
    span: SourceSpan


@dataclass(frozen=True)
class SiteSummary:
    """A site as claims about all modules together see it.

    digest: as in its model.
    grants: the modules that it names to grant them something, and where.
    """

    id: str
    digest: str
    grants: Mapping[str, SourceSpan]
    blocks: tuple[BlockSummary, ...]


def summarize_site(site: Site) -> SiteSummary:
    """What claims about all modules together have to know of `site`."""
    return SiteSummary(
        site.id,
        site.digest,
        {name: site.grant_spans.get(name, site.span) for name in site.grants},
        tuple(
            BlockSummary(one.id, one.module, one.skill, one.span or site.span)
            for one in site.blocks
            if one.module is not None
        ),
    )


def summarize_module(ecm: Ecm) -> ModuleSummary:
    """What others have to know of `ecm`."""
    written: dict[str, frozenset[str]] = {}
    for skill in ecm.skills.values():
        for outcome in skill.success_outcomes:
            for name, value in outcome.effects.items():
                written[name] = written.get(name, frozenset()) | {_text(value)}
    return ModuleSummary(
        ecm.id,
        ecm.version,
        ecm.manifest_digest,
        ecm.code_digest,
        ecm.span,
        frozenset(ecm.skills),
        tuple(ecm.capabilities),
        tuple(
            TaskPhrase(task.id, word, span)
            for task in ecm.tasks.values()
            for word, span in zip(task.trigger_phrases, task.word_spans, strict=True)
        ),
        written,
        dict(ecm.required_modules),
        dict(ecm.requires_spans),
        ecm.required_aeros_version,
        ecm.runtime_span,
        dict(ecm.model_digests),
    )


def _text(value: Any) -> str:
    """Different for different values of one type: a truth, a number or a member."""
    if not isinstance(value, bool | Fraction | str):
        raise MisuseError(f"no effect has the value {value!r}")
    return str(value)


def summary_to_json(presence: ModuleSummary | SiteSummary) -> Any:
    """`presence` as values for `json.dumps`; every span is of one file."""
    return {field.name: _packed(getattr(presence, field.name)) for field in fields(presence)}


def _packed(value: Any) -> Any:
    match value:
        case SourceSpan(start=start, end=end):
            return [start, end]
        case TaskPhrase(task=task, word=word, span=span):
            return [task, word, *_packed(span)]
        case BlockSummary(id=id_, module=module, skill=skill, span=span):
            return [id_, module, skill, *_packed(span)]
        case frozenset():
            return sorted(value)
        case tuple():
            return [_packed(one) for one in value]
        case Mapping():
            return {name: _packed(one) for name, one in value.items()}
        case _:
            return value


def module_summary_from_json(data: Any, manifest: Source) -> ModuleSummary:
    """The presence that was packed; raises KeyError, TypeError or ValueError for anything else."""

    def span(pair: Any) -> SourceSpan:
        return SourceSpan(manifest, *pair)

    return ModuleSummary(
        **{
            **data,
            "span": span(data["span"]),
            "skills": frozenset(data["skills"]),
            "capabilities": tuple(data["capabilities"]),
            "ways": tuple(TaskPhrase(task, word, span(at)) for task, word, *at in data["ways"]),
            "written": {name: frozenset(values) for name, values in data["written"].items()},
            "requires_spans": {name: span(at) for name, at in data["requires_spans"].items()},
            "runtime_span": span(data["runtime_span"]),
        }
    )


def site_summary_from_json(data: Any, file: Source) -> SiteSummary:
    """As `module_summary_from_json`, of a site."""
    return SiteSummary(
        data["id"],
        data["digest"],
        {name: SourceSpan(file, *at) for name, at in data["grants"].items()},
        tuple(
            BlockSummary(id_, module, skill, SourceSpan(file, *at))
            for id_, module, skill, *at in data["blocks"]
        ),
    )
