from aeros.wired_arm.arm import MODES, REFLEX, USER_STOPPED, ArmError


def test_an_error_says_if_the_robot_can_still_be_reached() -> None:
    assert ArmError("it stopped").is_connected
    assert not ArmError("it is gone", is_connected=False).is_connected


def test_modes_have_the_numbers_of_the_library() -> None:
    assert (MODES[REFLEX], MODES[USER_STOPPED]) == ("reflex", "user-stopped")
    assert (REFLEX, USER_STOPPED, len(MODES)) == (4, 5, 7)
