"""Four drops with a hidden effect, by a rig program that shares no code with the simulator, through the command line."""

import json

import pytest
from tdbsim.machine import load_machine
from typer.testing import CliRunner

from tdbmon.cli import app, main
from tdbmon.shipped import shipped
from tests.json_page import documented


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder, out = shipped("loose"), tmp_path_factory.mktemp("diagnosis")
    files = [str(path) for path in sorted(folder.glob("drop_*.nc"))[:3]]  # the demo takes all four
    extended = out / "extended.toml"
    arguments = ["diagnose", str(folder / "machine.toml"), *files, "--json", str(out / "r.json")]
    run = CliRunner().invoke(app, [*arguments, "--extended", str(extended)], catch_exceptions=False)
    assert run.exit_code == 0
    return json.loads((out / "r.json").read_text()), extended, run.output


def test_hidden_effect_is_named_with_its_place_and_size(result):
    content, _, _ = result
    answer = json.loads(shipped("loose/answer.json").read_text())["hidden"]["loose_support"]
    assert set(content) == documented("diagnose")
    assert content["verdict"] == "named"
    (cause,) = content["causes"]
    assert (cause["effect"], cause["where"]) == ("loose_support", answer["where"])
    assert cause["probability"] > 0.9
    play = cause["parameters"]["play_um"]
    assert play["value"] == pytest.approx(answer["parameters"]["clearance_m"] * 1e6, rel=0.1)
    assert play["low"] < play["value"] < play["high"]


def test_gain_holds_on_the_drop_held_out(result):
    content, _, _ = result
    assert content["held_out"] == ["drop_100.nc"]
    assert content["gain"] > 0.8
    assert content["extended"]["held_out_rms_um"] < content["baseline"]["held_out_rms_um"]
    assert content["baseline"]["noise_um"] == pytest.approx(0.25, abs=0.02)


def test_extended_machine_is_one_that_other_commands_take(result):
    _, extended, _ = result
    (effect,) = load_machine(extended).effects
    assert (effect.name, effect.where) == ("loose_support", "NDE")


def test_the_terminal_says_what_the_json_says(result):
    _, _, text = result
    assert "verdict: named" in text
    assert "loose_support at NDE" in text
    assert "next test:" in text


def test_one_drop_says_what_is_lost():
    from tdbmon.diagnosis.diagnose import _remarks
    from tdbmon.identify.drop import measured_drop
    from tdbmon.record.read import read

    machine = load_machine(shipped("loose/machine.toml"))
    drop = measured_drop(read(shipped("loose/drop_100.nc")), machine)
    assert "none can be held out" in _remarks([drop])[0]
    assert "all drops are from one speed" in _remarks([drop, drop])[0]


def test_a_record_of_another_machine_is_no_case_for_the_catalogue():
    """All suspects were fitted for minutes, and the verdict named what left 154 times the noise."""
    from tdbmon.diagnosis.diagnose import _mistake
    from tdbmon.identify.drop import measured_drop
    from tdbmon.record.read import read

    record = read(shipped("loose/drop_100.nc"))
    own = load_machine(shipped("loose/machine.toml"))
    other = own.model_copy(update={"name": "Blower 7"})
    assert measured_drop(record, own).foreign == ""
    found = _mistake([measured_drop(record, other)], None)  # told before anything is simulated
    assert found.why.startswith("drop_100.nc: the record says that it is of") and "Blower 7" in found.why
    assert "put that right" in found.next_test


def test_same_drop_twice_is_an_error(capsys):
    drop = str(shipped("loose/drop_100.nc"))
    with pytest.raises(SystemExit) as stopped:
        main(["diagnose", str(shipped("loose/machine.toml")), drop, drop])
    assert stopped.value.code == 2
    assert "given twice" in capsys.readouterr().err


def test_same_drop_under_another_name_is_an_error(capsys, tmp_path):
    drop = shipped("loose/drop_100.nc")
    copy = tmp_path / "copy.nc"
    copy.write_bytes(drop.read_bytes())
    with pytest.raises(SystemExit):
        main(["diagnose", str(shipped("loose/machine.toml")), str(drop), str(copy)])
    assert "copy.nc is given twice, also as drop_100.nc" in capsys.readouterr().err


def test_wrong_machine_file_is_an_error_not_a_diagnosis(capsys, tmp_path):
    text = shipped("loose/machine.toml").read_text()
    wrong = tmp_path / "machine.toml"
    wrong.write_text(text.replace('nominal = "250 um"', 'nominal = "20 um"'))
    with pytest.raises(SystemExit) as stopped:
        main(["diagnose", str(wrong), *(str(p) for p in sorted(shipped("loose").glob("drop_*.nc")))])
    assert stopped.value.code == 2
    assert "drop_060.nc" in capsys.readouterr().err
