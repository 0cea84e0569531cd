"""The effects that a model may lack, one per file; for their interface see `tdbsim.effect`."""
