"""Tests; those of a folder bear its name."""

import os

# small matrices on few cores: threads of the linear algebra only get in each other's way, and round otherwise
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
