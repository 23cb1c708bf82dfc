#!/usr/bin/env python3
"""Times this crate's transform beside SHTns and ducc0, on one thread, three channels, in one run: in f64, and
in image precision (f32 sums) against the same f64 times of the peers.

    python3 crates/sphere/benches/peers.py [gl|equirectangular|cube] [band ...]

`cube`: synthesis at the texel centres of a cube map of 256 x 256, errors 2e-3 and 1e-5, against ducc0's
`synthesis_general` in single precision at the same errors.

Installs both libraries from PyPI into a virtual environment under the target folder (SHTns is built from
source and needs the development files of FFTW 3). The peers run out of process, never linked. Rounds
alternate between the programs, and the least time of each counts. Not part of continuous integration.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
VENV = TARGET / "peers"
ROUNDS = 2


def install():
    if not VENV.exists():
        subprocess.run([sys.executable, "-m", "venv", VENV], check=True)
    for package in ["numpy", "ducc0", "shtns"]:
        pip = [VENV / "bin/pip", "install", "-q", package]
        if subprocess.run(pip, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode:
            print(f"{package} does not install here: left out")


def binary():
    build = ["cargo", "bench", "-p", "steradian-sphere", "--bench", "transform", "--no-run"]
    lines = subprocess.run(build, cwd=ROOT, check=True, capture_output=True, text=True).stderr
    return lines.rsplit("(", 1)[1].split(")")[0]


def best(f):
    """Least of several runs, on the processor: other programs' time does not count."""
    least, start, runs = 1e9, time.perf_counter(), 0
    while runs < 3 or time.perf_counter() - start < 0.3:
        t = time.thread_time()
        f()
        least, runs = min(least, time.thread_time() - t), runs + 1
    return least * 1e3


def ducc(grid, band):
    if grid == "cube":
        return ducc_cube(band)
    import ducc0
    import numpy as np

    rows, columns, geometry = (band + 1, 2 * band + 2, "GL") if grid == "gl" else (2 * band + 2, 4 * band + 4, "F1")
    a = np.random.default_rng(1).standard_normal(((band + 1) * (band + 2) // 2, 2)) @ np.array([1, 1j])
    a[: band + 1] = a[: band + 1].real
    a = np.repeat(a[None, None], 3, 0)
    maps = np.zeros((3, 1, rows, columns))

    def synthesis():
        for k in range(3):
            ducc0.sht.synthesis_2d(alm=a[k], map=maps[k], spin=0, lmax=band, geometry=geometry, nthreads=1)

    def analysis():
        for k in range(3):
            ducc0.sht.analysis_2d(map=maps[k], alm=a[k], spin=0, lmax=band, geometry=geometry, nthreads=1)

    return best(synthesis), best(analysis)


def ducc_cube(band):
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
    c = np.random.default_rng(1).standard_normal(((band + 1) * (band + 2) // 2, 2)) @ np.array([1, 1j])
    c[: band + 1] = c[: band + 1].real
    c = c[None].astype(np.complex64)

    def synthesis(epsilon):
        for k in range(3):
            ducc0.sht.synthesis_general(alm=c, loc=loc, spin=0, lmax=band, epsilon=epsilon, nthreads=1)

    return best(lambda: synthesis(2e-3)), best(lambda: synthesis(1e-5))


def shtns(grid, band):
    import numpy as np
    import shtns

    if grid != "gl":
        return None
    result = None
    # Above band 63 the other modes' searches for the quickest variant take minutes on a busy machine.
    for mode in [shtns.sht_gauss, shtns.sht_quick_init][int(band > 63):]:
        sh = shtns.sht(band, norm=shtns.sht_orthonormal, nthreads=1)
        sh.set_grid(band + 1, 2 * band + 2, flags=mode | shtns.SHT_PHI_CONTIGUOUS, polar_opt=1e-10)
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

        pair = best(synthesis), best(analysis)
        result = pair if result is None else tuple(map(min, result, pair))
    return result


def main():
    if len(sys.argv) == 5 and sys.argv[1] == "--time":
        pair = {"ducc0": ducc, "shtns": shtns}[sys.argv[2]](sys.argv[3], int(sys.argv[4]))
        print("ms:", *(pair or ()))
        return
    grid = sys.argv[1] if len(sys.argv) > 1 else "gl"
    bands = [int(b) for b in sys.argv[2:]] or [63, 127, 255, 511, 1023]
    install()
    ours = binary()
    environment = dict(os.environ, RAYON_NUM_THREADS="1", OMP_NUM_THREADS="1")
    print(f"{grid}, 3 channels, 1 thread, least of {ROUNDS} rounds, ms (f64, image: our time / theirs)")
    peers = " ".join(f"{name:>10} {'f64':>6} {'image':>6}" for name in ["SHTns", "ducc0"])
    print(f"{'band':>5} {'':10} {'f64':>10} {'image':>10} {peers}")
    for band in bands:
        times = {name: [1e9, 1e9] for name in ["ours", "image", "shtns", "ducc0"]}
        for _ in range(ROUNDS):
            for name, row in times.items():
                command = {"ours": [ours, grid, band], "image": [ours, grid, "image", band]}.get(
                    name, [VENV / "bin/python", __file__, "--time", name, grid, band])
                run = subprocess.run(list(map(str, command)), env=environment, capture_output=True, text=True)
                words = run.stdout.split()
                words = words[2:4] if command[0] == ours else words[words.index("ms:") + 1:] if "ms:" in words else []
                if run.returncode == 0 and len(words) == 2:
                    times[name] = [min(a, float(b)) for a, b in zip(row, words)]
        for i, what in enumerate(["2e-3", "1e-5"] if grid == "cube" else ["synthesis", "analysis"]):
            ours_ms, image_ms = times["ours"][i], times["image"][i]
            cells = [f"{ours_ms:>10.4g} {image_ms:>10.4g}"]
            for name in ["shtns", "ducc0"]:
                t = times[name][i]
                cells.append(f"{t:>10.4g} {ours_ms / t:>6.2f} {image_ms / t:>6.2f}" if t < 1e9 else f"{'–':>10} {'':>13}")
            print(f"{band:>5} {what:10}", *cells, flush=True)


if __name__ == "__main__":
    main()
