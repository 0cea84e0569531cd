"""What every effect must do, by being in the folder; and how effects are read."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from types import ModuleType
from typing import ClassVar

import numpy as np
import pytest
from changed_machine import changed, exactly
from tdbsim import hooks, state_layout
from tdbsim.drop_model import build_model, with_effects
from tdbsim.effect import Effect, Place, _only_kind, catalogue, declaration, parameter, places
from tdbsim.errors import InputError
from tdbsim.machine import EffectSetting
from tdbsim.simulate import DropPlan, run, simulate
from tdbsim.stated_effects import all_effects, parse
from tdbsim.support import spring_force
from tdbsim.units import scale

PLAN = DropPlan(150.0, 0.35, levitated=0.1)
SHORT = DropPlan(150.0, 0.02, levitated=0.01)
EVERY = pytest.mark.parametrize("declared", catalogue(), ids=[each.identifier for each in catalogue()])

# what users, records and diagnoses name already: the catalogue may grow, none of these goes or moves
NAMES = {
    "residual_magnetic_force": Place.ROTOR, "unbalance": Place.PLANE, "shaft_bow": Place.ROTOR,
    "cross_coupled_stiffness": Place.PLANE, "stribeck_friction": Place.BEARING_OR_BOTH,
    "oval_clearance": Place.BEARING, "ring_out_of_round": Place.BEARING, "race_waviness": Place.BEARING,
    "off_sized_ball": Place.BEARING, "support_anisotropy": Place.BEARING_OR_BOTH, "loose_support": Place.BEARING,
    "hardening_support": Place.BEARING_OR_BOTH, "foundation_mode": Place.BEARING_OR_BOTH, "ring_drag": Place.BEARING,
    "quadratic_windage": Place.ROTOR, "thermal_growth": Place.BEARING_OR_BOTH, "probe_gain": Place.PROBE,
    "probe_angle": Place.PROBE, "probe_runout": Place.END, "probe_crosstalk": Place.END, "channel_lag": Place.PROBE,
}  # fmt: skip


@pytest.fixture(scope="module")
def plain_drop(machine):
    return simulate(machine, PLAN)


@pytest.fixture(scope="module")
def short_drop(machine):
    return simulate(machine, SHORT)


def test_the_catalogue_holds_what_is_named_already():
    assert {each.identifier: each.place for each in catalogue()}.items() >= NAMES.items()


@EVERY
def test_units_parse_and_declarations_are_whole(declared):
    assert declared.title
    assert all(each.endswith(".") for each in (declared.what, declared.signature, declared.on_the_machine))
    assert declared.kind.__doc__ and not declared.kind.__doc__.startswith(declared.kind.__name__ + "(")
    assert declared.parameters
    assert len(declared.parameters) == len(fields(declared.kind)) - 1
    for each in declared.parameters:
        assert each.meaning
        if each.choices:
            assert each.off in each.choices
            continue
        assert scale(each.unit, each.si) > 0
        assert each.low < each.high
        assert each.low <= each.typical <= each.high
        assert each.low <= each.off <= each.high or each.off == math.inf
        read = declared.at("somewhere", {each.name: each.text(each.typical)})
        assert getattr(read, each.name) == pytest.approx(each.typical, rel=1e-5)
    assert declared.parameters[0].typical != declared.parameters[0].off
    for kind in hooks.HOOKS:
        if hasattr(declared.module, kind):
            assert declared.kind.slots > 0
            assert declared.kind.most == 1 or kind == "ball"


@EVERY
def test_off_is_neutral_to_the_last_bit(declared, machine, short_drop):
    for where in places(declared.place, machine):
        off = declared.kind(where)
        assert off.is_off
        drop = simulate(machine, SHORT, [off])
        for name in short_drop.data_vars:
            np.testing.assert_array_equal(drop[name].values, short_drop[name].values, err_msg=name)


@EVERY
def test_finite_within_bounds(declared, machine):
    """At each bound of each parameter the drop is finite, or an error says what cannot be."""
    where = places(declared.place, machine)[-1]
    usual = {each.name: each.typical for each in declared.parameters if not each.choices}
    finite = 0
    for each in declared.parameters:
        for value in each.choices or (each.low, each.high):
            effect = declared.at(where, usual | {each.name: value})
            try:
                drop = simulate(machine, DropPlan(150.0, 0.03, levitated=0.005), [effect])
            except InputError as error:
                assert len(str(error)) > 30
                continue
            finite += 1
            assert all(np.all(np.isfinite(drop[name].values)) for name in drop.data_vars)
    assert finite > 0


@EVERY
def test_the_declared_signature_rises(declared, machine, plain_drop):
    where = places(declared.place, machine)[0]
    drop = simulate(machine, PLAN, [declared.typical(where)])
    assert float(drop["normal_force"].max()) > 1000
    before, after = (declared.kind.measure(each, where) for each in (plain_drop, drop))
    assert after > declared.kind.rise * before


@EVERY
def test_methods_agree_with_the_effect(declared, machine):
    """The fast kernel and the equations in the open give one drop, through the first contact.

    With few modes: a bow pushes high ones about, which takes shorter steps.
    """
    effect = declared.typical(places(declared.place, machine)[0])
    model = build_model(machine, [effect], bending=4)
    caught = run(model, DropPlan(150.0, 0.015, step=5e-6))
    assert caught.peak_normal.max() > 1000
    plan = DropPlan(150.0, 0.015, method="dormand_prince", tolerance=1e-9)
    fine, exact, n = caught.state, run(model, plan).state, model.n
    apart = fine - exact
    for along in (state_layout.modes_x(n), state_layout.modes_y(n)):
        assert np.abs(apart[:, along] @ model.arrays.at_end.T).max() < 5e-9
    assert np.abs(apart[:, state_layout.omega(n)]).max() < 0.01
    assert np.abs(apart[:, state_layout.ring_speeds(n)]).max() < 0.01


@EVERY
@pytest.mark.parametrize("kind", list(hooks.HOOKS))
def test_hooks_as_plain_functions_are_the_compiled_ones(declared, kind, machine):
    if not hasattr(declared.module, kind):
        assert not hooks.has_hook(declared, kind)
        return
    model = build_model(machine, [declared.typical(places(declared.place, machine)[0])])
    row = model.arrays.effect[2 if declared.place is Place.ROTOR else 0]
    start = hooks.offsets()[declared.identifier]
    arguments = {"gap": (0.7, 30.0), "ball": (0.7, 0.2), "support": (1e-5, -2e-5)}.get(kind, (0.7,))
    plain = getattr(declared.module, kind)(*arguments, row, start)
    assert np.any(np.asarray(plain) != 0.0)
    assert np.allclose(getattr(hooks, kind)(*arguments, row), plain, rtol=1e-13)


@pytest.mark.parametrize("law", ["radial", "normal"])
def test_slopes_of_shaped_bores(machine, law):
    for identifier, kind in (("oval_clearance", "gap"), ("ring_out_of_round", "bore")):
        declared = declaration(identifier)
        model = build_model(machine, [declared.at("NDE", {"amplitude": 1e-5, "law": law})])
        row, start = model.arrays.effect[0], hooks.offsets()[identifier]
        hook = getattr(declared.module, kind)

        def shape(azimuth, hook=hook, kind=kind, row=row, start=start):
            return hook(*((azimuth, 0.0) if kind == "gap" else (azimuth,)), row, start)

        for azimuth in np.linspace(0, 6, 25):
            value, slope, curvature = shape(azimuth)
            assert abs(value) <= 1e-5
            expected = (shape(azimuth + 1e-5)[0] - shape(azimuth - 1e-5)[0]) / 2e-5 if law == "normal" else 0.0
            assert slope == pytest.approx(expected, abs=1e-13)
            expected = (shape(azimuth + 1e-5)[1] - shape(azimuth - 1e-5)[1]) / 2e-5 if law == "normal" else 0.0
            assert curvature == pytest.approx(expected, abs=1e-12)


def test_effects_combine(machine, plain_drop):
    some = [
        parse("oval_clearance:end=NDE,amplitude=20 um,angle=35 deg"),
        parse("support_anisotropy:where=both,ratio=0.5"),
        parse("off_sized_ball:end=DE,ball=3,deviation=5 um"),
        parse("off_sized_ball:end=DE,ball=7,deviation=-5 um"),
        parse("probe_gain:probe=NDE_A,gain=1.1"),
        parse("quadratic_windage:share=0.3"),
        parse("loose_support:end=NDE,play=20 um"),
    ]
    drop, other = simulate(machine, SHORT, some), simulate(machine, SHORT, some[::-1])
    np.testing.assert_array_equal(drop["NDE_A"].values, other["NDE_A"].values)
    oversize = build_model(machine, some).arrays.ball_oversize[1]
    assert oversize[[2, 6]] == pytest.approx([5e-6, -5e-6])
    assert drop.attrs["effects"].count(";") == 6


PLAY, PLAY_RATIO, SOFTER = 20e-6, 0.1, 0.4


@pytest.fixture(params=[0.0, 0.5], ids=["level", "leaning"])
def loose_and_uneven(machine, request):
    """The support's force (x, y) at a deflection, one with play that is softer along an angle, and that angle."""
    direction = request.param
    pair = [
        declaration("loose_support").at("NDE", {"play": PLAY, "stiffness_ratio": PLAY_RATIO}),
        declaration("support_anisotropy").at("NDE", {"ratio": SOFTER, "direction": direction}),
    ]
    arrays, other = (build_model(machine, given).arrays for given in (pair, pair[::-1]))
    np.testing.assert_array_equal(arrays.effect, other.effect)

    def force(at):
        return np.array(
            [complex(*spring_force(arrays.end, arrays.effect, 0, z.real, z.imag)) for z in np.atleast_1d(at)]
        )

    return force, direction


