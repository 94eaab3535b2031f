from aeros.franka.error_words import explain_errors


def test_each_error_that_a_message_names_is_explained_once() -> None:
    text = 'libfranka: Move command aborted:\n  motion aborted by reflex! ["joint_reflex", "joint_reflex"]'
    assert explain_errors(text) == (
        'libfranka: Move command aborted: motion aborted by reflex! ["joint_reflex", "joint_reflex"] '
        "(`joint_reflex`, the torque of a joint was not as expected: the arm touched something)"
    )


def test_a_message_without_a_known_error_stays_as_it_is() -> None:
    assert explain_errors("libfranka: UDP receive: Timeout") == "libfranka: UDP receive: Timeout"
    assert explain_errors("some_future_error") == "some_future_error"
