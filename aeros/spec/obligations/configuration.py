"""Claims about all modules together: the configuration they would be installed as.

Adding a module never enlarges the set of actions that another may do.  That holds by construction, if names
are unique: module `m` may do envelope ∩ P_m ∩ Π(m) ∩ Φ.  Envelope and P_m belong to its own manifest, and Φ
belongs to the site.  Π(m) = access ∪ grants[m], risk ceiling, blocks and quotas belong to the site and the
name `m`.  No other module occurs in it.  Other modules can only cause more denials, as quotas and resources
are shared.  So the claims are about the meaning of names:

- identity: no two modules have one name, as the second would get the permissions granted to the first;
- absent: a grant or block for a name that is not in the set would apply to any module that takes that name,
  and so would the sharing of its variables (`absent_modules`).

Nor does a module's own state variable change a decision about another.  Its full name begins with the name of
its module, which is unique, and no name of a site has a `.`.  Φ and the conditions of other modules read it
only where the site shares it, under the site's own declaration.  The gate takes no notice of a module's
variable that no condition of the decision reads (`proofs/name_spaces`).

Routing: an instruction that names one task can be distinguished from those that name another.  Skills are
addressed by module and skill, so equal skill names do not collide.  Dependencies: every requirement is met
inside the set, by the one version there is.  Resources: a step takes all that it needs at once, or waits,
and needs no more than one of each, of which a site has at least one; compositions are proved in their own
group.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TypeVar

from aeros.spec.diagnostics.codes import Diagnostic, Severity, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.model.summary import ModuleSummary, SiteSummary
from aeros.spec.obligations.absent_modules import policy_name_obligations
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import StaticClaim
from aeros.spec.text.versions import is_compatible_version

_K = TypeVar("_K")
_V = TypeVar("_V")

_PhraseWords = tuple[str, ...]


def configuration_obligations(ecms: Sequence[ModuleSummary], site: SiteSummary) -> Iterator[StaticClaim]:
    """Make every claim of group configuration about a set of modules; near-linear in their number.

    Args:
        ecms: the modules.
        site: the site they would be installed at.

    Yields:
        The claims.
    """
    for name, same in _group_by_key((ecm.id, ecm) for ecm in ecms).items():
        yield StaticClaim(ClaimForm.MODULE_UNIQUE(name), _duplicate_module(same) if len(same) > 1 else None)
    yield from _routing(ecms)
    provided = _group_by_key((capability, ecm) for ecm in ecms for capability in ecm.capabilities)
    required = {capability for ecm in ecms for capability in ecm.required_capabilities}
    for capability, providers in provided.items():
        is_choice = capability in required  # which of them runs is the choice of the agent
        twice = _same_capability(capability, providers) if len(providers) > 1 and not is_choice else None
        yield StaticClaim(ClaimForm.CAPABILITY_UNIQUE(capability), twice)
    yield from _effects(ecms)
    yield from _dependencies(ecms)
    yield from policy_name_obligations({ecm.id: ecm.skills for ecm in ecms}, site)


def _group_by_key(pairs: Iterable[tuple[_K, _V]]) -> dict[_K, list[_V]]:
    found: dict[_K, list[_V]] = {}
    for key, value in pairs:
        found.setdefault(key, []).append(value)
    return found


def _duplicate_module(same: Sequence[ModuleSummary]) -> Diagnostic:
    first, *others = same
    return Diagnostic(
        "AE881",
        f"{len(same)} modules are named `{first.id}`: one would get the access granted to another",
        SpanLabel(others[0].span),
        (SpanLabel(first.span, "the name is taken here"), *(SpanLabel(one.span) for one in others[1:])),
        help=("install one of them, or rename one together with its folder",),
    )


@dataclass(frozen=True)
class _TaskPhrase:
    """A phrase that routes to a task, and its position in the manifest."""

    phrase: _PhraseWords
    module: str
    task: str
    objects: frozenset[_PhraseWords]
    span: SourceSpan

    def may_mean(self, other: _TaskPhrase) -> bool:
        """Return True if an instruction with this phrase may mean the task of another module's phrase."""
        shares_object = not (self.objects and other.objects) or not self.objects.isdisjoint(other.objects)
        return self.module != other.module and shares_object


