"""How wide intervals are: by curvature where noise alone is left, by what is left beyond it where it is not."""

from types import SimpleNamespace

import numpy as np
import pytest

from tdbmon.identify import certainty
from tdbmon.identify.certainty import drift, reach
from tdbmon.identify.follow import Passed
from tdbmon.identify.least_squares import Fit
from tdbmon.identify.stages import Stages

SLOPE = np.zeros((100, 2))
SLOPE[:, 0] = 0.5  # curvature 100 * 0.5^2 = 25 of the first value; the second is seen by nothing


def named(*names):
    return tuple(SimpleNamespace(name=name) for name in names)


@pytest.fixture
def problem(monkeypatch):
    """One drop that is touched from its first sample on, two values, both known to 1 beforehand; noise leaves 100.

    The second is one that the machine file states without tolerance.
    """
    monkeypatch.setattr(certainty, "noise_alone", lambda drop, horizon: 100.0)
    monkeypatch.setattr(certainty, "touched_rows", lambda drop, horizon, touch, rows: np.ones(rows, dtype=bool))
    monkeypatch.setattr(certainty, "beside", lambda problem, found, horizon: [])
    monkeypatch.setattr(certainty, "stated_parameters", lambda machine: named("second"))
    bearing = SimpleNamespace(radial_gap=SimpleNamespace(low=200e-6))
    return SimpleNamespace(
        drops=(SimpleNamespace(release=0.1),),
        prior=np.ones(2),
        stages=Stages(),
        shared=named("first", "second"),
        columns=lambda drop: np.arange(2),
        values=lambda point, drop: ({}, {"release": 0.0, "set_point_y_0": 0.0, "set_point_y_1": 0.0}),
        model=SimpleNamespace(machine=SimpleNamespace(touchdown_bearings=(bearing, bearing), gravity=9.81)),
    )


def passed(square, point=(0.0, 0.0), slope=SLOPE, horizon=0.03):
    """A fit that leaves a hundred residuals of one square."""
    return Passed(horizon, Fit(np.array(point), (np.full(100, square**0.5),), (slope,), 0.0))


def test_where_noise_alone_is_left_the_curvature_of_the_last_fit_says_it_all(problem):
    np.testing.assert_allclose(reach(problem, [passed(1.0, slope=SLOPE / 9), passed(1.0)]), np.diag([1 / 26, 1.0]))


def test_the_interval_reaches_to_where_the_misfit_rises_by_what_is_left_beyond_noise(problem):
    found = reach(problem, [passed(4.0)])
    curvature = 1 / found[0, 0] - 1  # without what is known beforehand
    assert 25 / curvature == pytest.approx(1 + 300 / 1.96**2)


def test_what_is_known_beforehand_stays_as_sure(problem):
    found = reach(problem, [passed(9.0)])
    assert found[1, 1] == pytest.approx(1.0)
    assert found[0, 0] < 1.0


def test_contacts_that_are_not_explained_prove_nothing(problem):
    explained, lost = passed(1.0), passed(4.0, slope=100 * SLOPE, horizon=0.06)
    np.testing.assert_allclose(reach(problem, [explained, lost]), np.diag([1 / 26, 1.0]))
    again = passed(1.0, slope=100 * SLOPE, horizon=0.07)  # what comes after rests on what was lost
    np.testing.assert_allclose(reach(problem, [explained, lost, again]), np.diag([1 / 26, 1.0]))


def test_fits_that_differ_widen_it(problem):
    apart = [passed(1.0, (0.4, 0.0)), passed(1.0, (0.2, 0.0)), passed(1.0)]
    assert drift(apart, 0.018)[0, 0] == pytest.approx((0.4**2 + 0.2**2) / 2)
    assert reach(problem, apart)[0, 0] == pytest.approx(1 / 26 + 0.1)


def test_what_was_measured_before_anything_touched_stays_as_sure(problem, monkeypatch):
    untouched = np.arange(100) >= 50
    monkeypatch.setattr(certainty, "touched_rows", lambda drop, horizon, touch, rows: ~untouched)
    found = reach(problem, [passed(4.0)])
    assert 1 / found[0, 0] - 1 == pytest.approx(12.5 + 12.5 / (1 + 300 / 1.96**2))


def beside(*fits):
    """Fits begun beside the clearances: how far each ended off in the second value, and how much more it leaves."""
    return [Fit(np.array([0.0, away]), (), (), more) for away, more in fits]


def test_a_fit_beside_that_leaves_no_more_may_be_the_truth(problem, monkeypatch):
    steep = np.hstack([SLOPE[:, :1], SLOPE[:, :1]])  # the hollow's curvature says that neither value can move
    narrow = reach(problem, [passed(1.0, slope=steep)])
    monkeypatch.setattr(certainty, "beside", lambda problem, found, horizon: beside((0.8, 0.0), (-0.6, 1.0)))
    wide = reach(problem, [passed(1.0, slope=steep)])
    assert 1.96**2 * (wide - narrow)[1, 1] == pytest.approx((0.8**2 + 0.6**2) / 2)


def test_the_more_a_fit_beside_leaves_the_less_it_counts(problem, monkeypatch):
    narrow = reach(problem, [passed(4.0)])
    monkeypatch.setattr(certainty, "beside", lambda problem, found, horizon: beside((0.8, 3000.0)))
    wide = reach(problem, [passed(4.0)])  # leaves 300 more than noise
    assert 1.96**2 * (wide - narrow)[1, 1] == pytest.approx(0.8**2 / 2 * (300 + 1.96**2) / 3000)


def test_a_stated_value_that_does_the_same_leaves_only_their_sum_known(problem, monkeypatch):
    """Two values of equal slopes, 25 by the drop and 1 beforehand each: [[26, 25], [25, 26]] inverted."""
    wider = SimpleNamespace(**{**vars(problem), "prior": np.ones(3), "columns": lambda drop: np.arange(3)})
    wider.parameters = named("first", "second", "held")

    def with_stated_values(problem, found, horizon):
        return wider, Fit(np.zeros(3), found.residuals, (np.hstack([SLOPE, SLOPE[:, :1]]),), 0.0)

    monkeypatch.setattr(certainty, "stated_parameters", lambda machine: named("held"))
    monkeypatch.setattr(certainty, "with_stated_values", with_stated_values)
    np.testing.assert_allclose(reach(problem, [passed(1.0)]), np.diag([26 / 51, 1.0]))


def test_a_shaft_that_hung_low_touches_sooner(problem):
    """Free fall from where it hung: with a centred one taken for granted, contacts counted as what was before them."""
    machine = problem.model.machine
    centred, low = ({"set_point_y_0": 20e-6, "set_point_y_1": y} for y in (0.0, -150e-6))
    assert certainty._least_fall(machine, centred) == pytest.approx((2 * 200e-6 / 9.81) ** 0.5)
    assert certainty._least_fall(machine, low) == pytest.approx((2 * 50e-6 / 9.81) ** 0.5)
