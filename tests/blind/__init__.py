"""The blind generator: synthetic drops that share no code with `tdbsim`, and how `tdbmon diagnose` does on them."""
