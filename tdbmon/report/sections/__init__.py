"""The parts of a drop's report, one file each: `section(analysis)` returns it, or None where there is nothing to say."""
