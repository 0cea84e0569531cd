"""What the machine file has wrong, if the drops tell it: before anything else is made of them."""

from __future__ import annotations

from tdbmon.identify.exchanged_cables import exchanged_cables
from tdbmon.identify.first_fits import few_drops, first_fits
from tdbmon.identify.mistaken_entry import Mistaken, mistaken_entry
from tdbmon.identify.problem import Problem


def machine_doubt(problem: Problem) -> Mistaken | None:
    """Say what the file of a plain machine has wrong: probes exchanged, or an entry; None where the drops tell of nothing."""
    plain = first_fits(few_drops(problem))
    exchanged = exchanged_cables(problem, plain)
    return Mistaken(exchanged) if exchanged is not None else mistaken_entry(problem, plain)
