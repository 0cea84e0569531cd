"""Which drop is held out."""

from types import SimpleNamespace

import pytest

from tdbmon.diagnosis.held_out import telling_drops

FLOOR = 0.95


def plain(speeds, ratios):
    drops = tuple(SimpleNamespace(speed=speed) for speed in speeds)
    return SimpleNamespace(problem=SimpleNamespace(drops=drops), floor=FLOOR, ratio_of_drops=list(ratios))


@pytest.mark.parametrize(
    ("speeds", "ratios", "order"),
    [
        ((60, 100, 150, 210), (3.0, 3.1, 2.9, 3.0), [1, 2, 0, 3]),  # all fail: the middle ones first
        ((210, 60, 150, 100), (3.0, 3.0, 2.5, 2.9), [3, 2, 1, 0]),  # by speed, not by place
        ((60, 100, 150, 210), (5.4, 1.25, 1.12, 1.15), [0, 1, 2, 3]),  # one fails: that first
        ((60, 100, 150, 210), (0.9, 0.94, 0.95, 0.92), [1, 2, 0, 3]),  # none fails
        ((60, 100), (1.0, 2.0), [1, 0]),
    ],
)
def test_a_drop_in_which_the_plain_model_fails_is_held_out_the_middle_one_of_several(speeds, ratios, order):
    assert telling_drops(plain(speeds, ratios)) == order
