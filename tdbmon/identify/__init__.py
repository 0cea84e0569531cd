"""A machine model fitted to records of drops: what no sensor measured follows from it."""
