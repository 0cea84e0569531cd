"""The laws of drag: closed forms, their fit with true intervals, and the choice between them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from tdbmon.analysis.autoregression import WHITE, noise_of
from tdbmon.analysis.drag_law import Coast, DragLaw, fit_law
from tdbmon.analysis.law_choice import MODELS, Candidate, choose_law, noise_in
from tdbmon.analysis.speed_model import speed_model
from tests.analysis.coasting import NAMES, STRONG, coloured

SEEDS = 200


@settings(max_examples=40, deadline=None)
@given(st.floats(0, 0.5), st.floats(0, 5), st.floats(0, 5e-3), st.floats(1, 300))
def test_law_agrees_with_a_numerical_integration(b: float, a: float, q: float, speed: float) -> None:
    law = DragLaw(1.0, speed, b, a, q)
    end = min(20.0, 0.98 * (law.standstill - 1.0))
    found = solve_ivp(
        lambda _, w: -(a + b * w + q * w**2), (0, end), [speed], rtol=1e-10, atol=1e-10, dense_output=True
    )
    t = np.linspace(0, end, 40)
    np.testing.assert_allclose(law.speed_at(1.0 + t), found.sol(t)[0], rtol=1e-6, atol=1e-7 * speed)


@pytest.mark.parametrize(("b", "a", "q"), [(0.1, 0.5, 0.0), (0.0, 2.0, 0.0), (0.05, 1.0, 3e-3), (0.0, 1.0, 1e-3)])
def test_rotor_stops_when_dry_friction_has_taken_its_momentum(b: float, a: float, q: float) -> None:
    law = DragLaw(0.0, 80.0, b, a, q)
    w = np.linspace(0, 80.0, 200_001)
    slowness = 1 / (a + b * w + q * w**2)
    expected = np.sum(0.5 * (slowness[1:] + slowness[:-1])) * w[1]  # ∫ dω / drag
    assert law.standstill == pytest.approx(expected, rel=1e-7)
    assert law.speed_at(law.standstill * 0.999) > 0
    assert np.all(law.speed_at(law.standstill + np.array([0.001, 10.0])) == 0)


def test_law_without_dry_friction_never_stops() -> None:
    assert DragLaw(0.0, 80.0, 0.1, 0.0, 1e-3).standstill == np.inf
    t = np.array([0.0, 500.0, 5000.0])
    np.testing.assert_allclose(DragLaw(0.0, 80.0, 1.0).speed_at(t), 80 * np.exp(-t), atol=1e-12)


def test_mean_over_a_span_is_the_angle_turned() -> None:
    begin, end = np.array([0.0, 1.0]), np.array([0.5, 1.2])
    law = DragLaw(0.0, 50.0, linear=0.5)
    turned = 50 / 0.5 * (np.exp(-0.5 * begin) - np.exp(-0.5 * end))
    np.testing.assert_allclose(law.mean_between(begin, end) * (end - begin), turned, rtol=1e-5)


def test_noise_model_recovers_an_autoregression() -> None:
    noise = noise_of(coloured(np.random.default_rng(3), 20_000, 0.2, 0.7), 0)
    assert noise.ar[0] == pytest.approx(0.7, abs=0.03)
    assert noise.sigma == pytest.approx(0.2 * np.sqrt(1 - 0.49), rel=0.03)


def test_fit_without_noise_returns_the_law() -> None:
    law = DragLaw(0.0, 90.0, 0.1, 0.8, 1e-3)
    edges = np.linspace(0, 10, 400)
    coast = Coast(edges[:-1], edges[1:], law.mean_between(edges[:-1], edges[1:]))
    found = fit_law(coast, MODELS["constant + exponential + quadratic"], WHITE).law
    np.testing.assert_allclose(
        [found.speed, found.linear, found.constant, found.quadratic], [90.0, 0.1, 0.8, 1e-3], rtol=1e-5
    )


# choice and intervals


def coast_of(name: str, seed: int, rho: float, step: float = 0.0) -> Coast:
    """Eight seconds from 100 Hz on, in 160 spans."""
    edges = np.linspace(0, 8, 161)
    law = DragLaw(0.0, 100.0, **STRONG[name])
    mean = law.mean_between(edges[:-1], edges[1:]) + coloured(np.random.default_rng(seed), 160, 0.05, rho)
    return Coast(edges[:-1], edges[1:], np.round(mean / step) * step if step else mean)


@pytest.mark.parametrize(("name", "rho", "step"), [(n, 0.0, 0.0) for n in STRONG] + [("exponential", 0.6, 0.05)])
def test_parameters_lie_in_their_intervals_as_often_as_stated(name: str, rho: float, step: float) -> None:
    hits = dict.fromkeys(STRONG[name], 0)
    for seed in range(SEEDS):
        coast = coast_of(name, seed, rho, step)
        fit = fit_law(coast, MODELS[name], noise_in(coast))
        model = speed_model(Candidate(name, fit, 1.0, 1.0), True)
        for term, true in STRONG[name].items():
            key, of = NAMES[term]
            hits[term] += model.parameters[key].low <= of(true) <= model.parameters[key].high
    for counted in hits.values():
        assert 0.90 * SEEDS <= counted <= 0.99 * SEEDS


@pytest.mark.parametrize("name", STRONG)
def test_right_law_is_chosen(name: str) -> None:
    count = SEEDS if name == "exponential" else 40
    right = 0
    for seed in range(count):
        coast = coast_of(name, 1000 + seed, 0.0)
        right += choose_law(coast, noise_in(coast))[1].name == name
    assert right >= 0.95 * count
