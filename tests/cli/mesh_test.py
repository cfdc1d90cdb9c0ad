#!/usr/bin/env python3
"""Tests of `roxel mesh` and of the mesh stage of `roxel reconstruct`, on a small synthetic data set.

    mesh_test.py ROXEL [unittest arguments]
"""

import collections
import json
import os
import shutil
import struct
import unittest

import program
from options_test import MESH
from program import Case, digest, files_below, run

MESH_FILES = ["mesh.glb", "mesh.mtl", "mesh.obj", "mesh.ply", "mesh.png", "mesh_turntable.jpg", "mesh_views.png"]
SMALL = ["--resolution", "40", "--levels", "2", "--passes", "4", "--no-render", "--no-report"]
PLAIN = [*SMALL, "--no-bp", "--no-refine"]  # where nobody looks at how good the depth maps are

# Each option of the surface: what is asked for besides, a value that must change the result, and where it shows.
CHANGES = {
    "colors": ([], ["--colors", "image"], "mesh.ply"),
    "faces": ([], ["--faces", "500"], "mesh.ply"),
    "hole-size": ([], ["--hole-size", "0"], "mesh.ply"),
    "level-seams": ([], ["--no-level-seams"], "mesh.png"),
    "mesh-band": ([], ["--mesh-band", "2"], "mesh.ply"),
    "mesh-error": ([], ["--mesh-error", "1"], "mesh.ply"),
    "mesh-smooth": ([], ["--mesh-smooth", "3"], "mesh.ply"),
    "mesh-voxel-size": ([], ["--mesh-voxel-size", "0.15"], "mesh.ply"),
    "min-views": ([], ["--min-views", "4"], "mesh.ply"),
    "seam-cost": ([], ["--seam-cost", "0"], "mesh.png"),
    "smallest-part": (["--min-views", "1"], ["--smallest-part", "0"], "mesh.ply"),
    "texture": ([], ["--texture", "jpeg"], "mesh.glb"),
    "texture-size": ([], ["--texture-size", "200"], "mesh.png"),
    "transient": ([], ["--transient", "0.01"], "mesh.png"),
}


