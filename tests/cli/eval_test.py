#!/usr/bin/env python3
"""Tests of `roxel eval` and of the report's page, through the program itself, on tiny synthetic data sets.

    eval_test.py ROXEL [unittest arguments, e.g. Measures]
"""

import html
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import unittest

import program
from program import TINY, Case, digest, files_below

# A box of two units a side about the middle of the demo's world: corners, and faces as squares.
CORNERS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-0.7, 1.3)]
SQUARES = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]


def ply(corners=CORNERS, squares=SQUARES):
    text = f"ply\nformat ascii 1.0\nelement vertex {len(corners)}\n"
    text += "".join(f"property float {axis}\n" for axis in "xyz")
    text += f"element face {len(squares)}\nproperty list uchar int vertex_indices\nend_header\n"
    text += "".join("%g %g %g\n" % corner for corner in corners)
    return text + "".join("4 %d %d %d %d\n" % square for square in squares)


def exr(planes, width=64, height=48):
    """An OpenEXR file without compression: channels of floats by name, each a function of x and y."""
    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value

    names = sorted(planes)
    channels = b"".join(name.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for name in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<ii", 20000630, 2) + attribute("channels", "chlist", channels) + attribute("compression", "compression", b"\0")
    head += attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
    head += attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)) + attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    line = 4 * width * len(names)
    lines = [struct.pack("<ii", y, line) + struct.pack(f"<{width * len(names)}f", *(planes[n](x, y) for n in names for x in range(width)))
             for y in range(height)]
    first = len(head) + 8 * height
    return head + struct.pack(f"<{height}q", *(first + y * (8 + line) for y in range(height))) + b"".join(lines)