def test_play_in_an_uneven_support_is_softer_by_its_ratio_in_each_direction(machine, loose_and_uneven):
    """Of each direction's own stiffness: k times the ratio within the play, k beyond it."""
    force, direction = loose_and_uneven
    whole = machine.touchdown_bearings[0].support_stiffness.nominal
    for stiffness, axis in ((SOFTER * whole, np.exp(1j * direction)), (whole, 1j * np.exp(1j * direction))):
        for at in (5e-6, -15e-6):
            np.testing.assert_allclose(force(at * axis), -PLAY_RATIO * stiffness * at * axis, rtol=1e-9)
        for at in (25e-6, 80e-6):
            expected = -stiffness * (PLAY_RATIO * PLAY + at - PLAY) * axis
            np.testing.assert_allclose(force(at * axis), expected, rtol=1e-9)


def test_an_uneven_support_with_play_pulls_to_the_middle_and_gives_no_energy(loose_and_uneven):
    """It pushed away from the middle within the play: as much stiffness was missing in the soft direction as in the other."""
    force, _ = loose_and_uneven
    turn = np.exp(2j * np.pi * np.arange(4000) / 4000)
    for radius in (1e-6, 15e-6, 21e-6, 60e-6):
        assert (force(radius * turn) * turn.conj()).real.max() < 0
    for shape, lean in ((0.1, 0.8), (0.3, -0.4)):  # the ways of whirls that go through the play and beyond it
        way = 60e-6 * (turn.real + 1j * shape * turn.imag) * np.exp(1j * lean) + 5e-6
        assert np.abs(way).min() < PLAY < np.abs(way).max()
        steps = (np.roll(way, -1) - np.roll(way, 1)) / 2
        power = (force(way).conj() * steps).real
        assert abs(power.sum()) < 1e-5 * np.abs(power).sum()


