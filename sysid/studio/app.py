"""The requests that the page makes. Reading never changes anything; what changes something says which text it saw."""

from __future__ import annotations

import asyncio
import json
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from ..errors import SysidError
from . import designs, page
from .diagnosed import dumped
from .experiments import Absent, Experiments
from .history import Changed
from .security import Guard
from .session import Session

_CHANGED = 409


def application(experiments: Experiments | Session, *, host: str = "127.0.0.1", port: int = 8765, token: str | None = None, csrf: str | None = None) -> Guard:
    """The ASGI application on several experiments, behind its guard: the first at `/`, each at `/NUMBER/`."""
    experiments = experiments if isinstance(experiments, Experiments) else Experiments.of(experiments)
    app = Starlette()
    guard = Guard(app, host=host, port=port, token=token, csrf=csrf)

    def at(request: Request) -> Session:
        return experiments.session(request.path_params.get("number", 0))

    def routed(path: str, endpoint, method: str) -> None:
        for place in (path, "/{number:int}" + path):
            app.router.routes.append(Route(place, endpoint, methods=[method]))

    def reading(path: str, answer) -> None:
        def endpoint(request: Request) -> Response:  # in a thread of its own: nothing waits for it
            return _said(lambda: answer(request))

        routed(path, endpoint, "GET")

    async def state(request: Request) -> Response:
        session = experiments.opened(request.path_params.get("number", 0))
        glanced = session and session.glance(lambda look: asyncio.get_running_loop().run_in_executor(None, look))
        return _json(glanced) if glanced else await run_in_threadpool(_said, lambda: _json(at(request).state()))

    def changing(path: str, act) -> None:
        async def endpoint(request: Request) -> Response:
            try:
                body = json.loads(await request.body())
                if not isinstance(body, dict):
                    raise ValueError
            except (ValueError, RecursionError):
                return _json({"error": "no JSON object"}, 400)
            return await run_in_threadpool(_said, lambda: _json(act(at(request), body)))

        routed(path, endpoint, "POST")

    def own(path: str, answer) -> None:
        reading(path, lambda r: answer(at(r), r))

    own("/", lambda session, r: _text(page.shell(session.history.name, guard.csrf, experiments.names, r.path_params.get("number", 0)), "text/html"))
    reading("/studio.js", lambda r: _text(page.script(), "text/javascript"))
    reading("/studio.css", lambda r: _text(page.style(), "text/css"))
    reading("/plotly.js", lambda r: Response(page.engine(), media_type="text/javascript", headers={"cache-control": "private, max-age=3600"}))
    routed("/api/state", state, "GET")
    own("/api/view", lambda session, r: _json(session.page(_word(r, "sha"))))
    own("/api/figure", _figure)
    own("/api/stretch", _stretch)
    own("/api/fitted", lambda session, r: _json(session.fitted(_word(r, "sha"))))
    own("/api/window", _window)
    own("/api/cloud", lambda session, r: _json(_seen(session, r).cloud(_word(r, "part"), _whole(r, "joint"))))
    own("/api/film", lambda session, r: _json(_seen(session, r).film(_word(r, "part"))))
    own("/export/rows.csv", _window_csv)
    own("/export/design", _design)
    own("/api/compare", lambda session, r: _json(session.compare(_whole(r, "from"), _whole(r, "to"))))
    own("/export/report.html", lambda session, r: _file(session.report(_word(r, "sha")), "text/html", f"{session.history.name}.html"))
    own("/export/experiment.yaml", lambda session, r: _file(session.history.text(), "application/yaml", f"{session.history.name}.yaml"))
    changing("/api/run", lambda session, b: session.run(_given(b, "sha", optional=True)))
    changing("/api/cancel", lambda session, b: session.cancel())
    changing("/api/undo", lambda session, b: session.undo(_given(b, "sha")))
    changing("/api/redo", lambda session, b: session.redo(_given(b, "sha")))
    changing("/api/add", lambda session, b: session.add(_given(b, "sha"), b))
    changing("/api/preview", lambda session, b: session.preview(_given(b, "sha"), b))
    changing("/api/design", lambda session, b: session.design(_given(b, "sha"), b.get("separate"), b.get("duration", 20.0)))
    return guard


def _figure(session: Session, request: Request) -> Response:
    found = session.diagnosed(_word(request, "sha")).chart(_word(request, "id"))
    if found is None:
        return _json({"error": "there is no such chart"}, 404)
    return Response(found, media_type="application/json", headers={"cache-control": "no-store"})


def _seen(session: Session, request: Request):
    return session.workspace(_word(request, "sha"), _word(request, "shown"))


def _window(session: Session, request: Request) -> Response:
    which = _word(request, "beside")
    beside = session.beside(_word(request, "sha"), which) if which else None
    return _json(_seen(session, request).window(*_what(request), beside))


def _stretch(session: Session, request: Request) -> Response:
    part = _word(request, "part") or "test"
    return _json(session.stretch(_word(request, "sha"), part, _number(request, "from"), _number(request, "to")))


def _design(session: Session, request: Request) -> Response:
    name, which = _word(request, "name"), _word(request, "file")
    text = designs.file(session.history.run, name, which)
    return _file(text, designs.FILES[which], f"{name}-{which}")


def _window_csv(session: Session, request: Request) -> Response:
    part, joint, low, high = _what(request)
    found = _seen(session, request)
    return _file(found.csv(part, joint, low, high), "text/csv", f"{session.history.name}-{found.joint(joint)}.csv")


def _what(request: Request) -> tuple:
    """Which logs, joint and window of time are asked for."""
    bounds = [_number(request, name) if name in request.query_params else None for name in ("from", "to")]
    return _word(request, "part"), _whole(request, "joint"), *bounds


def _said(act) -> Response:
    """What an action answers; bad input as one line."""
    try:
        return act()
    except Changed as error:
        return _json({"error": str(error), "changed": True}, _CHANGED)
    except Absent as error:
        return _json({"error": str(error)}, 404)
    except SysidError as error:
        return _json({"error": str(error)}, 422)


def _word(request: Request, name: str) -> str:
    return request.query_params.get(name, "")


def _whole(request: Request, name: str) -> int:
    try:
        return int(request.query_params.get(name, ""))
    except ValueError:
        raise SysidError(f"{name} must be a whole number") from None


def _number(request: Request, name: str) -> float:
    try:
        return float(request.query_params.get(name, ""))
    except ValueError:
        raise SysidError(f"{name} must be a number") from None


def _given(body: dict, name: str, optional: bool = False) -> str:
    value = body.get(name)
    if value is None and optional:
        return None
    if not isinstance(value, str):
        raise SysidError(f"{name} must be a text")
    return value


def _json(value, status: int = 200) -> Response:
    return Response(dumped(value), status, media_type="application/json", headers={"cache-control": "no-store"})


def _text(text: str, kind: str) -> Response:
    return Response(text, media_type=kind, headers={"cache-control": "no-store"})


def _file(text: str, kind: str, name: str) -> Response:
    return Response(text, media_type=kind, headers={"cache-control": "no-store", "content-disposition": f"attachment; filename*=UTF-8''{quote(name, safe='')}"})
