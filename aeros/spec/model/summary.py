"""Summaries of a module and a site for claims about several modules; each fits a line of JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.diagnostics.words import expanded
from aeros.spec.text.site_layers import layer_span, whole_offset

if TYPE_CHECKING:
    from aeros.spec.model.ecm import Ecm, Task
    from aeros.spec.model.site import Site


@dataclass(frozen=True)
class TaskPhrase:
    """Word that routes an instruction to a task.

    Attributes:
        task: id of the task.
        word: the word, casefolded.
        objects: phrases of which one must be said with it, casefolded; empty if none is needed.
        span: place in the manifest.
    """

    task: str
    word: str
    objects: tuple[str, ...]
    span: SourceSpan


class ComposedScenes(NamedTuple):
    """Scenes that make up the cell of a task that names none itself.

    Attributes:
        task: id of the task.
        scenes: module and name of each scene.
        span: place of the task in the manifest.
    """

    task: str
    scenes: tuple[tuple[str, str], ...]
    span: SourceSpan


@dataclass(frozen=True)
class ModuleSummary:
    """Module as other modules see it.

    Attributes:
        id: as in its model.
        version: as in its model.
        manifest_digest: as in its model.
        code_digest: as in its model.
        span: as in its model.
        skills: names of its skills.
        capabilities: names of its capabilities.
        task_phrases: every word that routes to one of its tasks.
        effect_values: by state variable, the values that some skill leaves it with on success, as text.
        requires: `required_modules` of its model.
        requires_spans: as in its model.
        runtime: `required_aeros_version` of its model.
        runtime_span: as in its model.
        model_digests: as in its model.
        variables: its own state variables without its own name, each with the members of its enum.
        measured_by_site: full names of those that a sensor of the site measures.
        needed_cameras: the site's names of cameras without whose pictures a perceiver or skill does not work.
        left_out: outcomes of probability 0, which its closed loops leave out.
        capability_versions: as in its model.
        required_capabilities: as in its model.
        capability_spans: as in its model.
        configuration: as in its model.
        resources: as in its model.
        scenes: scenes that its tasks name, and where.
        composed_scenes: of its tasks that name no scene and compose others, the scenes of these.
        cameras: for itself and each module that it requires, the site's names of cameras by the module's.
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
    variables: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    capability_versions: Mapping[str, str] = field(default_factory=dict)
    required_capabilities: Mapping[str, str] = field(default_factory=dict)
    capability_spans: Mapping[str, SourceSpan] = field(default_factory=dict)
    configuration: Mapping[str, str] = field(default_factory=dict)
    resources: Mapping[str, str] = field(default_factory=dict)
    scenes: Mapping[str, SourceSpan] = field(default_factory=dict)
    composed_scenes: tuple[ComposedScenes, ...] = ()
    measured_by_site: tuple[str, ...] = ()
    needed_cameras: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    cameras: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    @property
    def has_requirements(self) -> bool:
        """True if it needs other modules, so that its proof may depend on them."""
        return bool(self.requires or self.required_capabilities)


@dataclass(frozen=True)
class BlockSummary:
    """Operator override that names a module or a skill.

    Attributes:
        id: name of the override.
        module: name of the module.
        skill: id of the module's skill; None if it blocks the module as a whole.
        span: place in the site file.
    """

    id: str
    module: str
    skill: str | None
    span: SourceSpan


