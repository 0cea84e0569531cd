"""tdbsim."""
