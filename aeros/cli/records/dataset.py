"""`aeros run --dataset`: the run becomes an episode of a dataset."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from aeros.agent.instructions.meaning import Understanding
from aeros.apps.dataset.dataset import DatasetError, DatasetWriter, Episode
from aeros.apps.dataset.recorder import EpisodeRecorder
from aeros.apps.report_page.run_data import read_run_data
from aeros.cli.terminal.rendering import print_labelled
from aeros.runtime.gate.configuration import Configuration
from aeros.session.plant_factory import PHYSICS_PLANTS


class RunDataset(NamedTuple):
    """A dataset that waits for a run.

    Attributes:
        folder: Folder of the dataset.
        writer: Writes the episode.
        recorder: Listens to the run.
    """

    folder: Path
    writer: DatasetWriter
    recorder: EpisodeRecorder

    def add(
        self, run: Path, arguments: argparse.Namespace, drawn: Mapping[str, object], *, is_success: bool
    ) -> bool:
        """Add the run as an episode, and print a line about it.

        Args:
            run: Output folder of the run.
            arguments: Parsed options of `aeros run`.
            drawn: What was drawn for the scene, by name; empty unless it is randomised.
            is_success: True if the goal was reached, by truth where there is one.

        Returns:
            False if it could not be written.
        """
        self.recorder.finish()
        data = read_run_data(run)
        about = {
            "instruction": arguments.instruction,
            "plant": arguments.plant,
            "seed": arguments.seed,
            "drawn": dict(drawn),
            "audit_records": data.chain.records,
            "audit_head": data.chain.head,
        }
        frames, number = self.recorder.frames, self.writer.episodes
        episode = Episode(frames, data.decisions, arguments.instruction, is_success, about)
        try:
            self.writer.add(episode, run)
        except DatasetError as error:
            print(f"aeros: {error}", file=sys.stderr)
            return False
        print_labelled("dataset", f"{self.folder}/, episode {number} of {len(frames)} frames")
        return True


def open_run_dataset(
    arguments: argparse.Namespace, configuration: Configuration, meaning: Understanding
) -> RunDataset | None:
    """Open the dataset that the options name, before anything moves.

    Args:
        arguments: Parsed options of `aeros run`.
        configuration: Modules and site of the run.
        meaning: Requests of the instruction.

    Returns:
        The dataset; None without the option.

    Raises:
        DatasetError: A package is missing, or the folder has something else.
    """
    if arguments.dataset is None:
        return None
    routed = [errand.routed for errand in meaning.errands]
    parts = {module for one in routed for module, _ in one.task.rehearsals(one.module)}
    modules = sorted(parts | {one.module for one in routed})
    has_video = arguments.plant in PHYSICS_PLANTS and not arguments.no_film
    writer = DatasetWriter(arguments.dataset, configuration, modules, has_video=has_video)
    return RunDataset(arguments.dataset, writer, EpisodeRecorder(writer.state))
