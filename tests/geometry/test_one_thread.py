import os
import subprocess
import sys

import numpy as np

from lubdub.geometry.one_thread import one_threaded_open3d
from lubdub.geometry.rigid import OverlaySettings, feature_cloud, icp, ransac_start
from lubdub.library.load import load_library

LOADS = """
import os
from lubdub.geometry.one_thread import one_threaded_open3d
before = os.sched_getaffinity(0)
o3d = one_threaded_open3d()
assert os.sched_getaffinity(0) == before, "the process stays bound"
import numpy as np
cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.random.default_rng(1).random((50_000, 3))))
cloud.estimate_normals()
o3d.pipelines.registration.registration_icp(cloud, cloud, 0.01)
print(len(os.listdir("/proc/self/task")))
"""


def test_open3d_works_on_one_thread_and_the_process_keeps_its_processors() -> None:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "OMP_NUM_THREADS": "2"}
    end = subprocess.run([sys.executable, "-c", LOADS], env=environment, capture_output=True, text=True, check=False)
    assert (end.returncode, end.stdout.strip()) == (0, "1"), end.stderr


def test_it_is_the_usual_module() -> None:
    points = np.random.default_rng(2).random((10, 3))
    open3d = one_threaded_open3d()
    assert np.array_equal(np.asarray(open3d.utility.Vector3dVector(points)), points)


def test_the_same_two_bodies_are_laid_over_each_other_in_the_same_way_every_time() -> None:
    settings = OverlaySettings()
    clouds = [
        feature_cloud(one.surface.vertices, one.surface.normals, 20.0, settings)
        for one in load_library().references[:2]
    ]
    starts = [ransac_start(*clouds, settings) for _ in range(4)]
    assert len({start.matrix().tobytes() for start in starts}) == 1
    assert len({icp(*clouds, starts[0], settings).matrix().tobytes() for _ in range(4)}) == 1
