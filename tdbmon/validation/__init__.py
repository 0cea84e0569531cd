"""Validation against published numbers: ``python -m tdbmon.validation`` runs the cases and writes docs/validation.md."""
