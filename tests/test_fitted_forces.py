"""The page about fitted forces: that its shares are those of the outcomes, and that outcomes are kept."""

import json
import math
from dataclasses import asdict

from tests.fitted_forces import Found, SetOutcome, _load, page


def outcome(seed, error=""):
    """Peaks 2 and 8 % high, one interval of two holds the truth; friction 0.02 off, a phase 2 degrees across the half turn."""
    peaks = Found("100 NDE", 1000.0, 1020.0, 900.0, 1100.0), Found("100 DE", 1000.0, 1080.0, 1050.0, 1100.0)
    values = (
        Found("NDE.friction", 0.14, 0.16, 0.1, 0.2, least=0.007),
        Found("impeller.phase", math.radians(179), math.radians(-179), -4.0, 4.0),
        Found("NDE.contact_damping", 0.08, 0.04, 0.0, 0.1, loose=True),
    )
    parts = ((), (), (), math.nan) if error else (peaks, values, (1.4,), 0.06 if seed % 2 else 0.033)
    return SetOutcome(seed, float(seed % 2), 30.0, *parts, error=error)


def test_page_says_what_was_reached():
    text = page([outcome(2), outcome(4, "no way"), outcome(3)], "command")
    plain, strange = text.split("## Strange laws")
    assert "1 sets, 1 drops; 1 could not be fitted. Seeds 2, 4." in plain
    assert "| its half width: median, 95th percentile and greatest | | 6.1 %" in plain
    assert "| peak force within 5 % | all | 1/2 = 50 %" in plain
    assert "| interval of the peak force contains the true value | 90 to 99 % | 1/2 = 50 %" in plain
    assert "| peak force: mean of the errors | 0 | +5.0 % |" in plain
    assert "| friction within 0.01 | all | 0/1 = 0 %" in plain
    assert "| its phase within 5° | all | 1/1 = 100 %" in plain  # 2 degrees, not 358
    assert "| phase | 2.0°, 2.0° |" in plain
    assert "| contact damping | 50 %, 50 % | no case | 1 of 1 | 62 % |" in plain
    assert "| 36 % | 5 %, 5 % |" in plain  # of friction: what noise alone leaves stands beside its interval
    assert text.count("Fisher information") == 1
    assert "Fits ended at 33 ms (median; earliest 33 ms)" in plain
    assert "1 sets, 1 drops; 0 could not be fitted" in strange


def test_outcomes_are_kept(tmp_path):
    path = tmp_path / "set_0000002.json"
    path.write_text(json.dumps(asdict(outcome(2))))
    assert _load(path) == outcome(2)
