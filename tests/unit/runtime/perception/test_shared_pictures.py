"""Memory with pictures: its places, what is written there, and a descriptor that only reads."""

from __future__ import annotations

import mmap
import os
from dataclasses import replace

import numpy as np
import pytest

from aeros.runtime.perception.shared_pictures import SharedPictures, UnfitPictureError, sample
from aeros.spec.model.perception import PictureRequest
from tests.unit.runtime.perception.perceiving import VIEW, picture


def test_each_picture_has_a_place_of_its_own() -> None:
    shared = SharedPictures([PictureRequest("mast", 5, 3, True), PictureRequest("hand", 4, 4, False)])
    mast, hand = shared.slots
    assert (mast.camera, mast.rgb, mast.depth) == ("mast", 0, 64)
    assert (hand.camera, hand.rgb, hand.depth) == ("hand", 128, None)
    assert shared.size == 192
    shared.close()


def test_the_written_pictures_are_read_through_the_descriptor() -> None:
    shared = SharedPictures([PictureRequest("overhead", 4, 3, True)])
    (facts,) = shared.write({"overhead": picture(2.5)})
    assert facts is not None
    assert (facts.time, facts.full_size) == (2.5, (8, 6))
    assert (facts.eye, facts.target, facts.up, facts.field_of_view) == VIEW
    with mmap.mmap(shared.descriptor, shared.size, prot=mmap.PROT_READ) as memory:
        whole = np.frombuffer(picture().rgb, np.uint8).reshape(6, 8, 3)
        assert memory[:36] == whole[1::2, ::2].tobytes()
        depth = np.frombuffer(picture().depth or b"", np.float32).reshape(6, 8)
        assert memory[64 : 64 + 48] == depth[1::2, ::2].tobytes()
    shared.close()


def test_a_camera_that_has_taken_no_picture_leaves_its_place_as_it_was() -> None:
    both = [PictureRequest("overhead", 4, 3, True), PictureRequest("side", 4, 3, True, optional=True)]
    shared = SharedPictures(both)
    (facts, missing) = shared.write({"overhead": picture(2.5)})
    assert facts is not None
    assert missing is None
    shared.close()


def test_the_descriptor_can_neither_write_nor_change_the_size() -> None:
    shared = SharedPictures([PictureRequest("overhead", 4, 3, True)])
    with pytest.raises(PermissionError):
        mmap.mmap(shared.descriptor, shared.size)
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.write(shared.descriptor, b"x")
    with pytest.raises(OSError, match="Invalid argument"):
        os.ftruncate(shared.descriptor, 0)
    shared.close()


def test_without_pictures_there_is_a_descriptor_all_the_same() -> None:
    shared = SharedPictures([])
    assert (shared.size, shared.slots, shared.write({})) == (0, (), ())
    assert os.fstat(shared.descriptor).st_size == 1
    shared.close()


def test_a_picture_that_is_smaller_or_has_no_depth_does_not_fit() -> None:
    for size in ((9, 6), (8, 7)):
        with pytest.raises(UnfitPictureError, match=f"delivers 8 x 6 pixels, and {size[0]} x {size[1]}"):
            sample(picture(), size, with_depth=False)
    blind = replace(picture(), depth=None)
    with pytest.raises(UnfitPictureError, match="measures no depth"):
        sample(blind, (4, 3), with_depth=True)
    assert sample(blind, (4, 3), with_depth=False)[1] is None
