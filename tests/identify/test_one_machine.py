"""Drops of two machines in one call are told before any cause is sought, by what they name and by what they show (synthetic)."""

import re

import numpy as np
import pytest
from tdbsim.errors import InputError

from tdbmon.diagnosis.diagnose import diagnose
from tdbmon.diagnosis.reference import diagnose_since
from tdbmon.diagnosis.verdict import Kind
from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.crew import Crew
from tdbmon.identify.measured_drops import measured_drops
from tdbmon.identify.one_machine import _far_more, mixed_drops
from tdbmon.identify.problem import build_problem
from tdbmon.progress import silent
from tests.identify.drops import TRUTH, drop, machine

OWN, OTHER = "of this machine", "of one whose probes have other angles"
SOFTER = "of this machine with half the support stiffness at DE"
SHORT_S = 0.026


def records(*kinds):
    made = []
    for k, kind in enumerate(kinds):
        stiffness = TRUTH["DE.support_stiffness"] * (0.5 if kind is SOFTER else 1.0)
        values = {**TRUTH, "DE.support_stiffness": stiffness}
        record = drop(values, speed=70.0 + 30 * k, seed=k, seconds=SHORT_S)
        for end in machine().ends if kind is OTHER else ():  # turned by 45 deg
            a, b = record[f"{end}_A"], record[f"{end}_B"]
            turned = {a.name: (a + b) / np.sqrt(2), b.name: (b - a) / np.sqrt(2)}
            record = record.assign({name: each.assign_attrs(record[name].attrs) for name, each in turned.items()})
        made.append(record)
    return made


def told(*kinds):
    with Crew() as crew:
        return mixed_drops(build_problem(machine(), measured_drops(records(*kinds), machine()), crew))


def test_a_drop_of_another_machine_is_told_before_causes_are_sought():
    """Two drops each of two machines got no verdict in 643 s."""
    found = diagnose(machine(), records(OTHER, OWN, OWN))
    assert found.verdict.kind is Kind.UNKNOWN
    assert not any(each.causes for each in found.contenders)
    said = re.match(
        r"drop_70.nc does not match drop_100.nc, drop_130.nc: each fitted alone, the misfit of the plain model is (\S+) times"
        r" that of noise alone in the first 6 ms of the former, and at most (\S+) times in the latter",
        found.mistaken,
    )
    more, less = map(float, said.groups())
    assert more > 10
    assert less < 1.1
    assert "diagnose both sets of drops separately" in found.next_test


def test_forces_of_drops_of_two_machines_are_withheld():
    """They were told, of a fit that left 448 times the noise, with the advice to diagnose the drops."""
    found = fit_drops(machine(), records(OTHER, OWN), horizons=(0.006, 0.01))
    assert any("drop_70.nc does not match drop_100.nc" in remark for remark in found.remarks)
    assert all("see the fit's remarks" in found.no_forces(drop) for drop in range(2))


def test_drops_of_one_machine_go_together_and_so_do_those_of_a_machine_that_is_none_of_the_file():
    """The latter is a matter of the file."""
    assert told(OWN, OWN) is None
    assert told(OTHER, OTHER) is None
    assert told(SOFTER, SOFTER) is None
    assert told(OWN) is None


def test_drops_before_and_after_a_change_are_told_where_both_ends_have_touched():
    """Two drops each of two states of a rig's machine had no verdict after 15 minutes."""
    said = told(OWN, SOFTER, OWN, SOFTER)
    assert said.startswith("drop_100.nc, drop_160.nc do not match drop_70.nc, drop_130.nc")
    assert "in the first 14 ms" in said


@pytest.mark.parametrize(
    ("left", "odd"),
    [
        ((0.9, 8.9, 0.8), []),
        ((0.9, 9.1, 0.8), [1]),
        ((95.0, 0.9, 3.4, 120.0), [0, 3]),  # a cause in the others
        ((9.3, 9.9, 10.1), []),
        ((0.5, 6.0), []),  # less than noise leaves is no measure
        ((float("inf"), 0.9), [0]),
    ],
)
def test_far_more_is_ten_times_what_the_others_leave(left, odd):
    assert _far_more(left) == odd


def test_drops_that_name_two_machines_are_refused_with_those_that_may_stay():
    """One of four that named another machine made the verdict unknown, and its 29 um those of all."""
    three = records(OWN, OWN, OWN)
    for k, name in enumerate(("Blower 7", machine().name, "Blower 8")):
        three[k].attrs["machine"] = name
    with pytest.raises(
        InputError, match=r"drop_70.nc: the record names machine 'Blower 7'.*; so is drop_130.nc; leave them out"
    ) as one:
        measured_drops(three, machine())
    assert str(one.value).endswith("to use the other record")
    three[1].attrs["machine"] = "Blower 7"  # all of them: the file's name may be wrong
    assert all(each.foreign for each in measured_drops(three, machine()))


def test_reference_drops_that_name_another_machine_are_refused():
    """They were diagnosed first, and nothing was compared."""
    earlier, later = records(OWN, OWN)
    earlier.attrs["machine"] = "Blower 7"
    with pytest.raises(InputError, match="drop_70.nc: the record names machine 'Blower 7'"):
        diagnose_since(machine(), [earlier], [later], silent)
