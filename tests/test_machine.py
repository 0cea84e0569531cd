"""The machine file: what it means in SI, and every way to get it wrong, each with its cure."""

from __future__ import annotations

import math
import tomllib

import pytest
from tdbsim.errors import InputError
from tdbsim.machine import load_machine, parse_machine

from tdbmon.shipped import shipped

TEXT = shipped("coastdown/machine.toml").read_text()


def changed(old, new, count=1):
    assert old in TEXT
    return parse_machine(tomllib.loads(TEXT.replace(old, new, count)), "machine.toml")


def test_values_are_si_and_tolerances_are_limits(machine):
    bearing = machine.bearing("NDE")
    assert bearing.radial_gap.nominal == pytest.approx(250e-6)
    assert (bearing.radial_gap.low, bearing.radial_gap.high) == pytest.approx((200e-6, 300e-6))
    generator = machine.rotor.unbalance[0]
    assert generator.amount.nominal == pytest.approx(40e-6)
    assert generator.phase.high == pytest.approx(math.radians(20))  # an absolute tolerance
    assert machine.rotor.length == pytest.approx(1.24)
    assert machine.sense == 1


def test_a_number_is_already_si():
    assert changed('journal_radius = "35 mm"', "journal_radius = 0.035").bearing("NDE").journal_radius == 0.035


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("radial_gap", "radial_gp", "did you mean 'radial_gap'"),
        ("count = 11, diameter", "count = 11, diametr", "did you mean 'diameter'"),
        ("[speed]", "[sped]", "did you mean 'speed'"),
        ("[speed]", '[effect]\nname = "shaft_bow"\nwhere = "rotor"\n[speed]', "write [[effect]], in two brackets"),
        ('tolerance = "20 %"', 'tolerence = "20 %"', "did you mean 'tolerance'"),
        ('tolerance = "20 %"', "tolerance = 0.2", "has no unit, but the value has one"),
        ('density = "7850 kg/m^3"', 'density = "78500 kg/m^3"', "78500 kg/m^3 is not between"),
        ('nominal = "250 um"', 'nominal = "250 mm"', "check its unit"),
        ('nominal = "250 um"', 'nominal = "250 kg"', "'kg' is not a unit"),
        ('nominal = "250 um"', 'nominal = "0 um"', "tolerance '20 %' of a nominal value of zero is zero"),
        ('nominal = "250 um"', 'nominal = "-250 um"', "radial_gap -250 um (down to"),
        ('tolerance = "20 %"', 'tolerance = "-20 %"', "negative"),
        ('position = "1240 mm", mass', 'position = "1240 m", mass', "outside the shaft"),
        ("count = 11", "count = 2", "greater than or equal to 3"),
        ("count = 11", "count = 40", "do not fit"),
        (
            'outer_diameter = "60 mm" }',
            'outer_diameter = "60 mm", inner_diameter = "70 mm" }',
            "not smaller than outer",
        ),
        ('"45 deg"', '"135 deg"', "parallel to within 10 deg"),
        ('end = "DE"', 'end = "ED"', "no touchdown bearing"),
        ('name = "DE_A"', 'name = "DE_B"', "given twice"),
        ("nominal = 0.12", "nominal = 12", "friction 12 (up to"),
        ('"45 deg"', "45", 'more than a turn; if degrees are meant, write "45 deg"'),
        ('"45 deg"', '"45"', 'more than a turn; if degrees are meant, write "45 deg"'),
        ('elastic_modulus = "200 GPa"', 'elastic_modulus = "200 MPa"', "2e+08 Pa is not between"),
        ('rotation = "ccw"', 'rotation = "left"', "ccw"),
        (
            'outer_diameter = "60 mm"',
            "outer_diameter = 60",
            "section 1 of 60 m diameter and 0.08 m length is impossible for a shaft",
        ),
        ('length = "80 mm"', "length = 80", "A number without a unit is in m"),
        ('diameter = "12.303 mm"', 'diameter = "12,303 mm"', "has a decimal comma; write '12.303 mm'"),
        (
            'nominal = "250 um"',
            'nominal = "250 um ± 50 um"',
            "holds a tolerance; where a value may have one, write nominal",
        ),
        (
            'diametral_clearance = { nominal = "18 um"',
            'diametral_clearance = { nominal = "18 mm"',
            "18000 um is more than",
        ),
        ('nominal = "1.31e+08 N/m"', 'nominal = "1.31e+05 N/m"', "yields by 4e+03 um under half of the rotor's weight"),
        ("contact_stiffness = 1.3e9", "contact_stiffness = 1.3e3", "contact_stiffness 1300 N/m^(10/9) yields by"),
        ("stiffness = 1.06e10", "stiffness = 1.06e4", "balls: stiffness 10600 N/m^1.5 yields by"),
        (
            'polar_inertia = "0.08 kg m^2"',
            'polar_inertia = "0.12 kg m^2"',
            "disks 'impeller': polar_inertia 0.12 kg m^2 is more than twice the diametral_inertia 0.05 kg m^2",
        ),
        (
            'diametral_inertia = "0.05 kg m^2"',
            "diametral_inertia = 50000",
            "give its mass of 12 kg a radius of gyration of 64.5 m, more than the shaft's length (1.24 m)",
        ),
        (
            'nominal = "4e6 N/m", tolerance = "20 %"',
            "nominal = 0",
            "magnetic_bearing 'NDE': stiffness reaches down to 0 N/m",
        ),
        ('nominal = "4e3 N s/m"', 'nominal = "-4e3 N s/m"', "damping reaches down to -5200 N s/m"),
        ('nominal = "14 s"', 'nominal = "-14 s"', "speed_decay_time reaches down to"),
        ('nominal = "14 s"', 'nominal = "14 us"', "speed_decay_time 1.4e-05 s: drag in air stops no shaft in less than 1 ms"),
        ('rotation = "ccw"', 'rotation = "ccw"\ngravity = 981', "gravity 981 m/s^2 is impossible on earth"),
        ('rotation = "ccw"', 'rotation = "ccw"\ngravity = "0 m/s^2"', "an upright shaft does not fall"),
        ('rotation = "ccw"', 'rotation = "ccw"\ngravity = -9.81', "gravity -9.81 m/s^2: it already points down (-y)"),
        ('rotation = "ccw"', 'rotation = "ccw"\nmains = 0', "mains 0 Hz is no mains frequency"),
        ('journal_radius = "35 mm"', "journal_radius = 35", "journal_radius 35000 mm does not go into a bearing"),
        ('journal_radius = "35 mm"', 'journal_radius = "35 cm"', "journal_radius 350 mm does not go into a bearing"),
        ('pitch_diameter = "90 mm"', 'pitch_diameter = "900 mm"', "does not go into a bearing"),
        ('diameter = "12.303 mm"', 'diameter = "1.2303 mm"', "fill 0.048 of their pitch circle"),
        ('"0.00075 kg m^2"', '"0.75 kg m^2"', "give a radius of gyration of 1.29e+03 mm"),
        ('rotation = "ccw"', 'rotation = "ccw"\nmains = "0.5 kHz"', "mains 500 Hz is no mains frequency"),
        ('support_mass = "51.2 kg"', 'support_mass = "0 kg"', "greater than 0"),
        ("nominal = 0.12", 'nominal = "much"', "'much' is not a quantity; write a number, e.g. 1.5"),
        (
            '"45 deg"',
            '"45 deg"\nslow_roll = "9 um"',
            "write slow_roll = { peak_to_peak = ..., phase_lag = ... }, not '9 um'",
        ),
        ('"45 deg"', '"45 deg"\nsensitivity = 0', "[probe] 'NDE_A': sensitivity 0 V/m gives no displacement"),
    ],
)
def test_mistakes_are_said_with_their_cure(old, new, says):
    with pytest.raises(InputError, match="machine.toml") as error:
        changed(old, new)
    assert says in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(("end", "means"), [("both", "both ends"), ("Both", "both ends"), ("Rotor", "the whole rotor")])
