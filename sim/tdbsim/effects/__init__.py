"""The effects that a model may lack, one a file; see `tdbsim.effect` for their form."""
