#!/usr/bin/env python3
"""Any-hit rays through Embree, the same that crates/scene/benches/rays.rs casts, for comparison.

    pip install embreex
    STERADIAN_DUMP=rays.bin cargo bench -p steradian-scene --bench rays
    python3 scripts/embree-rays.py crates/scene/rays.bin

Single rays (rtcOccluded1), one thread, best of five, in processor time: other work on the machine does not count.
"""

import sys
import time

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene


def main() -> None:
    with open(sys.argv[1], "rb") as f:
        vertices, triangles, rays = np.frombuffer(f.read(12), "<u4")
        positions = np.frombuffer(f.read(12 * int(vertices)), "<f4").reshape(-1, 3)
        indices = np.frombuffer(f.read(12 * int(triangles)), "<u4").reshape(-1, 3)
        both = np.frombuffer(f.read(24 * int(rays)), "<f4").reshape(-1, 2, 3)
    origins, directions = (np.ascontiguousarray(both[:, k]) for k in (0, 1))
    scene = EmbreeScene()
    TriangleMesh(scene, np.array(positions), np.array(indices, dtype=np.int32))
    scene.run(origins[:1], directions[:1], query="OCCLUDED")
    best = float("inf")
    for _ in range(5):
        start = time.process_time()
        hits = scene.run(origins, directions, query="OCCLUDED")
        best = min(best, time.process_time() - start)
    # What is hit gets another number than a miss, which is -1.
    share = float(np.mean(np.asarray(hits) != -1))
    print(f"Embree, single rays  {rays / best / 1e6:7.2f} Mray/s  occluded {share:.5f}")


if __name__ == "__main__":
    main()
