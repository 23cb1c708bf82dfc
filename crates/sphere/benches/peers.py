#!/usr/bin/env python3
"""Times this crate's transform beside SHTns and ducc0, three channels, in one run: in f64, and in image precision
(f32 sums) against the same f64 times of the peers.

    python3 crates/sphere/benches/peers.py [gl|equirectangular|cube|rotate] [threads=N] [rounds=N] [isa=avx2] [band ...]

`cube`: synthesis at the texel centres of a cube map of 256 x 256, errors 2e-3 and 1e-5, against ducc0's
`synthesis_general` in single precision at the same errors. `rotate`: turns of three sets of coefficients and of one,
against ducc0's `rotate_alm`.

`isa=avx2` (or STERADIAN_ISA=avx2) pins our instruction set and builds SHTns without AVX-512, so that like is compared
with like: SHTns is otherwise compiled for all that the machine has. ducc0 and FFTW choose for themselves as they run.

Installs both libraries from PyPI into a virtual environment under the target folder, or in STERADIAN_PEERS (with -avx2
appended for isa=avx2; SHTns is built from source and needs the development files of FFTW 3); STERADIAN_BENCH names a
benchmark that is built.
The peers run out of process, never linked. All programs of a band stay alive and take turns of a fraction of a
second; the least time of each counts: on one thread that of the processor, so that other programs' time does not,
on several the clock's. Not part of continuous integration.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
ISA = next((w[4:] for w in sys.argv if w.startswith("isa=")), os.environ.get("STERADIAN_ISA", ""))
VENV = Path(os.environ.get("STERADIAN_PEERS", str(TARGET / "peers")) + ("-avx2" if ISA == "avx2" else ""))
TURN = 0.15
SAMPLE = 0.002


def install():
    if not VENV.exists():
        subprocess.run([sys.executable, "-m", "venv", VENV], check=True)
    environment = dict(os.environ)
    fresh = []
    if ISA == "avx2":
        # After -march=native, which SHTns adds; a wheel that pip kept may be of the whole machine.
        environment["CFLAGS"], fresh = "-mno-avx512f", ["--no-cache-dir"]
    for package in ["numpy", "ducc0", "shtns"]:
        pip = [VENV / "bin/python", "-m", "pip", "install", "-q", *fresh, package]
        if subprocess.run(pip, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode:
            print(f"{package} does not install here: left out")


def binary():
    build = ["cargo", "bench", "-p", "steradian-sphere", "--bench", "transform", "--no-run"]
    lines = subprocess.run(build, cwd=ROOT, check=True, capture_output=True, text=True).stderr
    return lines.rsplit("(", 1)[1].split(")")[0]


def best(f, clock):
    """Least of several samples, in ms; short runs are repeated within one, since clocks are not finer."""
    least, start, samples, runs = 1e9, time.perf_counter(), 0, 1
    while samples < 2 or time.perf_counter() - start < TURN:
        wall, t = time.perf_counter(), clock()
        for _ in range(runs):
            f()
        t = clock() - t
        if time.perf_counter() - wall < SAMPLE:
            runs *= 2
        else:
            least, samples = min(least, t / runs), samples + 1
    return least * 1e3


def coefficients(np, band):
    a = np.random.default_rng(1).standard_normal(((band + 1) * (band + 2) // 2, 2)) @ np.array([1, 1j])
    a[: band + 1] = a[: band + 1].real
    return a


def ducc(grid, band, threads):
    if grid == "cube":
        return ducc_cube(band, threads)
    if grid == "rotate":
        return ducc_rotate(band, threads)
    import ducc0
    import numpy as np

    rows, columns, geometry = (band + 1, 2 * band + 2, "GL") if grid == "gl" else (2 * band + 2, 4 * band + 4, "F1")
    a = np.repeat(coefficients(np, band)[None, None], 3, 0)
    maps = np.zeros((3, 1, rows, columns))
    how = {"spin": 0, "lmax": band, "geometry": geometry, "nthreads": threads}

    def synthesis():
        for k in range(3):
            ducc0.sht.synthesis_2d(alm=a[k], map=maps[k], **how)

    def analysis():
        for k in range(3):
            ducc0.sht.analysis_2d(map=maps[k], alm=a[k], **how)

    return [(synthesis, analysis)]


def ducc_cube(band, threads):
    import ducc0
    import numpy as np

    a = (np.arange(256) + 0.5) / 128 - 1
    u, v = np.meshgrid(a, a)
    o = np.ones_like(u)
    faces = [(o, -v, -u), (-o, -v, u), (u, o, v), (u, -o, -v), (u, -v, o), (-u, -v, -o)]
    d = np.concatenate([np.stack(f, -1).reshape(-1, 3) for f in faces])
    d /= np.linalg.norm(d, axis=1)[:, None]
    # The pole of the coefficients is y.
    loc = np.stack([np.arccos(d[:, 1]), np.arctan2(d[:, 2], d[:, 0]) % (2 * np.pi)], -1)
    c = coefficients(np, band)[None].astype(np.complex64)

    def synthesis(epsilon):
        for k in range(3):
            ducc0.sht.synthesis_general(alm=c, loc=loc, spin=0, lmax=band, epsilon=epsilon, nthreads=threads)

    return [(lambda: synthesis(2e-3), lambda: synthesis(1e-5))]


def ducc_rotate(band, threads):
    import ducc0
    import numpy as np

    a = coefficients(np, band)

    def turn(times):
        for _ in range(times):
            ducc0.sht.rotate_alm(a, band, 0.3, 0.7, 0.2, nthreads=threads)

    return [(lambda: turn(3), lambda: turn(1))]


def shtns(grid, band, threads):
    import numpy as np
    import shtns

    if grid != "gl":
        return []
    # Above band 255 the searches of sht_gauss for the quickest variant take minutes.
    return [shtns_pair(np, shtns, mode, band, threads)
            for mode in [shtns.sht_gauss, shtns.sht_quick_init][int(band > 255):]]


def shtns_pair(np, shtns, mode, band, threads):
    sh = shtns.sht(band, norm=shtns.sht_orthonormal, nthreads=threads)
    # With AVX-512 it takes no fewer rows than 32.
    sh.set_grid(max(band + 1, 32), 2 * band + 2, flags=mode | shtns.SHT_PHI_CONTIGUOUS, polar_opt=1e-10)
    a = [sh.spec_array() for _ in range(3)]
    rng = np.random.default_rng(1)
    for v in a:
        v[:] = rng.standard_normal(sh.nlm)
    maps = [sh.spat_array() for _ in range(3)]

    def synthesis():
        for k in range(3):
            sh.SH_to_spat(a[k], maps[k])

    def analysis():
        for k in range(3):
            sh.spat_to_SH(maps[k], a[k])

    return synthesis, analysis


def serve(name, grid, band, threads):
    """Times on request, one line each."""
    variants = {"ducc0": ducc, "shtns": shtns}[name](grid, band, threads)
    clock = time.thread_time if threads == 1 else time.perf_counter
    if not variants:
        return
    print("ready", flush=True)
    for _ in sys.stdin:
        times = [[best(f, clock) for f in pair] for pair in variants]
        print(*(min(t) for t in zip(*times)), flush=True)


class Worker:
    def __init__(self, command, threads):
        environment = dict(os.environ, RAYON_NUM_THREADS=str(threads), OMP_NUM_THREADS=str(threads))
        if ISA:
            environment["STERADIAN_ISA"] = ISA
        self.least = [1e9, 1e9]
        self.process = subprocess.Popen(list(map(str, command)), env=environment, text=True, stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.alive = any(line == "ready\n" for line in iter(self.process.stdout.readline, ""))

    def turn(self):
        if self.alive:
            print(TURN, file=self.process.stdin, flush=True)
            words = self.process.stdout.readline().split()
            self.alive = len(words) == 2
            self.least = [min(a, float(b)) for a, b in zip(self.least, words)]

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def main():
    words = sys.argv[1:]
    if words and words[0] == "--serve":
        return serve(words[1], words[2], *map(int, words[3:]))
    options = dict(w.split("=") for w in words if "=" in w)
    threads, rounds = int(options.get("threads", 1)), int(options.get("rounds", 8))
    words = [w for w in words if "=" not in w]
    grid = words[0] if words else "gl"
    bands = [int(b) for b in words[1:]] or [15, 31, 63, 127, 255, 511, 1023]
    install()
    ours = os.environ.get("STERADIAN_BENCH") or binary()
    print(f"{grid}, 3 channels, {ISA or 'widest registers'}, {threads} thread(s), least of {rounds} turns, ms (f64, image: our time / theirs)")
    peers = " ".join(f"{name:>10} {'f64':>6} {'image':>6}" for name in ["SHTns", "ducc0"])
    print(f"{'band':>5} {'':10} {'f64':>10} {'image':>10} {peers}")
    for band in bands:
        peer = [VENV / "bin/python", __file__, "--serve"]
        workers = {
            "ours": [ours, grid, "serve", band],
            "image": [ours, grid, "image", "serve", band],
            "shtns": [*peer, "shtns", grid, band, threads],
            "ducc0": [*peer, "ducc0", grid, band, threads],
        }
        workers = {name: Worker(command, threads) for name, command in workers.items()}
        for _ in range(rounds):
            for worker in workers.values():
                worker.turn()
        names = {"cube": ["2e-3", "1e-5"], "rotate": ["three", "one"]}
        for i, what in enumerate(names.get(grid, ["synthesis", "analysis"])):
            ours_ms, image_ms = workers["ours"].least[i], workers["image"].least[i]
            cells = [f"{ours_ms:>10.4g} {image_ms:>10.4g}"]
            for name in ["shtns", "ducc0"]:
                t = workers[name].least[i]
                cells.append(f"{t:>10.4g} {ours_ms / t:>6.2f} {image_ms / t:>6.2f}" if t < 1e9 else f"{'–':>10} {'':>13}")
            print(f"{band:>5} {what:10}", *cells, flush=True)
        for worker in workers.values():
            worker.end()


if __name__ == "__main__":
    main()