@dataclass(frozen=True)
class SiteSummary:
    """Site as claims about all modules together see it.

    Attributes:
        id: as in its model.
        digest: as in its model.
        grants: modules that the site grants something, and where.
        blocks: operator overrides that name a module.
        shared: variables of modules that the site shares, by full name, and where.
        settings: modules that have settings, and where in the site file; None if the operator alone has any.
        variables: its own state variables, each with the members of its enum.
    """

    id: str
    digest: str
    grants: Mapping[str, SourceSpan]
    blocks: tuple[BlockSummary, ...]
    shared: Mapping[str, SourceSpan] = field(default_factory=dict)
    settings: Mapping[str, SourceSpan | None] = field(default_factory=dict)
    variables: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def summarize_site(site: Site) -> SiteSummary:
    """Extract the parts of a site that claims about all modules read.

    Args:
        site: resolved site.

    Returns:
        The summary.
    """
    from aeros.spec.model.variables import members_of  # not in a run that finds its proofs in the cache

    return SiteSummary(
        site.id,
        site.digest,
        {name: site.grant_spans.get(name, site.span) for name in site.grants},
        tuple(
            BlockSummary(block.id, block.module, block.skill, block.span or site.span)
            for block in site.blocks
            if block.module is not None
        ),
        {name: one.span for name, one in site.perception.shared.items()},
        {name: site.policy_spans.get(f"modules/{name}") for name in site.configurations},
        members_of({name: one for name, one in site.state.items() if "." not in name}),
    )


def summarize_module(ecm: Ecm) -> ModuleSummary:
    """Extract the parts of a module that other modules read.

    Args:
        ecm: resolved module.

    Returns:
        The summary.
    """
    from aeros.spec.model.variables import measured_by_site, members_of

    effect_values: dict[str, frozenset[str]] = {}
    for skill in ecm.skills.values():
        for outcome in skill.success_outcomes:
            for name, value in outcome.effects.items():
                effect_values[name] = effect_values.get(name, frozenset()) | {_text(value)}
    return ModuleSummary(
        ecm.id,
        ecm.version,
        ecm.manifest_digest,
        ecm.code_digest,
        ecm.span,
        frozenset(ecm.skills),
        tuple(ecm.capabilities),
        tuple(
            TaskPhrase(task.id, word, task.object_phrases, span)
            for task in ecm.tasks.values()
            for pattern, span in zip(task.trigger_phrases, task.word_spans, strict=True)
            for word in expanded(pattern)
        ),
        effect_values,
        dict(ecm.required_modules),
        dict(ecm.requires_spans),
        ecm.required_aeros_version,
        ecm.runtime_span,
        dict(ecm.model_digests),
        members_of(ecm.state),
        dict(ecm.capability_versions),
        dict(ecm.required_capabilities),
        dict(ecm.capability_spans),
        dict(ecm.configuration),
        dict(ecm.resources),
        {task.scene: task.span for task in ecm.tasks.values() if task.scene is not None},
        tuple(
            ComposedScenes(task.id, scenes, task.span)
            for task in ecm.tasks.values()
            if task.scene is None and (scenes := _scenes_of_composed(ecm, task))
        ),
        measured_by_site(ecm.state),
        _needed_cameras(ecm),
        tuple(
            f"{name}.{one.id}"
            for name, skill in ecm.callable_skills.items()
            for one in skill.outcomes.values()
            if ecm.tasks and one.probability == 0
        ),
        {
            one.id: dict(one.names.cameras)
            for one in (ecm, *ecm.foreign.modules.values())
            if one.names.cameras
        },
    )


def _needed_cameras(ecm: Ecm) -> tuple[str, ...]:
    pictures = [one for perceiver in ecm.perceivers.values() for one in perceiver.pictures]
    needed = [one.camera for one in pictures if not one.optional]
    optional = {one.camera for one in pictures} - set(needed)
    own = (one for one in ecm.names.cameras.values() if one not in optional)
    return tuple(dict.fromkeys((*needed, *own)))


def _scenes_of_composed(ecm: Ecm, task: Task) -> tuple[tuple[str, str], ...]:
    return tuple((id_, one.scene) for id_, one in task.rehearsals(ecm.id) if one.scene is not None)


def _text(value: Any) -> str:
    """Format a truth, a number, a member or an increment; different values of one type get different texts.

    Raises:
        MisuseError: the value is none of these.
    """
    # Here, as a run that finds its proofs in the cache imports nothing of the language.
    from aeros.spec.expr.effects import Increment

    if not isinstance(value, bool | Fraction | str | Increment):
        raise MisuseError(f"no effect has the value {value!r}")
    return str(value)


