"""A rotor with its magnetic and touchdown bearings, dropped: the machine and its physics."""