class EvalCase(program.Case):
    """A run with its data set, and a truth that has a mesh alone."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_folder = cls.folder / "run"
        done = program.run("reconstruct", cls.data, "-o", cls.run_folder, *TINY, "--passes", "4", "--bounds=-1.5,-1.5,-1.2,1.5,1.5,1.8")
        assert done.returncode == 0, done.stderr
        cls.mesh = cls.folder / "mesh"
        cls.mesh.mkdir()
        (cls.mesh / "mesh.ply").write_text(ply())

    def albedo(self, name):
        """A truth that has colours alone: grey everywhere."""
        folder = self.folder / name
        (folder / "albedo").mkdir(parents=True)
        (folder / "albedo/000.exr").write_bytes(exr({c: lambda x, y: 0.5 for c in "RGB"}))
        return folder

    def held_out(self, name):
        """A truth that has one held-out view alone."""
        folder = self.folder / name
        folder.mkdir()
        for kind in ("images", "mask"):
            shutil.copytree(self.data / kind, folder / kind)
        cameras = json.loads((self.data / "transforms.json").read_text())
        (folder / "transforms_test.json").write_text(json.dumps({**cameras, "frames": cameras["frames"][:1]}))
        return folder

    def changed_run(self, name, change):
        """A copy of the run whose summary is no longer what it was."""
        folder = self.folder / name
        shutil.copytree(self.run_folder, folder)
        summary = json.loads((folder / "summary.json").read_text())
        change(summary)
        (folder / "summary.json").write_text(json.dumps(summary))
        return folder

    def measures(self, *arguments, run=None):
        return json.loads(self.succeed("eval", run or self.run_folder, *arguments, "--json").stdout)


class Measures(EvalCase):
    def test_everything_is_measured_where_there_is_truth(self):
        truth = self.folder / "full"
        shutil.copytree(self.data, truth)
        shutil.copy(self.mesh / "mesh.ply", truth)
        out = self.folder / "metrics"
        text = self.succeed("eval", self.run_folder, "--truth", truth, "-o", out).stdout
        for part in ("within 0.5", "depth points that 2 views agree on", "weighted mean opacity", "SSIM", "1 sigma"):
            self.assertIn(part, text)
        found = json.loads((out / "metrics.json").read_text())
        self.assertEqual([s["name"] for s in found["surfaces"]],
                         ["depth points", "depth points that 2 views agree on", "depth points by pixel", "depth points of sigma within 4 voxels",
                          "refined depth points", "voxels"])
        self.assertTrue(0 < found["volume"]["share_within_4_voxels"] <= 1)
        self.assertTrue(0 < found["volume"]["weighted_mean_opacity"] < 1)
        self.assertEqual(len(found["images"]["views"]), 4)
        # Over the same pixels as the run's own figure, but for rounding to 8 bits.
        self.assertAlmostEqual(100 * found["images"]["object"]["rms"], found["reprojection_rms_percent"], delta=0.3)
        self.assertGreater(found["images"]["object"]["psnr_db"], 8)
        self.assertTrue(0 < found["images"]["all"]["ssim"] < 1)
        bins = found["calibration"]["opacity"]["bins"]
        self.assertEqual(sum(b["pixels"] for b in bins), 4 * 64 * 48)
        names = files_below(out)
        for name in ("metrics.json", "depth.csv", "surfaces.csv", "voxel_distances.csv", "images.csv", "opacity_reliability.csv",
                     "surface_1.svg", "voxel_distances.svg", "section_x.svg", "section_z.svg", "report.html"):
            self.assertIn(name, names)
        self.assertIn("#e00000", (out / "section_z.svg").read_text())
        page = (out / "report.html").read_text()
        self.assertIn("Against the truth", page)

    def test_truth_against_itself_is_perfect(self):
        found = self.measures("--truth", self.mesh, "--estimate", self.mesh / "mesh.ply", "--distances", "0.001,1")
        estimate = found["surfaces"][-1]
        self.assertEqual(estimate["name"], "mesh.ply")
        self.assertEqual([w["f_score"] for w in estimate["within"]], [1, 1])
        self.assertIsNone(found["depth"])

    def test_a_scan_is_truth_as_it_is(self):
        scan = self.folder / "scan"
        scan.mkdir()
        (scan / "mesh.ply").write_text(ply(CORNERS, []))
        found = self.measures("--truth", scan, "--estimate", scan / "mesh.ply")
        self.assertEqual(found["surface_samples"], len(CORNERS))
        self.assertEqual(found["surfaces"][-1]["within"][0]["f_score"], 1)
        self.assertIn("a set of points", found["notes"][0])

    def test_voxels_that_were_written_are_the_voxels_that_are_measured(self):
        *_, voxels, estimate = self.measures("--truth", self.mesh, "--estimate", self.run_folder / "voxels.ply")["surfaces"]
        self.assertEqual(estimate["points"], voxels["points"])
        self.assertAlmostEqual(estimate["mean_to_truth"], voxels["mean_to_truth"], places=5)  # floats in the file
        self.assertAlmostEqual(estimate["accuracy_90"], voxels["accuracy_90"], places=5)

    def test_what_lies_outside_the_box_is_not_missed(self):
        whole = self.measures()["depth"]
        half = self.folder / "half"
        self.succeed("reconstruct", self.data, "-o", half, *TINY, "--resolution", "64", "--bounds=-1.5,-1.5,-1.2,0,1.5,1.8", "--quiet")
        found = self.measures(run=half)["depth"]
        self.assertLess(found["true_pixels"], 0.8 * whole["true_pixels"])
        self.assertEqual(found["true_pixels"] + found["empty_pixels"], 4 * 64 * 48)
        self.assertGreater(found["share_found"], 0.5)

    def test_another_run_may_be_the_truth(self):
        truth = self.folder / "same-run"
        shutil.copytree(self.run_folder, truth)
        found = self.measures("--truth", truth)["depth"]
        # Depth of rays that are hardly opaque is there in the truth, and is left out of the estimate.
        self.assertEqual(found["share_within_voxels"]["0.5"], found["share_found"])
        self.assertGreater(found["share_found"], 0.3)
        self.assertEqual(found["bias_voxels"], 0)

    def test_colours_alone_are_truth(self):
        found = self.measures("--truth", self.albedo("albedo-alone"))
        self.assertGreater(found["color"]["pixels"], 100)
        self.assertIsNone(found["depth"])

    def test_a_background_is_no_colour_of_the_object(self):
        truth = self.albedo("albedo-red")
        red = {"kind": "constant", "color": [1, 0, 0]}
        on_red = self.changed_run("on-red", lambda summary: summary["scene"].update(background=red))
        self.assertEqual(self.measures("--truth", truth, run=on_red)["color"], self.measures("--truth", truth)["color"])

    def test_held_out_views_alone_are_truth(self):
        found = self.measures("--truth", self.held_out("held-out-alone"))
        self.assertEqual([v["name"] for v in found["held_out"]["views"]], ["000"])

    def test_depths_a_voxel_and_a_half_apart_do_not_agree(self):
        # Two views from one place, whose depth maps are planes; nothing else has depth.
        data, run = self.folder / "one-place", self.folder / "planes"
        shutil.copytree(self.data, data)
        shutil.rmtree(data / "sparse")
        cameras = json.loads((data / "transforms.json").read_text())
        pose = cameras["frames"][0]["transform_matrix"]
        cameras["frames"][1]["transform_matrix"] = pose
        (data / "transforms.json").write_text(json.dumps(cameras))
        shutil.copytree(self.run_folder, run)
        shutil.rmtree(run / "depth")
        (run / "depth").mkdir()
        voxel = json.loads((run / "summary.json").read_text())["scene"]["voxel_size"]
        middle = sum(row[3] ** 2 for row in pose[:3]) ** 0.5

        def points(apart):
            for name, z in (("000", middle), ("001", middle + apart * voxel)):
                planes = {"Z": lambda x, y: z, "V": lambda x, y: 0.01, "A": lambda x, y: 1}
                (run / f"depth/{name}.exr").write_bytes(exr(planes))
            return self.measures("--truth", self.mesh, "--dataset", data, run=run)["surfaces"]

        every, agreed = points(0.5)[:2]
        self.assertEqual(agreed["points"], every["points"])
        every, agreed = points(1.5)[:2]
        self.assertGreater(every["points"], 100)
        self.assertEqual((agreed["points"], agreed["accuracy_90"]), (0, None))

    def test_depth_points_by_pixel_are_as_the_photographs_weigh_them(self):
        # One view of a true plane: 16 columns of truth, of which the run finds 8; its other 16 columns lie 4 voxels behind.
        run, truth = self.folder / "by-pixel", self.folder / "true-plane"
        shutil.copytree(self.run_folder, run)
        shutil.rmtree(run / "depth")
        for folder in (run / "depth", truth / "depth"): folder.mkdir(parents=True)
        voxel = json.loads((run / "summary.json").read_text())["scene"]["voxel_size"]
        pose = json.loads((self.data / "transforms.json").read_text())["frames"][0]["transform_matrix"]
        right, up, back, centre = ([row[c] for row in pose[:3]] for c in range(4))
        z = sum(c * c for c in centre) ** 0.5
        shown = lambda x, y: 16 <= x < 48 and 12 <= y < 36
        depth = lambda x, y: 0 if not shown(x, y) or x >= 40 else z if x < 24 else z + 4 * voxel
        (run / "depth/000.exr").write_bytes(exr({"Z": depth, "V": lambda x, y: 0.01, "A": lambda x, y: 1}))
        (truth / "depth/000.exr").write_bytes(exr({"Z": lambda x, y: z if shown(x, y) and x < 32 else 0}))
        corners = [tuple(centre[i] - z * back[i] + 5 * (u * right[i] + v * up[i]) for i in range(3)) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        (truth / "mesh.ply").write_text(ply(corners, [(0, 1, 2, 3)]))
        found = {s["name"]: s for s in self.measures("--truth", truth, "--distances", "0.005", run=run)["surfaces"]}["depth points by pixel"]
        self.assertEqual((found["points"], found["true_points"], found["pixel_stride"]), (24 * 24, 16 * 24, 1))
        shares = found["within"][0]
        for name, share in (("precision", 1 / 3), ("recall", 1 / 2), ("f_score", 2 / 5)):
            self.assertAlmostEqual(shares[name], share, places=9)

    def test_depth_points_by_pixel_need_true_depth_and_a_surface(self):
        self.assertNotIn("depth points by pixel", [s["name"] for s in self.measures("--truth", self.mesh)["surfaces"]])

    def test_sky_debris_is_what_has_nothing_above_it(self):
        self.assertNotIn("sky_debris", self.measures("--truth", self.mesh))  # no sky: nobody says what is up
        skies, run = self.folder / "demo-skies", self.folder / "with-skies"
        self.succeed("sky", self.data, "-o", skies, "--up", "0,0,1", "--facets", "4", "--no-pictures", "--quiet")
        shutil.copytree(self.run_folder, run)
        shutil.copytree(skies / "sky", run / "sky")
        out = self.folder / "debris"
        self.succeed("eval", run, "--truth", self.mesh, "-o", out, "--quiet")
        found = json.loads((out / "metrics.json").read_text())["sky_debris"]
        self.assertEqual(len((out / "sky_debris.csv").read_text().splitlines()), 1 + len(found))
        self.assertEqual([at["opacity_threshold"] for at in found], [0.04, 0.3])
        head, _, body = (run / "voxels.ply").read_bytes().partition(b"end_header\n")
        properties = re.findall(r"property (\w+) (\w+)", head.decode())
        line = struct.Struct("<" + "".join({"float": "f", "uchar": "B"}[kind] for kind, _ in properties))
        names = [name for _, name in properties]
        voxel = json.loads((run / "summary.json").read_text())["scene"]["voxel_size"]
        expected = [[0, 0, 0.0, 0.0], [0, 0, 0.0, 0.0]]
        for values in line.iter_unpack(body):
            x, y, z, opacity = (values[names.index(name)] for name in ("x", "y", "z", "opacity"))
            if not (abs(x) <= 1.5 and abs(y) <= 1.5 and -1.2 <= z <= 1.8): continue
            out_by = [max(abs(x) - 1, 0), max(abs(y) - 1, 0), max(abs(z - 0.3) - 1, 0)]
            inside = not any(out_by)
            away = min(1 - abs(x), 1 - abs(y), 1 - abs(z - 0.3)) if inside else sum(d * d for d in out_by) ** 0.5
            in_the_open = away > voxel and (abs(x) > 1 or abs(y) > 1 or z > 1.3)
            for counts, threshold in zip(expected, (0.04, 0.3)):
                if opacity < threshold: continue
                counts[0] += 1
                counts[1] += in_the_open
                counts[2] += opacity
                counts[3] += opacity * in_the_open
        self.assertGreater(expected[0][1], 10)
        for at, (voxels, debris, opacity, of_debris) in zip(found, expected):
            self.assertEqual((at["voxels"], at["in_the_open"]["voxels"]), (voxels, debris))
            self.assertAlmostEqual(at["in_the_open"]["share"], debris / voxels, places=9)
            self.assertAlmostEqual(at["in_the_open"]["share_of_opacity"], of_debris / opacity, places=5)
            self.assertLessEqual(at["before_sky"]["voxels"], voxels)

    def test_older_measures_are_removed_and_nothing_else(self):
        full = self.held_out("full-before")
        for kind in ("depth", "mesh.ply"):
            source = self.data / kind if kind == "depth" else self.mesh / kind
            (shutil.copytree if source.is_dir() else shutil.copy)(source, full / kind)
        blind = self.changed_run("blind", lambda summary: None)
        shutil.rmtree(blind / "render")
        out, fresh = self.folder / "again", self.folder / "fresh"
        self.succeed("eval", self.run_folder, "--truth", full, "--estimate", full / "mesh.ply", "-o", out, "--quiet")
        for name in ("surface_4.svg", "held_out.csv", "images.svg", "depth.csv"):
            self.assertIn(name, files_below(out))
        (out / "mine.csv").write_text("kept")
        (out / "images").mkdir()
        self.succeed("eval", blind, "--truth", self.albedo("albedo-again"), "-o", out, "--quiet")
        self.succeed("eval", blind, "--truth", self.folder / "albedo-again", "-o", fresh, "--quiet")
        self.assertEqual(files_below(out), sorted([*files_below(fresh), "mine.csv"]))
        self.assertTrue((out / "images").is_dir())

    def test_files_that_no_eval_wrote_are_kept(self):
        out = self.folder / "not-measures"
        out.mkdir()
        (out / "held_out.csv").write_text("kept")
        self.succeed("eval", self.run_folder, "-o", out, "--quiet")
        self.assertEqual((out / "held_out.csv").read_text(), "kept")

    def test_passes_without_a_figure_leave_a_gap(self):
        for name, passes in (("no-list", 5), ("null", [{"level": 1, "mean_log_likelihood": None}, {"level": 1, "mean_log_likelihood": -1}])):
            with self.subTest(name):
                run = self.changed_run(f"passes-{name}", lambda summary: summary.update(passes=passes))
                self.succeed("eval", run, "-o", self.folder / f"page-{name}", "--quiet")

    def test_truth_displaced_is_off_by_as_much(self):
        moved = self.folder / "moved.ply"
        top = [(x, y, 1.3) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        (self.folder / "top").mkdir()
        (self.folder / "top/mesh.ply").write_text(ply(top, [(0, 1, 2, 3)]))
        moved.write_text(ply([(x, y, z - 0.25) for x, y, z in top], [(0, 1, 2, 3)]))
        found = self.measures("--truth", self.folder / "top", "--estimate", moved, "--distances", "0.24,0.26")["surfaces"][-1]
        self.assertAlmostEqual(found["accuracy_90"], 0.25, places=6)
        self.assertEqual([w["f_score"] for w in found["within"]], [0, 1])

    def test_without_its_photographs_a_run_is_still_measured(self):
        away = self.folder / "away"
        run = self.folder / "left-behind"
        shutil.copytree(self.data, away)
        self.succeed("reconstruct", away, "-o", run, *TINY, "--quiet")
        here = self.measures(run=run)
        away.rename(self.folder / "elsewhere")
        found = self.measures("--truth", self.data, run=run)
        self.assertEqual(found["depth"]["true_pixels"], here["depth"]["true_pixels"])
        self.assertIsNone(found["images"])
        self.assertIn("--dataset", found["notes"][0])
        self.assertIn("cameras are not known", self.measures("--truth", self.mesh, run=run)["notes"][1])
        again = self.measures("--dataset", self.folder / "elsewhere", run=run)
        self.assertEqual(again["images"], here["images"])

    def test_results_do_not_depend_on_threads(self):
        seen = []
        for threads in (1, 3):
            out = self.folder / f"threads{threads}"
            self.succeed("eval", self.run_folder, "--truth", self.mesh, "-o", out, "--threads", threads, "--quiet")
            seen.append({name: digest(out / name) for name in files_below(out)})
        self.assertEqual(*seen)


class Options(EvalCase):
    # What the line has besides, and a value that must change what is measured.
    CHANGES = {
        "truth": ([], ["--truth", "MESH"]),
        "dataset": ([], ["--dataset", "OTHER"]),
        "depth-within": ([], ["--depth-within", "0.1,0.5"]),
        "distances": (["--truth", "MESH"], ["--distances", "0.3"]),
        "estimate": (["--truth", "MESH"], ["--estimate", "MESH/mesh.ply"]),
        "opacity-threshold": (["--truth", "MESH"], ["--opacity-threshold", "0.5"]),
        "confidence-threshold": (["--truth", "MESH"], ["--confidence-threshold", "0.5"]),
        "views-agree": (["--truth", "MESH"], ["--views-agree", "3"]),
        "sure-within": (["--truth", "MESH"], ["--sure-within", "0.5"]),
        "samples": (["--truth", "MESH"], ["--samples", "1000"]),
        "seed": (["--truth", "MESH"], ["--seed", "2"]),
    }
    ELSEWHERE = {"section", "threads", "quiet", "verbose", "json", "config", "help", "output"}

    def line(self, arguments):
        return [a.replace("MESH", str(self.mesh)).replace("OTHER", str(self.folder / "other")) for a in arguments]

    def test_thresholds_leave_voxels_out(self):
        voxels = [self.measures("--truth", self.mesh, *more)["volume"]["voxels"]
                  for more in ([], ["--opacity-threshold", "0.5"], ["--confidence-threshold", "0.5"])]
        self.assertLess(voxels[1], voxels[0])
        self.assertLess(voxels[2], voxels[0])

    def test_what_the_run_is_not_sure_of_is_left_out_of_the_sure_points(self):
        points = []
        for voxels in (0.2, 1, 1000):
            surfaces = self.measures("--truth", self.mesh, "--sure-within", voxels)["surfaces"]
            counts = {surface["name"]: surface["points"] for surface in surfaces}
            points.append(counts[f"depth points of sigma within {voxels} voxels"])
        self.assertLess(points[0], points[1])
        self.assertLess(points[1], points[2])
        self.assertEqual(points[2], counts["depth points"])

    def test_every_option_changes_something(self):
        other = self.folder / "other"
        self.synth(other, 4, "64x48")
        shutil.copy(other / "images/001.png", other / "images/000.png")
        known = {}
        for option, (base, change) in self.CHANGES.items():
            with self.subTest(option):
                key = tuple(base)
                if key not in known:
                    known[key] = self.measures(*self.line(base))
                self.assertNotEqual(known[key], self.measures(*self.line(base + change)))

    def test_every_option_has_a_case_and_is_in_the_docs(self):
        named = set(re.findall(r"^  --(?:no-)?([a-z-]+)", self.succeed("eval", "--help").stdout, re.M))
        self.assertEqual(named - self.ELSEWHERE, set(self.CHANGES))
        docs = (program.SOURCE / "docs/evaluation.md").read_text()
        for option in set(self.CHANGES) | {"section"}:
            self.assertIn(f"--{option}", docs)

    def test_sections_go_through_the_point(self):
        out = self.folder / "sections"
        self.succeed("eval", self.run_folder, "-o", out, "--section", "0.5,0.25,-0.125", "--quiet")
        for axis, position in (("x", "0.5"), ("y", "0.25"), ("z", "-0.125")):
            self.assertIn(f"section {axis} = {position}<", (out / f"section_{axis}.svg").read_text())


class BadTruth(EvalCase):
    def test_bad_files_and_values_end_with_code_2(self):
        bad = self.folder / "bad"
        bad.mkdir()
        table = [("not a PLY\n", "expected a PLY file"), (ply()[:-20], "the end of the file"),
                 (ply().replace("4 0 1 3 2", "4 0 1 3 99"), "vertex 99"), (ply().replace("-1 -1 -0.7", "-1 nan -0.7"), "mesh.ply:10: y"),
                 ("", "mesh.ply")]
        for text, message in table:
            with self.subTest(message):
                (bad / "mesh.ply").write_text(text)
                self.expect_error(2, message, "eval", self.run_folder, "--truth", bad)
                self.expect_error(2, message, "eval", self.run_folder, "--truth", self.mesh, "--estimate", bad / "mesh.ply")
        self.expect_error(2, "--distances: found", "eval", self.run_folder, "--distances", "0.1,-1")
        self.expect_error(2, "--depth-within: found", "eval", self.run_folder, "--depth-within", "1;2")
        self.expect_error(2, "no true surface", "eval", self.run_folder, "--estimate", self.mesh / "mesh.ply")
        self.expect_error(2, "missing.ply", "eval", self.run_folder, "--truth", self.mesh, "--estimate", bad / "missing.ply")
        self.expect_error(2, "nowhere", "eval", self.run_folder, "--dataset", self.folder / "nowhere")

    def test_truth_that_gives_nothing_says_why(self):
        aside = self.folder / "aside"
        aside.mkdir()
        (aside / "mesh.ply").write_text(ply([(x + 50, y, z) for x, y, z in CORNERS]))
        done = self.expect_error(2, "is in the run's box", "eval", self.run_folder, "--truth", aside, "--quiet")
        self.assertNotIn("no mesh.ply", done.stderr)
        (aside / "mesh.ply").unlink()
        (aside / "albedo").mkdir()
        self.expect_error(2, "no NAME.exr in " + str(aside / "albedo"), "eval", self.run_folder, "--truth", aside, "--quiet")

    def test_a_damaged_summary_ends_with_code_2(self):
        def with_value(key, value):
            return lambda summary: summary.update({key: value})

        table = {"views": with_value("views", [5]), "scene": with_value("scene", None), "name": with_value("views", [{"name": 7}]),
                 "nulls": lambda summary: summary["scene"].update(bounds=[None] * 6),
                 "order": lambda summary: summary["scene"].update(bounds=[0, 0, 0, 1, -1, 1]),
                 "background": lambda summary: summary["scene"].update(background=5)}
        truth = self.held_out("held-out-damaged")
        for name, change in table.items():
            with self.subTest(name):
                run = self.changed_run(f"damaged-{name}", change)
                self.expect_error(2, str(run / "summary.json"), "eval", run, "--truth", truth, "--quiet")

    def test_a_full_disc_leaves_older_measures(self):
        out = self.folder / "older"
        self.succeed("eval", self.run_folder, "-o", out, "--quiet")
        before = program.digests(out)
        most_bytes = (out / "report.html").stat().st_size // 2
        done = program.run_on_a_full_disc("eval", self.run_folder, "--truth", self.mesh, "-o", out, most_bytes=most_bytes)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(program.digests(out), before)
        self.assertFalse((out / ".partial").exists())

    def test_truth_of_another_size_is_refused(self):
        small = self.folder / "small"
        self.synth(small, 4, "32x24")
        self.expect_error(2, "32 x 24 pixels, expected 64 x 48", "eval", self.run_folder, "--truth", small)


class Daylight(Case):
    """A street of three nodes, each with its own time; runs with reports."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.street, cls.run_folder = cls.folder / "street", cls.folder / "lit"
        cls.small = ["--resolution", "24", "--levels", "1", "--passes", "2", "--masks", "none", "--surround", "off", "--no-mesh", "--no-bp",
                     "--no-refine", "--quiet"]
        for command in (["synth", "street", "-o", cls.street, "--images", "48", "--size", "36x28", "--samples", "1", "--quiet"],
                        ["reconstruct", cls.street, "-o", cls.run_folder, *cls.small, "--illumination", "sky-normal"]):
            done = program.run(*command)
            assert done.returncode == 0, done.stderr

    def eval_street(self, run, *arguments):
        return json.loads(self.succeed("eval", run, "--truth", self.street, "--samples", 2000, "--json", *arguments).stdout)

    def captions(self, page):
        return re.findall(r"<figcaption>([^<]*)</figcaption>", page.read_text())

    def test_lights_are_measured_at_the_same_places(self):
        found = self.eval_street(self.run_folder)["light"]
        self.assertEqual([light["light"] for light in found], ["none", "sky", "run", "true dome", "true light on the surface"])
        self.assertEqual(len({(light["places"], light["albedo"] and light["albedo"]["pixels"]) for light in found}), 1)
        self.assertTrue(0 < found[0]["places"] <= found[0]["shared_places"])
        # What the run does not know the light of is left out for every light.
        fewer = self.folder / "fewer"
        shutil.copytree(self.run_folder, fewer)
        for name in sorted(os.listdir(fewer / "light"))[::2]:
            if name.endswith(".exr"): (fewer / "light" / name).write_bytes(exr({c: lambda x, y: 0 for c in "RGB"}, 36, 28))
        left = self.eval_street(fewer)["light"]
        self.assertEqual(len({light["places"] for light in left}), 1)
        self.assertLess(left[0]["places"], found[0]["places"])
        self.assertEqual(left[0]["shared_places"], found[0]["shared_places"])

    def test_a_node_without_light_has_no_errors(self):
        dark = self.folder / "dark"
        shutil.copytree(self.run_folder, dark)
        sky = json.loads((dark / "sky/n00.json").read_text())
        sky["model"] = "none"
        (dark / "sky/n00.json").write_text(json.dumps(sky))
        skies = self.eval_street(dark)["skies"]
        errors = ("fit_error", "dome_error", "oracle_error", "horizontal_error", "horizontal_sky_error")
        self.assertEqual({skies[0][error] for error in errors}, {None})
        for error in errors: self.assertGreater(skies[1][error], 0)

    def test_a_report_shows_the_skies_that_the_run_fitted(self):
        captions = self.captions(self.run_folder / "report.html")
        nodes = len(json.loads((self.run_folder / "summary.json").read_text())["skies"])
        for caption in ("as the images show it", "too much contrast", "facets of the fit", "fitted sky", "error of the fit (pale: not used)"):
            self.assertEqual(captions.count(caption), nodes)
        self.assertEqual(captions.count("photograph over its light"), captions.count("photograph"))

    def test_pages_drawn_again_show_them_too(self):
        def kinds(page): return {c: self.captions(page).count(c) for c in ("fitted sky", "photograph", "photograph over its light")}
        before = kinds(self.run_folder / "report.html")
        out = self.folder / "measured"
        self.eval_street(self.run_folder, "-o", out)
        self.assertEqual(kinds(out / "report.html"), before)
        again = self.folder / "again"
        shutil.copytree(self.run_folder, again)
        self.succeed("depth", again, "--no-refine", "--quiet")
        self.assertEqual(kinds(again / "report.html"), before)

    def test_skies_of_another_run_are_shown_and_named(self):
        out = self.folder / "given"
        self.succeed("reconstruct", self.street, "-o", out, *self.small, "--sky", self.run_folder, "--illumination", "sky")
        self.assertEqual(re.findall('<a href="([^"]*)">', (out / "report.html").read_text()), [f"{self.run_folder}/report.html"])
        self.assertIn("fitted sky", self.captions(out / "report.html"))
        plain = self.folder / "plain"
        self.succeed("reconstruct", self.street, "-o", plain, *self.small, "--illumination", "none")
        self.assertNotIn("fitted sky", self.captions(plain / "report.html"))
        self.assertNotIn("photograph over its light", self.captions(plain / "report.html"))

    def test_gains_are_shown_by_what_they_do(self):
        out = self.folder / "gain"
        self.succeed("reconstruct", self.street, "-o", out, *self.small, "--illumination", "gain")
        captions = self.captions(out / "report.html")
        self.assertGreater(captions.count("photograph over its light"), 0)


