"""Which drop is held out."""

from types import SimpleNamespace

import pytest

from tdbmon.diagnosis import held_out
from tdbmon.diagnosis.held_out import HeldOut, telling_drops
from tdbmon.identify.stages import Stages

FLOOR = 0.95
WEAK = (0.9, 0.94, 0.95, 0.92)  # ratios of a plain model that holds


def plain(speeds, ratios):
    drops = tuple(SimpleNamespace(speed=speed) for speed in speeds)
    fails = max(ratios) > 1.1 * FLOOR
    return SimpleNamespace(
        problem=SimpleNamespace(drops=drops, stages=Stages()),
        floor=FLOOR,
        ratio=max(ratios),
        fit=SimpleNamespace(ratio_of_drops=list(ratios)),
        fails=fails,
    )


@pytest.mark.parametrize(
    ("speeds", "ratios", "order"),
    [
        ((60, 100, 150, 210), (3.0, 3.1, 2.9, 3.0), [1, 2, 0, 3]),  # all fail: the middle ones first
        ((210, 60, 150, 100), (3.0, 3.0, 2.5, 2.9), [3, 2, 1, 0]),  # by speed, not by index
        ((60, 100, 150, 210), (5.4, 1.25, 1.12, 1.15), [0, 1, 2, 3]),  # one fails: that first
        ((60, 100, 150, 210), (0.9, 0.94, 0.95, 0.92), [1, 2, 0, 3]),  # none fails
        ((60, 100), (1.0, 2.0), [1, 0]),
    ],
)
def test_a_drop_in_which_the_plain_model_fails_is_held_out_the_middle_one_of_several(speeds, ratios, order):
    assert telling_drops(plain(speeds, ratios)) == order


def proof_of(monkeypatch, left, ratios=(5.4, 1.25, 1.12, 1.15), in_contacts=True, drop_specific=False, fits_much=False):
    """The proof for rms residuals `left` of plain and extended model, in units of the noise (1 um), at successive horizons."""
    seen = dict(zip((0.022, 0.027, 0.033, 0.04), left, strict=True))

    def made(index, _, horizon):
        bare, wide = seen[horizon]
        return HeldOut((f"drop_{index}",), bare * 1e-6, wide * 1e-6, 1e-6, bare**2, wide**2)

    # whatever the horizon of the comparison, both models are fitted to the whole horizon of the other drops
    monkeypatch.setattr(held_out, "taught", lambda _, index, horizon: {0.04: index}[horizon])
    monkeypatch.setattr(held_out, "judged", made)
    extended = SimpleNamespace(horizon=0.04, drop_specific=drop_specific, in_contacts=in_contacts, fits_much=fits_much)
    return held_out.proof_of(plain((60, 100, 150, 210), ratios), extended)


def test_a_drop_proves_nothing_before_the_plain_model_fails_there(monkeypatch):
    """A right model leaves a little more than noise in a held-out drop; by chance the plain one may leave less."""
    proof = proof_of(monkeypatch, [(1.3, 1.5), (1.9, 1.7), (2.5, 2.5), (4.0, 1.4)])
    assert proof.drops == ("drop_0",)
    assert proof.gain == pytest.approx(1 - 0.4 / 3.0)
    assert proof.named == "drop_0, which was held out"


def test_the_first_horizon_that_tells_is_taken(monkeypatch):
    assert proof_of(monkeypatch, [(1.3, 1.5), (2.5, 1.2), (3.0, 3.0), (4.0, 4.0)]).gain == pytest.approx(1 - 0.2 / 1.5)


def test_two_drops_are_asked_where_one_is_no_proof(monkeypatch):
    proof = proof_of(monkeypatch, [(1.1, 1.1), (1.1, 1.1), (1.1, 1.1), (1.3, 1.5)])
    assert proof.drops == ("drop_0", "drop_1")
    assert not proof.holds
    assert proof.named == "drop_0 and drop_1, each held out by itself"


@pytest.mark.parametrize(("in_contacts", "asked"), [(True, 2), (False, 1)])
def test_beside_a_plain_model_that_leaves_noise_what_acts_in_contacts_needs_two_drops(monkeypatch, in_contacts, asked):
    left = [(1.1, 1.1), (1.1, 1.1), (1.1, 1.1), (1.3, 1.1)]
    assert len(proof_of(monkeypatch, left, WEAK, in_contacts).drops) == asked


@pytest.mark.parametrize(
    ("left", "ratios", "fits_much", "asked"),
    [
        ((1.3, 1.28), WEAK, True, 2),
        ((1.3, 1.05), WEAK, True, 1),  # one drop proves it in readings
        ((1.3, 1.05), WEAK, False, 2),  # a contact cause needs a second drop
        ((1.6, 1.4), (1.3, 1.25, 1.12, 1.15), True, 2),
        ((1.6, 1.4), (1.3, 1.25, 1.12, 1.15), False, 1),
        ((1.6, 1.4), (5.4, 1.25, 1.12, 1.15), True, 1),
    ],
)
def test_waves_lobes_and_balls_are_to_be_seen_where_the_plain_model_explains_the_drops(
    monkeypatch, left, ratios, fits_much, asked
):
    proof = proof_of(monkeypatch, [(1.1, 1.1), (1.1, 1.1), (1.1, 1.1), left], ratios, fits_much=fits_much)
    assert len(proof.drops) == asked
    assert proof.named.endswith(", each held out by itself") == (asked > 1)
