"""Textures are made smaller in linear light."""

from __future__ import annotations

import numpy as np

from fullwell.assets.ingest.textures import bounded_texture

ONE_LEVEL = 1
"""Rounding to eight bits."""


def test_a_fine_checkerboard_becomes_the_grey_of_half_the_light() -> None:
    """Half of the light is 0.5 linear, which sRGB encodes as 188; averaging the encoded values would give 128."""
    board = np.zeros((64, 64, 3), dtype=np.uint8)
    board[::2, ::2] = board[1::2, 1::2] = 255
    small = bounded_texture(board, 16)
    assert small.shape == (16, 16, 3)
    assert np.all(np.abs(small.astype(int) - 188) <= ONE_LEVEL)


def test_small_textures_are_left_alone() -> None:
    texture = np.zeros((16, 8, 3), dtype=np.uint8)
    assert bounded_texture(texture, 16) is texture


def test_proportions_and_colours_stay() -> None:
    texture = np.full((1000, 300, 3), (10, 120, 250), dtype=np.uint8)
    small = bounded_texture(texture, 100)
    assert small.shape == (100, 30, 3)
    assert np.all(np.abs(small.astype(int) - (10, 120, 250)) <= ONE_LEVEL)


def test_a_strip_keeps_at_least_one_pixel() -> None:
    assert bounded_texture(np.zeros((1, 4096, 3), dtype=np.uint8), 64).shape == (1, 64, 3)
