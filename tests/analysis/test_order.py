"""Order tracking against signals made of known orders on a shaft whose angle is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from tdbsim.errors import InputError

from tdbmon.analysis.order import PER_TURN, resample, track
from tests.analysis.planes import planes_of

RATE, TAU, START = 4000.0, 10.0, 90.0
TIME = np.arange(80_000) / RATE
TURNED = 2 * np.pi * START * TAU * (1 - np.exp(-TIME / TAU))
SPEED = START * np.exp(-TIME / TAU)


def _planes(z: np.ndarray, noise: float = 0.0, seed: int = 0) -> xr.Dataset:
    """Orbit z = x + j y at NDE, with noise in each axis."""
    xy = np.column_stack([z.real, z.imag])
    xy = xy + noise * np.random.default_rng(seed).standard_normal(xy.shape)
    return planes_of(TIME, {"NDE": xy})


@pytest.mark.parametrize("sense", [1, -1])
def test_forward_and_backward_circles_come_out_with_their_lags(sense):
    angle = 0.4 + sense * TURNED
    # lag: the high spot passes so much after the mark; a backward circle is a forward one mirrored in the x axis
    forward = 5e-6 * np.exp(1j * (angle - sense * 0.9))
    backward = 2e-6 * np.exp(-1j * (angle - sense * 0.35))
    second = 1e-6 * np.exp(1j * (2 * angle + sense * 1.2))
    found = track(_planes(forward + backward + second - 3e-4j), angle, sense=sense)
    one, two = found.sel(order=1.0, end="NDE"), found.sel(order=2.0, end="NDE")
    np.testing.assert_allclose(one.forward, 5e-6, rtol=2e-3)
    np.testing.assert_allclose(one.backward, 2e-6, rtol=2e-3)
    np.testing.assert_allclose(one.forward_lag, 0.9, atol=3e-3)
    np.testing.assert_allclose(one.backward_lag, 0.35, atol=3e-3)
    np.testing.assert_allclose(two.forward, 1e-6, rtol=2e-3)
    np.testing.assert_allclose(two.forward_lag, -1.2, atol=6e-3)
    assert float(two.backward.max()) < 5e-9


def test_lag_of_an_axis_is_that_of_its_own_high_spot():
    # x = 4 cos(angle - 0.5), y = 3 cos(angle - 2.0)
    z = 4e-6 * np.cos(TURNED - 0.5) + 3e-6j * np.cos(TURNED - 2.0)
    found = track(_planes(z), TURNED).sel(order=1.0, end="NDE")
    np.testing.assert_allclose(found.amplitude.sel(axis="x"), 4e-6, rtol=2e-3)
    np.testing.assert_allclose(found.amplitude.sel(axis="y"), 3e-6, rtol=2e-3)
    np.testing.assert_allclose(found.lag.sel(axis="x"), 0.5, atol=3e-3)
    np.testing.assert_allclose(found.lag.sel(axis="y"), 2.0, atol=3e-3)


def test_speed_and_time_are_those_of_the_windows():
    found = track(_planes(np.exp(1j * TURNED) * 1e-6), TURNED)
    # a window's mean speed is that at its middle in time to second order in its length over the decay time
    np.testing.assert_allclose(found.speed, START * np.exp(-found.time / TAU), rtol=0.02)
    assert found.time[0] > 0 and found.time[-1] < TIME[-1]


def test_an_amplitude_that_changes_is_followed():
    swelling = 1e-6 + 4e-6 * np.exp(-(((SPEED - 45.0) / 12.0) ** 2))
    found = track(_planes(swelling * np.exp(1j * TURNED)), TURNED).sel(order=1.0, end="NDE")
    expected = np.interp(found.time, TIME, swelling)
    np.testing.assert_allclose(found.forward, expected, rtol=0.03)


def test_interval_holds_the_truth_in_noise():
    inside = []
    for seed in range(40):
        found = track(_planes(2e-7 * np.exp(1j * (TURNED - 0.4)), 4e-7, seed), TURNED).sel(order=1.0, end="NDE")
        some = found.isel(time=slice(None, None, 12))  # windows that share nothing
        error = some.forward * np.exp(-1j * some.forward_lag) - 2e-7 * np.exp(-0.4j)
        inside += (np.abs(error.to_numpy().real) < 1.96 * some.forward_sigma.to_numpy()).tolist()
    assert len(inside) > 400
    assert 0.90 < np.mean(inside) < 0.99


def test_a_line_that_crosses_the_order_widens_its_interval():
    swing = 5e-5 * np.cos(2 * np.pi * 28.5 * TIME)
    found = track(_planes(1e-6 * np.exp(1j * TURNED) + swing), TURNED).sel(order=1.0, end="NDE")
    away = found.where(np.abs(np.log(found.speed / 28.5)) > 0.45, drop=True)
    np.testing.assert_allclose(away.forward, 1e-6, rtol=0.03)
    at = int(np.argmin(np.abs(found.speed.to_numpy() - 28.5)))
    wrong = np.abs(found.forward[at] - 1e-6)
    assert wrong > 2e-6  # the swing is taken for 1X here,
    assert found.forward_sigma[at] > wrong / 3  # and the interval says so


def test_angle_that_is_unknown_for_a_while_leaves_a_gap():
    angle = TURNED.copy()
    angle[30_000:34_000] = np.nan
    found = track(_planes(1e-6 * np.exp(1j * TURNED)), angle).sel(order=1.0, end="NDE")
    known = np.isfinite(found.forward)
    lost = found.time.to_numpy()[~known.to_numpy()]
    assert lost.size and lost.min() < TIME[34_000] and lost.max() > TIME[30_000]
    np.testing.assert_allclose(found.forward[known], 1e-6, rtol=2e-3)


def test_a_hole_in_time_leaves_a_gap():
    cut = np.r_[:30_000, 32_000 : len(TIME)]
    found = track(_planes(1e-6 * np.exp(1j * TURNED)).isel(time=cut), TURNED[cut]).sel(order=1.0, end="NDE")
    known = np.isfinite(found.forward)
    lost = found.time.to_numpy()[~known.to_numpy()]
    assert lost.size and lost.min() < TIME[32_000] and lost.max() > TIME[30_000]
    np.testing.assert_allclose(found.forward[known], 1e-6, rtol=2e-3)


def test_mean_over_a_step_of_angle_keeps_fast_signals_off_low_orders():
    speed = np.full_like(TIME, 5.0)
    turned = 2 * np.pi * 5.0 * TIME
    fast = np.cos(2 * np.pi * (PER_TURN - 1) * speed * TIME)  # would fold onto 1X
    steps = resample(fast[None], TIME, turned).values[0]
    angle = 2 * np.pi * (np.arange(steps.size) + 0.5) / PER_TURN
    assert np.abs(2 * np.mean(steps * np.exp(-1j * angle))) < 0.01


def test_few_revolutions_give_no_track():
    found = track(_planes(np.exp(1j * TURNED)).isel(time=slice(0, 400)), TURNED[:400])
    assert found.sizes["time"] == 0
    assert set(found.data_vars) == set(track(_planes(np.exp(1j * TURNED)), TURNED).data_vars)


def test_what_cannot_be_tracked_is_said():
    planes = _planes(np.exp(1j * TURNED))
    with pytest.raises(InputError, match="against the direction of rotation"):
        track(planes, -TURNED)
    with pytest.raises(InputError, match="one per sample"):
        track(planes, TURNED[:-1])
