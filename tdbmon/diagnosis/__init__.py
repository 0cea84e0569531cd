"""What the model of a machine lacks: where it fails, the cause by name and place, the extended model, the gain."""
