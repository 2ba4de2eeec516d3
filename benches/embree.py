"""The nearest hits that benches/embree.rs asks for, by Embree: CPU seconds with its default flags and
with the robust one, and how many rays hit. What the wrapper costs for each ray is taken off: measured
on a triangle that no ray comes near, it is too much by what Embree needs to see that."""

import sys
import time
from pathlib import Path

try:
    import numpy as np
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ImportError as error:
    sys.exit(f"skipped: {error} (pip install embreex numpy; PYTHON names another interpreter)")


def read(path, shape):
    return np.fromfile(path, dtype="<f4").reshape(shape)


def scene_of(triangles, robust):
    scene = EmbreeScene(robust=robust)
    TriangleMesh(scene, triangles)
    return scene


def seconds(scene):
    start = time.process_time()
    hits = scene.run(origins, directions)
    return time.process_time() - start, int((hits >= 0).sum())


folder = Path(sys.argv[1])
triangles = read(folder / "triangles", (-1, 3, 3))
rays = read(folder / "rays", (-1, 2, 3))
origins, directions = (np.ascontiguousarray(rays[:, i]) for i in (0, 1))
scenes = [scene_of(triangles, robust) for robust in (False, True)]
far = scene_of(np.float32([[[1e6, 1e6, 1e6], [1e6, 1e6, 1e6 + 1], [1e6, 1e6 + 1, 1e6]]]), False)
for _ in sys.stdin:
    wrapper, _ = seconds(far)
    (default, hits), (robust, _) = (seconds(scene) for scene in scenes)
    print(default - wrapper, robust - wrapper, hits, flush=True)
