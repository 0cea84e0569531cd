"""Parts of the splitting's kernel that stand for something simpler: tables, series, rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from changed_machine import at_ends
from tdbsim import integration
from tdbsim.columns import CAGE_ANGLE, CAGE_RATIO, RING_ANGLE
from tdbsim.drop_model import build_model
from tdbsim.errors import InputError
from tdbsim.mode_rows import LANES
from tdbsim.power_table import power, power_table
from tdbsim.simulate import DropPlan, run
from tdbsim.turning import ANGLE, COSINES, SINES, SPIN, TURNING_STOP, set_directions, turn_on

COMPILED_AND_PLAIN = pytest.mark.parametrize("plain", [False, True], ids=["compiled", "plain"])


@COMPILED_AND_PLAIN
@pytest.mark.parametrize("exponent", [1 / 9, 0.0, 0.5, 1.0, 1.5, -0.4])
def test_power_by_table(plain, exponent):
    """As the library's to rounding, at all depths that occur, and where a piece or an octave begins."""
    table_of, power_of = (power_table.py_func, power.py_func) if plain else (power_table, power)
    rng = np.random.default_rng(1)
    borders = np.outer(2.0 ** np.arange(-40, 0), 1 + np.arange(32) / 32).ravel()
    depths = np.concatenate([10 ** rng.uniform(-15, 0, 500), borders, np.nextafter(borders, 0)])
    tables = np.array([table_of(1.0), table_of(exponent)])
    found = np.array([power_of(float(depth), tables, 1) for depth in depths])
    np.testing.assert_allclose(found, depths**exponent, rtol=2e-15)


@COMPILED_AND_PLAIN
@pytest.mark.parametrize("tau", [1e-5, -2e-5, 3e-3])
def test_directions_follow_the_angles(plain, tau, machine):
    """By series in small turns, anew in large ones."""
    set_on, turn = (set_directions.py_func, turn_on.py_func) if plain else (set_directions, turn_on)
    columns = build_model(machine).arrays.end
    columns[:, CAGE_ANGLE], columns[:, RING_ANGLE] = (0.3, 2.0), (0.1, -1.0)
    rows = np.zeros(TURNING_STOP)
    rows[ANGLE : ANGLE + 3], rows[SPIN : SPIN + 3] = (0.4, 0.1, -1.0), (940.0, 500.0, -900.0)
    rows[TURNING_STOP - LANES : TURNING_STOP - LANES + 3] = 1.0, columns[0, CAGE_RATIO], columns[1, CAGE_RATIO]
    set_on(rows, columns)
    for _ in range(100):
        turn(rows, LANES, tau, columns)
    turned = 100 * tau * rows[SPIN : SPIN + 3]
    np.testing.assert_allclose(rows[ANGLE : ANGLE + 3], np.array([0.4, 0.1, -1.0]) + turned, rtol=1e-12)
    angles = np.array([0.4 + turned[0], *(columns[:, CAGE_ANGLE] + columns[:, CAGE_RATIO] * turned[1:])])
    np.testing.assert_allclose(rows[COSINES : COSINES + 3], np.cos(angles), atol=2e-13)
    np.testing.assert_allclose(rows[SINES : SINES + 3], np.sin(angles), atol=2e-13)


@pytest.mark.parametrize("bending", [0, 2, 4, 9])
def test_any_number_of_modes(bending, machine):
    """Modes are taken by eights: two, six or thirteen of them go the same way as with the other method."""
    model = build_model(machine, bending=bending, attachment=bending > 0)
    assert (model.n % LANES == 0) == (bending == 4)
    plan = DropPlan(150.0, 0.012)
    exact = run(model, replace(plan, method="dormand_prince", tolerance=1e-11))
    found = run(model, plan)
    assert found.peak_normal.min() > 100
    assert np.abs(at_ends(found) - at_ends(exact)).max() < 2e-9


def test_too_many_modes_are_refused(machine, monkeypatch):
    model = build_model(machine, bending=8)
    monkeypatch.setattr(integration, "MOST_MODES", model.n - 3)
    with pytest.raises(InputError, match=r"12 modes per plane.*by 3"):
        run(model, DropPlan(150.0, 0.001))
    run(model, DropPlan(150.0, 0.001, method="dormand_prince"))
