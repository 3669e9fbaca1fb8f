"""From a STEP file to a deck at the desk, in a browser."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from polycube import HOME
from tests.fixtures.browser import Page, browser, found
from tests.fixtures.cad_parts import write

pytest.importorskip("nicegui")
pytestmark = pytest.mark.slow
BUTTON = "[...document.querySelectorAll('button')].find((b) => b.innerText.toLowerCase() === %s)"
LABEL = "[...document.querySelectorAll('label')].find((l) => l.innerText.startsWith(%s))"
OPTION = "[...document.querySelectorAll('.q-menu .q-item')].find((i) => i.innerText.trim() === %s)"


@pytest.fixture
def address(tmp_path) -> Iterator[str]:
    """Address of a desk for a bracket."""
    part = write("bracket", tmp_path)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "polycube.desk", part, "--no-browser", "--port", str(port)]
    # NiceGUI behaves otherwise in tests
    environment = {n: v for n, v in os.environ.items() if n != "PYTEST_CURRENT_TEST"}
    process = subprocess.Popen(
        command, cwd=HOME, env=environment, stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        end = time.monotonic() + 60
        while not listens(port):
            assert time.monotonic() < end and process.poll() is None, "the desk does not answer"
            time.sleep(0.2)
        yield address
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20)


def listens(port: int) -> bool:
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


def press(page: Page, name: str) -> None:
    page.run(f"{BUTTON % json.dumps(name.lower())}.click()")
    page.frame()


def choose(page: Page, label: str, option: str) -> None:
    for _ in range(5):  # a click is lost while the menu before closes
        page.run(f"{LABEL % json.dumps(label)}.querySelector('input, .q-field__native').click()")
        time.sleep(0.5)
        if page.run(f"!!({OPTION % json.dumps(option)})"):
            break
    page.run(f"{OPTION % json.dumps(option)}.click()")
    key = {"key": "Escape", "code": "Escape", "windowsVirtualKeyCode": 27}
    page.send("Input.dispatchKeyEvent", type="rawKeyDown", **key)
    page.send("Input.dispatchKeyEvent", type="keyUp", **key)
    page.wait("document.querySelector('.q-menu') === null")


def says(page: Page, text: str) -> None:
    page.wait(f"document.body.innerText.includes({json.dumps(text)})")


@pytest.mark.skipif(found() is None, reason="Chromium is not installed")
def test_from_a_step_file_to_a_deck(address, tmp_path) -> None:
    program = found()
    assert program is not None
    with browser(program) as page:
        page.size(1280, 1000)
        page.send("Page.navigate", url=address)
        page.wait("document.querySelector('canvas') !== null")
        says(page, "faces: 11, lengths in mm")
        page.run("new Promise((d) => setTimeout(d, 2000))")  # until the faces are drawn
        page.click("canvas", 30, 40)
        says(page, "cad_face_9")  # the upper side of the plate
        assert "cad_face_9" in page.run(f"{LABEL % json.dumps('Selected faces')}.innerText")
        press(page, "Hold")
        says(page, "cad_face_9: held")
        page.click("canvas", 30, 40)  # no longer selected
        choose(page, "Selected faces", "z_max")
        page.set('input[aria-label="Force x, N"]', 100)
        press(page, "Add force")
        says(page, "z_max: force (100.0, 0.0, 0.0) N")
        choose(page, "Analysis", "static")
        choose(page, "Effort", "first")
        choose(page, "Exports", "abaqus")
        page.run("document.querySelector('[role=checkbox]').click()")  # the deck solves it
        press(page, "Run")
        says(page, "finished")
        page.wait("!!document.querySelector('iframe').contentDocument.querySelector('h1')")
        heading = "document.querySelector('iframe').contentDocument.querySelector('h1').innerText"
        assert page.run(heading) == "bracket.step"
        page.size(480, 900)
        assert page.run("document.documentElement.scrollWidth") <= 480
        assert page.messages == []
        asked = [each for each in page.requests if re.match("(http|ws)s?:", each)]
        hosts = {each.split("/")[2] for each in asked}
        assert hosts == {address.split("/")[2]}, "the desk works without a network"
    [deck] = (tmp_path / "outputs" / "bracket").glob("*/hex.inp")
    text = deck.read_text()
    assert "*BOUNDARY" in text.upper() and "*STATIC" in text.upper() and "cad_face_9" in text
    words = (deck.parent / "command.txt").read_text()
    assert "'analysis.fixed=[cad_face_9]'" in words and "export=[abaqus]" in words
