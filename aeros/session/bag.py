"""Record a run as ROS 2 messages, or show them live; writer and server are imported only if requested."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final, TextIO

from aeros.distribution import install_command
from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.recording.topic_choice import ChosenTopic, TopicChoice, TopicChoiceError
from aeros.runtime.bus.robot_description import without_meshes
from aeros.runtime.bus.viewer.link_visuals import embedded_visuals
from aeros.runtime.bus.viewer.things import cameras_of_perceivers
from aeros.runtime.bus.viewer.topics import topics_of
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import Hull, LinkModel
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.sim.robot.model import RobotModel

_NOUN: Final = {"--bag": "folder", "--mcap": "file"}


class BagOutputError(Exception):
    """A recording or live view that cannot be opened; the message says why and what to do."""


def read_link_models(site: Site) -> Mapping[Hull, LinkModel]:
    """Read how viewers draw the links of a site's robot; for before a run, as that takes up to a second.

    Args:
        site: The site that names the robot.

    Returns:
        The links by their hull; empty if their meshes are not installed, or the robot has no file.
    """
    try:
        from aeros.sim.robot.robot_file import robot_of

        return _link_models(robot_of(site))
    except (ImportError, UserError):
        return {}


@lru_cache(maxsize=1)  # a run may have a recording, a live view and peers
def _link_models(robot: RobotModel) -> Mapping[Hull, LinkModel]:
    from aeros.sim.film.link_models import link_models

    return link_models(robot)


@contextmanager
def open_bag(
    folder: Path | None, file: Path | None, configuration: Configuration, chosen: Sequence[ChosenTopic] = ()
) -> Iterator[BusFeed | None]:
    """Open a feed into a bag or an MCAP file, which is complete when the block ends.

    Args:
        folder: A new folder for a bag; None for no bag.
        file: A new MCAP file; None for none.
        configuration: The site that declares the measured vocabulary, and the modules that perceive.
        chosen: Topics to keep; none to keep all.

    Yields:
        The feed; None if neither `folder` nor `file` is given.

    Raises:
        BagOutputError: The output exists already or cannot be written, a chosen topic does not exist, or the
            extra `ros` is missing.
    """
    option, path = ("--bag", folder) if file is None else ("--mcap", file)
    if path is None:
        yield None
        return
    try:
        from aeros.runtime.bus.recording.bag import Bag, BagError, McapFile
    except ImportError as error:
        raise BagOutputError(f"{option} needs {install_command('ros')} ({error.name} is missing)") from error
    choice, cameras = TopicChoice(chosen), cameras_of_perceivers(configuration.modules.values())
    try:
        choice.require_topics(topics_of(configuration.site, cameras))
    except TopicChoiceError as refusal:
        raise BagOutputError(f"--keep: {refusal}") from refusal
    try:
        bag = Bag(path, choice) if file is None else McapFile(file, choice)
    except BagError as refusal:
        raise BagOutputError(f"{refusal}; give a new {_NOUN[option]} with {option}") from refusal
    try:
        site = configuration.site
        models = read_link_models(site)
        visuals = without_meshes if file is None else embedded_visuals(models)
        with bag, BusFeed(bag, site, is_whole=True, cameras=cameras, models=models, visuals=visuals) as feed:
            yield feed
    except BagError as failure:
        raise BagOutputError(str(failure)) from failure


@contextmanager
def open_live_view(
    port: int | None, configuration: Configuration, stream: TextIO | None
) -> Iterator[BusFeed | None]:
    """Open a feed to viewers, which never makes the run wait, until the block ends.

    Args:
        port: Port of 127.0.0.1; 0 for any free one, None for no live view.
        configuration: The site that declares the measured vocabulary, and the modules that perceive.
        stream: Stream that the address is printed to; None to print nothing.

    Yields:
        The feed; None if `port` is None.

    Raises:
        BagOutputError: The port is in use, or the extra `live` is missing.
    """
    if port is None:
        yield None
        return
    try:
        from aeros.runtime.bus.live_view import LiveView, LiveViewError
    except ImportError as error:
        raise BagOutputError(f"--live needs {install_command('live')} ({error.name} is missing)") from error
    cameras = cameras_of_perceivers(configuration.modules.values())
    site = configuration.site
    view = LiveView(site.id)
    models = read_link_models(site)
    visuals = embedded_visuals(models)
    with view, BusFeed(view, site, cameras=cameras, models=models, visuals=visuals) as feed:
        try:
            url = view.serve(port)
        except LiveViewError as refusal:
            raise BagOutputError(f"{refusal}; give another port with --live") from refusal
        if stream is not None:
            print(f"live       {url}", file=stream, flush=True)
        yield feed
