import aeros
from aeros.sim.fake import FakePlant


def robot() -> aeros.Plant:
    return FakePlant({"estop_pressed": True})


with aeros.open_session("ecms/clean_table", plant=robot()) as session:
    print(session.run("clean the table", timeout=1.0).reason)
