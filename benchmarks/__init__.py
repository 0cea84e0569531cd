"""Benchmarks: ratios against a reference measured in the same run."""

import os

# small matrices on few cores: threads of the linear algebra only get in each other's way, and round otherwise
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
