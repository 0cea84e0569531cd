"""Machine files written: what is read back is the machine, to the last digit, in the units that people use."""

from __future__ import annotations

import math
import tomllib

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tdbsim.effect import catalogue, places
from tdbsim.errors import InputError
from tdbsim.machine import EffectSetting, Tolerant, load_machine, parse_machine
from tdbsim.stated_effects import all_effects

from tdbmon.cli import main
from tdbmon.estimate import Estimate
from tdbmon.identify import fitted
from tdbmon.identify.calibration import Calibration, DropFit, Undetermined
from tdbmon.identify.forces import DropForces
from tdbmon.identify.parameters import calibrated_machine, machine_parameters
from tdbmon.machine_file import machine_text, with_effects, write_machine
from tdbmon.shipped import shipped

FILES = sorted(shipped("machines").parent.glob("*/*.toml"))
MACHINES = [load_machine(file) for file in FILES]
SHORT = load_machine(shipped("short/machine.toml"))

# every part and every field that the shipped files leave out
WHOLE = """
name = "Pump \\"P-1\\" \\\\ München\\n\\u007f"
rotation = "cw"
gravity = "9.81 m/s^2"
mains = 60
[channels]
"Vib X" = "Ai0/Vib_X"
DE_A = "3"
[[probe]]
name = "Vib X"
end = "NDE"
position = "150 mm"
angle = "0 deg"
sensitivity = "-7.87 mV/um"
offset = "-10 V"
range = ["-900 um", "900 um"]
[speed]
channel = "n"
unit = "rpm"
sensitivity = 0.1
[keyphasor]
channel = "key"
edge = "falling"
angle = "33.3 deg"
[[effect]]
name = "ring_drag"
where = "NDE"
torque = 0.25
[[effect]]
name = "race_waviness"
where = "DE"
race = "outer"
order = 3
amplitude = "1.5 um"
"""


def whole():
    data = tomllib.loads(WHOLE)
    short = tomllib.loads(shipped("short/machine.toml").read_text())
    data["probe"] += short["probe"][1:]
    short["rotor"]["sections"][2]["inner_diameter"] = "20 mm"
    return parse_machine(short | data)


def read_back(machine, head=""):
    return parse_machine(tomllib.loads(machine_text(machine, head)))


def tolerances(machine):
    """Return every value with limits, by place."""
    found = {}

    def walk(part, place):
        for name in type(part).model_fields:
            value = getattr(part, name)
            if isinstance(value, Tolerant):
                found[f"{place}.{name}"] = value
                continue
            for k, each in enumerate(value if isinstance(value, tuple) else (value,)):
                if hasattr(each, "model_fields_set"):
                    walk(each, f"{place}.{name}{k}")

    walk(machine, "machine")
    return found


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_shipped_machines_come_back_as_they_were(file, tmp_path):
    machine = load_machine(file)
    write_machine(machine, tmp_path / "again.toml", "from the drawing")
    assert load_machine(tmp_path / "again.toml") == machine


def test_every_field_comes_back(tmp_path):
    machine = whole()
    assert (machine.probes[0].range, machine.mains, machine.channels["Vib X"]) == ((-9e-4, 9e-4), 60.0, "Ai0/Vib_X")
    write_machine(machine, tmp_path / "again.toml")
    assert load_machine(tmp_path / "again.toml") == machine


def test_values_are_written_as_people_write_them():
    text = machine_text(whole())
    for line in (
        'radial_gap = { nominal = "250 um", tolerance = "20 %" }',
        'elastic_modulus = "200 GPa"',
        '{ length = "120 mm", outer_diameter = "80 mm", inner_diameter = "20 mm" }',
        'amount = { nominal = "40 g mm", tolerance = "50 %" }, phase = { nominal = "0 deg", tolerance = "20 deg" }',
        'friction = { nominal = 0.12, tolerance = "40 %" }',
        'sensitivity = "-7.87 mV/um"',
        'inner_ring_drag = { nominal = "15 mN m", tolerance = "50 %" }',
        "order = 3",
    ):
        assert line in text


def test_defaults_that_the_owner_left_out_stay_out():
    text = machine_text(SHORT)
    assert all(word not in text for word in ("gravity", "mains", "inner_diameter", "offset", "edge", "channels"))


