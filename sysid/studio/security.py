"""Who may ask what: only this page, from this machine unless told otherwise, and then only who holds the token.

A page in the browser can be made to send requests anywhere. So every request is checked:
- Host must name this server. A foreign name that resolves here (DNS rebinding) is refused.
- Origin and Sec-Fetch-Site, where the browser sends them, must be this page's own.
- What changes anything is a POST of JSON with a header that only this page knows, new at every start.
- Served on another address than this machine's own, everything needs the token.
"""

from __future__ import annotations

import hmac
import ipaddress
import re
import secrets
import socket
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from ..errors import SysidError

_LOCAL = ("127.0.0.1", "localhost", "[::1]")
_LARGEST = 65536  # bytes of a request
POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; connect-src 'self'; img-src data: blob:; worker-src blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "content-security-policy": POLICY, "x-content-type-options": "nosniff", "referrer-policy": "no-referrer", "x-frame-options": "DENY",
    "cross-origin-opener-policy": "same-origin", "cross-origin-resource-policy": "same-origin",
}  # fmt: skip


def is_local(host: str) -> bool:
    """Whether an address is this machine's own, reached by nobody else."""
    return host in ("localhost", "127.0.0.1", "::1", "[::1]")


def checked(token: str) -> str:
    """A token that an address and a cookie can carry. Raises SysidError."""
    if not re.fullmatch(r"[A-Za-z0-9_.~-]+", token):
        raise SysidError("this token cannot stand in an address", where="--token", allowed="letters, digits, - _ . ~, at least one", do="leave it out to have one made up")
    return token


class Guard:
    """Wraps the application (ASGI)."""

    def __init__(self, app, *, host: str, port: int, token: str | None = None, csrf: str | None = None):
        if token is None and not is_local(host):
            raise ValueError("an address that others reach needs a token")
        if token is not None:
            checked(token)
        self._app, self._token = app, token
        self.csrf = csrf or secrets.token_urlsafe(32)
        self.cookie = f"sysid_{port}"
        self._port, self._host = port, host
        names = list(_LOCAL) if is_local(host) or _any(host) else []
        if not _any(host):
            names.append(f"[{host}]" if ":" in host and not host.startswith("[") else host)
        self._hosts = {f"{name}:{port}".lower() for name in names}

    async def __call__(self, scope, receive, send):
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self._app(scope, receive, send)
            elif scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008})
            return
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        refusal = self._refusal(scope, headers)
        if refusal is not None:
            await _answer(send, *refusal)
            return
        if self._token is not None and not self._known(headers):
            offered = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])[0]
            if scope["path"] == "/" and scope["method"] == "GET" and _same(offered, self._token):
                # the token leaves the address bar; the cookie is for this page alone
                cookie = f"{self.cookie}={self._token}; HttpOnly; SameSite=Strict; Path=/"
                await _answer(send, 303, "", {"location": "/", "set-cookie": cookie})
                return
            await _answer(send, 401, "This studio needs its token: open the address that `sysid studio` printed.")
            return

        async def with_headers(message):
            if message["type"] == "http.response.start":
                there = {name for name, _ in message["headers"]}
                message["headers"] = [*message["headers"], *((k.encode(), v.encode()) for k, v in _HEADERS.items() if k.encode() not in there)]
            await send(message)

        await self._app(scope, receive, with_headers)

    def _refusal(self, scope, headers) -> tuple[int, str] | None:
        hosts = headers.get("host", [])
        if len(hosts) != 1 or not self._ours(hosts[0].lower()):
            return 403, "This host name is not the studio's."
        origins = headers.get("origin", [])
        if any(origin.lower() != f"http://{hosts[0].lower()}" for origin in origins):
            return 403, "Requests of other pages are refused."
        if any(site not in ("same-origin", "none") for site in headers.get("sec-fetch-site", [])):
            return 403, "Requests of other pages are refused."
        method = scope["method"]
        if method in ("GET", "HEAD"):
            return None
        if method != "POST":
            return 405, "Only GET and POST."
        if headers.get("content-type", [""])[0].partition(";")[0].strip().lower() != "application/json":
            return 415, "Only JSON."
        if not _same(headers.get("x-sysid-csrf", [""])[0], self.csrf):
            return 403, "This page is of an earlier start of the studio: reload it."
        length = headers.get("content-length", [""])[0]
        if not length.isdigit() or int(length) > _LARGEST:
            return 413, "Too long."
        return None

    def _ours(self, host: str) -> bool:
        if host in self._hosts:
            return True
        if not _any(self._host):
            return False
        # bound to every address: one of them written as a number, or this machine's own name. A name of someone else's is neither.
        name, _, port = host.rpartition(":")
        if port != str(self._port):
            return False
        try:
            ipaddress.ip_address(name.strip("[]"))
            return True
        except ValueError:
            return name in (socket.gethostname().lower(), socket.getfqdn().lower())

    def _known(self, headers) -> bool:
        bearer = headers.get("authorization", [""])[0]
        if bearer.startswith("Bearer ") and _same(bearer[7:], self._token):
            return True
        try:
            found = SimpleCookie("; ".join(headers.get("cookie", []))).get(self.cookie)
        except CookieError:
            return False
        return found is not None and _same(found.value, self._token)


def _any(host: str) -> bool:
    return host in ("0.0.0.0", "::", "[::]", "")


def _same(one: str, other: str) -> bool:
    return hmac.compare_digest(one.encode(), other.encode())


async def _answer(send, status: int, text: str, more: dict | None = None) -> None:
    body = text.encode()
    headers = {"content-type": "text/plain; charset=utf-8", "content-length": str(len(body)), "cache-control": "no-store", **_HEADERS, **(more or {})}
    await send({"type": "http.response.start", "status": status, "headers": [(k.encode(), v.encode()) for k, v in headers.items()]})
    await send({"type": "http.response.body", "body": body})
