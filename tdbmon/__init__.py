"""tdbmon."""
