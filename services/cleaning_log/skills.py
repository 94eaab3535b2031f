"""Skill of `cleaning_log`: one entry into the log of the site."""

from aeros.skill import Inputs, Observation, SkillBody, act


def record(observed: Observation, inputs: Inputs) -> SkillBody:
    """Enter what was measured. If nothing answers, `recorded` stays unknown, and the outcome is a failure."""
    wiped, organized = observed["clean_table.table_wiped"], observed["clean_table.table_organized"]
    yield act("enter", wiped=wiped, organized=organized)
