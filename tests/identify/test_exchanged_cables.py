"""Probes connected as others, in drops of a rig program that shares no code with the simulator (synthetic)."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest
from tdbsim.machine import load_machine
from tdbsim.stated_effects import parse
from typer.testing import CliRunner

from tdbmon.cli import app
from tdbmon.identify.crew import Crew
from tdbmon.identify.exchanged_cables import exchanged_cables
from tdbmon.identify.first_fits import few_drops, first_fits, of_which
from tdbmon.identify.measured_drops import measured_drops
from tdbmon.identify.problem import build_problem
from tdbmon.machine_file import with_effects
from tdbmon.record.read import read
from tdbmon.shipped import shipped


def other_way_round(text):
    """A machine file whose channels of the one end are those of the other."""
    names = {"NDE_A": "DE_A", "NDE_B": "DE_B", "DE_A": "NDE_A", "DE_B": "NDE_B"}
    return text + "\n[channels]\n" + "".join(f'{name} = "{channel}"\n' for name, channel in names.items())


@pytest.fixture(scope="module")
def cabled(tmp_path_factory):
    """(machine as it is, machine with the cables exchanged, two records) with nothing hidden."""
    folder = shipped("short")
    path = tmp_path_factory.mktemp("cables") / "machine.toml"
    path.write_text(other_way_round((folder / "machine.toml").read_text()))
    return load_machine(folder / "machine.toml"), load_machine(path), sorted(folder.glob("drop_*.nc"))[:2]


def said(machine, records):
    drops = measured_drops([read(path) for path in records], machine)
    with Crew() as crew:
        return told_by(build_problem(machine, drops, crew)), drops


def told_by(problem):
    return exchanged_cables(problem, first_fits(few_drops(problem)))


def test_exchanged_cables_are_told_and_right_ones_are_not(cabled):
    right, exchanged, records = cabled
    told, _ = said(exchanged, records)
    assert told is not None
    assert "probes of NDE taken for those of DE" in told
    assert said(right, records)[0] is None


@pytest.mark.parametrize(
    ("one", "other", "question"),
    [("NDE_A", "NDE_B", "or their angles in the machine file?"), ("NDE_B", "DE_B", "exchanged between the ends?")],
)
def test_two_probes_exchanged_are_told(cabled, one, other, question):
    """The catalogue was searched for five minutes, and something in no catalogue said to act."""
    right, _, records = cabled
    channels = dict(zip((one, other), (other, one), strict=True))
    told, drops = said(right.model_copy(update={"channels": channels}), records)
    assert told is not None
    assert f"with the readings of {one} and {other} exchanged" in told and told.endswith(question)
    assert all("exchanged" in " ".join(each.faults) or "swapped" in " ".join(each.faults) for each in drops)


def test_of_more_drops_it_is_said_which_two_the_misfit_is_of():
    """The report had 13.7 times the noise beside the 12 times that all four drops leave."""
    two = SimpleNamespace(drops=[SimpleNamespace(name=name) for name in ("a.nc", "b.nc")])
    assert of_which(two) == ""
    assert of_which(SimpleNamespace(drops=[*two.drops, *two.drops])) == " of a.nc and b.nc"


def test_an_end_that_lacks_a_probe_tells_nothing(cabled):
    _, exchanged, records = cabled
    _, drops = said(exchanged, records[:1])
    lame = replace(drops[0], probes=drops[0].probes[1:], reading=drops[0].reading[1:], noise=drops[0].noise[1:])
    with Crew() as crew:
        assert told_by(build_problem(exchanged, (lame,), crew)) is None


def test_what_the_machine_file_knows_to_act_acts_in_both_fits(cabled, monkeypatch):
    from tdbmon.identify import exchanged_cables as module

    _, exchanged, records = cabled
    drops = measured_drops([read(path) for path in records[:1]], exchanged)
    known = with_effects(exchanged, [parse("oval_clearance:end=DE,amplitude=20 um")])
    fitted = []
    one_of_them = module.first_fits
    monkeypatch.setattr(module, "first_fits", lambda problem: fitted.append(problem) or one_of_them(problem))
    with Crew() as crew:
        told_by(build_problem(known, drops, crew))
    (put_back,) = fitted
    assert [each.identifier() for each in put_back.standing] == ["oval_clearance"]


def test_diagnosis_names_no_cause_and_says_what_to_put_right(tmp_path):
    folder = shipped("loose")
    machine = tmp_path / "machine.toml"
    machine.write_text(other_way_round((folder / "machine.toml").read_text()))
    files = [str(path) for path in sorted(folder.glob("drop_*.nc"))]
    out = tmp_path / "r.json"
    run = CliRunner().invoke(app, ["diagnose", str(machine), *files, "--json", str(out)], catch_exceptions=False)
    assert run.exit_code == 0
    content = json.loads(out.read_text())
    assert content["verdict"] == "unknown"
    assert content["causes"] == []
    assert "cables of both ends exchanged" in content["why"]
    assert "put that right" in content["next_test"]
