"""The residual force: found where a known one acts, zero in noise.  All records here are synthetic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tdbsim.sensors import ProbeChain, SensorChain

from tdbmon.diagnosis.left_over import LeftOver, seen_along
from tdbmon.diagnosis.residual_force import ResidualForce, residual_force, responses
from tests.diagnosis.plain_drop import COUNT, INTERVAL, bare
from tests.identify import drops

SIGMA = 0.25e-6


def _moved(drop: LeftOver, force: np.ndarray, position: float) -> np.ndarray:
    """Integrate the modal equations in real coordinates, plane by plane, under a force (2, k) complex at the ends."""
    model = drop.motion.model
    arrays, n = model.arrays, model.n
    time = drop.time - drop.time[0]

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        a, b, va, vb = np.split(y, 4)
        f = np.array([np.interp(t, time, row.real) + 1j * np.interp(t, time, row.imag) for row in force])
        ka = -arrays.square * a - arrays.damping * va - drop.omega * arrays.gyro @ vb + arrays.at_end.T @ f.real
        kb = -arrays.square * b - arrays.damping * vb + drop.omega * arrays.gyro @ va + arrays.at_end.T @ f.imag
        return np.concatenate([va, vb, ka, kb])

    found = solve_ivp(rate, (0, time[-1]), np.zeros(4 * n), "LSODA", time, rtol=1e-8, atol=1e-12, max_step=5e-4)
    shape = model.modes.at(position)
    return np.asarray(shape @ found.y[:n] + 1j * (shape @ found.y[n : 2 * n]))


def _with_residual(drop: LeftOver, seen: np.ndarray) -> LeftOver:
    return replace(drop, measured=drop.simulated + seen)


def _at(force: np.ndarray, drop: LeftOver, found: ResidualForce) -> np.ndarray:
    """The true force at the instants of the residual force."""
    return np.array([np.interp(found.time, drop.time, row) for row in force])


def _parts(force: np.ndarray) -> np.ndarray:
    return np.stack([force.real, force.imag], axis=1)


@pytest.fixture(scope="module")
def drop() -> LeftOver:
    return bare(SIGMA)


@pytest.fixture(scope="module")
def pushed(drop: LeftOver) -> tuple[np.ndarray, LeftOver]:
    """A half sine of 300 N over 5 ms at the second end, 30 degrees above +x, seen by noisy probes."""
    since = drop.time - 6e-3
    bump = np.where((since > 0) & (since < 5e-3), np.sin(np.pi * since / 5e-3), 0.0) * 300 * np.exp(1j * np.radians(30))
    force = np.stack([np.zeros(COUNT, dtype=complex), bump])
    rng = np.random.default_rng(3)
    rows = [
        (_moved(drop, force, p.position) * np.exp(-1j * p.angle)).real + SIGMA * rng.standard_normal(COUNT)
        for p in drop.probes
    ]
    return force, _with_residual(drop, np.array(rows))


def test_a_known_force_is_found_at_its_end_in_its_direction(pushed: tuple[np.ndarray, LeftOver]) -> None:
    force, drop = pushed
    found = residual_force(drop)
    truth = _at(force, drop, found)
    error = found.force - truth
    assert np.mean(np.abs(_parts(error)) <= found.band) > 0.85
    assert np.sqrt(np.mean(np.abs(error[1]) ** 2)) < 0.15 * np.sqrt(np.mean(np.abs(truth[1]) ** 2))
    assert found.stands_out[1] > 0.15
    at = found.summary(1, (found.time > 7e-3) & (found.time < 10e-3))
    assert at is not None
    assert np.degrees(at.axis) == pytest.approx(30, abs=5)
    assert at.straight > 0.9
    assert np.degrees(np.angle(at.mean)) == pytest.approx(30, abs=5)
    # the impulse shows in the rotor's velocity: it is far better determined than the force at any instant
    impulse = np.trapezoid(found.force[1], found.time)
    assert abs(impulse) == pytest.approx(300 * 5e-3 * 2 / np.pi, rel=0.08)


def test_noise_alone_makes_no_force(drop: LeftOver) -> None:
    rng = np.random.default_rng(5)
    outs = []
    for _ in range(5):
        found = residual_force(_with_residual(drop, SIGMA * rng.standard_normal((len(drop.probes), COUNT))))
        outs.append(found.stands_out.mean())
        assert np.abs(found.force).max() < 30
    assert np.mean(outs) < 0.1


def test_coloured_noise_is_known_for_what_it_is(drop: LeftOver) -> None:
    """Correlated noise makes no force either, if the probes' noise model contains the correlation."""
    rng = np.random.default_rng(6)
    white = SIGMA * rng.standard_normal((len(drop.probes), COUNT + 200))
    walk = np.zeros_like(white)
    for k in range(1, walk.shape[1]):
        walk[:, k] = 0.9 * walk[:, k - 1] + white[:, k]
    red = walk[:, 200:]
    colour = tuple(replace(noise, colour=np.array([0.9]), innovation=SIGMA) for noise in drop.noise)
    known = residual_force(replace(_with_residual(drop, red), noise=colour))
    taken_for_white = residual_force(_with_residual(drop, red))
    assert known.stands_out.mean() < 0.1 < taken_for_white.stands_out.mean()


