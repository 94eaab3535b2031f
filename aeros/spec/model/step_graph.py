"""Generic graphs of steps, and walks over them.

Σ ::= step | Σ ; Σ | Σ ∥ Σ | if c then Σ else Σ | Σ or else Σ | again Σ | fail | Σ while c | Σ within t
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Final, Generic, TypeAlias, TypeVar, cast

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t

if TYPE_CHECKING:
    from aeros.spec.model.ecm import ActionCondition

S = TypeVar("S")
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Seq(Generic[S]):
    """Parts that run one after the other; it does nothing if empty.

    Attributes:
        parts: parts in the order in which they run.
    """

    parts: tuple[Part[S], ...]

    def __str__(self) -> str:
        return f"({' → '.join(map(str, self.parts))})" if self.parts else "nothing"


@dataclass(frozen=True, slots=True)
class Par(Generic[S]):
    """Parts that run at the same time. It fails with the first branch that fails for good.

    Attributes:
        branches: parts that start at the same time.
        span: place in the manifest.
    """

    branches: tuple[Part[S], ...]
    span: SourceSpan

    def __str__(self) -> str:
        return f"({' ∥ '.join(map(str, self.branches))})"


@dataclass(frozen=True, slots=True)
class If(Generic[S]):
    """Choice: `then` if the condition is measured as true, `otherwise` if as false; else it fails.

    Attributes:
        condition: the condition, on the state.
        text: its source text.
        then: part that runs if it is true.
        otherwise: None if the condition is claimed to be always true.
        span: place in the manifest.
    """

    condition: t.Term
    text: str
    then: Part[S]
    otherwise: Part[S] | None
    span: SourceSpan

    def __str__(self) -> str:
        otherwise = "" if self.otherwise is None else f" else {self.otherwise}"
        return f"(if {self.text} then {self.then}{otherwise})"


@dataclass(frozen=True, slots=True)
class Fallback(Generic[S]):
    """Alternatives: each runs only after the previous one has failed; the first that succeeds ends it.

    It fails if the last one does. A tolerated failure is a fallback to an empty `Seq`.

    Attributes:
        parts: the alternatives in the order in which they are tried.
        span: place in the manifest.
    """

    parts: tuple[Part[S], ...]
    span: SourceSpan

    def __str__(self) -> str:
        return f"({' or else '.join(map(str, self.parts))})"


@dataclass(frozen=True, slots=True)
class RetriedPart(Generic[S]):
    """Part that runs again from its beginning after it has failed, as long as tries are left.

    Attributes:
        part: the part.
        retry: number of further tries after a failure, at least 1.
        span: place in the manifest.
    """

    part: Part[S]
    retry: int
    span: SourceSpan

    def __str__(self) -> str:
        return f"({self.part}, at most {self.retry + 1} tries)"


@dataclass(frozen=True, slots=True)
class FailingPart:
    """Part that does nothing and fails.

    Attributes:
        text: source text of the condition that is not met.
        span: place in the manifest.
    """

    text: str
    span: SourceSpan

    def __str__(self) -> str:
        return "fail"


@dataclass(frozen=True, slots=True)
class StoppablePart(Generic[S]):
    """Part whose running steps are stopped, and which has failed, when something happens in its midst.

    Attributes:
        part: the part.
        span: place in the manifest.
        stops_composition: the manifest says that the composition stops as failed then.
    """

    part: Part[S]
    span: SourceSpan
    stops_composition: bool


@dataclass(frozen=True, slots=True)
class HeldPart(StoppablePart[S]):
    """Part that fails once a condition is not measured as true: at its beginning, while it runs, at its end.

    Attributes:
        condition: the condition, on the state.
    """

    condition: ActionCondition

    def __str__(self) -> str:
        return f"({self.part} while {self.condition.text})"


@dataclass(frozen=True, slots=True)
class TimedPart(StoppablePart[S]):
    """Part that fails once some time has passed since its beginning.

    Attributes:
        timeout: the time, s of the plant's clock; positive.
    """

    timeout: Fraction

    def __str__(self) -> str:
        return f"({self.part} within {float(self.timeout):g} s)"


@dataclass(frozen=True, slots=True)
class NestedIf(If[S]):
    """Choice of another composition, which stands here as a whole.

    Attributes:
        is_precondition: it is the precondition of that composition.
    """

    is_precondition: bool = False


Part: TypeAlias = Seq[S] | Par[S] | If[S] | Fallback[S] | RetriedPart[S] | StoppablePart[S] | FailingPart | S


_PARTS: Final = (Seq, Par, If, Fallback, RetriedPart, StoppablePart, FailingPart)


def walk_parts(part: Part[S]) -> Iterator[Part[S]]:
    """Yield a part and everything inside it.

    Args:
        part: graph.

    Yields:
        Each part before its own parts, in the order written.
    """
    yield part
    for inner in children_of(part):
        yield from walk_parts(inner)


def children_of(part: Part[S]) -> tuple[Part[S], ...]:
    """Return the direct parts of a part.

    Args:
        part: graph.

    Returns:
        Its parts, in the order written; none for a step.
    """
    match part:
        case Seq(parts=inner) | Par(branches=inner) | Fallback(parts=inner):
            return inner
        case If(then=then, otherwise=otherwise):
            return (then,) if otherwise is None else (then, otherwise)
        case RetriedPart(part=inner) | StoppablePart(part=inner):
            return (inner,)
        case _:
            return ()


def steps_of(part: Part[S]) -> Iterator[S]:
    """Yield the steps of a graph.

    Args:
        part: graph.

    Yields:
        The steps, in the order written.
    """
    for inner in walk_parts(part):
        if not isinstance(inner, _PARTS):
            yield inner


def map_graph_steps(part: Part[S], become: Callable[[S], R]) -> Part[R]:
    """Replace each step of a graph.

    Args:
        part: graph.
        become: function from a step to its replacement, called in the order written.

    Returns:
        A graph of the same shape.
    """
    match part:
        case Seq(parts=inner):
            return Seq(tuple(map_graph_steps(child, become) for child in inner))
        case Par(branches=inner, span=span):
            return Par(tuple(map_graph_steps(child, become) for child in inner), span)
        case Fallback(parts=inner, span=span):
            return Fallback(tuple(map_graph_steps(child, become) for child in inner), span)
        case RetriedPart(part=inner, retry=retry, span=span):
            return RetriedPart(map_graph_steps(inner, become), retry, span)
        case StoppablePart(part=inner):
            return cast("Part[R]", replace(part, part=cast("Part[S]", map_graph_steps(inner, become))))
        case FailingPart():
            return part
        case If() as choice:
            then = map_graph_steps(choice.then, become)
            other = None if choice.otherwise is None else map_graph_steps(choice.otherwise, become)
            changed = If(choice.condition, choice.text, then, other, choice.span)
            return changed if not isinstance(choice, NestedIf) else _marked(changed, choice.is_precondition)
        case step:
            return become(step)


def as_nested(part: Part[S]) -> Part[S]:
    """Mark every choice of a graph as one of another composition, which stands here as a whole.

    Args:
        part: graph.

    Returns:
        A graph of the same shape.
    """
    return _map_choices(part, lambda one: _marked(one, isinstance(one, NestedIf) and one.is_precondition))


def without_marks(part: Part[S]) -> Part[S]:
    """Undo `as_nested`: whoever runs a graph need not know where its choices come from.

    Args:
        part: graph.

    Returns:
        A graph of the same shape.
    """
    return _map_choices(part, lambda one: If(one.condition, one.text, one.then, one.otherwise, one.span))


def _map_choices(part: Part[S], become: Callable[[If[S]], If[S]]) -> Part[S]:
    match part:
        case Seq(parts=inner):
            return Seq(tuple(_map_choices(one, become) for one in inner))
        case Par(branches=inner, span=span):
            return Par(tuple(_map_choices(one, become) for one in inner), span)
        case Fallback(parts=inner, span=span):
            return Fallback(tuple(_map_choices(one, become) for one in inner), span)
        case RetriedPart(part=inner, retry=retry, span=span):
            return RetriedPart(_map_choices(inner, become), retry, span)
        case If(then=then, otherwise=otherwise):
            other = None if otherwise is None else _map_choices(otherwise, become)
            return become(replace(part, then=_map_choices(then, become), otherwise=other))
        case _:
            return part


def _marked(choice: If[S], is_precondition: bool) -> NestedIf[S]:
    return NestedIf(
        choice.condition, choice.text, choice.then, choice.otherwise, choice.span, is_precondition
    )


MAX_STEPS: Final = 100
"""The most steps of one plan: with the caps on retries and re-plans it bounds every run."""

MAX_RUNS: Final = 1000
"""The most steps of one plan together with the steps that failures lead to, each as often as it is used."""

MAX_DEPTH: Final = 20
"""Largest nesting depth of a plan's parts, and of a failure that leads to a step that may fail."""