def _routing(ecms: Sequence[ModuleSummary]) -> Iterator[StaticClaim]:
    """Claim that no phrase of one module's tasks is part of a phrase of another's about the same objects.

    Phrases are compared as `aeros.agent.instructions` reads them.
    """
    phrases = [
        _TaskPhrase(
            normalized_words(entry.word),
            ecm.id,
            entry.task,
            frozenset(map(normalized_words, entry.objects)),
            entry.span,
        )
        for ecm in ecms
        for entry in ecm.task_phrases
    ]
    by_phrase = _group_by_key((entry.phrase, entry) for entry in phrases)
    modules = {phrase: {entry.module for entry in equal} for phrase, equal in by_phrase.items()}
    lengths = sorted({len(phrase) for phrase in by_phrase})
    for phrase, equal in by_phrase.items():
        inner = {phrase[i : i + n] for n in lengths for i in range(len(phrase) - n + 1)} & modules.keys()
        clash = None
        # Almost all phrases hold none of another module, and there are thousands of them.
        if len(modules[phrase].union(*(modules[part] for part in inner))) > 1:
            contained = [entry for part in sorted(inner) for entry in by_phrase[part]]
            pairs = ((one, other) for one in equal for other in contained if one.may_mean(other))
            clash = next(pairs, None)
        yield StaticClaim(
            ClaimForm.WORDS_UNAMBIGUOUS("-".join(phrase)),  # no word holds a `-`
            None if clash is None else _ambiguous_phrases(*clash),
        )


def _ambiguous_phrases(one: _TaskPhrase, other: _TaskPhrase) -> Diagnostic:
    tasks = " or ".join(f"`{entry.module}.{entry.task}`" for entry in (one, other))
    return Diagnostic(
        "AE882",
        f"`{' '.join(one.phrase)}` may mean {tasks}",
        SpanLabel(one.span, f"routes to `{one.task}`"),
        (SpanLabel(other.span, f"routes to `{other.task}`"),),
        help=(
            "change the words, or declare `objects` that differ: no word of a task may be part of another "
            "task's word about the same objects",
        ),
    )


def _same_capability(name: str, providers: Sequence[ModuleSummary]) -> Diagnostic:
    first, second, *_ = providers
    return Diagnostic(
        "AE883",
        f"`{first.id}` and `{second.id}` both provide `{name}`",
        SpanLabel(second.span),
        (SpanLabel(first.span, "provides it too"),),
        severity=Severity.WARNING,
    )


def _effects(ecms: Sequence[ModuleSummary]) -> Iterator[StaticClaim]:
    """Warn where successes of two modules never leave a state variable with the same value."""
    written = _group_by_key(
        (name, (ecm, values)) for ecm in ecms for name, values in ecm.effect_values.items()
    )
    for name, by_module in written.items():
        module_by_values = {values: ecm for ecm, values in by_module}
        opposed = next(
            (pair for pair in combinations(module_by_values, 2) if pair[0].isdisjoint(pair[1])), None
        )
        diagnostic = None
        if opposed is not None:
            first, second = (module_by_values[values] for values in opposed)
            diagnostic = Diagnostic(
                "AE885",
                f"success leaves different values of `{name}` in `{first.id}` and in `{second.id}`",
                SpanLabel(second.span),
                (SpanLabel(first.span, "and of this one"),),
                help=("a task of one module may undo the result of a task of the other",),
                severity=Severity.WARNING,
            )
        yield StaticClaim(ClaimForm.EFFECTS_AGREE(name), diagnostic)


def _dependencies(ecms: Sequence[ModuleSummary]) -> Iterator[StaticClaim]:
    """Claim that every required module is in the set, and that all agree on its version."""
    versions = {ecm.id: ecm.version for ecm in ecms}
    for name, requiring in _group_by_key((name, ecm) for ecm in ecms for name in ecm.requires).items():
        version = versions.get(name)
        met = {
            version is not None and is_compatible_version(ecm.requires[name], version) for ecm in requiring
        }
        # A version that suits no module is reported for each module by itself.
        agreed = met == {True} or (met == {False} and version is not None)
        found = "not in this set" if version is None else f"version {version} in this set"
        labels = [SpanLabel(ecm.requires_spans[name], f"needs {ecm.requires[name]}") for ecm in requiring]
        yield StaticClaim(
            ClaimForm.VERSIONS_AGREE(name),
            None
            if agreed
            else Diagnostic(
                "AE884",
                f"`{name}`, which modules of this set need, is {found}",
                labels[0],
                tuple(labels[1:]),
                help=("name the folders of all modules that belong together, in versions that agree",),
            ),
        )
