"""Check of the drops against each other and of the machine file against them, before anything else is derived."""

from __future__ import annotations

from tdbmon.identify.exchanged_cables import exchanged_cables
from tdbmon.identify.first_fits import few_drops, first_fits
from tdbmon.identify.mistaken_entry import Mistaken, mistaken_entry
from tdbmon.identify.one_machine import mixed_drops
from tdbmon.identify.problem import Problem


def machine_doubt(problem: Problem) -> Mistaken | None:
    """Return the error of set-up (drops of two machines, exchanged probes, an entry); None where the drops show none."""
    mixed = mixed_drops(problem)
    if mixed is not None:
        return Mistaken(mixed, of_two_machines=True)
    plain = first_fits(few_drops(problem))
    exchanged = exchanged_cables(problem, plain)
    return Mistaken(exchanged) if exchanged is not None else mistaken_entry(problem, plain)
