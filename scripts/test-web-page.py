#!/usr/bin/env python3
"""Opens a page that `steradian export-web` wrote in headless Chromium and holds what it draws against the pictures that the
CPU rendered.

    scripts/test-web-page.py DIR SHOTS [--only desktop|phone]

DIR is the page's folder, SHOTS a folder for screenshots. Needs chromium and chromium-driver (Debian) and nothing else; the
software adapters of Chromium draw. For each API, technique and light the canvas is read at the pictures' size and compared
with the PNG of the page: mean difference in 8-bit steps, and the share of pixels that differ by more than 24. Exit code 1
where a check fails.
"""

import base64
import functools
import http.server
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

MEAN, LARGE, SHARE = 2.0, 24, 0.02
SIZES = {"desktop": (1440, 900), "phone": (390, 844)}


class Driver:
    """As much of the W3C WebDriver protocol as is needed here."""

    def __init__(self):
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        self.home = tempfile.TemporaryDirectory()
        self.process = subprocess.Popen(
            ["chromedriver", f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self.base = f"http://127.0.0.1:{port}"
        for _ in range(100):
            try:
                self.call("GET", "/status")
                break
            except OSError:
                time.sleep(0.1)
        arguments = [
            "--headless=new", "--no-sandbox", "--use-webgpu-adapter=swiftshader", "--enable-unsafe-webgpu",
            "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars",
            # Without Vulkan for the compositor too, showing a WebGPU canvas loses the device.
            "--use-vulkan=swiftshader", "--enable-features=Vulkan",
            # Its software adapters take minutes for measured reflectance under a sun, which the watchdog takes for a hang.
            "--disable-gpu-watchdog",
            f"--user-data-dir={self.home.name}", "--allow-file-access-from-files=false",
        ]
        capabilities = {"browserName": "chrome", "goog:chromeOptions": {"args": arguments}, "goog:loggingPrefs": {"browser": "ALL"}}
        session = self.call("POST", "/session", {"capabilities": {"alwaysMatch": capabilities}})
        self.base += "/session/" + session["sessionId"]
        self.call("POST", "/timeouts", {"script": 300000, "pageLoad": 120000})

    def call(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.base + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=400) as r:
                return json.load(r)["value"]
        except urllib.error.HTTPError as e:
            raise RuntimeError(json.load(e)["value"]["message"].splitlines()[0]) from None

    def cdp(self, name, **parameters):
        return self.call("POST", "/goog/cdp/execute", {"cmd": name, "params": parameters})

    def size(self, name):
        width, height = SIZES[name]
        self.cdp("Emulation.setDeviceMetricsOverride", width=width, height=height,
                 deviceScaleFactor=2 if name == "phone" else 1, mobile=name == "phone")

    def run(self, script, *args):
        return self.call("POST", "/execute/sync", {"script": script, "args": list(args)})

    def run_async(self, script, *args):
        body = "const done = arguments[arguments.length - 1]; (async () => {" + script + "})().then(done, (e) => done('error: ' + e.message));"
        return self.call("POST", "/execute/async", {"script": body, "args": list(args)})

    def open(self, url):
        self.call("POST", "/url", {"url": url})
        for _ in range(1200):
            ready = self.run("return document.documentElement.dataset.ready")
            if ready:
                return ready
            time.sleep(0.1)
        raise RuntimeError(f"{url} never became ready: {self.run('return document.getElementById(`status`).textContent')}")

    def drag(self, x0, y0, x1, y1, keys=()):
        pointer = [
            {"type": "pointerMove", "duration": 0, "x": x0, "y": y0}, {"type": "pointerDown", "button": 0},
            {"type": "pointerMove", "duration": 100, "x": x1, "y": y1}, {"type": "pointerUp", "button": 0},
        ]
        actions = [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": pointer}]
        if keys:
            down = [{"type": "keyDown", "value": k} for k in keys]
            up = [{"type": "keyUp", "value": k} for k in keys]
            pause = [{"type": "pause", "duration": 0}]
            actions[0]["actions"] = pause * len(keys) + pointer
            actions.append({"type": "key", "id": "keys", "actions": down + pause * 4 + up})
        self.call("POST", "/actions", {"actions": actions})

    def key(self, k):
        keys = [{"type": "keyDown", "value": k}, {"type": "keyUp", "value": k}]
        self.call("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": keys}]})

    def shot(self, folder, name):
        with open(os.path.join(folder, name + ".png"), "wb") as f:
            f.write(base64.b64decode(self.call("GET", "/screenshot")))

    def problems(self):
        log = self.call("POST", "/se/log", {"type": "browser"})
        return [e["message"] for e in log if e["level"] == "SEVERE"]

    def close(self):
        try:
            self.call("DELETE", "")
        finally:
            self.process.terminate()
            self.process.wait()