def plan_size_fault(part: Part[S], runs: int) -> str | None:
    """Return the reason that a graph is too large for a plan, whose body is a sequence of its parts.

    Args:
        part: graph.
        runs: number of its steps and of those that their failures lead to, each as often as it is used.

    Returns:
        The reason in words; None if the agent runs it.
    """
    steps, depth = sum(1 for _ in steps_of(part)), depth_of(part)
    if steps > MAX_STEPS:
        return f"the plan has {steps} steps; at most {MAX_STEPS} are allowed"
    if depth + (not isinstance(part, Seq)) > MAX_DEPTH:
        return f"the plan is nested more than {MAX_DEPTH} deep"
    if max(runs, count_tries(part)) > MAX_RUNS:
        return f"the plan has more than {MAX_RUNS} steps and steps that failures lead to"
    return None


def depth_of(part: Part[S]) -> int:
    """Count the parts around the innermost part of a graph.

    Args:
        part: graph.

    Returns:
        0 for a step, and for a part without parts.
    """
    return max((1 + depth_of(inner) for inner in children_of(part)), default=0)


def count_tries(part: Part[S]) -> int:
    """Count the steps of a graph, each as often as tries of parts around it run it.

    Args:
        part: graph.

    Returns:
        The number of steps, if every try of a part fails at its end.
    """
    if not isinstance(part, _PARTS):
        return 1
    tries = part.retry + 1 if isinstance(part, RetriedPart) else 1
    return tries * sum(count_tries(inner) for inner in children_of(part))
