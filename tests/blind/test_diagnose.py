"""A fixed share of the blind cases through the command line; the rest by ``make blind``."""

import pytest

from tests.blind.outcome import diagnose_case


# the moved mark is outside the catalogue, with strange laws; the magnet's force that fades is that of a small spindle, whose
# paths part early.  Both take little time.  Drops with nothing hidden are those of test_reference, by a rig program that is
# not the simulator's either
@pytest.mark.parametrize("seed", [1353, 1214], ids=["moved_mark", "fading_magnet"])
def test_a_blind_case_is_judged_right(tmp_path, seed):
    outcome = diagnose_case(seed, tmp_path)
    assert not outcome.error
    assert outcome.judgement.right, (outcome.judgement.said, outcome.result["why"])
    assert outcome.judgement.place
