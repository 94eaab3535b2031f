"""Runs of perceivers: in a worker, or in this process for modules that the site trusts."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping
from typing import Any, Final, NamedTuple, Protocol

from aeros.runtime.isolation.isolated_code import IsolatedCode, format_exit_code
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.limits import ProcessLimits
from aeros.runtime.isolation.protocol import (
    LoadPerceiver,
    PerceivedValue,
    ProtocolError,
    ResponseTimeoutError,
    ResumePerceiver,
    SkillRaised,
    ValuesPerceived,
    WorkerConnection,
    WorkerEndedError,
)
from aeros.runtime.isolation.zygote_pool import ZygotePool
from aeros.runtime.perception.shared_pictures import SharedPictures, UnfitPictureError, sample
from aeros.runtime.ports import CameraPicture
from aeros.runtime.skills.load import CertifiedCode, load_certified_models
from aeros.runtime.skills.perceiver_code import PerceiverNames, execute_perceiver, start_perceiver
from aeros.runtime.skills.raised import describe_raised
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Perceiver
from aeros.spec.model.site import Site
from aeros.spec.obligations.skill_syntax.allowed_names import ALLOWED_BUILTINS
from aeros.spec.obligations.skill_syntax.perceiver_names import PERCEIVER_NAMES

NAMES: Final = PerceiverNames(PERCEIVER_NAMES.members, ALLOWED_BUILTINS)
"""Names that perceivers may use, as their code was read against them before it was installed."""

Samples = Mapping[str, tuple[tuple[float, Any], ...]]
"""Time and value of each sampled reading, oldest first, by the module's name for the variable."""


class PerceiverError(Exception):
    """The perceiver computed no values, and its run is over; the message says why."""


class ViewInput(NamedTuple):
    """View of a perceiver, before it is sampled and handed over.

    Attributes:
        time: plant time, s.
        readings: values (SI) by the module's name for the variable.
        samples: sampled readings.
        pictures: newest picture of each camera that it asks for, as the camera took it.
    """

    time: float
    readings: Mapping[str, Any]
    samples: Samples
    pictures: Mapping[str, CameraPicture]


Perceived = Mapping[str, PerceivedValue]
"""Value and uncertainty by the module's name for the variable; nothing is checked."""


class PerceiverRun(Protocol):
    """One run of a perceiver, which keeps its state between two views."""

    def perceive(self, view: ViewInput, seconds: float) -> Perceived:
        """Compute values of a view.

        Args:
            view: the view.
            seconds: limit on the real time, s; cannot be enforced in this process.

        Returns:
            The values.

        Raises:
            PerceiverError: there are none, and there will be none from this run.
        """

    def close(self) -> None:
        """End the run; safe to call twice."""


OpenPerceiver = Callable[[Site, Ecm, Perceiver], PerceiverRun]
"""Opens a run of a perceiver under the site in force; raises `SkillRefusedError`."""


class InProcessPerceiver:
    """Run of a perceiver in this process, for modules that the site trusts.

    Args:
        code: certified code of the perceiver.
        perceiver: its declaration.

    Raises:
        SkillRefusedError: the code cannot be loaded.
    """

    def __init__(self, code: CertifiedCode, perceiver: Perceiver) -> None:
        self._perceiver = perceiver
        self._function = execute_perceiver(code.file, code.function, NAMES)
        self._models = load_certified_models(code)
        self._body: Generator[Any, Any, None] | None = None

    def perceive(self, view: ViewInput, seconds: float) -> Perceived:
        """Implements `PerceiverRun.perceive`.

        Raises:
            PerceiverError: the code failed.
            KeyboardInterrupt: the user interrupted the code.
        """
        del seconds  # cannot be enforced in this process
        from aeros.perception.plain_values import plain_values
        from aeros.perception.view_builder import PictureData, build_view

        try:
            pictures = []
            for asked in self._perceiver.pictures:
                if asked.name not in view.pictures:
                    continue
                picture, size = view.pictures[asked.name], (asked.width, asked.height)
                rgb, depth = sample(picture, size, with_depth=asked.depth)
                full = (picture.width, picture.height)
                pictures.append(
                    PictureData(asked.name, picture.time, size, rgb, depth, *picture.view, full_size=full)
                )
            built = build_view(view.time, view.readings, view.samples, pictures)
            if self._body is None:
                self._body = start_perceiver(self._function, built, self._models)
                yielded = next(self._body)
            else:
                yielded = self._body.send(built)
            return {name: PerceivedValue(*parts) for name, parts in plain_values(yielded).items()}
        except KeyboardInterrupt:
            raise
        except StopIteration as end:
            raise PerceiverError("the perceiver returned: it yields values for every view") from end
        except BaseException as failure:
            known = (*view.readings, *view.pictures)
            raise PerceiverError(describe_raised(failure, self._function, known)) from failure

    def close(self) -> None:
        """Implements `PerceiverRun.close`."""
        self._body = None


