"""How many threads the linear algebra may use."""

from __future__ import annotations

import functools
import os

_OWN = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def single_threaded(work):
    """A function in which linear algebra keeps to one thread, unless the user's environment says how many.

    The matrices here are small: threads cost more than they give, five times the work on a machine with many cores.
    """

    @functools.wraps(work)
    def limited(*args, **how):
        if any(name in os.environ for name in _OWN):
            return work(*args, **how)
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, user_api="blas"):
            return work(*args, **how)

    return limited
