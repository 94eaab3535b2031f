"""Places inside a composition that one try of a step runs, as `aeros.spec.closed_loop.composed_run` has them.

Places are made from the end of the graph to its start.  Inside a composition chance decides, also between
the skills that provide a capability.  The branches of a `par` do not interfere: their places are combined, so
that each comes forward alone.  On the way to the goal they count as one after the other, and the failure of
one of them is no way to the goal.

From the tries inside a part under `hold` or within `timeout`, and from all combined places, an unlikely
branch leads to the place of the part's stop.  After each try, the conditions around it decide where it goes
on.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.symbolic.program import (
    End,
    Move,
    Place,
    ProgramBranch,
    all_of,
    any_of,
    step,
)
from aeros.spec.closed_loop.symbolic.skill_branches import SymbolicSkill
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, negate
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.hold_conditions import predicates_of
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    StoppablePart,
)

_DONE: Final = Place("inside", number=-1)
_FAILED: Final = Place("inside", number=-2)

AddInside = Callable[..., Place]
FindSkill = Callable[[str, Mapping[str, Any]], SymbolicSkill]
DescribeStop = Callable[[StoppablePart[Step]], SymbolicSkill]


@dataclass(frozen=True)
class _Surrounding:
    """A part that may be stopped, around the places that are being made.

    Attributes:
        holds: the condition that it holds, on predicates.
        stop: place of its stop, after which the part has failed.
        failed: place after its failure.
    """

    holds: t.Term
    stop: Place
    failed: Place


class CompositionPlaces:
    """Maker of the places of one composition.

    Args:
        composition: the composition.
        goal: the task's goal, after which nothing more starts.
        add: adds a place with its moves.
        find_skill: describes a skill with constant inputs.
        describe_stop: describes the stop of a part as a skill.
        uncertain: predicates that may be unknown although everything is measured; an `if` whose condition
            reads one of them may fail.
    """

    def __init__(
        self,
        composition: Composition,
        goal: t.Term,
        add: AddInside,
        find_skill: FindSkill,
        describe_stop: DescribeStop,
        uncertain: Collection[str] = (),
    ) -> None:
        self._composition = composition
        self._goal = goal
        self._add = add
        self._find_skill = find_skill
        self._describe_stop = describe_stop
        self._uncertain = {*uncertain}
        self._may_go_on = False
        self._around: list[_Surrounding] = []

    def entry(self, done: Place, failed: Place) -> Place:
        """Add all places.

        Args:
            done: place after the composition has succeeded.
            failed: place after it has failed.

        Returns:
            The first place.

        Raises:
            StateSpaceError: an outcome leaves a variable open.
        """
        return self._part(self._composition.body, done, failed)

    def _part(self, part: Part, done: Place, failed: Place) -> Place:
        match part:
            case Step():
                return self._step(part, done, failed)
            case Seq(parts=parts):
                for one in reversed(parts):
                    done = self._part(one, done, failed)
                return done
            case If():
                return self._if(part, done, failed)
            case Par():
                return self._par(part, done, failed)
            case Fallback(parts=parts):
                return self._in_turn(parts, done, failed)
            case RetriedPart(part=one, retry=retry):
                return self._in_turn((one,) * (retry + 1), done, failed)
            case StoppablePart():
                return self._stoppable(part, done, failed)
            case FailingPart():
                return self._add(step(self._goal, done), step(negate(self._goal), failed))

    def _in_turn(self, parts: Sequence[Part], done: Place, failed: Place) -> Place:
        """Add the places of parts, each of which begins where the one before has failed."""
        outer = self._may_go_on
        for one in reversed(parts):
            failed = self._part(one, done, failed)
            self._may_go_on = True
        self._may_go_on = outer
        return failed

    def _stoppable(self, part: StoppablePart[Step], done: Place, failed: Place) -> Place:
        open_ = negate(self._goal)
        holds = lower(predicates_of(part.condition)) if isinstance(part, HeldPart) else t.TRUE
        ends = tuple(
            ProgramBranch(one.guard, (End(one.agrees, failed),), one.updates, one.opened)
            for one in self._describe_stop(part).branches
        )
        stop = self._add(Move(t.TRUE, ends))
        self._around.append(_Surrounding(holds, stop, failed))
        inner = self._part(part.part, done, failed)
        self._around.pop()
        stopped = ProgramBranch(t.TRUE, (End(t.TRUE, stop),), is_likely=False)
        entered = ProgramBranch(t.TRUE, (End(t.TRUE, inner),))
        return self._add(
            step(self._goal, done),
            Move(all_of(open_, holds), (entered, stopped)),
            step(all_of(open_, negate(holds)), failed),
        )

    def _held(self, target: Place) -> Place:
        """Add the place after a step, which goes on only while the conditions around it hold."""
        open_, moves = negate(self._goal), []
        for one in self._around:
            if one.holds != t.TRUE:
                moves.append(step(all_of(open_, negate(one.holds)), one.failed))
                open_ = all_of(open_, one.holds)
        return self._add(step(self._goal, target), *moves, step(open_, target)) if moves else target

    def _if(self, part: If[Step], done: Place, failed: Place) -> Place:
        condition, open_ = lower(part.condition), negate(self._goal)
        other = failed if part.otherwise is None else self._part(part.otherwise, done, failed)
        then = self._part(part.then, done, failed)
        is_certain = self._uncertain.isdisjoint(t.variables_of(part.condition))
        unknown = ProgramBranch(t.TRUE, (End(t.TRUE, failed),), is_likely=False)
        return self._add(
            step(self._goal, done),
            *(
                Move(
                    all_of(open_, holds),
                    (
                        ProgramBranch(t.TRUE, (End(t.TRUE, target),)),
                        *([] if is_certain else [unknown]),
                    ),
                )
                for holds, target in ((condition, then), (negate(condition), other))
            ),
        )

    def _step(self, one: Step, done: Place, failed: Place) -> Place:
        """Add the tries of a step and what follows its failure."""
        lost, handlers = failed, self._composition.handlers
        if one.last_handler is not None:
            handled = self._step(handlers[one.last_handler], failed, failed)
            lost = self._add(step(self._goal, failed), step(negate(self._goal), handled))
        following = self._failing(lost, None, one)
        for tries in reversed(range(one.retry + 1)):
            if tries < one.retry:
                between = None if one.between_tries is None else handlers[one.between_tries]
                after = following if between is None else self._step(between, following, lost)
                following = self._try(one, done, self._failing(after, lost, one), lost if tries else failed)
            else:
                following = self._try(one, done, following, lost if tries else failed)
        return following

    def _failing(self, after: Place, lost: Place | None, one: Step) -> Place:
        """Add the place after a failed try, where the agent's memory may leave out those that are left."""
        if lost is None or (one.last_handler is None and not self._may_go_on):
            return after
        given_up = ProgramBranch(t.TRUE, (End(t.TRUE, lost),), is_likely=False)
        return self._add(Move(t.TRUE, (ProgramBranch(t.TRUE, (End(t.TRUE, after),)), given_up)))

    def _try(self, one: Step, done: Place, failing: Place, unable: Place) -> Place:
        skills = [self._find_skill(name, one.inputs) for name in one.runs]
        if not all(skill.is_settled for skill in skills):
            raise StateSpaceError(f"a step of `{self._composition.id}` leaves a variable at several values")
        open_ = negate(self._goal)
        starts = [skill.can_start for skill in skills]
        succeeded, failing = self._held(done), self._held(failing)
        stops = [
            ProgramBranch(
                all_of(skill.can_start, each.guard),
                (End(each.agrees, around.stop),),
                each.updates,
                each.opened,
                is_likely=False,
            )
            for around in self._around
            for skill in skills
            for each in skill.stops
        ]
        branches = [
            ProgramBranch(
                all_of(skill.can_start, each.guard),
                (End(each.is_success, succeeded), End(each.is_failure, failing)),
                each.updates,
                each.opened,
                each.is_likely,
            )
            for skill in skills
            for each in skill.branches
        ]
        return self._add(
            step(self._goal, done),
            step(all_of(open_, *map(negate, starts)), unable),
            Move(all_of(open_, any_of(starts)), (*branches, *stops)),
        )

    def _par(self, part: Par[Step], done: Place, failed: Place) -> Place:
        """Add the combined places of parallel branches."""
        graphs: list[dict[Place, tuple[Move, ...]]] = []
        entries: list[Place] = []
        for branch in part.branches:
            alone = _PlacesOfBranch()
            maker = CompositionPlaces(
                self._composition,
                self._goal,
                alone.add,
                self._find_skill,
                self._describe_stop,
                self._uncertain,
            )
            maker._may_go_on = self._may_go_on
            entries.append(maker._part(branch, _DONE, _FAILED))
            graphs.append(alone.moves)
        return self._combine(graphs, tuple(entries), done, failed)

    def _combine(
        self,
        graphs: Sequence[dict[Place, tuple[Move, ...]]],
        entries: tuple[Place, ...],
        done: Place,
        failed: Place,
    ) -> Place:
        """Add a place for each combination of the branches' places, the last of them first."""
        orders = [
            {place: number for number, place in enumerate([_DONE, _FAILED, *graph])} for graph in graphs
        ]
        reached = {entries}
        pending = [entries]
        while pending:
            at = pending.pop()
            for number, place in enumerate(at):
                for target in _targets(graphs[number].get(place, ())):
                    after = (*at[:number], target, *at[number + 1 :])
                    if after not in reached:
                        reached.add(after)
                        pending.append(after)
        made: dict[tuple[Place, ...], Place] = {}
        failed = self._held(failed)
        stops = [
            ProgramBranch(negate(self._goal), (End(t.TRUE, one.stop),), is_likely=False)
            for one in self._around
        ]
        for at in sorted(reached, key=lambda one: [o[p] for o, p in zip(orders, one, strict=True)]):
            if all(place == _DONE for place in at):
                made[at] = self._add(step(t.TRUE, done))
                continue
            branches: list[ProgramBranch] = [*stops]
            for number, place in enumerate(at):
                others = (at[:number], at[number + 1 :])
                in_turn = all(one == _DONE for one in others[0]) and others[1] == entries[number + 1 :]
                following = {
                    target: self._held(made[(*others[0], target, *others[1])])
                    for target in _targets(graphs[number].get(place, ()))
                }
                branches += [
                    _moved(each, move.guard, following, in_turn)
                    for move in graphs[number].get(place, ())
                    for each in move.branches
                ]
            if _FAILED in at:
                branches.append(ProgramBranch(t.TRUE, (End(t.TRUE, failed),), is_likely=False))
            made[at] = self._add(Move(t.TRUE, tuple(branches)))
        return made[entries]


class _PlacesOfBranch:
    """Places of one parallel branch, with numbers of their own."""

    def __init__(self) -> None:
        self.moves: dict[Place, tuple[Move, ...]] = {}

    def add(self, *moves: Move) -> Place:
        place = Place("inside", number=len(self.moves))
        self.moves[place] = moves
        return place


def _targets(moves: Sequence[Move]) -> set[Place]:
    return {end.target for move in moves for branch in move.branches for end in branch.ends}


def _moved(
    branch: ProgramBranch, guard: t.Term, following: Mapping[Place, Place], is_in_turn: bool
) -> ProgramBranch:
    """Make a branch of one parallel branch one of the combined places."""
    return replace(
        branch,
        guard=all_of(guard, branch.guard),
        ends=tuple(End(end.guard, following[end.target]) for end in branch.ends),
        is_likely=branch.is_likely and is_in_turn,
    )