def test_a_rigid_rotor_obeys_newton(drop: LeftOver) -> None:
    """Steady forces at the ends, in proportion to their shares of the mass, accelerate the whole rotor alike."""
    model = drop.motion.model
    rotor = model.modes.model
    ends = [bearing.position for bearing in model.machine.touchdown_bearings]
    share = (rotor.centre_of_mass - ends[0]) / (ends[1] - ends[0])
    _, jump, _ = responses(model, 0.0, (rotor.centre_of_mass,), INTERVAL, 4, COUNT)
    moved = (1 - share) * jump[0, :, 0] + share * jump[0, :, 1]
    time = np.arange(COUNT) * INTERVAL
    late = time > 0.015  # bending oscillates about it by some hundredths of a micrometre
    np.testing.assert_allclose(moved[late].real, (time**2 / 2 / rotor.total_mass)[late], rtol=0.02)
    assert np.abs(moved.imag).max() == pytest.approx(0, abs=1e-18)


def test_three_probes_still_give_a_force_with_a_wider_band(pushed: tuple[np.ndarray, LeftOver]) -> None:
    force, drop = pushed
    kept = [0, 2, 3]
    fewer = replace(
        drop,
        probes=tuple(drop.probes[k] for k in kept),
        noise=tuple(drop.noise[k] for k in kept),
        measured=drop.measured[kept],
        simulated=drop.simulated[kept],
        axes=drop.axes[np.ix_(kept, kept)],
        to_ends=np.zeros((2, 3), dtype=complex),
    )
    found, full = residual_force(fewer), residual_force(drop)
    assert found.band[0].mean() > full.band[0].mean()
    assert np.mean(np.abs(_parts(found.force - _at(force, drop, found))) <= found.band) > 0.85


def test_a_probe_that_the_model_knows_to_stand_otherwise_does_not_turn_the_force(
    pushed: tuple[np.ndarray, LeftOver],
) -> None:
    """Both probes of the end stand a quarter turn further: they read like a push a quarter turn back."""
    force, drop = pushed
    ends = drops.machine().ends
    turned = {p.name: ProbeChain(angle_error=np.pi / 2) for p in drop.probes if p.end == ends[1]}
    known = seen_along(drop.probes, SensorChain(probes=turned))
    rows = np.array(
        [(_moved(drop, force, p.position) * axis).real for p, axis in zip(drop.probes, np.diag(known), strict=True)]
    )
    noise = SIGMA * np.random.default_rng(3).standard_normal((len(drop.probes), COUNT))
    found = residual_force(replace(_with_residual(drop, rows + noise), axes=known))
    at = found.summary(1, (found.time > 7e-3) & (found.time < 10e-3))
    assert at is not None
    assert np.degrees(np.angle(at.mean)) == pytest.approx(30, abs=5)
    assert np.mean(np.abs(_parts(found.force - _at(force, drop, found))) <= found.band) > 0.85


def test_samples_that_are_missing_are_not_taken_for_readings_as_simulated(pushed: tuple[np.ndarray, LeftOver]) -> None:
    force, drop = pushed
    lacking = drop.measured.copy()
    lacking[2, (drop.time > 8e-3) & (drop.time < 14e-3)] = np.nan
    found = residual_force(replace(drop, measured=lacking))
    error = found.force - _at(force, drop, found)
    assert np.mean(np.abs(_parts(error)) <= found.band) > 0.85
    assert np.abs(error).max() < 300
    assert np.isfinite(found.place).all()  # as simulated there
