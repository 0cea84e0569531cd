"""What has changed since earlier drops: drops of the simulator itself (synthetic), so no test of its physics."""

import json
from types import SimpleNamespace

import pytest
from tdbsim.errors import InputError
from tdbsim.machine import load_machine

from tdbmon.arguments import one_by_one
from tdbmon.cli import main
from tdbmon.diagnosis.contender import Contender, with_cause
from tdbmon.diagnosis.reference import _edges, changes, diagnose_since, smaller, standing
from tdbmon.diagnosis.sizes import sizes_of
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.diagnosis.verdict import Kind, Verdict
from tdbmon.estimate import Estimate
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import fit
from tdbmon.identify.parameters import machine_parameters
from tdbmon.identify.problem import build_problem
from tdbmon.shipped import shipped
from tests.diagnosis.simulated import problem_of
from tests.identify import drops

HORIZONS = (0.006, 0.01, 0.014, 0.018)


def fitted(crew, values, seeds):
    machine = drops.machine()
    records = [drops.drop(values, speed=60.0 + 40 * k, seed=seed, seconds=0.03) for k, seed in enumerate(seeds)]
    problem = build_problem(machine, tuple(measured_drop(each, machine) for each in records), crew)
    found = fit(problem, problem.start, HORIZONS[0])
    for horizon in HORIZONS[1:]:
        found = fit(problem, found.point, horizon)
    return sizes_of(Contender((), problem, found, HORIZONS[-1], 0.9)).machine


@pytest.fixture(scope="module")
def before(crew):
    return fitted(crew, drops.TRUTH, (1, 2))


def test_a_friction_that_rose_is_listed_with_both_values(crew, before):
    worn = {**drops.TRUTH, "NDE.friction": 0.165}
    found = {each.name: each for each in changes(drops.machine(), before, fitted(crew, worn, (3, 4)))}
    assert set(found) == {"NDE.friction"}
    change = found["NDE.friction"]
    assert change.before.value == pytest.approx(0.135, abs=0.01)
    assert change.since.value == pytest.approx(0.165, abs=0.01)


def test_other_drops_of_the_same_condition_show_no_change(crew, before):
    again = fitted(crew, drops.TRUTH, (3, 4))
    assert changes(drops.machine(), before, again) == ()
    assert smaller(drops.machine(), before, again) == ()


def test_a_gap_that_the_ball_clearance_makes_up_for_has_not_changed():
    machine = load_machine(shipped("short/machine.toml"))

    def values(gap, clearance):
        nominal = {
            p.name: Estimate.from_sigma(p.nominal, 1e-3 * p.scale, p.unit, "test") for p in machine_parameters(machine)
        }
        moved = {"NDE.radial_gap": gap, "NDE.diametral_clearance": clearance}
        return nominal | {name: Estimate.from_sigma(value, 1e-7, "um", "test") for name, value in moved.items()}

    before = values(250e-6, 17e-6)
    assert changes(machine, before, values(247.2e-6, 22.8e-6)) == ()  # the balls are met where they were
    assert {each.name for each in changes(machine, before, values(250e-6, 22.8e-6))} == {"NDE.diametral_clearance"}
    assert (
        changes(machine, before, values(250e-6, 20.5e-6)) == ()
    )  # a clearance by itself is known to its tolerance only
    assert {each.name for each in changes(machine, before, values(285e-6, 17e-6))} == {"NDE.radial_gap"}
    assert smaller(machine, before, values(285e-6, 17e-6)) == ()  # it is told as a change
    assert smaller(machine, before, values(247.2e-6, 22.8e-6)) == ()
    least = next(p.scale for p in machine_parameters(machine) if p.name == "NDE.radial_gap")
    worn = values(250e-6 + 0.8 * least, 17e-6)  # far beyond its interval, and no word of it
    assert changes(machine, before, worn) == ()
    (said,) = smaller(machine, before, worn)
    assert said.startswith("NDE.radial_gap differs too, 250.00 µm")
    assert f"below {least * 1e6:.2f} µm" in said


def test_a_friction_beyond_its_tolerance_is_said_to_be_at_its_edge(crew, before):
    beyond = fitted(crew, {**drops.TRUTH, "NDE.friction": 0.18}, (3, 4))
    assert changes(drops.machine(), before, beyond) == ()
    (remark,) = _edges(drops.machine(), before, beyond)
    assert remark.startswith("NDE.friction ran to the edge of its tolerance in the later drops")


def test_what_lies_otherwise_in_every_drop_does_not_stand_in_the_model_of_later_drops(crew):
    problem = problem_of(crew)
    bare = Contender((), problem, fit(problem, problem.start, HORIZONS[0], 1), HORIZONS[0], 0.9)
    machine = problem.model.machine
    everyone = suspects(machine, machine.probes, ())
    lobes = next(each for each in everyone if each.name == "ring_out_of_round@DE")
    oval = next(each for each in everyone if each.name == "oval_clearance@NDE")
    phases = ({"phase": 0.7}, {"phase": -1.7})
    found = with_cause(bare, lobes, Start({"amplitude": 2e-5}, phases))
    found = with_cause(found, oval, Start({"amplitude": 2e-5, "angle": 0.3}))
    before = SimpleNamespace(verdict=Verdict(Kind.NAMED, (found,), (0.94,), "as made"))
    (stays,) = standing(before)
    assert (stays.identifier(), stays.where) == ("oval_clearance", "NDE")
    assert standing(SimpleNamespace(verdict=Verdict(Kind.NONE, (), (), "nothing"))) == []


def test_a_record_on_both_sides_is_refused():
    record = drops.drop(seconds=0.03)
    with pytest.raises(InputError, match=r"drop_97\.nc is given as reference and as record"):
        diagnose_since(drops.machine(), [record], [record], lambda _: None)
    rounded = record.map(lambda channel: channel.round(9), keep_attrs=True)  # as another format has it
    with pytest.raises(InputError, match=r"drop_97\.nc is given as reference and as record"):
        diagnose_since(drops.machine(), [record], [rounded], lambda _: None)


def test_files_after_reference_belong_to_it():
    words = ["diagnose", "m.toml", "a.nc", "--reference", "b.nc", "c.nc", "--json", "r.json"]
    split = one_by_one(words)
    assert split == ["diagnose", "m.toml", "a.nc", "--reference", "b.nc", "--reference", "c.nc", "--json", "r.json"]
    assert one_by_one(["diagnose", "m.toml", "a.nc", "--reference"])[-1] == "--reference"
    assert one_by_one(["diagnose", "--reference", "--json", "r.json"]) == [
        "diagnose",
        "--reference",
        "--json",
        "r.json",
    ]


def test_the_command_says_that_nothing_changed(tmp_path, capsys):
    # drops of one machine in one condition, by a rig program that shares no code with the simulator
    _, second, third, fourth = (str(path) for path in sorted(shipped("short").glob("drop_*.nc")))
    out, page = tmp_path / "r.json", tmp_path / "r.html"
    words = ["diagnose", str(shipped("short/machine.toml")), third, "--reference", second, fourth]
    with pytest.raises(SystemExit) as stopped:
        main([*words, "--json", str(out), "--report", str(page)])
    said = capsys.readouterr()
    assert stopped.value.code == 0, said.err
    content = json.loads(out.read_text())
    assert content["verdict"] == "none"
    assert content["reference"]["verdict"] == "none"
    assert content["reference"]["changed"] == []
    assert len(content["reference"]["drops"]) == 2
    assert "no value of the machine has changed" in said.out
    assert "Changed since the reference drops" in page.read_text(encoding="utf-8")
