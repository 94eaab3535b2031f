"""A scene lists what is placed in it, places first, and what can move."""

from __future__ import annotations

from tests.shipped_scenes import shipped_scene


def test_a_thing_comes_after_those_whose_frame_it_is_in() -> None:
    for name in ("fetch", "table", "dumpling_bench"):
        known: list[str] = []
        for thing, placement in shipped_scene(name).placements():
            assert placement.frame is None or placement.frame in known
            known.append(thing)
        scene = shipped_scene(name)
        assert known == [*scene.places, *scene.bodies]


def test_bodies_with_a_mass_can_move() -> None:
    scene = shipped_scene("dumpling_bench")
    assert scene.movable == ("wrapper", "wrapper_2", "filling", "filling_2")
    assert not scene.bodies["press"].is_movable


def test_a_place_or_instrument_gives_the_variable_of_its_name() -> None:
    given = ["make_dumplings.pot_position", "make_dumplings.press_force"]
    scene = shipped_scene("dumpling_bench")
    assert scene.unmeasured(given) == []
    assert scene.unmeasured(["make_dumplings.lid_position", *given]) == ["make_dumplings.lid_position"]