# The canvas at the pictures' size beside the PNG of `name`: mean difference of a channel and the share of large ones.
COMPARE = """
const [name, width, height, large] = arguments;
const a = await steradian.capture(width, height);
const image = new Image();
image.src = name;
await image.decode();
const canvas = Object.assign(document.createElement("canvas"), { width, height });
const to = canvas.getContext("2d");
to.drawImage(image, 0, 0);
const b = to.getImageData(0, 0, width, height).data;
let sum = 0, far = 0, light = 0;
for (let i = 0; i < a.length; i += 4) {
  let most = 0;
  for (let c = 0; c < 3; c++) { const d = Math.abs(a[i + c] - b[i + c]); sum += d; most = Math.max(most, d); light += b[i + c]; }
  if (most > large) far++;
}
return [sum / (a.length * 0.75), far / (a.length / 4), light / (a.length * 0.75)];
"""

CAPTURE = "const a = await steradian.capture(320, 200); let s = 0; for (let i = 0; i < a.length; i += 7) s = (s * 31 + a[i]) % 1000003; return s;"


def main():
    folder, shots = sys.argv[1], sys.argv[2]
    only = sys.argv[sys.argv.index("--only") + 1] if "--only" in sys.argv else None
    os.makedirs(shots, exist_ok=True)
    with open(os.path.join(folder, "page.js"), encoding="utf-8") as f:
        page = json.loads(f.read().removeprefix("steradian.page(").removesuffix(");\n"))
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    url = f"http://127.0.0.1:{server.server_address[1]}/index.html"
    failures = []

    def check(what, holds, numbers=""):
        print(("ok    " if holds else "FAILED"), what, numbers, flush=True)
        if not holds:
            failures.append(what)

    weight = sum(os.path.getsize(os.path.join(folder, n)) for n in os.listdir(folder))
    print(f"the folder weighs {weight / 1e6:.2f} MB")
    driver = Driver()
    try:
        width, height = page["size"]
        for api in ("webgl2", "webgpu"):
            driver.size("desktop")
            for l, light in enumerate(page["lights"]):
                for t, technique in enumerate(page["techniques"]):
                    if not light["variants"][t]:
                        continue
                    slug = technique["slug"]
                    ready = driver.open(f"{url}?api={api}&theme=light&light={l}&technique={slug.replace('+', '%2B')}")
                    what = f"{api} {slug} under {light['name']}"
                    if ready == "picture":
                        check(what, False, driver.run("return document.getElementById('note').textContent"))
                        continue
                    result = driver.run_async(COMPARE, light["variants"][t]["picture"], width, height, LARGE)
                    if isinstance(result, str):
                        check(what, False, result)
                        continue
                    mean, share, brightness = result
                    good = mean < MEAN and share < SHARE and brightness > 5
                    check(what, good, f"mean {mean:.2f} of 255, {100 * share:.2f} % of pixels beyond {LARGE}")
            # What a visitor does.
            first = driver.open(f"{url}?api={api}&theme=light")
            before = driver.run_async(CAPTURE)
            driver.drag(500, 450, 620, 430)
            check(f"{api}: a drag turns", driver.run_async(CAPTURE) != before)
            driver.key("0")
            check(f"{api}: 0 resets", driver.run_async(CAPTURE) == before)
            driver.drag(500, 450, 620, 450, keys=["\ue008"])
            turned = driver.run("return steradian.state.turn")
            turns = page["lights"][0]["variants"][0]["turns"]
            check(f"{api}: a drag with Shift turns the light", (turned != 0) == turns and (driver.run_async(CAPTURE) != before) == turns)
            driver.key("0")
            driver.key("]")
            check(f"{api}: ] brightens", driver.run_async(CAPTURE) != before)
            driver.key("0")
            if len([v for v in page["lights"][0]["variants"] if v]) > 1:
                driver.key("t")
                time.sleep(0.2)
                for _ in range(600):
                    if driver.run("return document.documentElement.dataset.ready") != first:
                        break
                    time.sleep(0.1)
                check(f"{api}: T takes another technique", driver.run_async(CAPTURE) != before)
        for size in SIZES:
            if only and size != only:
                continue
            driver.size(size)
            for theme in ("light", "dark"):
                for api in ("webgl2", "webgpu", "picture"):
                    ready = driver.open(f"{url}?api={api}&theme={theme}")
                    check(f"{size} {theme} {api} opens", (ready == "picture") == (api == "picture"))
                    over = driver.run("return document.documentElement.scrollWidth - innerWidth")
                    check(f"{size} {theme} {api} fits the width", over <= 0)
                    time.sleep(0.3)
                    driver.shot(shots, f"{size}-{theme}-{api}")
            if page["lights"][0]["reference"]:
                driver.open(f"{url}?api=webgpu&theme=light&heat=1")
                time.sleep(0.3)
                check(f"{size} heat map", driver.run("return steradian.state.heat"))
                driver.shot(shots, f"{size}-heat")
        driver.size("desktop")
        for api in ("webgl2", "webgpu"):
            ready = driver.open("file://" + os.path.abspath(os.path.join(folder, "index.html")) + f"?api={api}")
            check(f"{api} from a disk", ready != "picture")
        for message in driver.problems():
            check("the console is quiet", False, message)
    finally:
        driver.close()
        server.shutdown()
    sys.exit(1 if failures else 0)


main()
