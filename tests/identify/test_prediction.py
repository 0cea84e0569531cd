"""How probes see a simulated drop."""

import numpy as np
import pytest
from tdbsim.sensors import ProbeChain, SensorChain

from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.prediction import Sensors, levitated, predict, readings, touched_rows, with_surface
from tdbmon.identify.problem import build_problem
from tests.identify import drops

LAG, GAIN = 19, 1.2


@pytest.fixture(scope="module")
def problem():
    machine = drops.machine()
    with Crew() as crew:
        yield build_problem(machine, (measured_drop(drops.drop(), machine),), crew)


def test_a_late_and_strong_channel_sees_the_surface_late_and_strong(problem):
    """Runout lies before lag and gain of a channel: it comes late and large like all that the probe sees."""
    shared, own = problem.values(problem.start, 0)
    measured, machine = problem.drops[0], problem.model.machine
    rough = own | {"NDE.runout_cosine_1": 2e-6, "NDE.runout_sine_2": 1e-6}
    prediction = predict(measured, problem.model, own, 0.01)
    row = [p.name for p in measured.probes].index("NDE_B")

    def surface(chain, see):
        seen = [see(Sensors(with_surface(chain, machine, values), shared, values)) for values in (own, rough)]
        return seen[1] - seen[0]

    late = SensorChain(probes={"NDE_B": ProbeChain(lag=LAG, gain=GAIN)})
    now = surface(SensorChain(), lambda s: readings(prediction, measured, machine, s))
    then = surface(late, lambda s: readings(prediction, measured, machine, s))
    assert np.abs(now[row]).max() > 1e-6
    np.testing.assert_allclose(then[row, LAG:], GAIN * now[row, :-LAG], atol=1e-12)
    others = np.arange(len(measured.probes)) != row
    np.testing.assert_allclose(then[others], now[others], atol=1e-15)

    before = surface(SensorChain(), lambda s: levitated(prediction, measured, machine, s).orders)
    after = surface(late, lambda s: levitated(prediction, measured, machine, s).orders)
    turn = np.exp(-1j * np.array([1, 2]) * prediction.omega * LAG * measured.interval)
    np.testing.assert_allclose(after[row], GAIN * turn * before[row], atol=1e-12)


def test_friction_moves_touched_rows_alone(problem):
    drop, horizon, fall = problem.drops[0], 0.014, 0.0064  # through the narrowest gap within tolerance
    residuals, slopes = problem.slopes(problem.start, 0, horizon, {"NDE.friction", "DE.friction"})
    moved = np.any(slopes != 0, axis=1)
    touched = touched_rows(drop, horizon, drop.release + fall, len(residuals))
    assert not moved[~touched].any()
    assert moved[touched].mean() > 0.5
