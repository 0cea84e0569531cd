"""Losses when a drop is analysed again: what its new current result lacks against the previous one."""

from __future__ import annotations

from tdbmon.history.catalogue import speed_of
from tdbmon.history.feature import KINDS
from tdbmon.history.filing import Filing
from tdbmon.quantity import counted, first_few

_NAMED = 4  # quantities named in a remark
_MISSING = "present "  # prefix of the check on a missing channel


def losses(before: Filing, after: Filing) -> tuple[str, ...]:
    """Return in words what a drop's later result lacks against the earlier one: speed, channels, checks, quantities."""
    found = []
    speed = speed_of(before.features)
    if speed is not None and speed_of(after.features) is None:
        found.append(f"the speed at the release ({speed:.4g} Hz before)")
    failed = [each for each in after.failed_checks if each not in before.failed_checks]
    channels = [each.removeprefix(_MISSING) for each in failed if each.startswith(_MISSING)]
    others = [each for each in failed if not each.startswith(_MISSING)]
    if channels:
        found.append(f"{counted(len(channels), 'channel')} ({', '.join(channels)})")
    if others:
        found.append(f"{counted(len(others), 'check')} passed before ({', '.join(others)})")
    known = {f.key for f in after.features if f.estimate.known}
    gone = [f for f in before.features if f.estimate.known and f.key not in known and f.name != "initial_hz"]
    if gone:
        titles = [KINDS[f.name].title_at(f.end) if f.name in KINDS else f"{f.name} {f.end}" for f in gone]
        found.append(f"{counted(len(gone), 'value')} ({first_few(titles, _NAMED, '; ')})")
    return tuple(found)
