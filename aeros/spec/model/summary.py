"""What other modules, and all modules together, have to know of a module: as much as fits a line of JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import Source, Span

if TYPE_CHECKING:
    from aeros.spec.model.model import Ecm, Site


@dataclass(frozen=True)
class Way:
    """A word that routes to a task, casefolded, and where it is written."""

    task: str
    word: str
    span: Span


@dataclass(frozen=True)
class Presence:
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
    span: Span
    skills: frozenset[str]
    capabilities: tuple[str, ...]
    ways: tuple[Way, ...]
    written: Mapping[str, frozenset[str]]
    requires: Mapping[str, str]
    requires_spans: Mapping[str, Span]
    runtime: str
    runtime_span: Span
    model_digests: Mapping[str, str]


@dataclass(frozen=True)
class Blocked:
    """A module, or a skill of it, that an operator override names, and where that is written."""

    id: str
    module: str
    skill: str | None
    span: Span


@dataclass(frozen=True)
class SitePresence:
    """A site as claims about all modules together see it.

    digest: as in its model.
    grants: the modules that it names to grant them something, and where.
    """

    id: str
    digest: str
    grants: Mapping[str, Span]
    blocks: tuple[Blocked, ...]


def presence_of_site(site: Site) -> SitePresence:
    """What claims about all modules together have to know of `site`."""
    return SitePresence(
        site.id,
        site.digest,
        {name: site.grant_spans.get(name, site.span) for name in site.grants},
        tuple(
            Blocked(one.id, one.module, one.skill, one.span or site.span)
            for one in site.blocks
            if one.module is not None
        ),
    )


def presence_of(ecm: Ecm) -> Presence:
    """What others have to know of `ecm`."""
    written: dict[str, frozenset[str]] = {}
    for skill in ecm.skills.values():
        for outcome in skill.success_outcomes:
            for name, value in outcome.effects.items():
                written[name] = written.get(name, frozenset()) | {_text(value)}
    return Presence(
        ecm.id,
        ecm.version,
        ecm.manifest_digest,
        ecm.code_digest,
        ecm.span,
        frozenset(ecm.skills),
        tuple(ecm.capabilities),
        tuple(
            Way(task.id, word, span)
            for task in ecm.tasks.values()
            for word, span in zip(task.words, task.word_spans, strict=True)
        ),
        written,
        dict(ecm.requires),
        dict(ecm.requires_spans),
        ecm.runtime,
        ecm.runtime_span,
        dict(ecm.model_digests),
    )


def _text(value: Any) -> str:
    """Different for different values of one type: a truth, a number or a member."""
    if not isinstance(value, bool | Fraction | str):
        raise MisuseError(f"no effect has the value {value!r}")
    return str(value)


def packed(presence: Presence | SitePresence) -> Any:
    """`presence` as values for `json.dumps`; every span is of one file."""
    return {field.name: _packed(getattr(presence, field.name)) for field in fields(presence)}


def _packed(value: Any) -> Any:
    match value:
        case Span(start=start, end=end):
            return [start, end]
        case Way(task=task, word=word, span=span):
            return [task, word, *_packed(span)]
        case Blocked(id=id_, module=module, skill=skill, span=span):
            return [id_, module, skill, *_packed(span)]
        case frozenset():
            return sorted(value)
        case tuple():
            return [_packed(one) for one in value]
        case Mapping():
            return {name: _packed(one) for name, one in value.items()}
        case _:
            return value


def unpacked(kept: Any, manifest: Source) -> Presence:
    """The presence that was packed; raises KeyError, TypeError or ValueError for anything else."""

    def span(pair: Any) -> Span:
        return Span(manifest, *pair)

    return Presence(
        **{
            **kept,
            "span": span(kept["span"]),
            "skills": frozenset(kept["skills"]),
            "capabilities": tuple(kept["capabilities"]),
            "ways": tuple(Way(task, word, span(at)) for task, word, *at in kept["ways"]),
            "written": {name: frozenset(values) for name, values in kept["written"].items()},
            "requires_spans": {name: span(at) for name, at in kept["requires_spans"].items()},
            "runtime_span": span(kept["runtime_span"]),
        }
    )


def unpacked_site(kept: Any, file: Source) -> SitePresence:
    """As `unpacked`, of a site."""
    return SitePresence(
        kept["id"],
        kept["digest"],
        {name: Span(file, *at) for name, at in kept["grants"].items()},
        tuple(Blocked(id_, module, skill, Span(file, *at)) for id_, module, skill, *at in kept["blocks"]),
    )
