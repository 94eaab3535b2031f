"""Pictures that a perceiver asks for."""

from __future__ import annotations

from aeros.spec.model.perception import PictureRequest


def test_a_picture_has_the_modules_name_for_its_camera_if_there_is_one() -> None:
    assert PictureRequest("overhead", 4, 3, False).name == "overhead"
    assert PictureRequest("overhead", 4, 3, False, "eye").name == "eye"
