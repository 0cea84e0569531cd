"""A machine model fitted to records of drops, and the unmeasured quantities that follow from it."""
