#!/usr/bin/env python3
"""Other programs on what `roxel` writes, where they are installed: COLMAP (Debian's package colmap) and the Khronos glTF validator (npm's
package gltf-validator, found by NODE_PATH).

    programs_test.py ROXEL [unittest arguments, e.g. Colmap]
"""

import json
import shutil
import struct
import subprocess
import unittest

import program
from mesh_test import SMALL, bounds_of

VALIDATE = """
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[1]));
require('gltf-validator').validateBytes(bytes).then(report => console.log(JSON.stringify(report.issues)));
"""


def has_validator():
    return shutil.which("node") and subprocess.run(["node", "-e", "require('gltf-validator')"], capture_output=True).returncode == 0


class ProgramCase(program.Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.photographs, cls.run_folder = cls.folder / "photographs", cls.folder / "run"
        cls.synth(cls.photographs, 16, "128x96")
        done = program.run("reconstruct", cls.photographs, "-o", cls.run_folder, *SMALL, "--export", "colmap", "--quiet")
        assert done.returncode == 0, done.stderr


@unittest.skipUnless(shutil.which("colmap"), "colmap is not installed")
class Colmap(ProgramCase):
    def test_stereo_fusion_makes_points_of_the_workspace(self):
        points = self.folder / "fused.ply"
        done = subprocess.run(["colmap", "stereo_fusion", "--workspace_path", self.run_folder / "colmap", "--workspace_format", "COLMAP",
                               "--input_type", "geometric", "--output_path", points, "--StereoFusion.max_reproj_error", "1",
                               "--StereoFusion.min_num_pixels", "2"],
                              capture_output=True, text=True, timeout=200, env={"QT_QPA_PLATFORM": "offscreen", "HOME": str(self.folder)})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        head, _, rows = points.read_bytes().partition(b"end_header\n")
        count = int(next(line for line in head.decode().splitlines() if line.startswith("element vertex")).split()[2])
        self.assertGreater(count, 500)
        # They lie where the mesh of the same depth maps does: half the box that its points fill, and no more than twice.
        _, _, box = bounds_of(self.run_folder / "mesh.ply")
        size = len(rows) // count
        for axis, (low, high) in enumerate(box):
            middle = sorted(struct.unpack_from("<f", rows, size * i + 4 * axis)[0] for i in range(count))
            span = middle[int(0.98 * count)] - middle[int(0.02 * count)]
            self.assertTrue(0.5 * (high - low) < span < 2 * (high - low), (axis, span, low, high))


@unittest.skipUnless(has_validator(), "the glTF validator is not installed")
class GltfValidator(ProgramCase):
    def test_the_textured_mesh_is_valid(self):
        done = subprocess.run(["node", "-e", VALIDATE, str(self.run_folder / "mesh.glb")], capture_output=True, text=True, timeout=100)
        self.assertEqual(done.returncode, 0, done.stderr)
        issues = json.loads(done.stdout)
        self.assertEqual((issues["numErrors"], issues["numWarnings"]), (0, 0), issues["messages"][:3])


if __name__ == "__main__":
    program.main()
