"""The gate's finite layers as they ship, explored: any site, module, skill, kind, caller and usage.

`finite_objections` is run with its parts put aside, and each part is explored by itself.  Two overrides,
two quotas, two actuators and two channels stand for any number: the code treats each by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.gate.decision import Reason
from aeros.spec.theorems.module_copies import ModuleSource, install_stubs
from aeros.spec.theorems.smtlib import smt_and, smt_literal, smt_not, smt_or
from aeros.spec.theorems.symbolic_execution import (
    DecideBranch,
    DecisionDiagram,
    SymbolicValue,
    execute_symbolically,
)
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation

LAYERS: Final = "aeros.runtime.gate.finite_layers"
POLICY: Final = "aeros.spec.model.policy"
SITE: Final = "aeros.spec.model.site"

_BLOCKS: Final = ("block.1", "block.2")
_QUOTAS: Final = ("quota.1", "quota.2")
_ACTUATORS: Final = ("arm", "hand")
_CHANNELS: Final = ("office", "internet")
_FIELDS: Final = ("module", "skill", "kind")


def _constants(sort: str, names: Iterable[str]) -> tuple[str, ...]:
    return tuple(f"(declare-const {name} {sort})" for name in names)


def layer_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Each layer objects exactly where it is there to; together they pass exactly where each does."""
    return {
        "finite-layers": _all_layers_obligation,
        "override": _override,
        "access": _access,
        "risk": _risk,
        "counts": _counts,
        "quota": _quota,
    }


# All of them.

LAYER_DECLARATIONS: Final = (
    *_constants("Bool", ("kind-known", "module-active", "skill-exists")),
    *_constants("Bool", (f"{block}.matches" for block in _BLOCKS)),
    *_constants("Bool", ("accessible", "risk-borne", "counts-formed")),
    *_constants("Bool", (f"{quota}.{what}" for quota in _QUOTAS for what in ("governs", "left"))),
    "(define-fun unblocked () Bool (not (or block.1.matches block.2.matches)))",
    "(define-fun dispatchable () Bool (and kind-known module-active skill-exists))",
    "(define-fun quotas-left () Bool"
    " (and (=> quota.1.governs quota.1.left) (=> quota.2.governs quota.2.left)))",
    "(define-fun every-layer () Bool"
    " (and unblocked dispatchable accessible risk-borne counts-formed quotas-left))",
)
"""Result of each layer, and of all together."""


@dataclass(frozen=True)
class SymbolicSite:
    """The overrides and quotas that a site has."""

    blocks: tuple[str, ...] = _BLOCKS
    quotas: tuple[str, ...] = _QUOTAS


_WHOLE_SITE: Final = SymbolicSite()


def execute_layers(
    code: ModuleSource, result: Callable[[list[Reason]], str], with_: SymbolicSite = _WHOLE_SITE
) -> DecisionDiagram:
    """Execute `finite_objections` under such a site; `result` makes a term of the objections."""
    layers = code.module(LAYERS)

    def run(ask: DecideBranch) -> str:
        def part(question: str, code: str) -> Callable[..., Iterator[Reason]]:
            return lambda *_: iter(() if ask(question) else (Reason(code, "", ""),))

        def quota_objections(quota: Any, _: Any) -> Iterator[Reason]:
            if not ask(f"{quota.id}.left"):
                yield Reason("AE742", quota.id, "")

        install_stubs(
            layers,
            {
                "_access_objections": part("accessible", "AE740"),
                "_risk_objections": part("risk-borne", "AE741"),
                "_malformed_usage_objections": part("counts-formed", "AE704"),
                "_quota_objections": quota_objections,
            },
        )
        site = SimpleNamespace(
            kinds=_SymbolicMapping(ask, "kind-known", "kind"),
            blocks=[
                SimpleNamespace(id=one, reason="", matches=lambda *_, one=one: ask(f"{one}.matches"))
                for one in with_.blocks
            ],
            quotas=[
                SimpleNamespace(id=one, kinds=_SymbolicSet(ask, f"{one}.governs")) for one in with_.quotas
            ],
        )
        ecm = SimpleNamespace(skills=_SymbolicMapping(ask, "skill-exists", "skill"))
        configuration = SimpleNamespace(site=site, modules=_SymbolicMapping(ask, "module-active", ecm))
        caller = SimpleNamespace(module="m", skill="k")
        return result(list(layers.finite_objections(configuration, caller, "a", {})))

    return execute_symbolically(run)


class _SymbolicMapping:
    """A mapping that has what is asked for, or has not."""

    def __init__(self, ask: DecideBranch, question: str, value: Any) -> None:
        self._ask, self._question, self._value = ask, question, value

    def get(self, _: Any) -> Any:
        return self._value if self._ask(self._question) else None


