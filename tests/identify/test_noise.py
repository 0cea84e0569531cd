"""The levitated stretch against closed forms."""

import numpy as np
import pytest
from scipy.signal import lfilter
from tdbsim.errors import InputError

from tdbmon.analysis.autoregression import whitened
from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.noise import levitated_noise
from tdbmon.identify.stages import Stages
from tests.identify import drops

RATE, SPEED, MAINS = 20e3, 2 * np.pi * 97.0, 50.0
TIME = np.arange(2000) / RATE


def orbit(colour=(), sigma=0.3e-6, seed=0):
    rng = np.random.default_rng(seed)
    white = sigma * rng.standard_normal(len(TIME) + 500)
    noise = lfilter([1.0], np.concatenate([[1.0], -np.array(colour)]), white)
    angle = SPEED * TIME
    clean = 12e-6 + 2e-6 * np.cos(angle + 0.7) + 0.5e-6 * np.cos(2 * angle) + 0.4e-6 * np.cos(2 * np.pi * MAINS * TIME)
    return clean + noise[500:], angle


def test_orbit_hum_and_white_noise_are_told_apart():
    reading, angle = orbit()
    found = levitated_noise(TIME, reading, angle, MAINS)
    assert found.sigma == pytest.approx(0.3e-6, rel=0.08)
    assert found.mean == pytest.approx(12e-6, abs=4 * found.mean_sigma)
    assert abs(found.orders[0] - 2e-6 * np.exp(0.7j)) < 6 * found.order_sigma
    assert abs(found.orders[1] - 0.5e-6) < 6 * found.order_sigma
    assert abs(found.hum - 0.4e-6) < 6 * found.order_sigma


def test_hum_at_the_speed_of_the_shaft_is_no_second_orbit():
    """Both fitted, they grow to any size against each other, and what goes on after the release is nonsense."""
    rng = np.random.default_rng(3)
    angle = 2 * np.pi * 50.02 * TIME
    reading = 2e-6 * np.cos(angle + 0.7) + 0.3e-6 * rng.standard_normal(len(TIME))
    found = levitated_noise(TIME, reading, angle, MAINS)
    assert found.hum == 0
    assert abs(found.orders[0] - 2e-6 * np.exp(0.7j)) < 6 * found.order_sigma < 0.2e-6


def test_white_noise_is_called_white_in_most_draws():
    orders = [len(levitated_noise(TIME, orbit(seed=seed)[0], SPEED * TIME, MAINS).colour) for seed in range(20)]
    assert sum(order == 0 for order in orders) >= 17


def test_whitening_takes_the_colour_away():
    reading, angle = orbit(colour=(0.6, 0.2))
    found = levitated_noise(TIME, reading, angle, MAINS)
    assert found.colour[:2] == pytest.approx([0.6, 0.2], abs=0.12)
    fresh, _ = orbit(colour=(0.6, 0.2), seed=7)
    left = fresh - orbit(sigma=0.0)[0]
    white = found.whiten(left)[20:]
    assert white.std() == pytest.approx(1.0, rel=0.1)
    lagged = [abs(np.corrcoef(white[k:], white[:-k])[0, 1]) for k in (1, 2, 3)]
    assert max(lagged) < 4 / np.sqrt(len(white))


def test_interval_of_the_mean_holds_the_truth():
    inside = 0
    for seed in range(60):
        reading, angle = orbit(colour=(0.7,), seed=seed)
        found = levitated_noise(TIME, reading, angle, MAINS)
        inside += abs(found.mean - 12e-6) < 1.96 * found.mean_sigma
    assert 48 <= inside


def test_colouring_is_the_recursion_it_says():
    values = np.arange(5.0) ** 2
    assert whitened(values, np.array([0.5])).tolist() == [0.0, 1.0, 3.5, 7.0, 11.5]
    assert whitened(values, np.empty(0)).tolist() == values.tolist()


def test_too_short_and_dead_stretches_are_refused():
    reading, angle = orbit()
    with pytest.raises(InputError, match="too few to separate orbit and noise"):
        levitated_noise(TIME[:20], reading[:20], angle[:20], MAINS)
    with pytest.raises(InputError, match="no noise at all"):
        levitated_noise(TIME, np.zeros_like(reading), angle, MAINS)


@pytest.mark.parametrize(("hz", "seconds"), [(0.0, 0.1), (1.0, 0.05), (5.0, 0.05), (10.0, 0.03), (97.0, 0.014)])
def test_orders_and_hum_of_a_small_part_of_a_turn_or_period_are_not_told(hz, seconds):
    """All fitted at once they grew to any size against each other: micrometres to kilometres."""
    time = np.arange(int(seconds * RATE)) / RATE
    angle = 2 * np.pi * hz * (time - seconds)
    after = np.arange(0, 0.065, 1 / RATE)
    for seed in range(10):
        noise = 0.3e-6 * np.random.default_rng(seed).standard_normal(len(time))
        found = levitated_noise(time, 12e-6 + 1e-6 * np.cos(angle + 0.7) + noise, angle, MAINS)
        third = (found.orders[2] * np.exp(6j * np.pi * hz * after)).real
        hum = (found.hum * np.exp(2j * np.pi * MAINS * (seconds + after))).real
        assert np.abs(third + hum).max() < 0.35e-6
        assert abs(found.mean - 12e-6) < 4 * found.mean_sigma < 16e-6
        assert abs(found.orders[0] - 1e-6 * np.exp(0.7j)) < 6 * found.order_sigma
        assert found.sigma == pytest.approx(0.3e-6, rel=0.2)


@pytest.mark.parametrize(("speed", "levitated"), [(0.0, 0.1), (5.0, 0.05)])
def test_a_drop_of_a_slow_rotor_is_fitted_as_any_other(speed, levitated):
    """At 5 Hz up to 91 um of orbit were taken off the readings and the gap was 300 um; at rest the record was refused."""
    machine, record = drops.machine(), drops.drop(speed=speed, levitated=levitated)
    drop = measured_drop(record, machine)
    raw = np.stack([record[machine.channel_in_file(probe.name)].values for probe in drop.probes])
    assert np.abs(drop.reading - raw).max() < 1e-6
    means = raw[:, drop.time < drop.release - 0.003].mean(axis=1)
    assert [noise.mean for noise in drop.noise] == pytest.approx(means, abs=3e-6)
    fitted = fit_drops(machine, [record], horizons=Stages().calibration[:5])
    assert fitted.misfit < 1.1
    for name in ("NDE.radial_gap", "DE.radial_gap"):
        assert fitted.values[name].value == pytest.approx(drops.TRUTH[name], abs=4e-6)
