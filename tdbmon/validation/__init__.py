"""The program against published numbers: ``python -m tdbmon.validation`` writes docs/validation.md from runs."""