def test_parse_reads_what_a_person_writes():
    for text in (
        "oval_clearance:end=NDE,amplitude=20 um,angle=35 deg",
        "oval_clearance: where = NDE , amplitude=0.02 mm,angle=35°",
        "oval_clearance:end='NDE',amplitude=\"20 um\",angle='35 deg'",
    ):
        oval = parse(text)
        assert isinstance(oval, declaration("oval_clearance").kind)
        assert oval.where == "NDE"
        assert oval.amplitude == pytest.approx(20e-6)
        assert oval.angle == pytest.approx(math.radians(35))
    assert parse(str(parse("race_waviness:end=DE,amplitude=2 um,order=3,race=outer"))) == parse(
        "race_waviness:end=DE,amplitude=2 um,order=3,race=outer"
    )
    assert parse("residual_magnetic_force:decay_time=3 ms").where == "rotor"
    assert parse("residual_magnetic_force").is_off


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("oval_clearence:end=NDE", "did you mean 'oval_clearance'"),
        ("oval_clearance:end=NDE,amplitud=20 um", "did you mean 'amplitude'"),
        ("stribek:end=NDE", "did you mean 'stribeck_friction'"),  # the beginning of a name
        ("Magnet", "did you mean 'residual_magnetic_force'"),  # of a word within it
        ("windage", "did you mean 'quadratic_windage'"),  # and not ring_drag, which has more of its letters in a row
        ("bow", "did you mean 'shaft_bow'"),
        ("probe_", "did you mean 'probe_angle' or 'probe_crosstalk' or 'probe_gain' or 'probe_runout'"),
        ("", "known: channel_lag, cross"),
        ("oval_clearance:end=NDE,amplitude=20 kg", "amplitude: 'kg' is not a unit"),
        ("oval_clearance:end=NDE,amplitude=900 um", "amplitude 900 um is out of bounds; give -100 um to 100 um"),
        ("oval_clearance:amplitude=20 um", "no place given"),
        ("oval_clearance:end=NDE,where=DE", "place is given twice"),
        ("oval_clearance:end=NDE,amplitude=1 um,amplitude=2 um", "amplitude is given twice"),
        ("oval_clearance:end=NDE,amplitude=20", 'amplitude 20 has no unit; write e.g. "20 um"'),
        ("oval_clearance:end=NDE,amplitude", "not of the form"),
        ('oval_clearance:end=NDE,amplitude=""', "not of the form"),
        ("off_sized_ball:end=NDE,ball=2.5", "whole number"),
        ("race_waviness:end=NDE,race=middle", "not one of inner, outer"),
        ("oval_clearance:end=NDE,amplitude=nan", "not a quantity"),
    ],
)
def test_wrong_texts(text, says):
    with pytest.raises(InputError, match=says):
        parse(text)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("oval_clearance:end=NED,amplitude=1 um", "did you mean 'NDE'"),
        ("oval_clearance:end=both,amplitude=1 um", "is no bearing"),
        ("unbalance:plane=impeler,amount=1 g mm", "did you mean 'impeller'"),
        ("probe_gain:probe=NDE,gain=1.1", "is no probe of this machine; did you mean 'NDE_A' or 'NDE_B'"),
        ("off_sized_ball:end=NDE,ball=30,deviation=1 um", "has 11 balls"),
        ("cross_coupled_stiffness:plane=impeller,stiffness=5e6 N/m", "not stable"),
    ],
)
def test_effects_that_do_not_fit_the_machine(machine, text, says):
    with pytest.raises(InputError, match=says):
        simulate(machine, SHORT, [parse(text)])


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("foundation_mode:where=both,stiffness=3e7 N/m", "foundation_mode:end=DE,stiffness=6e7 N/m"),
        ("probe_crosstalk:end=NDE,factor=0.1", "probe_crosstalk:end=NDE,factor=0.2"),
        ("support_anisotropy:end=DE,ratio=0.5", "support_anisotropy:end=DE,ratio=0.4,direction=40 deg"),
        ("support_anisotropy:where=both,ratio=0.5", "support_anisotropy:end=DE,ratio=0.4"),
    ],
)
def test_what_a_second_one_would_undo_acts_once(machine, first, second):
    """The last foundation or leak was taken without a word; a second anisotropy counted from the first one's stiffness."""
    with pytest.raises(InputError, match="is given twice for .* can act only once at a place: give it once"):
        all_effects(machine, [parse(first), parse(second)])