class IsolatedPerceiver(IsolatedCode):
    """Run of a perceiver in a worker of its own.

    Args:
        pool: provides the worker.
        layers: isolation layers that the worker applies before it sees any code.
        code: certified code of the perceiver.
        perceiver: its declaration.
        load_within: limit on the time of loading, s of real time.
        names: names that the code may use.

    Raises:
        SkillRefusedError: there is no worker, or the code cannot be loaded in it.
    """

    def __init__(
        self,
        pool: ZygotePool,
        layers: Iterable[IsolationLayer],
        code: CertifiedCode,
        perceiver: Perceiver,
        load_within: float,
        names: PerceiverNames = NAMES,
    ) -> None:
        self._shared: SharedPictures | None = None
        shared = SharedPictures(perceiver.pictures)
        try:
            limits = ProcessLimits(perceiver.memory, float(perceiver.processor))
            super().__init__(pool, code.module, shared.descriptor, limits)
            self._shared = shared
            load = LoadPerceiver(
                WorkerConnection.token(),
                tuple(layer.value for layer in layers),
                perceiver.memory,
                code.file,
                code.function,
                {name: tuple(sorted(members)) for name, members in names.members.items()},
                tuple(sorted(names.builtins)),
                shared.slots,
                shared.size,
                code.models,
            )
            self._load(load, load_within)
        except BaseException:
            shared.close()
            self._shared = None
            raise

    def perceive(self, view: ViewInput, seconds: float) -> Perceived:
        """Implements `PerceiverRun.perceive`; kills the worker if it exceeds its time limit.

        Raises:
            PerceiverError: the code failed, or was killed.
        """
        if self._shared is None:
            raise PerceiverError("the perceiver's process has ended")
        try:
            facts = self._shared.write(view.pictures)
            question = ResumePerceiver(
                WorkerConnection.token(), view.time, dict(view.readings), dict(view.samples), facts
            )
            response = self._request(question, seconds)
        except UnfitPictureError as unfit:
            self.close()
            raise PerceiverError(str(unfit)) from unfit
        except ResponseTimeoutError as failure:
            self.close()
            raise PerceiverError(
                f"the perceiver did not answer within {seconds:g} s and was killed"
            ) from failure
        except WorkerEndedError as failure:
            ended = format_exit_code(self._end())
            raise PerceiverError(f"the perceiver's process {ended}") from failure
        except ProtocolError as failure:
            self.close()
            raise PerceiverError(f"the perceiver's process was killed: {failure}") from failure
        if isinstance(response, ValuesPerceived):
            return response.values
        self.close()
        if isinstance(response, SkillRaised):
            raise PerceiverError(response.reason)
        raise PerceiverError("the perceiver's process was killed: it sent an unexpected response")

    def close(self) -> None:
        """Implements `PerceiverRun.close`: ends the perceiver and every process that it started."""
        self._end()

    def _end(self) -> int | None:
        code = self._kill_worker() if self._shared is not None else None
        if self._shared is not None:
            self._shared.close()
            self._shared = None
        return code
