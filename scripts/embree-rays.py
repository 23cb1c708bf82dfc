#!/usr/bin/env python3
"""Any-hit rays through Embree, the same that crates/scene/benches/rays.rs casts, for comparison.

    pip install embreex
    STERADIAN_DUMP=. cargo bench -p steradian-scene --bench rays
    python3 scripts/embree-rays.py crates/scene/bunny.rays crates/scene/knot.rays

Single rays (rtcOccluded1) and packets of 16 (rtcOccluded16, incoherent, as they lie in the file), one thread, best of
five, in processor time: other work on the machine does not count. The package brings Embree's library; the loop over the
rays is compiled by `cc`, so that no interpreter stands in between.
"""

import ctypes
import glob
import os
import subprocess
import sys
import tempfile
import time

import embreex
import numpy as np

# RTCRay and RTCRay16 of Embree 4: origin, tnear, direction, time, tfar, mask, id, flags. A ray that is occluded has a
# tfar of minus infinity afterwards.
LOOPS = r"""
#include <math.h>
#include <string.h>

typedef struct { float org[3], tnear, dir[3], time, tfar; unsigned mask, id, flags; } __attribute__((aligned(16))) Ray;
typedef struct {
  float org[3][16], tnear[16], dir[3][16], time[16], tfar[16];
  unsigned mask[16], id[16], flags[16];
} __attribute__((aligned(64))) Ray16;

int single(void (*occluded)(void *, Ray *, void *), void *scene, const float *rays, int n) {
  int hits = 0;
  for (int i = 0; i < n; i++) {
    const float *r = rays + 6 * i;
    Ray ray = {{r[0], r[1], r[2]}, 0, {r[3], r[4], r[5]}, 0, INFINITY, ~0u, 0, 0};
    occluded(scene, &ray, 0);
    hits += ray.tfar < 0;
  }
  return hits;
}

int packets(void (*occluded)(const int *, void *, Ray16 *, void *), void *scene, const float *rays, int n) {
  int hits = 0;
  int valid[16] __attribute__((aligned(64)));
  Ray16 ray;
  memset(&ray, 0, sizeof ray);
  for (int i = 0; i < n; i += 16) {
    for (int k = 0; k < 16; k++) {
      const float *r = rays + 6 * (i + k < n ? i + k : i);
      valid[k] = i + k < n ? -1 : 0;
      for (int c = 0; c < 3; c++) ray.org[c][k] = r[c], ray.dir[c][k] = r[3 + c];
      ray.tfar[k] = INFINITY;
      ray.mask[k] = ~0u;
    }
    occluded(valid, scene, &ray, 0);
    for (int k = 0; k < 16; k++) hits += valid[k] && ray.tfar[k] < 0;
  }
  return hits;
}
"""
TRIANGLES, INDICES, VERTICES, UINT3, FLOAT3 = 0, 0, 1, 0x5003, 0x9003


def embree() -> ctypes.CDLL:
    beside = os.path.join(os.path.dirname(embreex.__file__), "..", "embreex.libs")
    for tbb in glob.glob(os.path.join(beside, "libtbb-*")):
        ctypes.CDLL(tbb, mode=ctypes.RTLD_GLOBAL)
    [path] = glob.glob(os.path.join(beside, "libembree4-*"))
    lib = ctypes.CDLL(path)
    for name in ["rtcNewDevice", "rtcNewScene", "rtcNewGeometry", "rtcSetNewGeometryBuffer"]:
        getattr(lib, name).restype = ctypes.c_void_p
    return lib


def built(lib: ctypes.CDLL, positions: np.ndarray, indices: np.ndarray) -> ctypes.c_void_p:
    """A scene of one mesh."""
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    device = pointer(lib.rtcNewDevice(None))
    scene = pointer(lib.rtcNewScene(device))
    geometry = pointer(lib.rtcNewGeometry(device, TRIANGLES))
    for kind, form, data in [(INDICES, UINT3, indices), (VERTICES, FLOAT3, positions)]:
        to = lib.rtcSetNewGeometryBuffer(geometry, kind, 0, form, size(12), size(len(data)))
        ctypes.memmove(to, data.ctypes.data, data.nbytes)
    lib.rtcCommitGeometry(geometry)
    lib.rtcAttachGeometry(scene, geometry)
    lib.rtcCommitScene(scene)
    return scene


def loops() -> ctypes.CDLL:
    folder = tempfile.mkdtemp()
    source, out = os.path.join(folder, "loops.c"), os.path.join(folder, "loops.so")
    with open(source, "w") as f:
        f.write(LOOPS)
    subprocess.run(["cc", "-O3", "-march=native", "-shared", "-fPIC", "-o", out, source], check=True)
    return ctypes.CDLL(out)


def main() -> None:
    lib, ours = embree(), loops()
    for path in sys.argv[1:]:
        with open(path, "rb") as f:
            vertices, triangles, count = (int(n) for n in np.frombuffer(f.read(12), "<u4"))
            positions = np.frombuffer(f.read(12 * vertices), "<f4").reshape(-1, 3)
            indices = np.frombuffer(f.read(12 * triangles), "<u4").reshape(-1, 3)
            rays = np.frombuffer(f.read(24 * count), "<f4").copy()
        scene = built(lib, positions, indices)
        for name, loop, occluded in [
            ("single rays", ours.single, lib.rtcOccluded1),
            ("packets of 16", ours.packets, lib.rtcOccluded16),
        ]:
            best = float("inf")
            for _ in range(5):
                start = time.process_time()
                hits = loop(occluded, scene, rays.ctypes.data_as(ctypes.c_void_p), count)
                best = min(best, time.process_time() - start)
            rate = count / best / 1e6
            print(f"{os.path.basename(path)}: Embree, {name:14} {rate:7.2f} Mray/s  occluded {hits / count:.5f}")


if __name__ == "__main__":
    main()
