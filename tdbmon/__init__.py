"""tdbmon: measurement analysis and condition monitoring of rotor dropdowns on touchdown bearings."""

from importlib.metadata import version as _version

__version__ = _version("tdbmon")
