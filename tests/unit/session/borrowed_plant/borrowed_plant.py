"""A plant of another distribution: whoever waits at its bench finds it clean."""

from aeros.runtime.ports import MotionHandle, PlannedMotion
from aeros.session.plant_provider import PlantProvider, PlantRequest
from aeros.sim.conformance.plant_under_test import PlantUnderTest
from aeros.sim.fake import FakePlant
from aeros.skill import Action, act

FACTOR = 3


class Bench(FakePlant):
    """At the bench nobody is near, and waiting cleans it."""

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle:
        if action.kind == "wait":
            self.values["bench_clean"] = True
        return super().begin(action, decided)


def open_bench(request: PlantRequest) -> Bench:
    """Open it as the task's start says."""
    empty = {"human_distance": 20.0, "stop_pressed": False, "off": 0.0, "joint_angle": (0.0,)}
    return Bench({**empty, "bench_clean": False, "cloth_held": True, **request.start})


def open_broken(request: PlantRequest) -> Bench:
    """Fail as a driver does without its robot."""
    raise ConnectionRefusedError(f"no robot answers for {request.site.id}")


def bench_under_test() -> PlantUnderTest:
    """A plant without a body keeps few of the promises."""
    return PlantUnderTest(Bench, act("move"), act("wait"), period=None)


PROVIDER = PlantProvider(open_bench, bench_under_test)
BROKEN = PlantProvider(open_broken)
