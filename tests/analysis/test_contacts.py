"""Contacts and the single-mass stiffness, on a mass that falls onto a spring: every instant is a closed form."""

from __future__ import annotations

import numpy as np
import pytest

from tdbmon.analysis.contact_events import contact_events
from tdbmon.analysis.contacts import find_contacts
from tdbmon.analysis.rest import RestTravel
from tdbmon.analysis.stiffness import single_mass_stiffness
from tdbmon.estimate import Estimate
from tests.analysis.circles import circle_of
from tests.analysis.planes import G, planes_of

MASS, STIFFNESS, HEIGHT = 50.0, 4e7, 280e-6
SAG = MASS * G / STIFFNESS


def fall_on_a_spring(rate=20000.0, noise=0.0, seed=0):
    """Depth below the release of a mass that falls onto a lossless spring, with its touch and lift-off."""
    w = np.sqrt(STIFFNESS / MASS)
    touch = 0.01 + np.sqrt(2 * HEIGHT / G)
    speed = np.sqrt(2 * G * HEIGHT)
    # about the position at rest: z = -SAG cos + (v/w) sin from the touch on
    size = np.hypot(SAG, speed / w)
    lift = touch + (np.pi + 2 * np.arctan2(SAG, speed / w)) / w
    time = np.arange(int(0.05 * rate)) / rate
    depth = np.zeros(len(time))
    falling = (time > 0.01) & (time <= touch)
    depth[falling] = 0.5 * G * (time[falling] - 0.01) ** 2
    pressed = (time > touch) & (time <= lift)
    phase = w * (time[pressed] - touch) - np.arctan2(SAG, speed / w)
    depth[pressed] = HEIGHT + SAG + size * np.sin(phase)
    rising = time > lift
    s = time[rising] - lift
    depth[rising] = HEIGHT - speed * s + 0.5 * G * s**2
    depth[rising & (time > lift + 2 * speed / G)] = HEIGHT - 1e-6
    xy = np.column_stack([np.zeros(len(time)), -depth]) + noise * np.random.default_rng(seed).standard_normal(
        (len(time), 2)
    )
    return planes_of(time, {"NDE": xy}), touch, lift, np.pi / w


def circle(sigma=0.2e-6):
    zero = Estimate.from_sigma(0.0, sigma, "um", "")
    radius = Estimate.from_sigma(HEIGHT + SAG, sigma, "um", "")
    return circle_of(radius, zero, zero, settled_from=0.045)


TRAVEL = RestTravel(0.0, 0.0, SAG, 0.0, SAG)


def test_touch_liftoff_and_rebound_are_the_closed_forms():
    planes, touch, lift, _ = fall_on_a_spring()
    first = find_contacts(planes, "NDE", circle(), TRAVEL, 0.0, 0.01, G).first
    assert first.touch.value == pytest.approx(touch, abs=5e-5)
    assert first.duration.value == pytest.approx(lift - touch, abs=1e-4)
    assert first.duration.low <= lift - touch <= first.duration.high
    assert first.rebound.value == pytest.approx(HEIGHT, rel=0.01)  # a lossless spring throws it back up
    assert first.restitution.value == pytest.approx(1.0, abs=0.01)
    assert first.direction == pytest.approx(-np.pi / 2, abs=0.01)


def test_nothing_lasts_or_rises_less_than_nothing():
    planes, *_ = fall_on_a_spring()
    first = find_contacts(planes, "NDE", circle(300e-6), TRAVEL, 0.0, 0.01, G).first
    assert first.duration.low >= 0.0
    assert first.rebound.low == pytest.approx(0.0, abs=1e-6)
    assert first.rebound.low >= 0.0
    assert first.restitution.low >= 0.0


def hop_between_two_contacts(hop):
    """Depth of a mass that is pressed in for 4 ms, leaves its ring by `hop` for 1 ms, is pressed in for 8 ms and flies."""
    time = np.arange(1000) / 20000.0
    depth = np.where(time < 0.010, 0.0, HEIGHT - 50e-6)
    for start, stop, size in (
        (0.010, 0.014, 20e-6),
        (0.014, 0.015, -hop),
        (0.015, 0.023, 15e-6),
        (0.023, 0.031, -50e-6),
    ):
        inside = (time >= start) & (time < stop)
        depth[inside] = HEIGHT + size * np.sin(np.pi * (time[inside] - start) / (stop - start))
    late = time >= 0.031
    depth[late] = HEIGHT + 10e-6 * np.sin(np.pi * (time[late] - 0.031) / 0.008) * np.exp(-(time[late] - 0.031) / 0.01)
    return planes_of(time, {"NDE": np.column_stack([np.zeros(len(time)), -depth])})


