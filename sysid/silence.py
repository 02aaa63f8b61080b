"""Native code writes to standard error on its own; there it is kept from the user, who is told in
one line."""

import os
from contextlib import contextmanager


@contextmanager
def silenced():
    """Keeps native code off standard error."""
    kept, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nothing)
