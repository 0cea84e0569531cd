"""Which drop or measurement would teach most after a verdict."""

from dataclasses import replace

from tdbmon.diagnosis.contender import plain_of
from tdbmon.diagnosis.next_test import next_test
from tdbmon.diagnosis.verdict import Kind, Verdict


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


def test_no_speed_above_the_fastest_is_asked_for(competed):
    plain = plain_of(competed)
    assert advice(plain, Kind.NAMED, (80.0, 150.0)).startswith("a drop from between 80 and 150 Hz")
    assert advice(plain, Kind.NAMED, (80.0,)).startswith("a drop from a speed below 80 Hz")


def test_what_the_checks_say_comes_before_another_drop(competed):
    plain = plain_of(competed)
    assert advice(plain, Kind.UNKNOWN, (80.0, 150.0)).startswith("two drops from the same speed")
    first, *others = plain.problem.drops
    inverted = replace(first, name="drop_80.nc", faults=("drop_80.nc: NDE: falls upwards",))
    wrong = replace(plain, problem=replace(plain.problem, drops=(inverted, *others)))
    assert "checks of drop_80.nc say" in next_test(Verdict(Kind.UNKNOWN, (), (), ""), (wrong,))