def test_an_end_is_not_named_as_what_is_no_end(end, means):
    with pytest.raises(
        InputError, match=f"touchdown_bearing '{end}': .* this word means {means}; give the bearing another name"
    ):
        parse_machine(tomllib.loads(TEXT.replace('"NDE"', f'"{end}"')), "machine.toml")


def test_a_disk_and_an_unbalance_plane_of_one_name_are_in_one_place():
    data = tomllib.loads(TEXT)
    (disk,), plane = data["rotor"]["disks"], data["rotor"]["unbalance"][1]
    assert disk["name"] == plane["name"] == "impeller"
    disk["position"] = "1.24 m"
    parse_machine(data, "machine.toml")
    plane["position"] = "1230 mm"
    with pytest.raises(
        InputError, match="disk at 1240 mm and an unbalance plane at 1230 mm, .* rename one of them"
    ):
        parse_machine(data, "machine.toml")


def test_a_machine_with_one_touchdown_bearing_is_refused():
    data = tomllib.loads(TEXT)
    data["touchdown_bearing"] = data["touchdown_bearing"][:1]
    with pytest.raises(InputError, match="two, one at each end"):
        parse_machine(data)


def test_a_missing_value_is_named_with_its_place():
    data = tomllib.loads(TEXT)
    del data["touchdown_bearing"][1]["journal_radius"]
    with pytest.raises(InputError, match=r"\[touchdown_bearing\] 'DE': 'journal_radius' is missing"):
        parse_machine(data)


