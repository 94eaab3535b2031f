"""Evidence of how skills do, read from the episodes of a memory: counts, weights by age, and durations.

Nothing of it is stored. So an episode that is forgotten counts no more.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import quantiles
from typing import Final, NamedTuple, TypeAlias

from aeros.agent.memory.experience import MAX_EXPERIENCED_TRIES, ExperiencedEnd
from aeros.agent.memory.posterior import (
    MAX_WEIGHED_TRIES,
    NO_RESULTS,
    RecentRecord,
    SuccessRecord,
    recent_median,
    weigh_tries,
)

SkillId: TypeAlias = tuple[str, str]
"""A skill as its module and its id."""

_DURATION_SAMPLES: Final = 101
"""Number of the latest successes that a skill's usual duration is computed from."""

_SUCCESSES_FOR_USUAL: Final = 8
"""Least number of successes whose quartiles tell what is usual: two in each quarter."""

_AGREES: Final = """CASE WHEN {asked} = context THEN 1
    WHEN json_valid({asked}) AND json_valid(context) THEN json_type({asked}, '$.predicates') IS NULL
        AND json_extract({asked}, '$.task') = json_extract(context, '$.task')
        AND instr(json_extract(context, '$.code'), json_extract({asked}, '$.code')) > 0
    ELSE 0 END"""
"""Condition that an episode's context is the one asked for, or one that `context_in_any_state` stands for."""


_MOST_HINDRANCES: Final = 3
"""Number of hindrances of a skill that are read."""

MAX_HINDERED_STEPS: Final = 1000
"""Number of the latest steps whose hindrances planners get, so that a long memory makes no plan slow."""


class Hindrance(NamedTuple):
    """A rule, reading or condition that denied, stopped or prevented a skill.

    Attributes:
        kind: as of `Cause`.
        name: of the rule, the reading or the obstacle.
        times: number of times that it did.
    """

    kind: str
    name: str
    times: int


@dataclass(frozen=True, slots=True)
class DurationStats:
    """Statistics of the durations of a skill's latest successes.

    Attributes:
        median: plant seconds.
        low, high: lower and upper quartile, plant seconds.
        successes: number of the successes.
    """

    median: float
    low: float
    high: float
    successes: int

    @property
    def longest_usual(self) -> float | None:
        """Duration beyond which a step takes unusually long, plant seconds; None of too few successes.

        Tukey's outer fence (Exploratory Data Analysis, 1977), three times the distance of the quartiles above
        the upper one; at least half as long again as the median, as durations may be all but equal.
        """
        if self.successes < _SUCCESSES_FOR_USUAL:
            return None
        return max(self.high + 3 * (self.high - self.low), 1.5 * self.median)

    def __str__(self) -> str:
        spread = f"{self.low:.1f} to {self.high:.1f}"
        return f"{self.median:.1f} s" if self.successes == 1 else f"{self.median:.1f} s (half in {spread} s)"


def read_success_record(
    database: sqlite3.Connection,
    module: str,
    skill: str,
    context: str | None = None,
    plant: str | None = None,
    until: int | None = None,
) -> SuccessRecord:
    """Count successes and failures as `Memory.success_record` does.

    Args:
        database: connection to the memory.
        module: id of the module.
        skill: id of the skill.
        context: context that must agree; None for all contexts.
        plant: plant of the sessions to count; None for all.
        until: number of the last episode to count; None for all.

    Returns:
        The counts.
    """
    sql = f"""SELECT coalesce(sum(failed = 0), 0), coalesce(sum(failed = 1), 0)
              FROM episodes JOIN sessions ON sessions.id = session
              WHERE module = :module AND skill = :skill AND counts = 1
              AND (:context IS NULL OR {_AGREES.format(asked=":context")})
              AND (:plant IS NULL OR plant = :plant)
              AND (:until IS NULL OR episodes.id <= :until)"""  # noqa: S608  a constant
    asked = {"module": module, "skill": skill, "context": context, "plant": plant, "until": until}
    return SuccessRecord(*database.execute(sql, asked).fetchone())


def read_hindrances(database: sqlite3.Connection, plant: str | None = None) -> dict[str, list[Hindrance]]:
    """Count what denied, stopped or prevented each skill.

    Args:
        database: connection to the memory.
        plant: plant whose latest steps are counted; None for all steps on all plants.

    Returns:
        For each skill, as MODULE.SKILL, its most frequent hindrances first.
    """
    sql = """WITH latest AS (SELECT episodes.id, module || '.' || skill AS name, causes
                 FROM episodes JOIN sessions ON sessions.id = session
                 WHERE :plant IS NULL OR plant = :plant ORDER BY episodes.id DESC LIMIT :most)
             SELECT name, json_extract(cause.value, '$.kind') AS kind,
                    json_extract(cause.value, '$.rule') AS rule, count(*) AS times
             FROM latest, json_each(coalesce(causes, '[]')) AS cause
             WHERE kind NOT IN ('outcome', 'undeclared-outcome', 'unknown-outcome')
             GROUP BY name, kind, rule ORDER BY name, times DESC, max(latest.id) DESC"""
    most = -1 if plant is None else MAX_HINDERED_STEPS
    found: dict[str, list[Hindrance]] = {}
    for name, *hindrance in database.execute(sql, {"plant": plant, "most": most}):
        if len(found.setdefault(name, [])) < _MOST_HINDRANCES:
            found[name].append(Hindrance(*hindrance))
    return found