def bounds_of(ply):
    """Number of points and triangles, and the box, of a mesh.ply with float coordinates and colours."""
    data = ply.read_bytes()
    head, _, rows = data.partition(b"end_header\n")
    count = {line.split()[1]: int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")}
    points = [struct.unpack_from("<3f", rows, 27 * i) for i in range(count["vertex"])]
    return count["vertex"], count["face"], [(min(a), max(a)) for a in zip(*points)]


def directed_edges(ply):
    """Of a mesh.ply: how often each edge is run through from one point to another."""
    points, triangles, _ = bounds_of(ply)
    _, _, rows = ply.read_bytes().partition(b"end_header\n")
    edges = collections.Counter()
    for corners in struct.iter_unpack("<B3i", rows[27 * points : 27 * points + 13 * triangles]):
        a, b, c = corners[1:]
        edges.update([(a, b), (b, c), (c, a)])
    return edges


class Mesh(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.photographs = cls.folder / "photographs"
        cls.synth(cls.photographs, 12, "96x72")
        cls.run_folder = cls.folder / "run"
        done = run("reconstruct", cls.photographs, "-o", cls.run_folder, *SMALL, "--report", "--json")
        assert done.returncode == 0, done.stderr
        cls.summary = json.loads(done.stdout)

    def mesh(self, name, *arguments):
        out = self.folder / name
        self.succeed("mesh", self.run_folder, "-o", out, *arguments, "--quiet")
        return out

    def test_reconstruct_makes_it_unless_told_not_to(self):
        self.assertEqual([f for f in files_below(self.run_folder) if f.startswith("mesh")], MESH_FILES)
        mesh = self.summary["mesh"]
        points, triangles, box = bounds_of(self.run_folder / "mesh.ply")
        self.assertEqual((mesh["points"], mesh["triangles"]), (points, triangles))
        self.assertGreater(triangles, 1000)
        for low, high in box:
            self.assertTrue(-2 < low < high < 2.5, box)
        self.assertGreater(mesh["texture"]["charts"], 4)
        self.assertLess(mesh["texture"]["seam_rms"], mesh["texture"]["seam_rms_before"])
        self.assertIn("mesh", [stage["name"] for stage in self.summary["stages"]])

    @unittest.skipUnless(os.access("/proc/self/clear_refs", os.W_OK), "the system's mark of memory cannot start anew")
    def test_each_stage_has_a_peak_of_its_own(self):
        mesh = self.summary["mesh"]["stages"]
        stages = {stage["name"]: stage["peak_memory_bytes"] for stage in self.summary["stages"]}
        parts = [part["peak_memory_bytes"] for part in mesh]
        levels = [level["peak_memory_bytes"] for level in self.summary["levels"]]
        for peak in [*stages.values(), *parts, *levels]:
            self.assertGreater(peak, 1e6)
        self.assertEqual(self.summary["peak_memory_bytes"], max([*stages.values(), *levels]))
        self.assertAlmostEqual(stages["mesh"], max(parts), delta=1e6)  # a page or two come after the last part
        # Not the largest so far: of those that follow one another, some hold less than one before.
        for peaks in (list(stages.values()), parts):
            self.assertTrue(any(after < before for before, after in zip(peaks, peaks[1:])), peaks)

    def test_no_edge_has_more_than_two_triangles(self):
        for folder in (self.run_folder, self.mesh("whole", "--mesh-error", "0", "--texture", "none")):
            edges = directed_edges(folder / "mesh.ply")
            self.assertEqual(max(edges.values()), 1)
            self.assertGreater(sum((b, a) in edges for a, b in edges), 0.9 * len(edges))

    def test_the_command_does_what_the_stage_does(self):
        again = self.mesh("again", "--threads", 1)
        for name in MESH_FILES:
            self.assertEqual(digest(again / name), digest(self.run_folder / name), name)
        figures = json.loads((again / "mesh.json").read_text())
        self.assertEqual(figures["triangles"], self.summary["mesh"]["triangles"])

    def test_the_run_s_own_mesh_is_replaced_as_a_whole(self):
        copy = self.folder / "copy"
        shutil.copytree(self.run_folder, copy)
        self.succeed("mesh", copy, "--texture", "none", "--no-mesh-pictures", "--faces", "600", "--quiet")
        self.assertEqual([f for f in files_below(copy) if f.startswith("mesh")], ["mesh.ply"])
        summary = json.loads((copy / "summary.json").read_text())
        self.assertLessEqual(summary["mesh"]["triangles"], 600)
        self.assertEqual(summary["passes"], self.summary["passes"])

    def test_every_option_changes_something(self):
        self.assertEqual(set(CHANGES) | {"mesh", "mesh-pictures"}, MESH)
        known = {(): self.run_folder}
        for option, (base, change, name) in CHANGES.items():
            with self.subTest(option):
                key = tuple(base)
                if key not in known:
                    known[key] = self.mesh("base" + "".join(base), *base, "--no-mesh-pictures")
                changed = self.mesh("changed", *base, *change, "--no-mesh-pictures")
                self.assertNotEqual(digest(known[key] / name), digest(changed / name))

    def test_failures_leave_the_earlier_mesh(self):
        before = {f: digest(self.run_folder / f) for f in files_below(self.run_folder)}
        table = [("no surface that 50 views agree on", ["--min-views", "50"]),
                 ("--faces: ", ["--faces", "4"]),
                 ("--mesh-voxel-size: found 0.0005, expected at least", ["--mesh-voxel-size", "0.0005"]),
                 ("the surface's lattice of voxels of 0.0", ["--memory", "0.001"]),
                 ("nothing-here", ["--dataset", self.folder / "nothing-here"])]
        for message, arguments in table:
            with self.subTest(message):
                self.expect_error(2, message, "mesh", self.run_folder, *arguments, "--quiet")
        self.expect_error(1, "cannot be made", "mesh", self.run_folder, "-o", "/proc/roxel", "--quiet")
        self.expect_error(2, "a folder that is read", "mesh", self.run_folder, "-o", self.run_folder)
        largest = max((self.run_folder / name).stat().st_size for name in MESH_FILES)
        for most_bytes in (20000, largest - 10):
            with self.subTest(most_bytes):
                full = program.run_on_a_full_disc("mesh", self.run_folder, "--quiet", most_bytes=most_bytes)
                self.assertEqual(full.returncode, 1, full.stderr)
                self.assertRegex(full.stderr, "mesh.*(cannot write|writing failed)")
        self.assertEqual({f: digest(self.run_folder / f) for f in files_below(self.run_folder)}, before)

    def test_reconstruct_refuses_what_no_mesh_can_be_made_with(self):
        again = self.folder / "refused"
        shutil.copytree(self.run_folder, again)
        before = {f: digest(again / f) for f in files_below(again)}
        table = [("--faces: ", ["--faces", "4"]), ("--mesh-voxel-size: ", ["--mesh-voxel-size", "0.0005"])]
        for message, arguments in table:
            with self.subTest(message):
                self.expect_error(2, message, "reconstruct", self.photographs, "-o", again, *PLAIN, *arguments, "--quiet")
                self.assertEqual({f: digest(again / f) for f in before}, before)
        self.succeed("reconstruct", self.photographs, "-o", again, *PLAIN, "--faces", "600", "--resume", "--quiet")
        summary = json.loads((again / "summary.json").read_text())
        self.assertTrue(any(note.startswith("resumed after") for note in summary["notes"]), summary["notes"])
        self.assertLessEqual(summary["mesh"]["triangles"], 600)

    def test_too_fine_a_mesh_is_refused_before_the_passes(self):
        out = self.folder / "fine"
        arguments = ["reconstruct", self.photographs, "-o", out, *PLAIN, "--mesh-voxel-size", "0.0005"]
        said = self.expect_error(2, "--mesh-voxel-size: found 0.0005, expected at least", *arguments, "--verbose").stderr
        self.assertNotIn("pass 1/", said)
        self.assertFalse(out.exists())
        for off in ("--no-mesh", "--no-depth"):
            self.succeed(*arguments, off, "--passes", "1", "--quiet")

    def test_memory_changes_no_mesh(self):
        tight = self.mesh("tight", "--no-mesh-pictures", "--memory", "0.5")
        self.assertEqual(digest(self.run_folder / "mesh.ply"), digest(tight / "mesh.ply"))

    def test_a_new_run_whose_mesh_is_refused_can_be_given_another(self):
        out = self.folder / "first"
        arguments = ["reconstruct", self.photographs, "-o", out, *PLAIN, "--faces", "4", "--no-checkpoints", "--quiet"]
        self.expect_error(2, "--faces: ", *arguments)
        summary = json.loads((out / "summary.json").read_text())
        self.assertIsNone(summary["mesh"])
        self.assertTrue(any(note.startswith("no mesh: ") for note in summary["notes"]))
        self.succeed("mesh", out, "--faces", "600", "--quiet")
        self.assertLessEqual(json.loads((out / "summary.json").read_text())["mesh"]["triangles"], 600)

    def test_a_run_whose_views_agree_on_nothing_says_so_and_has_the_rest(self):
        out = self.folder / "none"
        said = self.succeed("reconstruct", self.photographs, "-o", out, *PLAIN, "--min-views", "50").stderr
        self.assertIn("no mesh: ", said)
        self.assertIn("no surface that 50 views agree on", said)
        summary = json.loads((out / "summary.json").read_text())
        self.assertIsNone(summary["mesh"])
        self.assertTrue(any("no surface that 50 views agree on" in note for note in summary["notes"]))
        self.assertEqual([f for f in files_below(out) if f.startswith("mesh")], [])
        self.assertTrue((out / "volume.vdb").is_file() and (out / "depth/000.exr").is_file())

    def test_a_run_without_depth_has_no_mesh(self):
        bare = self.folder / "bare"
        self.succeed("reconstruct", self.photographs, "-o", bare, *SMALL, "--no-depth", "--quiet")
        self.assertIsNone(json.loads((bare / "summary.json").read_text())["mesh"])
        self.expect_error(2, "no depth/NAME.exr", "mesh", bare, "--quiet")

    def test_a_depth_map_of_another_size_is_named(self):
        copy = self.folder / "mixed"
        shutil.copytree(self.run_folder, copy)
        small, _ = self.reconstruct("small")
        shutil.copy(small / "depth/000.exr", copy / "depth/000.exr")
        self.expect_error(2, "000.exr: found 64 x 48 pixels, expected 96 x 72", "mesh", copy, "--quiet")

    def test_eval_measures_it_where_there_is_a_true_surface(self):
        truth = self.folder / "truth"
        truth.mkdir()
        shutil.copy(self.run_folder / "mesh.ply", truth / "mesh.ply")
        found = json.loads(self.succeed("eval", self.run_folder, "--truth", truth, "--samples", 20000, "--json").stdout)["surfaces"][-1]
        self.assertEqual(found["name"], "mesh")
        self.assertGreater(found["within"][0]["f_score"], 0.999)

    def test_the_report_shows_it(self):
        out = self.folder / "shown"
        shutil.copytree(self.run_folder, out)
        page = (out / "report.html").read_text()
        self.assertIn("<h2>Surface</h2>", page)
        self.assertIn('class="turntable"', page)
        self.assertIn("textured", page)
        self.succeed("mesh", out, "--texture", "none", "--faces", "600", "--quiet")
        again = (out / "report.html").read_text()
        triangles = json.loads((out / "summary.json").read_text())["mesh"]["triangles"]
        self.assertIn(f"<td>triangles</td><td>{triangles}</td>", again)
        self.assertNotIn("textured", again)
        self.assertEqual(page.count("<figcaption>depth, refined"), again.count("<figcaption>depth, refined"))
        said = self.succeed("depth", out, "--no-refine").stderr
        self.assertIn("the mesh is still that of the earlier depth maps", said)
        self.assertIn('class="turntable"', (out / "report.html").read_text())


if __name__ == "__main__":
    program.main()
