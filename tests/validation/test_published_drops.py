"""The published drops: what delays a first contact against closed forms, heat against energy, ratios of the case study."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from tdbmon.validation import __main__ as command
from tdbmon.validation import case_study, first_drop, publication_one, publication_two

GRAVITY = 9.80665


@pytest.fixture(scope="module")
def nominal():
    return first_drop.sequence(seconds=0.02)


def test_free_fall_ends_on_the_hanging_ring(nominal):
    assert 7.5e-6 <= nominal.ring_rest < 10e-6  # half the clearance, and a little between two balls
    fall = math.sqrt(2 * (300e-6 + nominal.ring_rest) / GRAVITY)
    assert nominal.starts[0] == pytest.approx(fall, abs=0.05e-3)


@pytest.mark.parametrize(
    ("index", "size", "fallen"),
    [
        (0, 1.0, lambda t: GRAVITY * (t**2 / 2 - 1e-3 * t + 1e-6 * (1 - math.exp(-t / 1e-3)))),
        (1, 50.0, lambda t: GRAVITY * t**2 / 2 - 50e-6),
        (2, 5.0, lambda t: GRAVITY * t**2 / 2 - 5e-3 * t),
        (3, 50.0, lambda t: GRAVITY * t**2 / 2 - 50e-6),
    ],
)
def test_each_candidate_delays_as_a_rigid_body_would(nominal, index, size, fallen):
    found = first_drop.CANDIDATES[index].run(size, 0.015).starts[0]
    depth = GRAVITY * nominal.starts[0] ** 2 / 2
    assert found == pytest.approx(brentq(lambda t: fallen(t) - depth, 1e-3, 20e-3), abs=0.05e-3)


def test_size_needed_puts_the_contact_where_it_is_printed():
    fading = first_drop.CANDIDATES[0]
    assert fading.run(first_drop.needed(fading), 0.015).starts[0] == pytest.approx(first_drop.PRINTED[0], abs=0.02e-3)


@pytest.fixture(scope="module")
def pair_drop():
    return publication_two.drop()


def test_first_peak_and_settled_force_are_of_the_printed_size(pair_drop):
    at = pair_drop.sel(end=publication_two.PAIR)
    assert float(at["peak_normal_force"]) > 5000
    late = pair_drop["time"].values > 0.25
    weight = 109.7 * GRAVITY / 2
    for end in pair_drop["end"].values:
        assert float(pair_drop["normal_force"].sel(end=end).values[late].mean()) == pytest.approx(weight, rel=0.25)


def test_rubbing_spends_what_spinning_the_ring_up_costs(pair_drop):
    """Friction brings the ring from rest to speed against its torque M: J omega^2/2 and the integral of M times the lag."""
    assert publication_two.at_speed(pair_drop, publication_two.DEEP_GROOVE) < publication_two.at_speed(
        pair_drop, publication_two.PAIR
    )
    rubbed = float(pair_drop["work"].sel(work_kind="friction_1").values[-1])
    at = pair_drop.sel(end="DE", heat_end="DE")
    rim = 34.75 / 35 * at["rotor_speed"].values  # at which the ring rolls along with the shaft
    torque = sum(at[f"{name}_torque"].values for name in ("load", "speed", "spin"))
    braked = np.trapezoid(torque * 2 * math.pi * (rim - at["ring_speed"].values), at["time"].values)
    assert braked > 5
    spun = 0.5 * 3.2e-4 * (2 * math.pi * publication_two.SPEED) ** 2
    assert rubbed == pytest.approx(spun + braked, rel=0.02)


def test_heat_of_the_pair_is_closed(pair_drop):
    at = pair_drop.sel(heat_end="DE")
    np.testing.assert_allclose(at["heat_stored"] + at["heat_lost"], at["heat_supplied"], rtol=1e-9, atol=1e-9)
    assert float(at["temperature_rise"].sel(node="inner_ring").max()) > 1


def test_row_loads_of_the_joined_rows_are_those_of_the_pair():
    """The machine's file joins the pair to one radial row; the pair itself, held axially, must agree."""
    from tdbsim.angular_contact import pair

    bearing = pair(publication_two.pair_geometry(), case_study.ROW_COUNT, case_study.ROW_WIDTH, "X")
    press = 8e-6
    rows = bearing.displaced([0.0, -press, 0.0, 0.0, 0.0], -math.pi / 2)
    joined = case_study.machine().bearing("DE")
    load = joined.ball_stiffness * press**1.5 * joined.balls.radial_share
    assert max(row.load.max() for row in rows) == pytest.approx(load, rel=0.03)  # the contact angle falls a little


def test_stress_of_the_two_ends_stands_as_the_cube_root_of_the_force():
    ratio = case_study.under_printed_force("DE", False) / case_study.under_printed_force("NDE", False)
    assert ratio == pytest.approx((4889 / 2907) ** (1 / 3), rel=0.02)
    assert ratio == pytest.approx(3577 / 3014, rel=0.02)  # printed


def test_chapters_hold_every_published_number():
    text = publication_one.chapter()
    for each in publication_one.ARRANGEMENTS:
        assert all(f"| {value * 1e-6:.0f} |" in text for value in each.printed)
    assert all(f"{force:.0f} N" in case_study.chapter() for force in case_study.PRINTED_FORCE.values())


def test_the_report_is_written_where_it_is_wanted(tmp_path, monkeypatch):
    for module in (publication_one, first_drop, publication_two, case_study):
        monkeypatch.setattr(module, "chapter", lambda name=module.__name__: f"## {name}\n")
    command.main([str(tmp_path / "new" / "validation.md")])
    text = (tmp_path / "new" / "validation.md").read_text(encoding="utf-8")
    assert text.startswith("# Validation")
    assert text.index("publication_one") < text.index("first_drop") < text.index("case_study")
