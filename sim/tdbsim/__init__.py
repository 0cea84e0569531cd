"""Dropdowns of a rotor in magnetic and touchdown bearings: the machine and its physics."""
