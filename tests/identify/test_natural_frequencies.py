"""Natural frequencies of a calibration: intervals, the map through the machine's own values, crossings with the orders."""

import json
from dataclasses import replace

import numpy as np
import pytest
from tdbsim.rotor import build_rotor

from tdbmon.analysis.resting_modes import resting_basis, resting_ends, resting_modes
from tdbmon.identify import natural_frequencies as module
from tdbmon.identify.contract import natural_frequencies_json
from tdbmon.identify.natural_frequencies import ORDERS, natural_frequencies
from tdbmon.identify.parameters import calibrated_machine
from tests.identify import drops


@pytest.fixture(scope="module")
def found(calibration):
    return natural_frequencies(calibration)


def test_frequencies_are_those_of_the_true_machine(found):
    """Gap and support are what the drops were made with; the rotor is the same.

    The intervals are those of the calibration, which are too narrow for the gap (`docs/forces.md`): no claim for them here.
    """
    true = calibrated_machine(drops.machine(), drops.TRUTH)
    rotor = build_rotor(true)
    expected = resting_modes(resting_basis(true, rotor), resting_ends(true, rotor)).frequencies[0]
    for mode, value in zip(found.modes, expected, strict=True):
        assert mode.frequency.low < mode.frequency.value < mode.frequency.high
        assert mode.frequency.value == pytest.approx(value, rel=2e-3)


def test_an_elastic_modulus_that_is_not_known_is_in_the_intervals(calibration):
    """Drawn machines had the fitted shaft, whose frequencies did not move."""
    machine = calibration.calibrated
    rotor = build_rotor(machine)
    basis = resting_basis(machine, rotor)
    softer = calibrated_machine(machine, {"rotor.elastic_modulus": 0.98 * machine.rotor.elastic_modulus})
    anew = build_rotor(softer)
    expected = resting_modes(resting_basis(softer, anew), resting_ends(softer, anew)).frequencies
    found = module._of_drawn(softer, rotor, basis, machine).frequencies[:, : expected.shape[1]]
    same = resting_modes(basis, resting_ends(softer, rotor)).frequencies
    assert np.abs(same / expected - 1).max() > 1e-3  # it does matter
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_the_map_passes_through_the_fitted_stiffness(found):
    at = int(np.argmin(np.abs(found.factors - 1)))
    assert found.factors[at] == pytest.approx(1)
    assert found.still.frequencies[at] == pytest.approx([mode.frequency.value for mode in found.modes])


def test_stiffer_supports_lower_no_frequency_at_standstill(found):
    """Rayleigh: of a conservative system that is stiffened."""
    assert np.all(np.diff(found.still.frequencies, axis=0) >= -1e-9 * found.still.frequencies[1:])
    assert found.still.frequencies[-1, 2] > 1.1 * found.still.frequencies[0, 2]  # and it does matter


def test_a_support_with_mass_is_softer_upwards(found):
    upwards = [mode for mode in found.modes if mode.direction == "up and down"]
    assert upwards and all(mode.massless > mode.frequency.value for mode in upwards)
    for mode in found.modes:
        if mode.direction == "sideways":
            assert mode.massless == pytest.approx(mode.frequency.value, rel=1e-6)


def test_orders_meet_the_modes_at_their_critical_speeds(found, calibration):
    machine = calibration.calibrated
    rotor = build_rotor(machine)
    basis, ends = resting_basis(machine, rotor), resting_ends(machine, rotor)
    met = 0
    for k, mode in enumerate(found.modes):
        for order, speed in zip(ORDERS, mode.critical, strict=True):
            if speed is None:
                assert resting_modes(basis, ends, found.speed).frequencies[0, k] > order * found.speed
                continue
            met += 1
            assert resting_modes(basis, ends, speed).frequencies[0, k] == pytest.approx(order * speed, rel=1e-3)
    assert met >= 4  # both swings by 1X and 2X


def test_an_interval_is_that_of_one_mode_where_another_crosses_it(calibration, monkeypatch):
    """With supports half as stiff again the third mode up and down, 309 Hz, comes near the sideways one, which has 304.8 Hz.

    Sorted by frequency alone, draws with softer supports gave the sideways mode the frequencies of the other.
    """

    def stiffer(factor):
        bearings = [
            each.model_copy(update={"support_stiffness": drops.exact(each.support_stiffness.model_copy(
                update={"nominal": factor * each.support_stiffness.nominal}))})
            for each in drops.machine().touchdown_bearings
        ]  # fmt: skip
        return drops.machine().model_copy(update={"touchdown_bearings": tuple(bearings)})

    monkeypatch.setattr(module, "_machines", lambda _: (stiffer(factor) for factor in np.linspace(1.3, 1.7, 21)))
    found = natural_frequencies(replace(calibration, calibrated=stiffer(1.5)))
    sideways, upwards = found.modes[4].frequency, found.modes[5].frequency
    assert (found.modes[4].direction, found.modes[5].direction) == ("sideways", "up and down")
    assert sideways.high - sideways.low < 0.1
    assert upwards.low < sideways.low and upwards.high > 315


def test_json_is_plain(found):
    back = json.loads(json.dumps(natural_frequencies_json(found), allow_nan=False))
    assert back[0]["frequency_hz"]["unit"] == "Hz" and set(back[0]["critical_speed_hz"]) == {"1X", "2X"}
