"""Benchmarks: ratios to a reference measured in the same run."""

import os

# small matrices on few cores: BLAS threads only slow each other down, and change the rounding
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
