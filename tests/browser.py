"""Headless Chromium for tests of pages: DevTools' protocol over two pipes, no library needed.

`POLYCUBE_BROWSER` names the program; else the first of `NAMES` on the path is taken.
"""

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import numpy as np

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome", "microsoft-edge")
FLAGS = (
    "--headless=new --no-sandbox --disable-dev-shm-usage --remote-debugging-pipe --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync --hide-scrollbars "
    "--disable-extensions --mute-audio --use-angle=swiftshader --enable-unsafe-swiftshader"
).split()
# DevTools reads file 3 and writes file 4
START = "import os, sys; os.dup2({}, 3); os.dup2({}, 4); os.execvp(sys.argv[1], sys.argv[1:])"


def found() -> str | None:
    """Path of the browser; None where there is none."""
    given = os.environ.get("POLYCUBE_BROWSER")
    return shutil.which(given) if given else next(filter(None, map(shutil.which, NAMES)), None)


class Page:
    """The one page of a browser: what it says, and hands to use it with."""

    def __init__(self, read: int, write: int, seconds: float = 60) -> None:
        self._read, self._write, self._seconds = read, write, seconds
        self._number, self._rest, self._session = 0, b"", None
        self.said: list[str] = []  # errors and warnings of the console, exceptions
        self.asked: list[str] = []  # addresses that were requested
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")

    def send(self, method: str, **parameters: object) -> dict:
        """The answer to one command; events that come before it are noted."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]

    def _next(self) -> dict:
        end = time.monotonic() + self._seconds
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._read], [], [], max(0, end - time.monotonic()))
            chunk = os.read(self._read, 1 << 20) if ready else b""
            assert chunk, "the browser has gone, or says nothing"
            self._rest += chunk
        text, self._rest = self._rest.split(b"\0", 1)
        message = json.loads(text)
        self._note(message.get("method"), message.get("params", {}))
        return message

    def _note(self, event: str | None, told: dict) -> None:
        if event == "Runtime.exceptionThrown":
            details = told["exceptionDetails"]
            self.said.append(details.get("exception", {}).get("description", details["text"]))
        elif event == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning"):
            self.said.append(str([each.get("value") for each in told["args"]]))
        elif event == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning"):
            self.said.append(told["entry"]["text"])
        elif event == "Network.requestWillBeSent":
            self.asked.append(told["request"]["url"])

    def size(self, width: int, height: int, phone: bool = False) -> None:
        """Of the window, in CSS pixels; a phone has fingers and two pixels to each."""
        self.send(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=2 if phone else 1,
            mobile=phone,
        )
        self.send("Emulation.setTouchEmulationEnabled", enabled=phone)

    def media(self, medium: str = "", **features: str) -> None:
        """Show it as on paper ("print"), or as users of `prefers_color_scheme="dark"` see it."""
        listed = [{"name": n.replace("_", "-"), "value": v} for n, v in features.items()]
        self.send("Emulation.setEmulatedMedia", media=medium, features=listed)

    def open(self, path: Path) -> None:
        """Load a file, and wait until it is drawn."""
        self.send("Page.navigate", url=path.resolve().as_uri())
        self.wait("document.readyState === 'complete' && location.protocol === 'file:'")
        self.frame()

    def run(self, script: str) -> object:
        """Value of a JavaScript expression; a promise is waited for."""
        answer = self.send(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, condition: str) -> None:
        """Until a JavaScript expression is true."""
        end = time.monotonic() + self._seconds
        while not self.run(condition):
            assert time.monotonic() < end, f"never true: {condition}"
            time.sleep(0.05)

    def frame(self) -> None:
        """Until the next two frames are drawn."""
        self.run("new Promise((d) => requestAnimationFrame(() => requestAnimationFrame(d)))")

    def box(self, selector: str) -> tuple[float, float, float, float]:
        """Left, top, width, height in the window, the element scrolled to its middle."""
        found = self.run(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            "e.scrollIntoView({block: 'center', behavior: 'instant'});"
            "const b = e.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()"
        )
        return tuple(found)

    def drag(self, selector: str, dx: float, dy: float, steps: int = 5) -> None:
        """Press the mouse in the middle of an element, move, release."""
        x, y, width, height = self.box(selector)
        x, y = x + width / 2, y + height / 2
        self._mouse("mousePressed", x, y)
        for k in range(1, steps + 1):
            self._mouse("mouseMoved", x + dx * k / steps, y + dy * k / steps)
        self._mouse("mouseReleased", x + dx, y + dy)
        self.frame()

    def click(self, selector: str, right: float = 0, down: float = 0) -> None:
        """Press and release in the middle of an element, or that far from it."""
        x, y, width, height = self.box(selector)
        for kind in ("mousePressed", "mouseReleased"):
            self._mouse(kind, x + width / 2 + right, y + height / 2 + down)
        self.frame()

    def _mouse(self, kind: str, x: float, y: float) -> None:
        self.send(
            "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1
        )

    def set(self, selector: str, value: object) -> None:
        """Give a control a value as a user does, and let the page answer."""
        key = "checked" if isinstance(value, bool) else "value"
        self.run(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            f"e.{key} = {json.dumps(value)};"
            "e.dispatchEvent(new Event('input', {bubbles: true}));"
            "e.dispatchEvent(new Event('change', {bubbles: true})); })()"
        )
        self.frame()

    def picture(self, selector: str = "", whole: bool = False) -> np.ndarray:
        """(height, width, 3) uint8 of an element, of the window, or of the whole page."""
        from PIL import Image

        clip = {}
        if selector:
            x, y, width, height = self.box(selector)
            scroll = self.run("[scrollX, scrollY]")
            clip = {"x": x + scroll[0], "y": y + scroll[1], "width": width, "height": height}
        elif whole:
            size = self.send("Page.getLayoutMetrics")["cssContentSize"]
            clip = {"x": 0, "y": 0, "width": size["width"], "height": size["height"]}
        options = {"clip": {**clip, "scale": 1}, "captureBeyondViewport": True} if clip else {}
        data = self.send("Page.captureScreenshot", format="png", **options)["data"]
        return np.asarray(Image.open(BytesIO(base64.b64decode(data))).convert("RGB"))


@contextmanager
def browser(program: str) -> Iterator[Page]:
    """A page of a browser that ends with the block."""
    to_it, write = os.pipe()
    read, from_it = os.pipe()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [sys.executable, "-c", START.format(to_it, from_it), program, *FLAGS]
        process = subprocess.Popen(
            [*command, f"--user-data-dir={profile}"],
            pass_fds=(to_it, from_it),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_it)
        os.close(from_it)
        try:
            yield Page(read, write)
        finally:
            process.terminate()
            process.wait(20)
            os.close(read)
            os.close(write)