def test_what_stands_still_is_written_so_that_it_can_be_read(machine):
    """A foundation's stiffness is infinite by default, which no text says."""
    rigid = declaration("foundation_mode").at("NDE", {"mass": 100.0})
    assert math.isinf(rigid.stiffness)
    assert "inf" not in str(rigid)
    assert declaration("foundation_mode").parameter("stiffness").text(math.inf) == "infinite"
    assert parse(str(rigid)) == rigid


def test_a_shape_that_takes_all_of_the_gap_is_refused(machine):
    narrow = changed(machine, ends={"radial_gap": exactly(90e-6)})
    with pytest.raises(InputError, match=r"reaches 100 um inwards and closes the radial gap of 90 um"):
        build_model(narrow, [declaration("oval_clearance").at("NDE", {"amplitude": 100e-6})])


def test_friction_that_would_drive_the_slip_is_refused(machine):
    slippery, stribeck = changed(machine, ends={"friction": exactly(0.1)}), declaration("stribeck_friction")
    build_model(slippery, [stribeck.at("both", {"static_excess": -0.1})])
    with pytest.raises(InputError, match=r"static_excess -0.2 with the friction of 0.1 at 'NDE' .* give -0.1 or more"):
        build_model(slippery, [stribeck.at("both", {"static_excess": -0.2})])