class _SymbolicSet:
    """A set that has what is asked for, or has not."""

    def __init__(self, ask: DecideBranch, question: str) -> None:
        self._ask, self._question = ask, question

    def __contains__(self, _: Any) -> bool:
        return self._ask(self._question)


def no_objection(reasons: Iterable[Reason]) -> str:
    """Term that is true without objections."""
    return smt_literal(not list(reasons))


def objects_with_code(code: str) -> Callable[[list[Reason]], str]:
    """Term that is true if an objection has this code."""
    return lambda found: smt_literal(any(one.code == code for one in found))


def _all_layers_obligation(code: ModuleSource) -> TheoremObligation:
    # Where there is no such module, skill or kind, nobody asks what it may touch.
    return TheoremObligation(
        "`finite_objections` yields nothing exactly where every finite layer passes.",
        LAYER_DECLARATIONS,
        "(= nothing every-layer)",
        tables=(SymbolicFunction("nothing", "Bool", execute_layers(code, no_objection)),),
    )


# Overrides.


def _override(code: ModuleSource) -> TheoremObligation:
    policy = code.module(POLICY)

    def run(ask: DecideBranch) -> str:
        def given(name: str) -> Any:
            return None if ask(f"any-{name}") else SymbolicValue(f"blocked-{name}", ask)

        block = policy.OperatorOverride("block", "", *(given(name) for name in _FIELDS))
        asking = (SymbolicValue(f"asking-{name}", ask) for name in _FIELDS)
        return str(bool(block.matches(*asking))).lower()

    matched = smt_and(f"(or any-{name} (= blocked-{name} asking-{name}))" for name in _FIELDS)
    return TheoremObligation(
        "`OperatorOverride.matches` exactly where every field that the operator gave is that of who asks,\n"
        "and what for.",
        (
            "(declare-sort Name 0)",
            *_constants("Bool", (f"any-{name}" for name in _FIELDS)),
            *_constants("Name", (f"{whose}-{name}" for name in _FIELDS for whose in ("blocked", "asking"))),
        ),
        f"(= matches {matched})",
        tables=(SymbolicFunction("matches", "Bool", execute_symbolically(run)),),
    )


# Access.


class _NameSet:
    """A set of actuators or channels: for each, the formula that says whether it is in."""

    def __init__(self, ask: DecideBranch, members: Mapping[str, str]) -> None:
        self._ask, self._members = ask, members

    @classmethod
    def named(cls, ask: DecideBranch, whose: str, names: Iterable[str]) -> _NameSet:
        return cls(ask, {one: f"{whose}.{one}" for one in names})

    def _combine(self, other: _NameSet | frozenset[str], of_both: Callable[[str, str], str]) -> _NameSet:
        theirs = (
            other._members
            if isinstance(other, _NameSet)
            else {x: smt_literal(x in other) for x in self._members}
        )
        return _NameSet(self._ask, {x: of_both(mine, theirs[x]) for x, mine in self._members.items()})

    def __and__(self, other: _NameSet | frozenset[str]) -> _NameSet:
        return self._combine(other, lambda mine, theirs: smt_and([mine, theirs]))

    def __or__(self, other: _NameSet | frozenset[str]) -> _NameSet:
        return self._combine(other, lambda mine, theirs: smt_or([mine, theirs]))

    def __sub__(self, other: _NameSet | frozenset[str]) -> _NameSet:
        return self._combine(other, lambda mine, theirs: smt_and([mine, smt_not(theirs)]))

    def __iter__(self) -> Iterator[str]:
        return (one for one, formula in self._members.items() if self._ask(formula))


def _granted(name: str) -> str:
    return f"(or site.{name} (and granted grant.{name}))"