class HeldOut(EvalCase):
    def test_views_of_the_test_split_are_rendered_and_compared(self):
        data = self.folder / "split"
        self.synth(data, 6, "64x48")
        cameras = json.loads((data / "transforms.json").read_text())
        shutil.rmtree(data / "sparse")
        frames = cameras["frames"]
        (data / "transforms.json").write_text(json.dumps({**cameras, "frames": frames[:4]}))
        (data / "transforms_test.json").write_text(json.dumps({**cameras, "frames": frames[4:]}))
        run = self.folder / "split-run"
        self.succeed("reconstruct", data, "-o", run, *TINY, "--quiet")
        found = self.measures(run=run)
        self.assertEqual(len(found["images"]["views"]), 4)
        self.assertEqual([v["name"] for v in found["held_out"]["views"]], ["004", "005"])
        self.assertTrue(0.01 < found["held_out"]["object"]["rms"] < 0.5)
        # Held-out views that were seen are the run's own renders.
        (data / "transforms_test.json").write_text(json.dumps({**cameras, "frames": frames[:4]}))
        again = self.measures(run=run)
        self.assertAlmostEqual(again["held_out"]["all"]["rms"], again["images"]["all"]["rms"], places=3)


CHROMIUM = next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)

# Holds a page in a frame of a phone's or a desk's width, and writes down what the browser made of it.
PROBE = """<!DOCTYPE html><html><body><iframe id="page" style="width:%dpx;height:900px;border:0" srcdoc="%s"></iframe>
<pre id="found"></pre><script>
onload = () => {
  const page = document.getElementById("page").contentDocument;
  const images = [...page.images];
  document.getElementById("found").textContent = JSON.stringify({
    width: page.documentElement.clientWidth, needed: page.documentElement.scrollWidth,
    images: images.length, broken: images.filter(i => !i.complete || i.naturalWidth == 0).length,
    plots: page.querySelectorAll(".plots svg").length, sections: page.querySelectorAll(".sections svg").length,
    columns: getComputedStyle(page.querySelector(".view .row")).gridTemplateColumns.split(" ").length});
};
</script></body></html>"""


