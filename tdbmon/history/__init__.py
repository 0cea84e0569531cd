"""Drops over years: the archive of a machine's drops, what has changed since, and many machines side by side.

record ── filing ── archive (raw file, result file, catalogue) ── matching ── difference, trend ── verdict ── report
"""
