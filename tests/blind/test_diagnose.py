"""A fixed share of the blind cases through the command line; the rest by ``make blind``."""

import pytest

from tests.blind.outcome import diagnose_case


# the kick, outside the catalogue, comes 47 ms after the release, when the paths of most models have parted; the growth, of
# 12 nm/J, is so weak that the values of the plain model make up for it, which leaves noise alone
@pytest.mark.parametrize(
    ("seed", "effect"),
    [(2, None), (4, "channel_lag"), (1003240, "x_magnet_kick"), (910, "thermal_growth")],
    ids=["nothing", "lag", "kick", "weak"],
)
def test_a_blind_case_is_judged_right(tmp_path, seed, effect):
    outcome = diagnose_case(seed, tmp_path, kind=None if effect else "none", effect=effect, strangeness=0.0)
    assert not outcome.error
    assert outcome.judgement.right, (outcome.judgement.said, outcome.result["why"])
    assert outcome.judgement.place