def _access(code: ModuleSource) -> TheoremObligation:
    layers, policy = code.module(LAYERS), code.module(POLICY)
    sites = code.module(SITE, using=(policy,))

    def run(ask: DecideBranch) -> str:
        def access(whose: str) -> Any:
            actuators, channels = (_NameSet.named(ask, whose, names) for names in (_ACTUATORS, _CHANNELS))
            return policy.Access(actuators, channels=channels)

        class Grants:
            def get(self, _: str, default: Any) -> Any:
                return access("grant") if ask("granted") else default

        site = SimpleNamespace(access=access("site"), grants=Grants())
        site.access_of = lambda module: sites.Site.access_of(site, module)
        ecm = SimpleNamespace(id="m", requested_access=access("module"))
        skill = SimpleNamespace(id="k", actuators=_NameSet.named(ask, "skill", _ACTUATORS))
        kind = access("kind")
        return no_objection(layers._access_objections(site, ecm, skill, kind))

    usable = smt_and(
        (
            *(f"(=> kind.{one} (and skill.{one} module.{one} {_granted(one)}))" for one in _ACTUATORS),
            *(f"(=> kind.{one} (and module.{one} {_granted(one)}))" for one in _CHANNELS),
        )
    )
    names = (*_ACTUATORS, *_CHANNELS)
    return TheoremObligation(
        "`_access_objections` yields nothing exactly where each actuator of the kind is the skill's, the\n"
        "module's, and the site's for everybody or granted to the module; and each channel that its tool\n"
        "uses is the module's, and the site's for everybody or granted to the module.",
        _constants(
            "Bool",
            (
                "granted",
                *(f"{whose}.{one}" for one in names for whose in ("kind", "module", "site", "grant")),
                *(f"skill.{one}" for one in _ACTUATORS),
            ),
        ),
        f"(= nothing {usable})",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
    )


# Risk.


def _risk(code: ModuleSource) -> TheoremObligation:
    layers = code.module(LAYERS)

    def run(ask: DecideBranch) -> str:
        kind = SimpleNamespace(name="a", risk=SymbolicValue("kind.risk", ask))
        skill = SimpleNamespace(id="k", risk=SymbolicValue("skill.risk", ask))
        site = SimpleNamespace(risk_ceiling=SymbolicValue("site.risk", ask))
        return no_objection(layers._risk_objections(site, skill, kind))

    return TheoremObligation(
        "`_risk_objections` yields nothing exactly where the skill declares the risk of the kind, and the\n"
        "site bears that of the skill.",
        _constants("Int", ("kind.risk", "skill.risk", "site.risk")),
        "(= nothing (and (<= kind.risk skill.risk) (<= skill.risk site.risk)))",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
    )


# Quotas, and what is said of their use.

_USAGE_DECLARATIONS: Final = (
    *_constants("Bool", (f"{quota}.{what}" for quota in _QUOTAS for what in ("told", "whole"))),
    *_constants("Int", (f"{quota}.{what}" for quota in _QUOTAS for what in ("used", "at-most"))),
    "(declare-const stranger-told Bool)",
)


class _SymbolicUsage:
    """Symbolic usage of each quota, as the caller states it."""

    def __init__(self, ask: DecideBranch) -> None:
        self._ask = ask

    def get(self, quota: str) -> Any:
        return SymbolicValue(f"{quota}.used", self._ask) if self._ask(f"{quota}.told") else None

    def items(self) -> Iterator[tuple[str, Any]]:
        yield from (
            (one, SymbolicValue(f"{one}.used", self._ask)) for one in _QUOTAS if self._ask(f"{one}.told")
        )
        if self._ask("stranger-told"):
            yield "stranger", 0


def _type_of(value: Any) -> type:
    """Type of a quota's stated usage: `int`, or `str` for a value that is no number."""
    if not isinstance(value, SymbolicValue):
        return type(value)
    return int if value.ask(f"{value.term.removesuffix('.used')}.whole") else str


def _counts(code: ModuleSource) -> TheoremObligation:
    layers = code.module(LAYERS, type=_type_of)

    def run(ask: DecideBranch) -> str:
        site = SimpleNamespace(quotas=[SimpleNamespace(id=quota) for quota in _QUOTAS])
        return no_objection(layers._malformed_usage_objections(site, _SymbolicUsage(ask)))

    formed = smt_and(
        ["(not stranger-told)", *(f"(=> {q}.told (and {q}.whole (>= {q}.used 0)))" for q in _QUOTAS)]
    )
    return TheoremObligation(
        "`_malformed_usage_objections` yields nothing exactly where all that is said of use is a count of\n"
        "a quota of the site.",
        _USAGE_DECLARATIONS,
        f"(= nothing {formed})",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
    )


def _quota(code: ModuleSource) -> TheoremObligation:
    layers = code.module(LAYERS, type=_type_of)

    def run(ask: DecideBranch) -> str:
        quota = SimpleNamespace(id="quota.1", max_count=SymbolicValue("quota.1.at-most", ask))
        return no_objection(layers._quota_objections(quota, _SymbolicUsage(ask)))

    return TheoremObligation(
        "`_quota_objections` yields nothing exactly where less of it is used than there is; of what is no\n"
        "count, `_malformed_usage_objections` has objected.",
        _USAGE_DECLARATIONS,
        "(=> (=> quota.1.told (and quota.1.whole (>= quota.1.used 0)))"
        " (= nothing (and quota.1.told (< quota.1.used quota.1.at-most))))",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
    )
