"""Sizes of causes with their intervals: the jackknife's part, and a size at the limit of the catalogue."""

from dataclasses import replace

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.diagnosis.contender import Contender, settled, with_cause
from tdbmon.diagnosis.contract import value_and_interval
from tdbmon.diagnosis.sizes import law_errors, sizes_of
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import fit
from tdbmon.identify.problem import build_problem
from tdbmon.shipped import shipped
from tests.diagnosis.conftest import GAIN
from tests.diagnosis.simulated import record

NAME = "probe_gain@DE_A.gain"
SOFTER = "support_anisotropy@DE"
LATE_S = 0.04  # after several contacts; at 22 ms the Jacobian is still smooth


@pytest.fixture
def named(competed):
    return next(each for each in competed if each.name == "probe_gain@DE_A")


def size(contender, *without):
    return sizes_of(contender, without).causes["probe_gain@DE_A"]["gain"]


def with_soft_support(contender):
    """The contender with an anisotropic support, which is better determined so early than an oval."""
    machine = contender.problem.model.machine
    cause = next(each for each in suspects(machine, machine.probes, ()) if each.name == SOFTER)
    return with_cause(contender, cause, Start({"ratio": 0.5, "direction": 0.01}))


def test_a_size_that_moves_when_a_drop_is_left_out_is_known_less(named):
    value = size(named).value
    assert size(named).low < GAIN < size(named).high
    once = size(named, {NAME: value + 0.01})
    # n - 1 times the mean square, of two drops; noise alone adds little
    assert (once.high - once.low) / 2 == pytest.approx(1.96 * 0.01, rel=0.05)
    assert size(named, {NAME: value + 0.01}, {NAME: value}).high - value == pytest.approx(
        1.96 * 0.01 / np.sqrt(2), rel=0.05
    )


def test_a_size_at_the_end_of_what_the_catalogue_allows_has_no_interval(named):
    at = [p.name for p in named.problem.parameters].index(NAME)
    point = named.fit.point.copy()
    point[at] = named.problem.high[at]
    stuck = size(replace(named, fit=replace(named.fit, point=point)))
    assert stuck.value == pytest.approx(5.0)  # the greatest gain in the catalogue
    assert stuck.low is None
    assert "may lie beyond" in stuck.why
    assert value_and_interval(stuck) == f"5 ({stuck.why})"


def test_a_size_that_is_known_less_than_the_catalogue_knows_it_has_no_interval(named):
    of = next(p for p in named.problem.parameters if p.name == NAME)
    told, untold = (
        sizes_of(named, rest={NAME: share * (of.high - of.low) / 1.96}).causes["probe_gain@DE_A"]["gain"]
        for share in (0.49, 0.51)
    )
    assert told.low is not None and untold.low is None
    assert untold.value == told.value
    assert "do not determine it" in untold.why


def test_an_angle_that_is_known_less_than_to_its_period_has_no_interval(named):
    """The direction of an anisotropic support has a period of half a turn."""
    found, name = with_soft_support(named), f"{SOFTER}.direction"
    told, untold = (
        sizes_of(found, rest={name: share * np.pi / 1.96}).causes[SOFTER]["direction"] for share in (0.49, 0.51)
    )
    assert told.low is not None and untold.low is None
    assert "do not determine it" in untold.why


def test_an_interval_ends_where_a_size_cannot_be_less(named):
    """A delay is never negative; an angle has no lower limit."""
    machine = named.problem.model.machine
    lag = next(each for each in suspects(machine, machine.probes, ()) if each.name == "channel_lag@DE_A")
    both = with_soft_support(with_cause(named, lag, Start({"delay": 1e-4})))
    sizes = sizes_of(both, rest={f"{lag.name}.delay": 1e-4}).causes
    delay, angle = sizes[lag.name]["delay"], sizes[SOFTER]["direction"]
    assert delay.low == 0.0 < delay.value < delay.high
    assert angle.low < 0.0 < angle.value


def test_the_law_of_what_acts_on_the_rotor_is_never_exact_and_that_of_a_sensor_is(named):
    machine = named.problem.model.machine
    everyone = {each.name: each for each in suspects(machine, machine.probes, ())}
    both = with_cause(named, everyone["oval_clearance@DE"], Start({"amplitude": 1e-8, "angle": 0.3}))
    both = with_cause(both, everyone["support_anisotropy@DE"], Start({"ratio": 0.9, "direction": 0.2}))
    values, _ = both.problem.values(both.fit.point, 0)
    by_laws = law_errors(both.problem, values)
    assert by_laws == {
        "oval_clearance@DE.amplitude": pytest.approx(0.005 * 1e-8),
        "support_anisotropy@DE.ratio": pytest.approx(0.005 * 0.1),  # counted from where the effect is off
    }
    ratio = sizes_of(both).causes["support_anisotropy@DE"]["ratio"]
    assert ratio.high - ratio.value >= 1.96 * by_laws["support_anisotropy@DE.ratio"]


def test_an_unbalance_is_known_no_better_than_the_machines_own_in_its_plane(crew):
    """Drops determine only their sum; chance errors of the Jacobian where contacts begin and end must not separate them."""
    machine = load_machine(shipped("short/machine.toml"))
    hidden = "unbalance:plane=generator,amount=120 g mm,phase=2.5 rad"
    speeds = ((80.0, 1), (150.0, 2), (210.0, 3))
    made = (record(machine, speed, seed, hidden, seconds=LATE_S + 0.005) for speed, seed in speeds)
    problem = build_problem(machine, tuple(measured_drop(each, machine) for each in made), crew)
    cause = next(s for s in suspects(machine, machine.probes, ()) if s.name == "unbalance@generator")
    fallen = Contender((), problem, fit(problem, problem.start, 0.006), 0.006, 0.9)
    found = with_cause(fallen, cause, Start({"amount": 120e-6, "phase": 2.5}))
    for horizon in (0.006, 0.01, 0.014, 0.018, 0.022, 0.027, 0.033, LATE_S):
        found = settled(found, horizon, 4)
    amount = sizes_of(found).causes["unbalance@generator"]["amount"]
    own = next(p for p in problem.shared if p.name == "generator.along")
    assert amount.low < 120e-6 < amount.high
    assert (amount.high - amount.low) / 2 > 0.7 * 1.96 * own.sigma