def summary_to_json(summary: ModuleSummary | SiteSummary, file: Source | None = None) -> Any:
    """Convert a summary for `json.dumps`.

    Args:
        summary: summary of a module or site.
        file: text of a site with all its layers, which the spans are in; None if they are in one file.

    Returns:
        Plain values; a span is its start and end offset in the file, or in the text of all layers.
    """
    return {one.name: _packed(getattr(summary, one.name), file) for one in fields(summary)}


def _packed(value: Any, file: Source | None) -> Any:
    match value:
        case SourceSpan(start=start, end=end):
            first = 0 if file is None else whole_offset(file, value)
            return [first + start, first + end]
        case TaskPhrase(task=task, word=word, objects=objects, span=span):
            return [task, word, list(objects), *_packed(span, file)]
        case ComposedScenes(task=task, scenes=scenes, span=span):
            return [task, [list(one) for one in scenes], *_packed(span, file)]
        case BlockSummary(id=id_, module=module, skill=skill, span=span):
            return [id_, module, skill, *_packed(span, file)]
        case frozenset():
            return sorted(value)
        case tuple():
            return [_packed(item, file) for item in value]
        case Mapping():
            return {name: _packed(item, file) for name, item in value.items()}
        case _:
            return value


def module_summary_from_json(data: Any, manifest: Source) -> ModuleSummary:
    """Read the summary of a module.

    Args:
        data: values that `summary_to_json` made.
        manifest: the manifest, which the spans are in.

    Returns:
        The summary.

    Raises:
        KeyError: a field is missing.
        TypeError: a field has another type, or there is an unknown field.
        ValueError: a value is malformed.
        MisuseError: a span lies outside the manifest.
    """

    def span(pair: Any) -> SourceSpan:
        return SourceSpan(manifest, *pair)

    return ModuleSummary(
        **{
            **data,
            "span": span(data["span"]),
            "skills": frozenset(data["skills"]),
            "capabilities": tuple(data["capabilities"]),
            "task_phrases": tuple(
                TaskPhrase(task, word, tuple(objects), span(at))
                for task, word, objects, *at in data["task_phrases"]
            ),
            "effect_values": {name: frozenset(values) for name, values in data["effect_values"].items()},
            "requires_spans": {name: span(at) for name, at in data["requires_spans"].items()},
            "runtime_span": span(data["runtime_span"]),
            "variables": _members(data["variables"]),
            "capability_spans": {name: span(at) for name, at in data["capability_spans"].items()},
            "measured_by_site": tuple(data["measured_by_site"]),
            "needed_cameras": tuple(data["needed_cameras"]),
            "left_out": tuple(data["left_out"]),
            "scenes": {name: span(at) for name, at in data["scenes"].items()},
            "composed_scenes": tuple(
                ComposedScenes(task, tuple((module, scene) for module, scene in scenes), span(at))
                for task, scenes, *at in data["composed_scenes"]
            ),
        }
    )


def site_summary_from_json(data: Any, file: Source) -> SiteSummary:
    """Read the summary of a site.

    Args:
        data: values that `summary_to_json` made.
        file: text of the site with all its layers, which the spans are in.

    Returns:
        The summary.

    Raises:
        KeyError: a field is missing.
        TypeError: a field has another type.
        ValueError: a value is malformed.
        MisuseError: a span lies outside the file.
    """
    return SiteSummary(
        data["id"],
        data["digest"],
        {name: layer_span(file, *at) for name, at in data["grants"].items()},
        tuple(
            BlockSummary(id_, module, skill, layer_span(file, *at))
            for id_, module, skill, *at in data["blocks"]
        ),
        {name: layer_span(file, *at) for name, at in data["shared"].items()},
        {name: None if at is None else layer_span(file, *at) for name, at in data["settings"].items()},
        _members(data["variables"]),
    )


def _members(data: Any) -> dict[str, tuple[str, ...]]:
    return {name: tuple(members) for name, members in data.items()}