@settings(max_examples=60)
@given(data=st.data())
def test_moved_values_come_back_to_the_last_digit(data):
    machine = data.draw(st.sampled_from([each for each in MACHINES if machine_parameters(each)]))
    moved = calibrated_machine(
        machine, {p.name: data.draw(st.floats(p.low, p.high), label=p.name) for p in machine_parameters(machine)}
    )
    again = read_back(moved)
    before, after = tolerances(moved), tolerances(again)
    assert {place: value.nominal for place, value in after.items()} == {p: v.nominal for p, v in before.items()}
    for place, value in after.items():
        width, was = value.high - value.low, before[place].high - before[place].low
        if before[place].low >= 0 and not place.endswith("phase"):
            middle, was_middle = value.nominal, (before[place].high + before[place].low) / 2
            assert width * was_middle == pytest.approx(was * middle, rel=1e-9, abs=1e-30), place
            assert value.low >= 0
        else:
            assert width == pytest.approx(was, rel=1e-9), place
    assert read_back(again) == again  # limits alike on both sides are kept exactly


def test_a_nominal_value_next_to_nothing_takes_no_share_of_it():
    """A calibration may turn an unbalance by a hair; no per cent of that hair is a number."""
    turned = calibrated_machine(SHORT, {"impeller.along": 20e-6, "impeller.across": 1e-320})
    phase = turned.rotor.unbalance[1].phase
    assert 0 < phase.nominal < 1e-300
    assert read_back(turned).rotor.unbalance[1].phase == phase


def test_a_share_of_nought_is_refused():
    data = tomllib.loads(shipped("short/machine.toml").read_text())
    data["touchdown_bearing"][0]["balls"]["diametral_clearance"] = {"nominal": "0 um", "tolerance": "30 %"}
    with pytest.raises(InputError, match="of a nominal value of zero is zero: write its half-width with a unit"):
        parse_machine(data)


@settings(max_examples=200)
@given(
    nominal=st.floats(1e-5, 3e-3),
    percent=st.floats(1e-3, 99.9).map(lambda share: float(f"{share:.6g}")),
    absolute=st.booleans(),
)
def test_tolerances_keep_their_limits_exactly(nominal, percent, absolute):
    width = nominal * percent / 100 if absolute else f"{percent!r} %"
    data = tomllib.loads(shipped("short/machine.toml").read_text())
    for bearing in data["touchdown_bearing"]:
        bearing["radial_gap"] = bearing["balls"]["diametral_clearance"] = {"nominal": nominal, "tolerance": width}
    machine = parse_machine(data)
    assert machine.bearing("DE").radial_gap.nominal == nominal
    assert read_back(machine) == machine


@given(name=st.text(st.characters(exclude_categories=["Cs"])), head=st.text(st.characters(exclude_categories=["Cs"])))
def test_any_name_and_any_head_make_a_file(name, head):
    assume(name not in ("NDE_B", "DE_A", "DE_B"))
    probe = SHORT.probes[0].model_copy(update={"name": name})
    machine = SHORT.model_copy(
        update={"name": name, "probes": (probe, *SHORT.probes[1:]), "channels": {name: name, "DE_A": "A 1"}}
    )
    assert read_back(machine, head) == machine


def test_the_head_is_a_comment_at_the_top():
    assert machine_text(SHORT, "fitted to a.nc\nrotor = 3").startswith("# fitted to a.nc\n# rotor = 3\nname = ")


def test_a_machine_that_could_not_be_read_is_not_written(tmp_path):
    slick = SHORT.bearing("DE").model_copy(update={"friction": Tolerant(nominal=3.0, low=2.4, high=3.6)})
    machine = SHORT.model_copy(update={"touchdown_bearings": (SHORT.bearing("NDE"), slick)})
    with pytest.raises(InputError, match=r"m\.toml.*no friction coefficient"):
        write_machine(machine, tmp_path / "m.toml")
    assert not list(tmp_path.iterdir())


def test_a_setting_that_no_effect_takes_is_refused():
    setting = EffectSetting.model_validate({"name": "ring_drag", "where": "DE", "torque": [1, 2]})
    with pytest.raises(InputError, match=r"\[1, 2\]"):
        machine_text(SHORT.model_copy(update={"effects": (setting,)}))


@pytest.mark.parametrize("found", catalogue(), ids=lambda found: found.identifier)
def test_every_effect_comes_back_equal(found):
    """At its typical size, at its defaults (some infinite), at odd values, and with every word, at every place."""
    odd = {p.name: p.low + (p.high - p.low) / 7 for p in found.parameters if not p.choices and not p.whole}
    for where in places(found.place, SHORT):
        effects = [found.typical(where), found.kind(where), found.at(where, odd)]
        for each in found.parameters:
            effects += [found.at(where, {each.name: word}) for word in each.choices]
        for effect in effects:
            machine = with_effects(SHORT, [effect])
            assert all_effects(read_back(machine)) == (effect,)
            assert read_back(machine) == machine