@pytest.mark.parametrize("name", ["probe_runout", "probe_crosstalk"])
def test_an_effect_on_the_probes_of_an_end_that_has_none_is_refused(machine, name):
    half = changed(machine, probes=machine.probes_at("NDE"))
    all_effects(half, [declaration(name).typical("NDE")])
    with pytest.raises(InputError, match=r"end 'DE' has no \[\[probe\]\], so it changes nothing"):
        all_effects(half, [declaration(name).typical("DE")])


def test_what_acts_beside_its_like_may_be_given_again(machine):
    either_way = [parse(f"probe_crosstalk:end=NDE,factor=0.1,into={word}") for word in ("first", "second")]
    sums = [parse("unbalance:plane=impeller,amount=20 g mm"), parse("shaft_bow:bow=40 um")] * 2
    assert all_effects(machine, either_way + sums) == (*either_way, *sums)


@pytest.mark.parametrize(
    ("texts", "says"),
    [
        (
            ["oval_clearance:end=NDE,amplitude=20 um", "oval_clearance:end=NDE,amplitude=10 um"],
            "is given twice for 'NDE'",
        ),
        (["oval_clearance:end=NED,amplitude=20 um"], "'NED' is no bearing of this machine"),
    ],
)
def test_a_ready_model_refuses_what_a_machine_does(machine, texts, says):
    """The second oval took the first one's place in the kernels, and a wrong place was a bare ValueError."""
    model = build_model(machine)
    with pytest.raises(InputError, match=says):
        with_effects(model, [parse(text) for text in texts])


@dataclass(frozen=True)
class OnceAtAProbe(Effect):
    place: ClassVar = Place.PROBE
    once: ClassVar = True
    size: float = parameter("1", 0.0, (0.0, 1.0), 0.5, "of a channel")