def browse(*arguments):
    return subprocess.run([CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                           "--host-resolver-rules=MAP * ~NOTFOUND", *map(str, arguments)],
                          capture_output=True, timeout=120)


@unittest.skipUnless(CHROMIUM, "no Chromium is installed: the report's page is not looked at")
class Report(EvalCase):
    def pages(self):
        out = self.folder / "metrics"
        self.succeed("eval", self.run_folder, "-o", out, "--quiet")
        return {"run": self.run_folder / "report.html", "eval": out / "report.html"}

    def probe(self, page, width):
        file = self.folder / "probe.html"
        file.write_text(PROBE % (width, html.escape(page.read_text(), quote=True)))
        shown = browse("--virtual-time-budget=5000", "--dump-dom", file.as_uri()).stdout.decode()
        return json.loads(html.unescape(re.search(r'<pre id="found">(.*?)</pre>', shown, re.S)[1]))

    def test_the_page_fits_a_phone_and_a_desk(self):
        for name, page in self.pages().items():
            for width, columns in ((360, 6), (1200, None)):
                with self.subTest(f"{name} at {width}"):
                    found = self.probe(page, width)
                    self.assertEqual(found["width"], width)
                    self.assertLessEqual(found["needed"], width, "it scrolls sideways")
                    pictures = 10  # of two rows
                    self.assertEqual((found["images"], found["broken"]), (4 * pictures, 0))
                    self.assertEqual(found["columns"], columns or 5)
                    self.assertEqual(found["sections"], 3)
                    self.assertGreaterEqual(found["plots"], 5)

    def test_it_is_drawn_and_printed(self):
        page = self.pages()["eval"]
        shot, paper = self.folder / "page.png", self.folder / "page.pdf"
        browse("--window-size=1000,1400", f"--screenshot={shot}", page.as_uri())
        self.assertEqual(struct.unpack(">II", shot.read_bytes()[16:24]), (1000, 1400))
        self.assertGreater(shot.stat().st_size, 30000, "hardly anything is on it")
        browse("--no-pdf-header-footer", f"--print-to-pdf={paper}", page.as_uri())
        self.assertTrue(paper.read_bytes().startswith(b"%PDF"))


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if not CHROMIUM:
        print("SKIPPED: no Chromium is installed, so nobody looks at the report's page", file=sys.stderr)
    program.ROXEL = os.path.abspath(sys.argv.pop(1))
    unittest.main(argv=[sys.argv[0], *sys.argv[1:]])


if __name__ == "__main__":
    main()
