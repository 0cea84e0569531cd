"""The sections of reports, one file each: `section(...)` returns the section, or None if there is nothing to report."""
