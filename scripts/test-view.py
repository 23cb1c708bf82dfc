#!/usr/bin/env python3
"""Opens the window of `steradian view` on a display of its own, drives it with real mouse and key events, and looks at its
pixels.

    cargo build --features view
    scripts/test-view.py target/debug/steradian SHOTS

SHOTS is a folder for screenshots. Needs Xvfb, xdotool, ImageMagick and python-xlib (Debian: xvfb xdotool imagemagick
python3-xlib) and a Vulkan driver (mesa-vulkan-drivers is one in software). Exit code 1 where a check fails.
"""

import math
import os
import struct
import subprocess
import sys
import tempfile
import time
import zlib

from Xlib import X, Xatom, display
from Xlib.protocol import event

PICTURE = (420, 60, 1180, 640)  # within the picture at 1280 x 820
PANEL = (4, 4, 280, 30)


class Window:
    """The command on a display of its own."""

    def __init__(self, command, home, display, arguments=(), size=(1280, 820)):
        self.size = size
        self.display = f":{display}"
        self.server = subprocess.Popen(
            ["Xvfb", self.display, "-screen", "0", f"{size[0]}x{size[1]}x24"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        time.sleep(1)
        self.environment = {
            **os.environ, "DISPLAY": self.display, "XDG_DATA_HOME": home, "XDG_RUNTIME_DIR": home, "WAYLAND_DISPLAY": "",
        }
        del self.environment["WAYLAND_DISPLAY"]
        self.home = home
        self.log = open(os.path.join(home, "log"), "w+")
        self.process = subprocess.Popen(
            [command, "view", *arguments], env=self.environment, cwd=home, stdout=self.log, stderr=self.log
        )
        self.id = None
        for _ in range(300):
            found = self.do("search", "--name", "^Steradian$", check=False).split()
            if found:
                self.id = found[-1]
                break
            if self.process.poll() is not None:
                break
            time.sleep(0.1)
        if self.id is None:
            self.log.seek(0)
            raise RuntimeError(f"no window: {self.log.read()}")
        self.do("windowsize", self.id, *map(str, size))
        self.do("windowmove", self.id, "0", "0")
        # Without a window manager nobody gives it the keyboard.
        for _ in range(20):
            self.do("windowfocus", self.id, check=False)
            time.sleep(0.2)
            if self.do("getwindowfocus", check=False).strip() == self.id:
                break

    def do(self, *words, check=True):
        done = subprocess.run(["xdotool", *words], env=self.environment, capture_output=True, text=True, check=False)
        if check and done.returncode:
            raise RuntimeError(done.stderr)
        return done.stdout

    def pixels(self, box):
        """RGB bytes of a part of the screen."""
        x0, y0, x1, y1 = box
        crop = f"{x1 - x0}x{y1 - y0}+{x0}+{y0}"
        done = subprocess.run(
            ["import", "-silent", "-window", "root", "-crop", crop, "-depth", "8", "rgb:-"],
            env=self.environment, capture_output=True, check=True,
        )
        return done.stdout

    def shot(self, path):
        subprocess.run(["import", "-silent", "-window", "root", path], env=self.environment, check=True)

    def worked(self):
        """Seconds of processor time so far."""
        with open(f"/proc/{self.process.pid}/stat", encoding="ascii") as f:
            fields = f.read().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def settled(self, box=PICTURE, seconds=120):
        """The pixels once they have stayed the same for a second in which the window hardly worked: no bake is under way."""
        last, since, start, work = self.pixels(box), time.time(), time.time(), self.worked()
        while time.time() - since < 1.2:
            time.sleep(0.25)
            now = self.pixels(box)
            if now != last or self.worked() - work > 0.25:
                last, since, work = now, time.time(), self.worked()
            if time.time() - start > seconds:
                raise RuntimeError("the window never comes to rest")
        return last

    def until(self, holds, seconds=60):
        """Waits until something holds; does it in the end?"""
        start = time.time()
        while not holds():
            if time.time() - start > seconds:
                return False
            time.sleep(0.2)
        return True

    def changed(self, before, box=PICTURE, seconds=30):
        """The pixels once they are no longer `before` and at rest."""
        start = time.time()
        while self.pixels(box) == before:
            if time.time() - start > seconds:
                return before
            time.sleep(0.1)
        return self.settled(box)

    def picture(self):
        """The first picture, which takes a while: until then there is one colour and a few words."""
        self.until(lambda: len(set(self.pixels(PICTURE))) >= 180)
        return self.settled()

    def drag(self, x, y, dx, dy, key=None, button="1"):
        if key:
            self.do("keydown", key)
        self.do("mousemove", str(x), str(y), "sleep", "0.1", "mousedown", button, "sleep", "0.1")
        for k in range(1, 6):
            self.do("mousemove", str(x + dx * k // 5), str(y + dy * k // 5), "sleep", "0.05")
        self.do("mouseup", button)
        if key:
            self.do("keyup", key)
        self.do("mousemove", "700", "760")

    def key(self, name):
        self.do("key", name)

    def close(self):
        """Asks the window to close; its exit code, or None where it does not end within ten seconds."""
        self.key("ctrl+q")
        try:
            code = self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            code = None
        self.server.terminate()
        self.server.wait()
        return code


def drop(name, window, file):
    """Drops a file onto a window as a file manager does (XDND 5); was it taken?"""
    d = display.Display(name)
    screen = d.screen()
    source = screen.root.create_window(0, 0, 1, 1, 0, screen.root_depth, event_mask=X.PropertyChangeMask)
    target = d.create_resource_object("window", int(window))
    atom = d.intern_atom
    selection, uris = atom("XdndSelection"), atom("text/uri-list")
    source.set_selection_owner(selection, X.CurrentTime)

    def send(kind, *data):
        numbers = [source.id, *data, 0, 0, 0, 0][:5]
        message = event.ClientMessage(window=target, client_type=atom(kind), data=(32, numbers))
        target.send_event(message)
        d.flush()

    send("XdndEnter", 5 << 24, uris)
    place = target.translate_coords(screen.root, 0, 0)
    at = (700 - place.x) << 16 | (400 - place.y)
    send("XdndPosition", 0, at, X.CurrentTime, atom("XdndActionCopy"))
    taken, deadline = False, time.time() + 10
    while time.time() < deadline:
        if not d.pending_events():
            time.sleep(0.01)
            continue
        e = d.next_event()
        if e.type == X.SelectionRequest:
            text = f"file://{os.path.abspath(file)}\r\n".encode()
            e.requestor.change_property(e.property, uris, 8, text)
            notify = event.SelectionNotify(
                time=e.time, requestor=e.requestor, selection=e.selection, target=e.target, property=e.property
            )
            e.requestor.send_event(notify)
            d.flush()
        elif e.type == X.ClientMessage and e.client_type == atom("XdndStatus") and not taken:
            taken = bool(e.data[1][1] & 1)
            send("XdndDrop", 0, X.CurrentTime)
        elif e.type == X.ClientMessage and e.client_type == atom("XdndFinished"):
            break
    d.close()
    return taken


def apart(a, b):
    """Mean difference of two pictures in 8-bit steps."""
    return sum(abs(x - y) for x, y in zip(a, b)) / max(len(a), 1)


def wipe(w):
    """Where the white line between both sides stands."""
    x0, y0, x1, y1 = box = (320, 560, 1260, 600)
    line, width = w.pixels(box), x1 - x0
    whites = [x for x in range(width)
              if all(min(line[3 * (y * width + x):][:3]) > 200 for y in range(y1 - y0))]
    return x0 + whites[len(whites) // 2] if whites else 0


def normal_map(path):
    """Waves as a PNG of 64 x 64 tangent-space normals."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b""
    for y in range(64):
        rows += b"\0"
        for x in range(64):
            n = (0.6 * math.sin(math.pi * x / 4), 0.6 * math.sin(math.pi * y / 4), 1.0)
            size = math.sqrt(sum(c * c for c in n))
            rows += bytes(round(127.5 * (c / size + 1)) for c in n)
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 64, 64, 8, 2, 0, 0, 0)))
        f.write(chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def main():
    command, shots = os.path.abspath(sys.argv[1]), sys.argv[2]
    os.makedirs(shots, exist_ok=True)
    failures = []

    def check(what, holds, numbers=""):
        print(("ok    " if holds else "FAILED"), what, numbers, flush=True)
        if not holds:
            failures.append(what)

    with tempfile.TemporaryDirectory() as home:
        w = Window(command, home, 91)
        w.do("mousemove", "700", "760")
        first = w.picture()
        check("a picture", len(set(first)) >= 180, f"{len(set(first))} different bytes")
        w.shot(os.path.join(shots, "first.png"))

        w.drag(700, 300, 120, 40)
        turned = w.changed(first)
        check("a drag turns the camera", apart(first, turned) > 1, f"{apart(first, turned):.1f} steps")
        w.key("0")
        check("0 brings the first view back", apart(first, w.changed(turned)) < 0.5)
        w.key("ctrl+z")
        check("Ctrl Z undoes that", apart(turned, w.changed(first)) < 0.5)
        w.key("0")
        first = w.changed(turned)
        w.drag(700, 300, 120, 60, button="3")
        panned = w.changed(first)
        check("a drag with the right button pans", apart(first, panned) > 1, f"{apart(first, panned):.1f} steps")
        w.key("0")
        first = w.changed(panned)
        w.drag(700, 300, 150, 0, key="shift")
        lit = w.changed(first)
        check("a drag with Shift turns the light", apart(first, lit) > 1, f"{apart(first, lit):.1f} steps")
        w.key("0")
        w.changed(lit)
        w.do("mousemove", "700", "300", "click", "4", "click", "4", "mousemove", "700", "760")
        near = w.changed(first)
        check("the wheel goes nearer", apart(first, near) > 1, f"{apart(first, near):.1f} steps")
        w.key("0")
        first = w.changed(near)
        w.key("bracketright")
        w.key("bracketright")
        bright = w.changed(first)
        check("] brightens", sum(bright) > 1.02 * sum(first), f"by {100 * (sum(bright) / sum(first) - 1):.0f} %")
        w.key("0")
        first = w.changed(bright)
        w.key("l")
        sky = w.changed(first)
        check("L takes another light", apart(first, sky) > 2, f"{apart(first, sky):.1f} steps")
        w.shot(os.path.join(shots, "light.png"))
        w.key("m")
        other = w.changed(sky)
        check("M takes another material", apart(sky, other) > 1, f"{apart(sky, other):.1f} steps")
        w.key("ctrl+z")
        w.changed(other)
        w.key("b")
        split = w.changed(sky)
        check("B splits the view", split != sky)
        w.shot(os.path.join(shots, "split.png"))
        at = wipe(w)
        w.drag(at, 500, 150, 0)
        w.changed(split)
        check("a drag moves the wipe", abs(wipe(w) - at - 150) < 8, f"{at} to {wipe(w)}")
        w.drag(wipe(w), 500, -150, 0)
        w.settled()
        w.key("b")
        w.changed(split)
        w.key("f")
        false = w.changed(sky)
        check("F shows false colours", apart(sky, false) > 2, f"{apart(sky, false):.1f} steps")
        w.shot(os.path.join(shots, "false.png"))
        w.key("f")
        w.changed(false)
        before = w.pixels(PANEL)
        w.key("d")
        after = w.changed(before, PANEL)
        check("D turns dark to light", apart(before, after) > 60, f"{apart(before, after):.0f} steps")
        w.shot(os.path.join(shots, "light-theme.png"))
        w.key("s")
        made = os.path.join(home, "steradian-0001.png")
        wrote = w.until(lambda: os.path.exists(made))
        check("S writes a PNG", wrote and open(made, "rb").read(4) == b"\x89PNG")
        w.key("e")
        made = os.path.join(home, "steradian-0001", "scene.toml")
        check("E writes a scene file", w.until(lambda: os.path.exists(made)))
        w.key("h")
        # Its first pass is enough.
        shown = w.until(lambda: apart(sky, w.pixels(PICTURE)) > 2, 120)
        w.shot(os.path.join(shots, "heat.png"))
        check("H shows errors", shown)
        w.key("h")
        w.settled()
        time.sleep(6)  # what was said goes away
        last = w.settled()
        check("it closes cleanly", w.close() == 0)

        w = Window(command, home, 92)
        w.do("mousemove", "700", "760")
        again = w.picture()
        check("it remembers", apart(last, again) < 1, f"{apart(last, again):.2f} steps")
        w.key("t")
        code = w.close()
        check("it closes while it bakes", code == 0, f"exit code {code}")

        w = Window(command, home, 94, ["knot", "-e", "sky:elevation=35", "-b", "ggx:alpha=0.4,f0=1"])
        w.do("mousemove", "700", "760")
        noon = w.picture()
        w.drag(1192, 78, 48, -28)
        moved = w.changed(noon)
        check("a sun moves with its handle", apart(noon, moved) > 1, f"{apart(noon, moved):.1f} steps")
        w.shot(os.path.join(shots, "sun.png"))
        w.key("ctrl+z")
        w.changed(moved)
        for _ in range(8):
            w.key("k")
        late = w.changed(noon)
        check("K makes it later", apart(noon, late) > 1, f"{apart(noon, late):.1f} steps")
        dropped = os.path.join(home, "red.pfm")
        with open(dropped, "wb") as f:
            f.write(b"PF\n8 4\n-1.0\n" + struct.pack("<fff", 1.0, 0.1, 0.1) * 32)
        taken = drop(w.display, w.id, dropped)
        red = w.changed(late)
        share = [sum(red[k::3]) for k in range(3)]
        check("a light dropped onto it is the light", taken and share[0] > 1.5 * share[1], f"{taken}, {share}")
        w.shot(os.path.join(shots, "dropped.png"))

        names = ("bumps.png", "bake.safetensors", "mesh.obj", "measured.binary")
        bumps, bake, mesh, measured = [os.path.join(home, n) for n in names]
        normal_map(bumps)
        subprocess.run([command, "bake", "studio", "-t", "split_sum", "-b", "ggx:alpha=0.6,f0=0.3", "-o", bake],
                       check=True, capture_output=True)
        with open(mesh, "w", encoding="ascii") as f:
            f.write("v 1 0 -1\nv -1 0 -1\nv 0 0 1\nv 0 1.5 0\nf 1 2 3\nf 2 1 4\nf 3 2 4\nf 1 3 4\n")
        subprocess.run([command, "convert", "brdf:ward:alpha=0.3,rd=0.05/0.1/0.3,rs=0.2", "-o", measured],
                       check=True, capture_output=True)
        drops = ("a normal map", bumps), ("a saved bake", bake), ("a mesh", mesh), ("a measured reflectance", measured)
        for what, file in drops:
            taken = drop(w.display, w.id, file)
            now = w.changed(red, seconds=120)
            check(f"{what} dropped onto it is shown", taken and apart(red, now) > 0.5, f"{taken}, {apart(red, now):.1f} steps")
            w.shot(os.path.join(shots, os.path.basename(file) + ".png"))
            red = now
        damaged = os.path.join(home, "damaged.obj")
        with open(damaged, "w", encoding="ascii") as f:
            f.write("v 0 0 zero\nf 1 2 3\n")
        taken = drop(w.display, w.id, damaged)

        def reds():
            line = w.pixels((330, 10, 1270, 50))
            return sum(1 for k in range(0, len(line), 3) if line[k] > 120 and line[k + 1] < 60)

        w.until(lambda: reds() > 500)
        w.shot(os.path.join(shots, "damaged.png"))
        check("a broken mesh is named over the picture", taken and reds() > 500, f"{taken}, {reds()} pixels")
        w.key("r")
        made = os.path.join(home, "steradian-0001.apng")
        start = time.time()
        while not os.path.exists(made) and time.time() - start < 240:
            time.sleep(1)
        check("R writes a turntable", os.path.exists(made) and b"acTL" in open(made, "rb").read(200))
        check("and closes cleanly", w.close() == 0)

        broken = os.path.join(home, "broken.hdr")
        with open(broken, "w", encoding="ascii") as f:
            f.write("#?RADIANCE\nnot an image")
        w = Window(command, home, 93, ["knot", "-e", broken])
        w.settled()
        w.shot(os.path.join(shots, "broken.png"))
        check("a broken file leaves the window open", w.process.poll() is None)
        check("and closes cleanly", w.close() == 0)

        environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")}
        done = subprocess.run([command, "view"], env=environment, capture_output=True, text=True, check=False)
        lines = [line for line in done.stderr.splitlines() if line.startswith("steradian:")]
        check("without a display: one line", done.returncode == 1 and len(lines) == 1 and "display" in lines[0], str(lines))
    sys.exit(1 if failures else 0)


main()
