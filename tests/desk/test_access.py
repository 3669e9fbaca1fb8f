"""The page answers only on this machine, and only to those who have the token."""

import asyncio
from typing import Any
from urllib.parse import quote

import pytest

pytest.importorskip("nicegui")

from polycube.desk.access import COOKIE, OnlyWithToken

TOKEN = "a-token"
HOST = "127.0.0.1:8080"


async def page(scope: dict, receive: Any, send: Any) -> None:
    """A page that greets, by HTTP and by a web socket."""
    if scope["type"] == "http":
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"hello"})
    else:
        await send({"type": "websocket.accept"})


def asked(kind: str = "http", token: str | None = None, cookie: str = "", host: str = HOST) -> list:
    """The answers to one request."""
    query = b"" if token is None else f"token={quote(token)}".encode()
    headers = [(b"host", host.encode()), (b"cookie", cookie.encode())]
    scope = {"type": kind, "path": "/", "query_string": query, "headers": headers}
    scope |= {"scheme": "http", "server": ("127.0.0.1", 8080), "method": "GET"}
    said: list = []

    async def send(message: dict) -> None:
        said.append(message)

    asyncio.run(OnlyWithToken(page, TOKEN)(scope, None, send))
    return said


def test_the_token_becomes_a_cookie() -> None:
    start, body = asked(token=TOKEN)
    assert body["body"] == b"hello"
    [(name, value)] = start["headers"]
    assert name == b"set-cookie" and value.decode().startswith(f"{COOKIE}={TOKEN}; HttpOnly; Same")
    start, body = asked(cookie=f"{COOKIE}={TOKEN}")
    assert body["body"] == b"hello" and start["headers"] == []
    assert asked("websocket", cookie=f"{COOKIE}={TOKEN}") == [{"type": "websocket.accept"}]


@pytest.mark.parametrize("token", [None, "", "another", "ä"])
def test_others_are_refused(token) -> None:
    start, body = asked(token=token)
    assert start["status"] == 403 and b"token" in body["body"]
    assert all(name != b"set-cookie" for name, _ in start["headers"])
    assert asked("websocket", token=token) == [{"type": "websocket.close", "code": 1008}]


def test_another_name_of_this_machine_is_refused() -> None:
    """A page of a stranger whose name resolves to 127.0.0.1 must not reach the desk."""
    assert asked(token=TOKEN, host="evil.example:8080")[0]["status"] == 403
