"""What has changed since earlier drops, on drops of the simulator itself (synthetic; no test of its physics)."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import pytest
from tdbsim.errors import InputError
from tdbsim.machine import load_machine

from tdbmon.arguments import one_by_one
from tdbmon.cli import main
from tdbmon.diagnosis import reference
from tdbmon.diagnosis.contender import Contender, with_cause
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.reference import _edges, _remarks, changes, compared, diagnose_since, smaller, standing
from tdbmon.diagnosis.reference_contract import reference_lines
from tdbmon.diagnosis.sizes import sizes_of
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.diagnosis.verdict import Kind, Verdict
from tdbmon.estimate import Estimate
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import fit
from tdbmon.identify.parameters import machine_parameters, restated_machine
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
    assert changes(machine, before, values(247.2e-6, 22.8e-6)) == ()  # gap and half the clearance: same sum
    assert {each.name for each in changes(machine, before, values(250e-6, 22.8e-6))} == {"NDE.diametral_clearance"}
    assert (
        changes(machine, before, values(250e-6, 20.5e-6)) == ()
    )  # a clearance alone must change by its whole tolerance
    assert {each.name for each in changes(machine, before, values(285e-6, 17e-6))} == {"NDE.radial_gap"}
    assert smaller(machine, before, values(285e-6, 17e-6)) == ()  # it is listed as a change
    assert smaller(machine, before, values(247.2e-6, 22.8e-6)) == ()
    least = next(p.scale for p in machine_parameters(machine) if p.name == "NDE.radial_gap")
    worn = values(250e-6 + 0.8 * least, 17e-6)  # far beyond its interval, but without a remark before
    assert changes(machine, before, worn) == ()
    (said,) = smaller(machine, before, worn)
    assert said.startswith("NDE.radial_gap differs too, 250.00 µm")
    assert f"below {least * 1e6:.2f} µm" in said


def test_a_friction_beyond_its_tolerance_is_said_to_be_at_its_edge(crew, before):
    beyond = fitted(crew, {**drops.TRUTH, "NDE.friction": 0.18}, (3, 4))
    assert changes(drops.machine(), before, beyond) == ()
    assert _edges(drops.machine(), before, before) == ""
    assert _edges(drops.machine(), before, beyond).startswith(
        "NDE.friction (later drops): the fit reached the limit"
    )


def diagnosed(machine, kind=Kind.NONE, ratio=1.0, **wanted):
    """A made-up diagnosis with values of the machine known to a tenth of their tolerances."""
    values = {p.name: Estimate.from_sigma(p.nominal, p.scale / 20, p.unit, "test") for p in machine_parameters(machine)}
    problem = SimpleNamespace(drops=(SimpleNamespace(name="a.nc"),))
    plain = SimpleNamespace(causes=(), ratio=ratio, times_noise=f"{ratio:g}", problem=problem)
    why = f"the misfit of the plain model is {ratio:g} times that of noise alone"
    verdict = Verdict(kind, (), (0.96,), why)
    return Diagnosis(machine, verdict, (plain,), None, {}, values, None, None, None, "another drop", (), 1.0, wanted)


SOFT = {"NDE.support_stiffness": 5e7}


def test_a_value_far_beyond_its_tolerance_has_changed_where_the_reference_fits_the_file(monkeypatch):
    machine, asked = load_machine(shipped("short/machine.toml")), []

    def diagnose_of(first):
        def diagnose(machine, *_):
            asked.append(machine)
            lost = diagnosed(machine, Kind.UNKNOWN, 61.0, **SOFT)
            return (first, lost, diagnosed(machine, ratio=1.02))[len(asked) - 1]

        return diagnose

    monkeypatch.setattr(reference, "diagnose", diagnose_of(diagnosed(machine)))
    since, told = diagnose_since(machine, [], [], lambda _: None)
    assert asked[2] == restated_machine(machine, SOFT)
    (change,) = told.changes
    assert (change.name, change.before.value) == ("NDE.support_stiffness", 1.31e8)
    assert change.since.value == 5e7 and change.since.low < 5e7 < change.since.high
    assert since.verdict.kind is Kind.UNKNOWN  # the change exceeds the tolerance, and no effect stands for it
    assert (
        "NDE.support_stiffness changed beyond what it allows; with that change the misfit of the plain model is 1.02"
        in since.verdict.why
    )
    assert "what has changed" in since.next_test
    said = "\n".join(reference_lines(told))
    assert "changed since: NDE.support_stiffness" in said
    assert not any(words in said for words in ("not compared", "no value", "wider"))

    # if the reference drops do not fit the file either, it may be wrong
    asked.clear()
    monkeypatch.setattr(reference, "diagnose", diagnose_of(diagnosed(machine, Kind.UNKNOWN, 40.0)))
    since, told = diagnose_since(machine, [], [], lambda _: None)
    assert (len(asked), told.changes, since.changed) == (2, (), None)
    assert (
        "40 times that of noise alone in the reference drops and 61 times that of noise alone in the later"
        in told.not_compared
    )


def test_what_is_named_beside_a_changed_value_stays_named():
    machine = load_machine(shipped("short/machine.toml"))
    since = reference.beside(SOFT, diagnosed(machine, Kind.NAMED))
    assert (since.verdict.kind, since.changed, since.next_test) == (Kind.NAMED, None, "another drop")
    assert since.verdict.why.endswith("with NDE.support_stiffness as changed since the reference drops")


def test_a_fit_that_does_not_follow_its_drops_tells_nothing_of_their_values():
    machine = load_machine(shipped("short/machine.toml"))
    before, lost = diagnosed(machine), diagnosed(machine, Kind.UNKNOWN, 61.0)
    edge = {p.name: replace(lost.values[p.name], value=p.high) for p in machine_parameters(machine)}
    told = compared(machine, before, replace(lost, values=edge), {})
    assert (told.changes, told.remarks) == ((), ())
    _, line = reference_lines(told)  # neither a list of values, nor the line that nothing has changed
    assert line.startswith(
        "  not compared: values of the machine: the misfit is 61 times that of noise alone in the later drops"
    )
    # a change that explains the first contacts stands, without an interval
    (change,) = compared(machine, before, lost, SOFT).changes
    assert (change.since.value, change.since.low) == (5e7, None)
    # a late cause does not affect the values
    late = diagnosed(machine, Kind.UNKNOWN, 1.1)
    assert compared(machine, before, late, {}).not_compared == ""


def test_a_changed_value_that_the_file_states_without_tolerance_is_told_from_what_it_states():
    machine = load_machine(shipped("short/machine.toml"))
    stiff = {"DE.contact_stiffness": 4e8}
    since = diagnosed(restated_machine(machine, stiff))
    (change,) = compared(machine, diagnosed(machine), since, stiff).changes
    assert (change.before.value, change.since.value) == (1.3e9, 4e8)
    assert change.before.low is None and change.since.low is None


def test_a_changed_value_that_a_later_fit_puts_within_its_tolerance_is_told_once():
    """The first contacts fit a value beyond the tolerance; the later fit with causes may return into it."""
    machine = load_machine(shipped("short/machine.toml"))
    before, since = diagnosed(machine), diagnosed(machine)
    gap = next(p for p in machine_parameters(machine) if p.name == "NDE.radial_gap")
    for far in (1.5, 0.8):
        found = Estimate.from_sigma(gap.nominal + far * gap.scale, gap.scale / 20, gap.unit, "test")
        moved = replace(since, values=since.values | {gap.name: found})
        told = compared(machine, before, moved, {gap.name: gap.high + gap.scale})
        assert [each.name for each in told.changes] == [gap.name]
        assert told.remarks == ()


def test_a_remark_says_what_of_a_known_cause_differs_from_drop_to_drop():
    free = [SimpleNamespace(name=name, of_each_drop=True, each_held=held) for name, held in (("a", ()), ("b", ({},)))]
    found = SimpleNamespace(problem=SimpleNamespace(free=free))
    found.words = "lobes and a ball"
    lobes, ball = _remarks(SimpleNamespace(verdict=Verdict(Kind.NAMED, (found,), (0.9,), "")))
    assert "at an angle that differs from drop to drop" in lobes
    assert "with a number that differs from drop to drop" in ball and "angle" not in ball


def test_a_remark_says_which_of_several_causes_counts_for_the_later_drops():
    oval, soft = (SimpleNamespace(words=words, problem=SimpleNamespace(free=[])) for words in ("oval", "soft support"))
    for or_nothing, rest in ((False, ""), (True, " or nothing at all")):
        verdict = Verdict(Kind.AMBIGUOUS, (oval, soft, soft), (0.5, 0.2, 0.2), "", or_nothing=or_nothing)
        (said,) = _remarks(SimpleNamespace(verdict=verdict))
        assert f"show oval, which the model of the later drops includes, or soft support{rest}:" in said


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
    rounded = record.map(lambda channel: channel.round(9), keep_attrs=True)  # as in another format
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
    assert re.search("no (other )?value of the machine has changed", said.out)
    assert "Changed since the reference drops" in page.read_text(encoding="utf-8")


def test_what_the_reference_drops_lack_is_told_too():
    """A dead probe in one of them was not reported."""
    machine = load_machine(shipped("short/machine.toml"))
    lacks = ("a.nc: calibrated without probe 'DE_A', which is dead", "one drop only: it cannot be held out")
    told = compared(machine, replace(diagnosed(machine), remarks=lacks), diagnosed(machine), {}).remarks
    assert told == (lacks[0], f"of the reference drops: {lacks[1]}")


def test_of_values_without_a_tolerance_none_is_said_to_have_stayed(tmp_path):
    """No value was fitted, but the output said "no value of the machine has changed"."""
    stated = re.sub(
        r'\{ nominal = ("?[^,]*?"?), tolerance = "[^"]*" \}', r"\1", shipped("short/machine.toml").read_text()
    )
    exact = tmp_path / "exact.toml"
    exact.write_text(stated)
    machine = load_machine(exact)
    said = "\n".join(reference_lines(compared(machine, diagnosed(machine), diagnosed(machine), {})))
    assert said.startswith("reference (1 drop): none")
    assert "not compared: values of the machine: its file states no tolerances" in said
    assert "has changed" not in said
