"""Orbits cut at the keyphasor's pulses, and the path of the mean position."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from tdbsim.errors import InputError

from tdbmon.analysis.orbit import centreline, orbit
from tests.analysis.planes import planes_of

RATE = 5000.0
TIME = np.arange(15_000) / RATE
TURNED = 2 * np.pi * (40.0 * TIME - 2.0 * TIME**2)  # 40 Hz, slowing by 4 Hz a second


def _planes(z: np.ndarray) -> xr.Dataset:
    return planes_of(TIME, {"NDE": np.column_stack([z.real, z.imag]), "DE": np.column_stack([z.imag, z.real])})


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("mark", [0.0, 1.1])
def test_revolutions_begin_where_the_keyphasor_passes(sense, mark):
    angle = mark + sense * TURNED
    found = orbit(_planes(np.exp(1j * angle)), angle, 0.5, 5, "raw", sense, mark)
    assert found.keyphasor.size == 5
    dots = found.displacement.sel(end="NDE").to_numpy()[:, found.keyphasor.to_numpy()]
    # a circle that turns with the shaft shows the mark's own angle at each dot, to within a sample of rotation
    late = np.angle((dots[0] + 1j * dots[1]) * np.exp(-1j * mark)) * sense
    assert (late > -1e-6).all() and (late < 2 * np.pi * 40.0 / RATE).all()
    assert float(found.time[0]) >= 0.5
    turned = found.turned.to_numpy()
    assert turned[0] == pytest.approx(0.0, abs=0.06) and turned[-1] == pytest.approx(10 * np.pi, abs=0.06)
    assert found.attrs["speed_hz"] == pytest.approx(5 / (found.attrs["end_s"] - found.attrs["start_s"]))
    middle = (found.attrs["end_s"] + found.attrs["start_s"]) / 2
    assert found.attrs["speed_hz"] == pytest.approx(40.0 - 4.0 * middle, rel=1e-3)


def test_filter_leaves_the_mean_and_the_first_order():
    z = 3e-6 * np.exp(1j * (TURNED - 0.7)) + 1e-6 * np.exp(-1j * TURNED) + 2e-6 * np.exp(2j * TURNED) - 2e-4j
    found = orbit(_planes(z), TURNED, 0.1, 12, "1X").sel(end="NDE")
    expected = 3e-6 * np.exp(1j * (found.turned - 0.7)) + 1e-6 * np.exp(-1j * found.turned)
    np.testing.assert_allclose(found.displacement.sel(axis="x"), expected.real, atol=2e-8)
    np.testing.assert_allclose(found.displacement.sel(axis="y"), expected.imag - 2e-4, atol=2e-8)


def test_average_keeps_what_turns_with_the_shaft_and_lowers_noise():
    rng = np.random.default_rng(3)
    steady = 3e-6 * np.exp(1j * TURNED) + 1e-6 * np.exp(3j * TURNED)
    noise = 1e-6 * (rng.standard_normal(TIME.size) + 1j * rng.standard_normal(TIME.size))
    found = orbit(_planes(steady + noise), TURNED, 0.1, 64, "averaged").sel(end="NDE")
    expected = 3e-6 * np.exp(1j * found.turned) + 1e-6 * np.exp(3j * found.turned)
    error = found.displacement.sel(axis="x") - expected.real
    # between two samples noise is the mean of them at most, itself at least
    assert 0.5 * 1e-6 / 8 < float(error.std()) < 1e-6 / 8
    assert 0.5e-6 < float(found.deviation.mean()) < 1e-6
    assert found.keyphasor.to_numpy().tolist() == [0]


def test_revolutions_that_are_not_known_are_not_cut():
    angle = TURNED.copy()
    angle[:1000] = np.nan
    angle[9000:] = np.nan
    planes = _planes(np.exp(1j * TURNED))
    assert float(orbit(planes, angle, 0.0, 3).time[0]) >= TIME[1000]
    with pytest.raises(InputError, match="40 whole revolutions after 1 s are not available; the shaft angle covers 2"):
        orbit(planes, angle, 1.0, 40)
    angle[4000:4100] = np.nan
    with pytest.raises(InputError, match="are not available"):
        orbit(planes, angle, 0.75, 5)
    with pytest.raises(InputError, match="unknown kind of orbit 'filtered'"):
        orbit(planes, angle, 0.0, 3, "filtered")
    with pytest.raises(InputError, match="give 1 or more"):
        orbit(planes, angle, 0.0, 0)


def test_centreline_is_the_mean_over_each_window():
    z = 1e-4 * TIME + 5e-5 * np.exp(2j * np.pi * 50.0 * TIME) - 2e-4j
    found = centreline(_planes(z), 0.2).sel(end="NDE")
    assert found.sizes["time"] == 15
    np.testing.assert_allclose(found.time, 0.1 + 0.2 * np.arange(15) - 0.5 / RATE, atol=1e-9)
    np.testing.assert_allclose(found.position.sel(axis="x"), 1e-4 * found.time, atol=1e-10)
    np.testing.assert_allclose(found.position.sel(axis="y"), -2e-4, atol=1e-10)
    np.testing.assert_allclose(found.deviation.sel(axis="y"), 5e-5 / np.sqrt(2), rtol=1e-6)
    with pytest.raises(InputError, match="give one of 2 samples"):
        centreline(_planes(z), 10.0)


def test_no_window_of_the_centreline_spans_a_hole_in_time():
    z = np.where(TIME < 1.0, 0.0, 1e-4) + 0j
    found = centreline(_planes(z).isel(time=(TIME < 0.7) | (TIME >= 1.1)), 0.2).sel(end="NDE")
    np.testing.assert_allclose(found.time[:5], [0.1, 0.3, 0.5, 1.2, 1.4], atol=1 / RATE)
    np.testing.assert_allclose(found.position.sel(axis="x")[:5], [0, 0, 0, 1e-4, 1e-4], atol=1e-12)
