"""Start the studio: the port, the token, the browser."""

from __future__ import annotations

import gc
import secrets
import socket
import sys
from collections.abc import Callable
from pathlib import Path

from ..config import file_of
from ..errors import SysidError
from .security import checked, is_local

PORT = 8765
SWITCH = 5e-4  # s


def serve(path: Path, *, out: Path | None = None, host: str = "127.0.0.1", port: int = PORT, token: str | None = None, ready: Callable[[str], None] | None = None) -> None:
    """Serve the page of an experiment, and of those beside it, until interrupted.

    Args:
        port: 0 takes a free one. token: needed by whoever asks; made up where the host is not this machine's own.
        ready: called with the page's address, once it can be opened.

    Raises:
        SysidError: the extra is not installed, or the address is taken.
    """
    try:
        import starlette  # noqa: F401
        import uvicorn
    except ImportError as error:
        raise SysidError(f"the studio needs {error.name}, which is not installed", do="pip install 'sysid[studio]'") from None
    from .app import application
    from .experiments import Experiments, beside

    if token is None and not is_local(host):
        token = secrets.token_urlsafe(24)
    if token is not None:
        checked(token)
    experiments = Experiments(beside(file_of(path)), out)
    session = experiments.session(0)
    session.history.text()  # a file that is not there is bad input; one that cannot be meant is said on the page
    found = _listening(host, port)
    responsive()
    with found:
        port = found.getsockname()[1]
        app = application(experiments, host=host, port=port, token=token)
        server = uvicorn.Server(uvicorn.Config(app, log_level="error", access_log=False, lifespan="off", server_header=False, timeout_graceful_shutdown=1))
        try:
            session.run()
        except SysidError:
            pass  # the page says it
        name = "127.0.0.1" if host in ("0.0.0.0", "::", "") else f"[{host}]" if ":" in host and not host.startswith("[") else host
        address = f"http://{name}:{port}/"
        if ready:
            ready(address + (f"?token={token}" if token else ""))
        try:
            server.run(sockets=[found])
        except KeyboardInterrupt:
            pass  # the way to stop it
        finally:
            experiments.cancel()


def responsive() -> None:
    """Let requests interrupt the work of this process sooner than Python does by itself (5 ms for each turn of a thread),
    and keep the collector of what nobody refers to any more, for which all waits, from what was imported to stay."""
    sys.setswitchinterval(SWITCH)
    gc.collect()
    gc.freeze()


def _listening(host: str, port: int) -> socket.socket:
    bare = host.strip("[]")
    family = socket.AF_INET6 if ":" in bare else socket.AF_INET
    found = socket.socket(family, socket.SOCK_STREAM)
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((bare, port))
        found.listen(64)
    except (OSError, OverflowError) as error:
        found.close()
        raise SysidError(f"port {port} of {host} cannot be used ({getattr(error, 'strerror', None) or error})", do="stop what listens there, or give another --port (0 takes a free one)") from None
    return found