def test_a_hop_that_the_clearance_hardly_knows_may_be_none():
    """Duration and rebound reach as far as if it were: a circle that is a little off made 24 ms of 4 ms, and was sure of it."""
    travel = RestTravel(0.0, 0.0, SAG, 0.0, SAG)
    sure, unsure = (
        find_contacts(hop_between_two_contacts(hop), "NDE", circle(), travel, 0.0, 0.005, G).first
        for hop in (40e-6, 2e-6)
    )
    assert sure.duration.high < 5e-3
    assert sure.rebound.low > 20e-6
    assert unsure.duration.value == pytest.approx(4e-3, abs=5e-4)
    assert unsure.duration.low < 4e-3
    assert unsure.duration.high > 12e-3
    assert unsure.rebound.low < 2e-6
    assert unsure.rebound.high > 40e-6


def test_half_a_period_about_rest_gives_the_stiffness():
    planes, *_, half = fall_on_a_spring()
    first = find_contacts(planes, "NDE", circle(), TRAVEL, 0.0, 0.01, G).first
    assert first.static_out.value - first.static_in.value == pytest.approx(half, rel=2e-3)
    found = single_mass_stiffness(first, MASS)
    assert found.value == pytest.approx(STIFFNESS, rel=5e-3)
    assert found.low <= STIFFNESS <= found.high


def test_stiffness_intervals_hold_the_truth_with_noise():
    inside = []
    for seed in range(200):
        planes, *_ = fall_on_a_spring(noise=0.3e-6, seed=seed)
        first = find_contacts(planes, "NDE", circle(0.5e-6), TRAVEL, 0.0, 0.01, G).first
        found = single_mass_stiffness(first, MASS)
        inside.append(found.low <= STIFFNESS <= found.high)
    assert np.mean(inside) >= 0.95


@pytest.mark.parametrize("rate", [2000.0, 2500.0, 5000.0])
def test_samples_far_apart_tell_the_touch_to_about_one_of_them(rate):
    """Two samples about the crossing tell no velocity, and without one the touch had an interval of seconds."""
    for seed in range(20):
        planes, touch, *_ = fall_on_a_spring(rate, noise=0.3e-6, seed=seed)
        found = find_contacts(planes, "NDE", circle(), TRAVEL, 0.0, 0.01, G).first.touch
        assert found.low <= touch <= found.high
        assert found.high - found.low < 1.5 / rate


