"""Check of the machine file against the drops, before anything else is derived from them."""

from __future__ import annotations

from tdbmon.identify.exchanged_cables import exchanged_cables
from tdbmon.identify.first_fits import few_drops, first_fits
from tdbmon.identify.mistaken_entry import Mistaken, mistaken_entry
from tdbmon.identify.problem import Problem


def machine_doubt(problem: Problem) -> Mistaken | None:
    """Return the error of a plain machine's file (exchanged probes or an entry); None where the drops show none."""
    plain = first_fits(few_drops(problem))
    exchanged = exchanged_cables(problem, plain)
    return Mistaken(exchanged) if exchanged is not None else mistaken_entry(problem, plain)