def test_all_that_is_missing_is_named_at_once_table_by_table():
    data = tomllib.loads(TEXT)
    del data["rotor"], data["touchdown_bearing"][0]["journal_radius"], data["touchdown_bearing"][0]["balls"]["count"]
    del data["touchdown_bearing"][0]["friction"], data["probe"][1]["angle"]
    with pytest.raises(InputError) as error:
        parse_machine(data, "machine.toml")
    said = str(error.value)
    assert said.startswith("machine.toml: 'rotor' (with sections, elastic_modulus, density) is missing; ")
    assert "[touchdown_bearing] 'NDE': 'journal_radius', 'friction' are missing" in said
    assert "[touchdown_bearing] 'NDE' [balls]: 'count' is missing" in said
    assert "[probe] 'NDE_B': 'angle' is missing" in said
    assert "docs/machine_file.md" in said and "template.toml" in said
    assert "more" not in said and "\n" not in said


def test_of_several_mistakes_each_is_named():
    for end in ("NDE", "DE"):
        assert f'name = "{end}"' in TEXT
    with pytest.raises(InputError) as error:
        parse_machine(tomllib.loads(TEXT.replace("diametral_clearance", "radial_clearance")), "machine.toml")
    said = str(error.value)
    assert "unknown key 'radial_clearance'; did you mean 'diametral_clearance'?" in said
    for end in ("NDE", "DE"):
        assert f"[touchdown_bearing] '{end}' [balls]: 'diametral_clearance' is missing" in said
    assert said.count("'radial_clearance'") == 2
    assert "\n" not in said


def test_a_table_that_is_wrong_as_a_whole_is_named_by_its_name():
    with pytest.raises(InputError) as error:
        parse_machine(
            tomllib.loads(TEXT.replace('angle = "45 deg"', 'angle = "45 deg"\nsensitivity = 0')), "machine.toml"
        )
    assert str(error.value).endswith("(also [probe] 'DE_A' is wrong)")


def test_channels_map_only_what_the_machine_has():
    data = tomllib.loads(TEXT) | {"channels": {"NDE_X": "Ai0"}}
    with pytest.raises(InputError, match="did you mean 'NDE_"):
        parse_machine(data)


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"a = = 1", "not valid TOML"), (b"\xff\xfe\x00\x01", "not a text file"), (None, "no such file")],
)
def test_files_that_cannot_be_read(tmp_path, content, says):
    path = tmp_path / "machine.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=says):
        load_machine(path)
    with pytest.raises(InputError, match="folder"):
        load_machine(tmp_path)


def test_a_record_as_text_in_the_place_of_a_machine_file(tmp_path):
    path = tmp_path / "drop.csv"
    path.write_text("time;NDE_A\n0,0;1,5\n")
    with pytest.raises(InputError, match="not valid TOML.*comes before the records"):
        load_machine(path)


@pytest.mark.parametrize(
    ("effect", "says"),
    [
        ('name = "shaft_bo"\nwhere = "rotor"', r"at 'rotor': 'shaft_bo' is no effect; did you mean 'shaft_bow'"),
        ('name = "shaft_bow"\nwhere = "rotr"', r"at 'rotr': shaft_bow: .* did you mean 'rotor'"),
        ('name = "shaft_bow"\nwhere = "rotor"\nbow = "9 m"', r"at 'rotor': shaft_bow: bow .* is out of bounds"),
    ],
)
def test_a_wrong_effect_names_the_file(effect, says):
    with pytest.raises(InputError, match=r"^machine\.toml: \[\[effect\]\] " + says):
        changed("[speed]", f"[[effect]]\n{effect}\n[speed]")


def test_a_decimal_comma_outside_of_texts_is_told(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(TEXT.replace("poisson_ratio = 0.3", "poisson_ratio = 0,3"))
    with pytest.raises(InputError, match="not valid TOML") as error:
        load_machine(path)
    assert "a number has a decimal point, not a comma" in str(error.value)