def test_a_rotor_that_never_reaches_the_ring_has_no_contact():
    planes, *_ = fall_on_a_spring()
    short = planes.isel(time=planes.time < 0.014)
    found = find_contacts(short, "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert found.first is None
    assert found.events == ()
    assert not single_mass_stiffness(found.first, MASS).known


def test_noise_about_the_level_does_not_multiply_contacts():
    planes, *_ = fall_on_a_spring(noise=0.5e-6, seed=4)
    planes = planes.isel(time=planes.time < 0.02)
    assert len(find_contacts(planes, "NDE", circle(), TRAVEL, 0.0, 0.01, G).events) == 1


LEVEL, FLIGHT = 250e-6, 0.01037  # m; s between two contacts, of any part of an interval more each time
BOUNCES = 200


def bounces(lasting, rate):
    """Bounces on a spring at 70 mm/s: half sines of so many s, and parabolas between; times and depth beyond LEVEL."""
    period = lasting + FLIGHT
    time = np.arange(int(BOUNCES * period * rate)) / rate
    since = time % period - FLIGHT / 2  # the touch
    aloft = np.where(since < 0, since + FLIGHT, since - lasting)  # since the lift-off
    pressed = 0.07 * lasting / np.pi * np.sin(np.pi * since / lasting)
    return time, np.where((since >= 0) & (since <= lasting), pressed, 0.07 * aloft * (aloft / FLIGHT - 1))


def events_of(time, depth, noise=0.0, seed=0):
    d = np.column_stack([np.zeros(len(time)), -(LEVEL + depth)])
    d += noise * np.random.default_rng(seed).standard_normal(d.shape)
    return contact_events(time, d, np.hypot(*d.T), LEVEL)


@pytest.mark.parametrize(
    ("lasting", "rate"), [(0.5e-3, 2e3), (1e-3, 2e3), (0.25e-3, 5e3), (0.3e-3, 10e3), (0.25e-3, 20e3), (0.25e-3, 100e3)]
)
def test_contacts_of_a_few_samples_are_found(lasting, rate):
    """From its first sample to its last a contact lasts up to two intervals less than from touch to lift-off."""
    found = events_of(*bounces(lasting, rate))
    assert len(found) == BOUNCES
    lasted = np.mean([each.end - each.start for each in found])
    assert lasted == pytest.approx(lasting, abs=1 / 3 / rate)  # straight lines cut a half sine of few samples


@pytest.mark.parametrize("rate", [5e3, 20e3, 100e3])
def test_what_is_shorter_than_noise_may_be_is_no_contact(rate):
    assert not events_of(*bounces(0.15e-3, rate))


@pytest.mark.parametrize("rate", [2e3, 5e3, 10e3, 20e3, 50e3])
def test_noise_neither_makes_nor_parts_contacts(rate):
    """Four standard deviations from the level, and through it: noise of 1 um crosses it in either direction for a sample."""
    for seed in range(5):
        time, depth = bounces(2e-3, rate)
        assert len(events_of(time, depth, 1e-6, seed)) == BOUNCES
        assert not events_of(time, np.full(len(time), -4e-6), 1e-6, seed)
        assert len(events_of(time, np.full(len(time), 4e-6), 1e-6, seed)) == 1


def without(planes, start, stop):
    """The same without the samples between two instants."""
    lost = (planes.time.values >= start) & (planes.time.values < stop)
    planes.displacement[:, :, lost] = np.nan
    return planes


@pytest.mark.parametrize("span", [0.6e-3, 2.5e-3])
def test_a_lift_off_that_no_sample_shows_ends_no_contact(span):
    """Where the record goes on after the gap says nothing of when the shaft left the ring."""
    planes, touch, lift, _ = fall_on_a_spring()
    found = find_contacts(without(planes, lift - span / 2, lift + span / 2), "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    first = found.first
    assert first.touch.value == pytest.approx(touch, abs=5e-5)
    assert not first.duration.known and not first.restitution.known
    assert "the shaft lifts off there" in first.duration.why
    assert not found.events[0].seen
    short = span < 1e-3  # too short to hide a contact: how far the shaft comes back is seen all the same
    assert first.rebound.known == short
    assert bool(found.hidden) != short
    if not short:
        assert not single_mass_stiffness(first, MASS).known


def test_a_touch_that_no_sample_shows_is_known_to_the_gap():
    planes, touch, *_ = fall_on_a_spring()
    first = find_contacts(without(planes, touch - 4e-4, touch + 4e-4), "NDE", circle(), TRAVEL, 0.0, 0.01, G).first
    assert first.touch.low <= touch <= first.touch.high
    assert first.touch.high - first.touch.low == pytest.approx(8e-4, abs=1e-4)
    assert "the shaft touches there" in first.duration.why
    assert first.rebound.value == pytest.approx(HEIGHT, rel=0.01)


def test_a_gap_as_long_as_a_contact_dates_no_touch():
    planes, touch, lift, _ = fall_on_a_spring()
    found = find_contacts(without(planes, touch - 3e-3, lift - 1e-3), "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert found.events[0].end == pytest.approx(lift, abs=1e-4)  # its lift-off was seen
    assert found.first.touch.value is None
    assert "the shaft touches there" in found.first.touch.why


def test_a_stiffness_needs_both_passages_of_rest():
    planes, touch, *_ = fall_on_a_spring()
    first = find_contacts(without(planes, touch + 4e-4, touch + 8e-4), "NDE", circle(), TRAVEL, 0.0, 0.01, G).first
    assert first.duration.known and first.static_in.known
    passed = first.static_in.value
    planes, *_ = fall_on_a_spring()
    first = find_contacts(without(planes, passed - 2e-4, passed + 2e-4), "NDE", circle(), TRAVEL, 0.0, 0.01, G).first
    found = single_mass_stiffness(first, MASS)
    assert not found.known and "passes its position at rest" in found.why


def test_what_lies_after_a_long_gap_is_not_called_the_first_contact():
    planes, touch, lift, _ = fall_on_a_spring()
    found = find_contacts(without(planes, touch - 1e-3, lift + 1e-3), "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert found.first is None
    assert "the shaft may have touched there" in found.why
    nothing = find_contacts(without(planes, 0.0, 1.0), "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert nothing.first is None and nothing.events == () and "has a value" in nothing.why


def test_a_gap_too_short_for_the_way_to_the_ring_and_back_hides_no_contact():
    planes, touch, *_ = fall_on_a_spring()
    whole = find_contacts(planes, "NDE", circle(), TRAVEL, 0.0, 0.01, G).first
    found = find_contacts(without(planes, touch - 4e-3, touch - 2e-3), "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert not found.hidden
    assert found.first.duration.value == pytest.approx(whole.duration.value)
    planes, *_ = fall_on_a_spring()
    early = find_contacts(without(planes, 0.0, 0.013), "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert early.first.duration.value == pytest.approx(whole.duration.value)  # it has fallen by 44 um only
    planes, *_ = fall_on_a_spring()
    near = find_contacts(without(planes, touch - 2.1e-3, touch - 1e-4), "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert "the shaft may have touched there" in near.why


@pytest.mark.parametrize("stop", [0.0104, 0.0131])
def test_a_gap_right_after_the_release_does_not_widen_what_is_known_of_a_contact_far_from_it(stop):
    """The first two samples that are there are as far apart as the gap is long."""
    whole, gapped = (
        find_contacts(planes, "NDE", circle(), TRAVEL, 0.0, 0.01, G).first
        for planes in (fall_on_a_spring()[0], without(fall_on_a_spring()[0], 0.01006, stop))
    )
    for name in ("touch", "duration", "static_in", "static_out", "rebound"):
        expected, got = getattr(whole, name), getattr(gapped, name)
        assert (got.low, got.value, got.high) == pytest.approx((expected.low, expected.value, expected.high))


@pytest.mark.parametrize("again", [-5e-5, 5e-5])
def test_a_gap_with_the_next_touch_in_it_tells_no_rebound(again):
    """Whether or not the shaft is seen to be on the ring after it: its top may lie in the gap too."""
    planes, _, lift, _ = fall_on_a_spring()
    flight = 2 * np.sqrt(2 * HEIGHT / G)
    rising = without(planes, lift + 0.2 * flight, lift + flight + 1e-3)
    after = rising.time.values > lift + flight + 1e-3
    rising.displacement[0, 1, after] = -HEIGHT + again
    found = find_contacts(rising, "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert found.first.duration.known
    assert "the shaft may have touched again" in found.first.rebound.why


def test_a_gap_to_the_end_of_the_bounces_may_hide_contacts():
    planes, _, lift, _ = fall_on_a_spring()
    found = find_contacts(without(planes, lift + 4e-3, 1.0), "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert not found.count.known
    assert "the shaft may have touched again" in found.first.rebound.why


def test_contacts_are_counted_where_none_can_have_been_missed():
    planes, _, lift, _ = fall_on_a_spring()  # it touches once before the record ends
    assert find_contacts(planes, "NDE", circle(), TRAVEL, 0.0, 0.01, G).count.value == 1.0
    hidden = find_contacts(without(planes, lift - 1.5e-3, lift + 1.5e-3), "NDE", circle(), TRAVEL, 0.0, 0.01, G)
    assert len(hidden.events) == 1 and not hidden.count.known and "more contacts may be hidden there" in hidden.count.why
    planes, *_ = fall_on_a_spring()
    late = find_contacts(planes, "NDE", circle(), TRAVEL, 0.0, 0.01, G, "the record begins after the release")
    assert len(late.events) == 1 and late.count.why == "the record begins after the release"


def test_missing_samples_do_not_spoil_the_contact():
    planes, touch, *_ = fall_on_a_spring()
    planes.displacement[:, :, ::50] = np.nan
    first = find_contacts(planes, "NDE", circle(), TRAVEL, 0.0, 0.01, G).first
    assert first.touch.value == pytest.approx(touch, abs=1e-4)
    assert first.rebound.value == pytest.approx(HEIGHT, rel=0.02)
