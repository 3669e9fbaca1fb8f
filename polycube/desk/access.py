"""Only the person who started the desk may use it: this machine, and a token."""

import secrets

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HERE = ("127.0.0.1", "localhost")
COOKIE = "polycube_desk"


class OnlyWithToken:
    """Refuse all requests without the token, or for another host name (DNS rebinding).

    app : the page
    token : of the address that the desk prints; a browser keeps it as a cookie of the session
    """

    def __init__(self, app: ASGIApp, token: str) -> None:
        self.app, self.token = app, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or hand it on."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        request = HTTPConnection(scope)
        asked = request.query_params.get("token")
        given = asked or request.cookies.get(COOKIE, "")
        is_known = secrets.compare_digest(given.encode(), self.token.encode())
        if request.url.hostname not in HERE or not is_known:
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008})
            else:
                text = "Open the address with the token that polycube-desk has printed.\n"
                await PlainTextResponse(text, 403)(scope, receive, send)
            return

        async def with_cookie(message: Message) -> None:
            if asked and message["type"] == "http.response.start":
                cookie = f"{COOKIE}={self.token}; HttpOnly; SameSite=Strict; Path=/"
                MutableHeaders(scope=message).append("set-cookie", cookie)
            await send(message)

        await self.app(scope, receive, with_cookie)