def test_effects_join_those_of_the_machine():
    machine = load_machine(shipped("machines/motor_6016.toml"))
    more = [
        found.typical(places(found.place, machine)[0]) for found in catalogue() if found.identifier == "loose_support"
    ]
    both = with_effects(machine, more)
    assert all_effects(both) == (*all_effects(machine), *more)
    assert read_back(both) == both
    assert with_effects(machine, []) == machine


def test_effects_that_the_machine_cannot_carry_are_refused():
    kinds = {found.identifier: found for found in catalogue()}
    with pytest.raises(InputError, match="no bearing"):
        with_effects(SHORT, [kinds["ring_drag"].typical("XDE")])
    carries = with_effects(SHORT, [kinds["loose_support"].typical("DE")])
    with pytest.raises(InputError, match="given twice"):
        with_effects(carries, [kinds["loose_support"].typical("DE")])


def fit_of(machine, values):
    """Return a calibration with given values, without a fit."""
    nothing = Estimate.missing("s", "not fitted")
    return Calibration(
        machine=machine,
        calibrated=calibrated_machine(machine, values),
        values={"DE.radial_gap": Estimate.from_sigma(values["DE.radial_gap"], 1e-6, "um", "made up")},
        at_bound=("DE.radial_gap",),
        undetermined=(Undetermined("NDE.friction", 0.9, ()),),
        drops=(DropFit("drop_100.nc", 100.0, nothing, ()),),
        horizon=0.1,
        trusted=0.06,
        misfit=1.25,
        remarks=(),
        seconds=30.0,
        problem=None,
        point=None,
        covariance=None,
    )


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main([str(each) for each in arguments])
    out, err = capsys.readouterr()
    return stop.value.code, out, err


def test_analyse_writes_the_calibrated_machine(capsys, tmp_path, monkeypatch):
    """The fit stands in: its own tests are elsewhere; here its values must reach the file and be named there."""
    values = {
        "DE.radial_gap": 300e-6,
        "NDE.support_stiffness": 1.4147e8,
        "impeller.along": 17e-6,
        "impeller.across": 2e-6,
    }

    def fit(machine, record, progress, also, workers):
        return fitted.FittedDrop(fit_of(machine, values), DropForces("drop_100.nc", 0.1, 1, {}))

    monkeypatch.setattr(fitted, "fit_drop", fit)
    file, record = tmp_path / "calibrated.toml", shipped("short/drop_100.nc")
    code, out, _ = run(capsys, "analyse", shipped("short/machine.toml"), record, "--calibrated", file)
    assert code == 0
    assert f"machine: {file}" in out
    assert "at the limit of their range, so the true value may lie beyond: DE.radial_gap 300.0 um" in out
    written = load_machine(file)
    assert written.bearing("DE").radial_gap.nominal == 300e-6
    assert written.bearing("NDE").support_stiffness.nominal == 1.4147e8
    plane = written.rotor.unbalance[1]
    assert plane.amount.nominal == math.hypot(17e-6, 2e-6)
    assert plane.phase.nominal == pytest.approx(math.atan2(2, 17))
    head = [line for line in file.read_text().splitlines() if line.startswith("#")]
    for word in ("machine.toml", "drop_100.nc", "1.25 times the noise", "NDE.friction", "DE.radial_gap"):
        assert word in " ".join(head)


@pytest.mark.parametrize(
    ("name", "says"),
    [("m.json", "m.toml"), ("nowhere/m.toml", "does not exist"), ("machine.toml", "name another")],
)
def test_a_place_that_cannot_be_is_said_before_the_fit(capsys, tmp_path, name, says):
    mine = tmp_path / "machine.toml"
    mine.write_text(shipped("short/machine.toml").read_text())
    code, out, err = run(capsys, "analyse", mine, shipped("short/drop_100.nc"), "--calibrated", tmp_path / name)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert says in err
    assert mine.read_text() == shipped("short/machine.toml").read_text()
    assert [each.name for each in tmp_path.iterdir()] == ["machine.toml"]


def test_a_byte_order_mark_at_the_head_is_no_mistake(tmp_path):
    text = shipped("short/machine.toml").read_text(encoding="utf-8")
    (tmp_path / "machine.toml").write_text(text, encoding="utf-8-sig")
    assert load_machine(tmp_path / "machine.toml") == load_machine(shipped("short/machine.toml"))
