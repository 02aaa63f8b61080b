"""Tests. One thread for small matrices, as the command line has it; said before anything loads NumPy."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
