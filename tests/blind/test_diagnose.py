"""A fixed share of the blind cases through the command line; the rest by ``make blind``."""

import pytest

from tests.blind.outcome import diagnose_case


# the kick, outside the catalogue, comes 47 ms after the release, when the paths of most models have parted; the weak one is a
# growth by heat, 56 times the noise: of another, 17 times the noise (910), it hangs on the processor whether it is found
@pytest.mark.parametrize(
    ("seed", "kind", "effect"),
    [(1270, None, None), (1003240, None, "x_magnet_kick"), (1296, None, None)],
    ids=["nothing", "kick", "weak"],
)
def test_a_blind_case_is_judged_right(tmp_path, seed, kind, effect):
    outcome = diagnose_case(seed, tmp_path, kind=kind, effect=effect, strangeness=0.0)
    assert not outcome.error
    assert outcome.judgement.right, (outcome.judgement.said, outcome.result["why"])
    assert outcome.judgement.place