def test_once_at_a_place_is_once_at_each(machine):
    """Of probes and planes it was once on the whole machine."""
    apart = (OnceAtAProbe("NDE_A", 0.1), OnceAtAProbe("DE_A", 0.2))
    assert all_effects(machine, apart) == apart
    with pytest.raises(InputError, match="is given twice for 'DE_A'"):
        all_effects(machine, [*apart, OnceAtAProbe("DE_A", 0.3)])


@pytest.mark.parametrize("place", [Place.PLANE, Place.PROBE])
def test_hooks_where_kernels_have_no_numbers_for_them_are_refused(place):
    """Two planes would share the rotor's numbers, and the second would take those of the first."""
    module = ModuleType("tdbsim.effects.hooked")
    module.Hooked = type("Hooked", (Effect,), {"place": place, "slots": 1, "__module__": module.__name__})
    with pytest.raises(InputError, match=f"effects/hooked.py has slots for hooks at a {place}"):
        _only_kind(module)


def test_an_effect_of_the_machine_file_is_not_replaced_without_a_word(machine):
    setting = EffectSetting.model_validate({"name": "oval_clearance", "where": "NDE", "amplitude": "20 um"})
    carrying = machine.model_copy(update={"effects": (setting,)})
    with pytest.raises(InputError, match="the machine file already has it: change it or remove it there"):
        all_effects(carrying, [parse("oval_clearance:end=NDE,amplitude=10 um")])


def test_one_hooked_effect_acts_once_at_a_place(machine):
    twice = [parse("oval_clearance:end=NDE,amplitude=1 um"), parse("oval_clearance:end=NDE,amplitude=2 um")]
    with pytest.raises(InputError, match="given twice"):
        all_effects(machine, twice)
    both = [parse("stribeck_friction:where=both,static_excess=0.1"), parse("stribeck_friction:end=DE")]
    with pytest.raises(InputError, match="given twice"):
        all_effects(machine, both)


WAVES = (
    "race_waviness:end=NDE,amplitude=3 um,order=2,phase=40 deg",
    "race_waviness:end=NDE,amplitude=1 um,order=5,phase=-10 deg,race=inner",
    "race_waviness:end=NDE,amplitude=2 um,order=3,phase=75 deg,race=outer",
    "off_sized_ball:end=NDE,deviation=4 um,ball=3",
    "off_sized_ball:end=NDE,deviation=-2 um,ball=8",
    "race_waviness:end=DE,amplitude=1.5 um,order=4,race=outer",
)


def test_waves_of_both_races_and_balls_of_several_sizes_act_together(machine):
    drop = simulate(machine, DropPlan(150.0, 0.04, cage_angle=(0.3, 0.0)), [parse(text) for text in WAVES])
    at = drop.sel(end="NDE")
    ring, count = at["ring_angle"].values, 11
    azimuth = at["cage_angle"].values + 2 * np.pi * np.arange(count)[:, None] / count
    ex, ey = (at["ring_x"] - at["support_x"]).values, (at["ring_y"] - at["support_y"]).values
    press = ex * np.cos(azimuth) + ey * np.sin(azimuth) - 9e-6
    press += 3e-6 * np.cos(2 * (azimuth - ring) - math.radians(40))
    press += 1e-6 * np.cos(5 * (azimuth - ring) + math.radians(10))
    press += 2e-6 * np.cos(3 * azimuth - math.radians(75))
    press[2] += 4e-6
    press[7] -= 2e-6
    loads = 1.06e10 * np.maximum(press, 0) ** 1.5
    assert loads.max() > 1000
    np.testing.assert_allclose(at["ball_load"].values, loads, atol=1e-6 * loads.max())


