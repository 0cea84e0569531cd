"""A fixed share of the blind cases through the command line; the rest by ``make blind``."""

import pytest

from tests.blind.outcome import diagnose_case


# the kick, outside the catalogue, comes when the paths of most models have parted; the weak one is a stiffness across the
# direction of motion of a quarter of its usual size.  Both take little time.  Drops with nothing hidden are those of
# test_reference, by a rig program that is not the simulator's either
@pytest.mark.parametrize("seed", [1333, 1218], ids=["kick", "weak"])
def test_a_blind_case_is_judged_right(tmp_path, seed):
    outcome = diagnose_case(seed, tmp_path)
    assert not outcome.error
    assert outcome.judgement.right, (outcome.judgement.said, outcome.result["why"])
    assert outcome.judgement.place
