"""Which drop or measurement would teach most after a verdict."""

from dataclasses import replace

from tdbsim.machine import load_machine

from tdbmon.diagnosis.contender import plain_of
from tdbmon.diagnosis.next_test import next_test
from tdbmon.diagnosis.stated_exactly import exact_remarks, stated_exactly
from tdbmon.diagnosis.verdict import Kind, Verdict
from tdbmon.shipped import shipped


def advice(plain, kind, speeds):
    drops = tuple(
        replace(drop, omega=2 * 3.141592653589793 * speed)
        for drop, speed in zip(plain.problem.drops, speeds, strict=False)
    )
    return next_test(Verdict(kind, (), (), ""), (replace(plain, problem=replace(plain.problem, drops=drops)),))


def test_nothing_more_is_needed_only_after_drops_from_several_speeds(competed):
    plain = plain_of(competed)
    assert advice(plain, Kind.NONE, (80.0, 150.0)).startswith("none needed")
    for speeds in ((80.0,), (80.0, 82.0)):
        assert advice(plain, Kind.NONE, speeds).startswith("drops from two speeds below 8")


def test_a_rest_of_the_record_that_was_not_looked_at_is_asked_for(competed):
    """The next test was "none needed", beside a remark that late causes are not excluded."""
    nothing = Verdict(Kind.NONE, (), (), "")
    assert next_test(nothing, tuple(competed)).startswith("none needed")
    drops = competed[0].problem.drops
    asked = next_test(nothing, tuple(competed), unseen=drops)
    assert asked.startswith("the same drops with a keyphasor, recorded for half a second")


def test_the_other_drops_are_not_asked_for_again_where_one_record_ends_early(competed):
    """Three drops with a keyphasor, half a second long, were to be done again with both for a fourth of 30 ms."""
    nothing, last = Verdict(Kind.NONE, (), (), ""), competed[0].problem.drops[-1]
    asked = next_test(nothing, tuple(competed), unseen=[last])
    assert asked.startswith(
        f"none yet: diagnose the drops without {last.name}; or drop from 150 Hz again with a keyphasor"
    )


def test_no_speed_above_the_fastest_is_asked_for(competed):
    plain = plain_of(competed)
    assert "from between 80 and 150 Hz" in advice(plain, Kind.NAMED, (80.0, 150.0))
    assert "from a speed below 80 Hz" in advice(plain, Kind.NAMED, (80.0,))


def test_what_is_named_is_looked_at_on_the_machine_before_another_drop(competed):
    cause = next(each for each in competed if each.causes)
    said = next_test(Verdict(Kind.NAMED, (cause,), (), ""), competed)
    where, how = cause.causes[0].where, cause.causes[0].declared.on_the_machine
    assert where in said and how[1:-1] in said
    assert said.index(how[1:-1]) < said.index("a drop after that")


def test_what_the_machine_file_states_exactly_comes_before_another_drop(competed):
    """A file without tolerances ended as unknown, with further drops as the next test."""
    plain = plain_of(competed)
    machine = load_machine(shipped("short/machine.toml"))
    assert stated_exactly(machine) == [] == [*exact_remarks(machine)]
    soft, *others = machine.touchdown_bearings
    gap = soft.radial_gap.model_copy(update={"low": soft.radial_gap.nominal, "high": soft.radial_gap.nominal})
    rotor = machine.rotor.model_copy(update={"unbalance": ()})
    bearings = (soft.model_copy(update={"radial_gap": gap}), *others)
    exact = machine.model_copy(update={"touchdown_bearings": bearings, "rotor": rotor})
    (said,) = exact_remarks(exact)
    assert "states no tolerance for radial gap of NDE; unbalance (no plane is stated): the fit cannot correct" in said
    model = replace(plain.problem.model, machine=exact)
    advised = next_test(
        Verdict(Kind.UNKNOWN, (), (), ""), (replace(plain, problem=replace(plain.problem, model=model)),)
    )
    assert advised.startswith(
        "state in the machine file a tolerance for radial gap of NDE; unbalance (no plane is stated), and"
    )
    assert "if it stays, two drops" in advised


def test_a_cause_that_may_be_nothing_is_looked_at_on_the_machine_too(competed):
    """The next test for a gain, the only cause, was to separate it from crosstalk of the other probe."""
    cause = next(each for each in competed if each.causes)
    named, open_ = (Verdict(kind, (cause,), (), "", or_nothing=True) for kind in (Kind.NAMED, Kind.AMBIGUOUS))
    assert next_test(open_, competed) == next_test(named, competed)


def test_what_the_checks_say_comes_before_another_drop(competed):
    plain = plain_of(competed)
    assert advice(plain, Kind.UNKNOWN, (80.0, 150.0)).startswith("two drops from the same speed")
    first, *others = plain.problem.drops
    inverted = replace(first, name="drop_80.nc", faults=("drop_80.nc: NDE: falls upwards",))
    wrong = replace(plain, problem=replace(plain.problem, drops=(inverted, *others)))
    assert "correct what the checks of drop_80.nc report" in next_test(Verdict(Kind.UNKNOWN, (), (), ""), (wrong,))