def test_two_equal_waves_are_one_of_twice_the_height(machine):
    one = parse("race_waviness:end=NDE,amplitude=4 um,order=3")
    half = parse("race_waviness:end=NDE,amplitude=2 um,order=3")
    twice, once = (simulate(machine, SHORT, waves)["rotor_y"].values for waves in ([half, half], [one]))
    np.testing.assert_allclose(twice, once, atol=1e-12)
    assert np.abs(once - simulate(machine, SHORT, [half])["rotor_y"].values).max() > 1e-8


def test_a_wave_of_no_height_among_others_is_neutral_to_the_last_bit(machine):
    waves = [parse(text) for text in WAVES]
    flat = parse("race_waviness:end=NDE,amplitude=0 um,order=7")
    without, found = (simulate(machine, SHORT, given) for given in (waves, [waves[0], flat, *waves[1:]]))
    for name in without.data_vars:
        np.testing.assert_array_equal(found[name].values, without[name].values, err_msg=name)


def test_more_waves_than_a_place_holds_are_refused(machine):
    many = [parse(f"race_waviness:end=NDE,amplitude=1 um,order={order}") for order in range(1, 18)]
    assert len(build_model(machine, many[:16]).effects) == 16
    with pytest.raises(InputError, match="more than 16 times for 'NDE'"):
        build_model(machine, many)
    with pytest.raises(InputError, match="more than 16 times for 'NDE'"):
        with_effects(build_model(machine), many)


def test_effects_of_the_machine_file_act(machine, short_drop):
    setting = EffectSetting.model_validate({"name": "oval_clearance", "where": "NDE", "amplitude": "20 um"})
    carrying = machine.model_copy(update={"effects": (setting,)})
    drop = simulate(carrying, SHORT)
    same = simulate(machine, SHORT, [declaration("oval_clearance").at("NDE", {"amplitude": "20 um"})])
    assert float(np.abs(drop["rotor_y"] - short_drop["rotor_y"]).max()) > 1e-6
    np.testing.assert_array_equal(drop["rotor_y"].values, same["rotor_y"].values)
    wrong = EffectSetting.model_validate({"name": "oval_clearance", "where": "NDE", "amplitud": "20 um"})
    with pytest.raises(InputError, match=r"\[\[effect\]\] at 'NDE': oval_clearance: .* did you mean 'amplitude'"):
        simulate(machine.model_copy(update={"effects": (wrong,)}), SHORT)


def test_the_heat_that_closes_the_gap_leaves_with_its_cooling_time(machine):
    """Of each joule of friction exp(-age / cooling_time) is left."""
    cooling = 0.1
    effect = declaration("thermal_growth").at("DE", {"growth": 2e-8, "cooling_time": cooling})
    drop = simulate(machine, DropPlan(150.0, 0.15), [effect])
    rubbed, heat = (drop["work"].sel(work_kind=f"{kind}_1").values for kind in ("friction", "heat"))
    time = drop["time"].values
    came = np.diff(rubbed) * np.exp((time[1:] + time[:-1]) / 2 / cooling)
    expected = np.concatenate([[0.0], np.cumsum(came)]) * np.exp(-time / cooling)
    assert heat[-1] < 0.6 * rubbed[-1]
    np.testing.assert_allclose(heat, expected, atol=1e-3 * heat.max())


def test_a_release_at_once_is_one_whatever_the_gravity(machine):
    """On the moon a free fall seemed to be held back."""
    kind, plan = declaration("residual_magnetic_force").kind, DropPlan(150.0, 0.05)
    for gravity in (9.80665, 1.62):
        there = changed(machine, gravity=gravity)
        assert kind.measure(simulate(there, plan), "rotor") < 0.5e-3
        assert kind.measure(simulate(there, plan, [kind("rotor", 2e-3)]), "rotor") > 1e-3


def test_parameters_out_of_bounds_in_python():
    with pytest.raises(InputError, match="out of bounds"):
        declaration("oval_clearance").kind("NDE", amplitude=1.0)
    with pytest.raises(InputError, match="not a number"):
        declaration("oval_clearance").kind("NDE", amplitude="20 um")
