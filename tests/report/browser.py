"""Chromium without a window, driven over its debugging pipe: NUL-ended JSON on descriptors 3 and 4."""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

EXECUTABLE = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Browser:
    """One page. `events` collects everything the page reports: console, log, exceptions, requests."""

    def __enter__(self):
        self.profile = tempfile.mkdtemp()
        child_in, self.to_child = os.pipe()
        self.from_child, child_out = os.pipe()
        command = [
            EXECUTABLE,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--remote-debugging-pipe",
            f"--user-data-dir={self.profile}",
        ]
        self.process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{child_in} 4>&{child_out}', "bash", *command],
            pass_fds=(child_in, child_out),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(child_in)
        os.close(child_out)
        self.events, self.answers, self.rest, self.last = [], {}, b"", 0
        self.session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        return self

    def __exit__(self, *_):
        os.close(self.to_child)
        self.process.kill()
        self.process.wait()
        os.close(self.from_child)
        shutil.rmtree(self.profile, ignore_errors=True)

    def call(self, method, **parameters):
        self.last += 1
        message = {"id": self.last, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.to_child, data) :]
        self._read(lambda: self.last in self.answers, method)
        answer = self.answers.pop(self.last)
        assert "error" not in answer, (method, answer["error"])
        return answer["result"]

    def _read(self, done, what, seconds=1800):
        deadline = time.monotonic() + seconds
        while not done():
            ready, _, _ = select.select([self.from_child], [], [], max(deadline - time.monotonic(), 0))
            chunk = os.read(self.from_child, 1 << 16) if ready else b""
            assert chunk, f"chromium did not answer {what}"
            *whole, self.rest = (self.rest + chunk).split(b"\0")
            for text in whole:
                message = json.loads(text)
                if "id" in message:
                    self.answers[message["id"]] = message
                else:
                    self.events.append(message)

    def screen(self, width, height, phone=False):
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=2 if phone else 1,
            mobile=phone,
        )

    def open(self, path):
        """Load a local file and wait until it, its images included, is there."""
        self.events.clear()
        self.call("Page.navigate", url=path.resolve().as_uri())
        self._read(lambda: any(e["method"] == "Page.loadEventFired" for e in self.events), "load")

    def evaluate(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def pdf(self):
        return base64.b64decode(
            self.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)["data"]
        )


def complaints(browser):
    """Console messages, log entries and exceptions of the page."""
    kinds = ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")
    return [event for event in browser.events if event["method"] in kinds]


def requests(browser):
    """Addresses asked for other than the page and what lies inside it."""
    asked = [
        e["params"]["request"]["url"] for e in browser.events if e["method"] == "Network.requestWillBeSent"
    ]
    return [url for url in asked[1:] if not url.startswith("data:")]
