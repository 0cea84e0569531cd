"""How probes see a simulated drop."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tdbsim.sensors import ProbeChain, Runout, SensorChain

from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import covariance_of, fit
from tdbmon.identify.prediction import (
    Sensors,
    levitated,
    noise_alone,
    predict,
    readings,
    touched_rows,
    window,
)
from tests.identify.drops import drop, machine

LAG, GAIN = 19, 1.2


def test_a_late_and_strong_channel_sees_the_surface_late_and_strong(problem):
    """Runout lies before lag and gain of a channel: it comes late and large like all that the probe sees."""
    shared, own = problem.values(problem.start, 0)
    measured, machine = problem.drops[0], problem.model.machine
    rough = own | {"NDE.runout_cosine_1": 2e-6, "NDE.runout_sine_2": 1e-6}
    prediction = predict(measured, problem.model, own, 0.01)
    row = [p.name for p in measured.probes].index("NDE_B")

    def surface(chain, see):
        seen = [see(Sensors(chain, shared, values)) for values in (own, rough)]
        return seen[1] - seen[0]

    late = SensorChain(probes={"NDE_B": ProbeChain(lag=LAG, gain=GAIN)})
    now = surface(SensorChain(), lambda s: readings(prediction.path, measured, machine, s))
    then = surface(late, lambda s: readings(prediction.path, measured, machine, s))
    assert np.abs(now[row]).max() > 1e-6
    np.testing.assert_allclose(then[row, LAG:], GAIN * now[row, :-LAG], atol=1e-12)
    others = np.arange(len(measured.probes)) != row
    np.testing.assert_allclose(then[others], now[others], atol=1e-15)

    before = surface(SensorChain(), lambda s: levitated(prediction.path, measured, machine, s).orders)
    after = surface(late, lambda s: levitated(prediction.path, measured, machine, s).orders)
    turn = np.exp(-1j * np.array([1, 2]) * prediction.path.omega * LAG * measured.interval)
    np.testing.assert_allclose(after[row], GAIN * turn * before[row], atol=1e-12)


CHAINS = st.builds(
    ProbeChain,
    gain=st.floats(0.8, 1.2),
    offset=st.floats(-20e-6, 20e-6),
    angle_error=st.floats(-0.1, 0.1),
    runout=st.tuples(
        st.builds(Runout, order=st.just(1), amplitude=st.floats(0, 5e-6), phase=st.floats(-3, 3)),
        st.builds(Runout, order=st.just(2), amplitude=st.floats(0, 3e-6), phase=st.floats(-3, 3)),
    ),
    lag=st.integers(0, 12),
)


@settings(max_examples=25, deadline=None)
@given(chains=st.fixed_dictionaries({"NDE_A": CHAINS, "NDE_B": CHAINS}), part=st.floats(-0.1, 0.1))
def test_the_levitated_orbit_in_closed_form_is_what_the_probes_read_before_the_release(problem, chains, part):
    """Means and the first two orders, by least squares from the samples of a whole sensor chain."""
    shared, own = problem.values(problem.start, 0)
    measured, machine = problem.drops[0], problem.model.machine
    sensors = Sensors(SensorChain(probes=chains, leaks={"NDE_B": ("NDE_A", part)}), shared, own)
    path = predict(measured, problem.model, own, 0.002).path
    since = measured.time[path.first : path.first + path.x.shape[-1]] - measured.release - own["release"]
    steady = np.flatnonzero(since < -2e-5)  # from the first on, also of a channel that lags
    turned = np.multiply.outer(path.omega * since[steady], [1, 2])
    basis = np.column_stack([np.ones(len(turned)), np.cos(turned), -np.sin(turned)])
    read = np.linalg.lstsq(basis, readings(path, measured, machine, sensors)[:, steady].T, rcond=None)[0].T
    held = levitated(path, measured, machine, sensors)
    turn = np.exp(1j * own["shaft_angle"] * np.array([1, 2]))
    np.testing.assert_allclose(held.mean, read[:, 0], atol=1e-9)
    np.testing.assert_allclose(held.orders * turn, read[:, 1:3] + 1j * read[:, 3:], atol=1e-9)


@pytest.mark.parametrize("levitated", [0.08, 0.0065])
def test_what_is_simulated_ends_at_the_horizon_however_short_the_levitated_stretch(levitated):
    measured = measured_drop(drop(levitated=levitated, seconds=0.03), machine())
    first, count = window(measured, 0.01)
    assert measured.time[first + count - 1] - measured.release == pytest.approx(0.01, abs=2 * measured.interval)
    assert measured.release - measured.time[first] == pytest.approx(min(levitated, 0.008), abs=2 * measured.interval)


def test_missing_samples_have_no_rows_and_the_others_theirs(problem):
    """With white noise a missing sample takes one row, at every step that counts rows."""
    measured, horizon = problem.drops[0], 0.014
    reading = measured.reading.copy()
    gone = slice(*np.searchsorted(measured.time, measured.release + np.array([0.009, 0.011])))
    reading[1, gone] = np.nan
    gappy = replace(problem, drops=(replace(measured, reading=reading),))
    orders = max(len(noise.colour) for noise in measured.noise)
    lost = gone.stop - gone.start + orders
    whole, fewer = (each.residual(problem.start, 0, horizon) for each in (problem, gappy))
    assert np.isfinite(fewer).all()
    assert len(whole) - len(fewer) == lost
    touch = measured.release + 0.0064
    kept = [touched_rows(each.drops[0], horizon, touch, len(r)) for each, r in ((problem, whole), (gappy, fewer))]
    assert kept[0].sum() - kept[1].sum() == lost
    # an allowance for the model takes some of each
    assert 0.7 * lost < noise_alone(measured, horizon) - noise_alone(gappy.drops[0], horizon) < lost
    found = fit(gappy, problem.start, horizon, 1)
    assert np.isfinite(covariance_of(gappy, found, horizon)).all()


def test_friction_moves_touched_rows_alone(problem):
    drop, horizon, fall = problem.drops[0], 0.014, 0.0064  # through the narrowest gap within tolerance
    residuals, slopes = problem.slopes(problem.start, 0, horizon, {"NDE.friction", "DE.friction"})
    moved = np.any(slopes != 0, axis=1)
    touched = touched_rows(drop, horizon, drop.release + fall, len(residuals))
    assert not moved[~touched].any()
    assert moved[touched].mean() > 0.5