def read_typical_duration(
    database: sqlite3.Connection, module: str, skill: str, origin: tuple[str, str] | None = None
) -> DurationStats | None:
    """Summarize durations as `Memory.typical_duration` does.

    Args:
        database: connection to the memory.
        module: id of the module.
        skill: id of the skill.
        origin: plant, and digest of the module's code and parameters, that must agree; None for all.

    Returns:
        Median and quartiles (s); None if there are no successes.
    """
    sql = """SELECT episodes.ended - started FROM episodes JOIN sessions ON sessions.id = session
             WHERE module = ? AND skill = ? AND counts = 1 AND failed = 0 AND (? IS NULL OR plant = ?)
             AND (? IS NULL OR code = ?) ORDER BY episodes.id DESC LIMIT ?"""
    plant, code = origin or (None, None)
    asked = (module, skill, plant, plant, code, code, _DURATION_SAMPLES)
    took = [seconds for (seconds,) in database.execute(sql, asked)]
    if not took:
        return None
    low, median, high = quantiles(took * 2 if len(took) == 1 else took, method="inclusive")
    return DurationStats(median, low, high, len(took))


def read_recent_duration(
    database: sqlite3.Connection, module: str, skill: str, origin: tuple[str, str], context: str
) -> float | None:
    """Compute a duration as `Memory.recent_duration` does.

    Args:
        database: connection to the memory.
        module: id of the module.
        skill: id of the skill.
        origin: plant, and digest of the module's code and parameters, that must agree.
        context: context that must agree, if there is any success in it.

    Returns:
        The duration, s; None if there are no successes.
    """
    sql = f"""SELECT episodes.ended - started, {_AGREES.format(asked=":context")}
              FROM episodes JOIN sessions ON sessions.id = session
              WHERE module = :module AND skill = :skill AND counts = 1 AND failed = 0
              AND plant = :plant AND code = :code
              ORDER BY 2 DESC, episodes.id DESC LIMIT :most"""  # noqa: S608  a constant
    plant, code = origin
    asked = {"module": module, "skill": skill, "plant": plant, "code": code, "context": context}
    rows = database.execute(sql, {**asked, "most": MAX_WEIGHED_TRIES}).fetchall()
    took = [seconds for seconds, agrees in rows if agrees] or [seconds for seconds, _ in rows]
    return recent_median(list(enumerate(took))) if took else None


def read_recent_records(
    database: sqlite3.Connection, contexts: Mapping[SkillId, str], plant: str
) -> Mapping[SkillId, RecentRecord]:
    """Weigh results by their age as `Memory.recent_records` does.

    Args:
        database: connection to the memory.
        contexts: context that must agree, by module and id of the skill.
        plant: plant that must agree.

    Returns:
        The record of each skill.
    """
    sql = f"""SELECT module, skill, failed FROM episodes JOIN sessions ON sessions.id = session
              JOIN json_each(?) AS asked ON asked.key = module || '.' || skill
              WHERE counts = 1 AND plant = ? AND {_AGREES.format(asked="asked.value")}
              ORDER BY episodes.id DESC LIMIT ?"""  # noqa: S608  a constant
    names = json.dumps({f"{module}.{skill}": context for (module, skill), context in contexts.items()})
    rows = database.execute(sql, (names, plant, MAX_WEIGHED_TRIES)).fetchall()
    weighed = weigh_tries([((module, skill), bool(failed)) for module, skill, failed in rows])
    return {skill: weighed.get(skill, NO_RESULTS) for skill in contexts}


def read_experience(
    database: sqlite3.Connection,
    module: str,
    skill: str,
    origin: tuple[str, str],
    until: int | None = None,
) -> list[ExperiencedEnd]:
    """List ends as `Memory.experience` does.

    Args:
        database: connection to the memory.
        module: id of the module.
        skill: id of the skill.
        origin: plant, and digest of the module's code and parameters, that must agree.
        until: number of the last episode to list; None for all.

    Returns:
        The ends, newest first.
    """
    sql = """SELECT outcome, failed, episodes.ended - started
             FROM episodes JOIN sessions ON sessions.id = session
             WHERE module = ? AND skill = ? AND counts = 1 AND plant = ? AND code = ?
             AND (? IS NULL OR episodes.id <= ?)
             ORDER BY episodes.id DESC LIMIT ?"""
    rows = database.execute(sql, (module, skill, *origin, until, until, MAX_EXPERIENCED_TRIES))
    return [ExperiencedEnd(outcome, bool(failed), seconds) for outcome, failed, seconds in rows]
