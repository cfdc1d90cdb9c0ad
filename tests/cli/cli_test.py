#!/usr/bin/env python3
"""Tests of the command line, through the program itself, on tiny synthetic data sets.

    cli_test.py ROXEL [unittest arguments, e.g. Usage or Options.test_every_option_changes_something]
"""

import hashlib
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

ROXEL = None  # the program, set in main
TINY = ["--resolution", "16", "--levels", "2", "--passes", "2", "--no-mesh"]  # mesh_test.py has the mesh


def run(*arguments, **kwargs):
    """Runs roxel and returns what it said."""
    return subprocess.run([ROXEL, *map(str, arguments)], capture_output=True, text=True, **{"timeout": 120, **kwargs})


def start_until(moment, *arguments):
    """Starts roxel and returns once `moment` is said: the process, which is still at work, and all that it said."""
    job = subprocess.Popen([ROXEL, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    said = ""
    for line in job.stderr:
        said += line
        if moment in line:
            break
    assert job.poll() is None, said
    return job, said


def files_below(folder):
    return sorted(str(p.relative_to(folder)) for p in pathlib.Path(folder).rglob("*") if p.is_file())


def digest(path):
    return hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()


class Case(unittest.TestCase):
    """A folder of its own with a data set of four photographs, 64 x 48."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="roxel-cli-"))
        cls.data = cls.folder / "data"
        cls.synth(cls.data, 4, "64x48")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    @classmethod
    def synth(cls, folder, images, size):
        made = run("synth", "demo", "-o", folder, "--images", images, "--size", size)
        assert made.returncode == 0, made.stderr

    def succeed(self, *arguments, **kwargs):
        done = run(*arguments, **kwargs)
        self.assertEqual(done.returncode, 0, f"roxel {' '.join(map(str, arguments))}\n{done.stderr}")
        return done

    def expect_error(self, code, message, *arguments):
        """The command ends with this code and one line that holds `message`."""
        done = run(*arguments)
        line = f"roxel {' '.join(map(str, arguments))}"
        self.assertEqual(done.returncode, code, f"{line}\n{done.stderr}")
        self.assertEqual(done.stderr.count("\n"), 1, f"{line}\n{done.stderr}")
        self.assertTrue(done.stderr.startswith("roxel: error: "), done.stderr)
        self.assertIn(message, done.stderr, line)
        self.assertEqual(done.stdout, "")
        return done

    def reconstruct(self, name, *arguments, data=None):
        """A tiny run; its folder and its summary."""
        out = self.folder / name
        self.succeed("reconstruct", data or self.data, "-o", out, *TINY, *arguments, "--quiet")
        return out, json.loads((out / "summary.json").read_text())


class Usage(Case):
    def test_bad_command_lines_end_with_code_2_and_write_nothing(self):
        out = self.folder / "never"
        table = [
            ('unknown command "paint"', ["paint"]),
            ("DATASET is missing", ["info"]),
            ("DATASET is missing", ["reconstruct", "-o", out]),
            ("-o RUN is missing", ["reconstruct", self.data]),
            ('found "more" after', ["reconstruct", self.data, "more", "-o", out]),
            ("--resolutoin: found an unknown option, expected perhaps resolution",
             ["reconstruct", self.data, "-o", out, "--resolutoin", "16"]),
            ('"-q" is no option', ["reconstruct", self.data, "-o", out, "-q"]),
            ("--passes: found no value", ["reconstruct", self.data, "-o", out, "--passes"]),
            ('--passes: found "x"', ["reconstruct", self.data, "-o", out, "--passes", "x"]),
            ('--resolution: found "3", expected a whole number in [8, 65536]',
             ["reconstruct", self.data, "-o", out, "--resolution", "3"]),
            ("--background: found", ["reconstruct", self.data, "-o", out, "--background", "green"]),
            ("--bounds: found", ["reconstruct", self.data, "-o", out, "--bounds", "0,0,0,1,1"]),
            ("first corner must be below", ["reconstruct", self.data, "-o", out, "--bounds", "1,0,0,0,1,1"]),
            ("--near must be below --far", ["reconstruct", self.data, "-o", out, "--near", "9", "--far", "3"]),
            ("--white-point", ["reconstruct", self.data, "-o", out, "--white-point", "D66"]),
            ("--response", ["reconstruct", self.data, "-o", out, "--response", "log"]),
            ("nothing-here", ["info", self.folder / "nothing-here"]),
            ("nothing-here", ["reconstruct", self.data, "-o", out, "--init", self.folder / "nothing-here"]),
            ("summary.json", ["render", self.data, "-o", out]),
            ("summary.json", ["eval", self.data]),
            ("expected at least 2", ["merge", self.data, "-o", out]),
            ('"paris"', ["synth", "paris", "-o", out]),
            ("--size", ["synth", "demo", "-o", out, "--size", "64"]),
            ("--images: found", ["synth", "demo", "-o", out, "--images", "1"]),
            ("images: found 281, expected 2 to 280", ["synth", "street", "-o", out, "--images", "281"]),
            ("--light: found", ["synth", "plane", "-o", out, "--light", "dark"]),
            ("--pose-noise: found", ["synth", "plane", "-o", out, "--pose-noise", "1"]),
            ("--light: found world demo", ["synth", "demo", "-o", out, "--light", "mix"]),
            ("--transients: found world demo", ["synth", "demo", "-o", out, "--transients", "1"]),
            ("--to: found", ["convert", self.data, "-o", out, "--to", "bundler"]),
            ('--depth: found "maybe"', ["reconstruct", self.data, "-o", out, "--depth=maybe"]),
            ('--dry-run: found "--dry-run="', ["reconstruct", self.data, "-o", out, "--dry-run="]),
            ('--no-adaptive: found "2"', ["info", self.data, "--no-adaptive=2"]),
        ]
        for message, arguments in table:
            with self.subTest(message):
                self.expect_error(2, message, *arguments)
                self.assertFalse(out.exists())

    def test_without_a_command_usage_goes_to_stderr_with_code_2(self):
        done = run()
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("reconstruct", done.stderr)

    def test_help_and_version_succeed(self):
        for command in ["info", "reconstruct", "mesh", "render", "eval", "merge", "synth", "convert"]:
            text = self.succeed(command, "--help").stdout
            self.assertIn(f"Usage: roxel {command} ", text)
            self.assertIn("--config", text)
            self.assertEqual(self.succeed("help", command).stdout, text)
            self.assertIn(f"\n  {command} ", self.succeed("--help").stdout)
        self.assertRegex(self.succeed("--version").stdout, r"^roxel \d+\.\d+\.\d+$")

    def test_a_file_in_the_place_of_the_output_ends_with_code_2_before_the_work(self):
        blocker = self.folder / "blocker"
        blocker.write_text("a file")
        for command in (["reconstruct", self.data], ["synth", "demo"], ["convert", self.data]):
            with self.subTest(command[0]):
                self.expect_error(2, f"found a file, {blocker}", *command, "-o", blocker / "run")
                self.expect_error(2, f"found a file, {blocker}", *command, "-o", blocker)
        self.assertEqual(blocker.read_text(), "a file")

    def test_an_output_that_cannot_be_written_fails_with_code_1_before_the_work(self):
        self.expect_error(1, "cannot be made", "synth", "demo", "-o", "/proc/roxel")

    def test_a_broken_photograph_ends_with_code_2_and_leaves_no_folder(self):
        broken = self.folder / "broken"
        shutil.copytree(self.data, broken)
        (broken / "images/002.png").write_bytes((broken / "images/002.png").read_bytes()[:500])
        self.expect_error(2, "002.png", "reconstruct", broken, "-o", self.folder / "deep/run", *TINY)
        self.assertFalse((self.folder / "deep").exists())

    def test_images_that_differ_in_their_suffix_only_are_refused(self):
        twins = self.folder / "twins"
        shutil.copytree(self.data, twins)
        shutil.rmtree(twins / "sparse")
        cameras = (twins / "transforms.json").read_text()
        (twins / "transforms.json").write_text(cameras.replace("images/001.png", "images/000.PNG"))
        shutil.copy(twins / "images/001.png", twins / "images/000.PNG")
        self.expect_error(2, "for the second time", "reconstruct", twins, "-o", self.folder / "twins-run", *TINY)

    def test_a_dry_run_writes_nothing_and_says_what_info_says(self):
        before = files_below(self.folder)
        out = self.folder / "dry"
        for extra in ([], ["-o", out]):
            dry = self.succeed("reconstruct", self.data, *extra, *TINY, "--dry-run").stdout
            self.assertEqual(dry, self.succeed("info", self.data, *TINY[:-1]).stdout)
        self.assertEqual(files_below(self.folder), before)
        self.assertFalse(out.exists())


class Config(Case):
    def config(self, text):
        file = self.folder / "config.json"
        file.write_text(text)
        return file

    def test_the_command_line_overrides_the_file(self):
        file = self.config('{"passes": 1, "levels": 1, "adaptive": false, "threads": 1}')
        _, summary = self.reconstruct("a", "--config", file)
        self.assertEqual([summary["options"][k] for k in ("passes", "levels", "adaptive")], [2, 2, False])
        out = self.folder / "b"
        self.succeed("reconstruct", self.data, "-o", out, "--resolution", "16", "--config", file, "--adaptive", "--quiet")
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual([summary["options"][k] for k in ("passes", "levels", "adaptive")], [1, 1, True])
        self.assertEqual(summary["threads"], 1)
        self.assertEqual(len(summary["passes"]), 1)

    def test_options_of_a_summary_make_the_same_run(self):
        _, first = self.reconstruct("first", "--noise", "6", "--spatial-prior", "0.5", "--bounds", "-1,-1.5,-1,1,1.5,1")
        file = self.config(json.dumps(first["options"]))
        self.succeed("reconstruct", self.data, "-o", self.folder / "second", "--config", file)
        second = json.loads((self.folder / "second/summary.json").read_text())
        self.assertEqual(first["options"], second["options"])
        self.assertEqual(first["views"], second["views"])

    def test_bounds_may_stand_in_a_file(self):
        file = self.folder / "box.txt"
        file.write_text("-1, -1.5 -1\n1 1.5, 1e0\n")
        _, summary = self.reconstruct("box", "--bounds", file)
        self.assertEqual(summary["options"]["bounds"], [-1, -1.5, -1, 1, 1.5, 1])
        for text, found in (("-1 -1 zero\n1 1 1", "-1,-1,zero,1,1,1"), ("1 2 3", "1,2,3"), ("", "")):
            file.write_text(text)
            self.expect_error(2, f'--bounds: {file}: found "{found}", expected 6 numbers', "info", self.data, "--bounds", file)
        self.expect_error(2, "or the name of a file that holds them", "info", self.data, "--bounds", self.folder / "no-box.txt")

    def test_mistakes_in_the_file_name_the_file_and_the_key(self):
        out = self.folder / "never"
        for text, message in [('{"pases": 3}', '"pases": found an unknown option'), ('{"passes": "many"}', '"passes"'),
                              ('{"passes": 3, "passes": 4}', "twice"), ("[]", "object"), ('{"passes": 3', "syntax"),
                              ('{"near": 3, "far": 2}', "--near must be below --far")]:
            with self.subTest(text):
                self.expect_error(2, message, "reconstruct", self.data, "-o", out, "--config", self.config(text))
        self.expect_error(2, "missing.json: found no such file", "reconstruct", self.data, "-o", out, "--config", self.folder / "missing.json")
        self.assertFalse(out.exists())


# Each option of `reconstruct`: what the run has besides, and a value that must change its result.
BLACK = ["--masks", "none"]  # the demo's black background is then a known colour
UNKNOWN = ["--masks", "none", "--background", "unknown"]
CHANGES = {
    "acceleration": ([], ["--acceleration", "1"]),
    "adaptive": (["--samples-per-voxel", "1"], ["--no-adaptive"]),
    "agreement": ([], ["--agreement", "linear"]),
    "agreement-scale": (["--agreement", "exponential"], ["--agreement-scale", "40"]),
    "all-passes": (["--tolerance", "0.5", "--passes", "6"], ["--all-passes"]),
    "background": (BLACK, ["--background", "none"]),
    "background-color": (BLACK + ["--background", "constant"], ["--background-color", "0.2,0.1,0.4"]),
    "bounds": ([], ["--bounds", "-1,-1,-1,1,1,1"]),
    "color-space": ([], ["--color-space", "hsv"]),
    "confidence-threshold": ([], ["--confidence-threshold", "0.5"]),
    "draft-passes": ([], ["--draft-passes", "0"]),
    "evidence-half": ([], ["--evidence-half", "2"]),
    "far": ([], ["--far", "5"]),
    "filter-background": (BLACK, ["--filter-background"]),
    "filter-rays": ([], ["--filter-rays"]),
    "format": ([], ["--format", "colmap"]),
    "illumination": ([], ["--illumination", "gain"]),
    "images": ([], ["--images", "00[012]*"]),
    "interpolate": ([], ["--interpolate"]),
    "levels": ([], ["--levels", "1"]),
    "masks": ([], ["--masks", "none"]),
    "matching": ([], ["--matching", "local"]),
    "matching-blur": (["--matching", "local"], ["--matching-blur", "20"]),
    "near": ([], ["--near", "5"]),
    "nodes": ([], ["--nodes", "1:4"]),
    "noise": ([], ["--noise", "9"]),
    "observation-weight": ([], ["--observation-weight", "6"]),
    "opacity-threshold": ([], ["--opacity-threshold", "0.3"]),
    "outlier": ([], ["--outlier", "0.01"]),
    "passes": ([], ["--passes", "1"]),
    "predictive": ([], ["--no-predictive"]),
    "prior-opacity": ([], ["--prior-opacity", "0.1"]),
    "prior-strength": ([], ["--prior-strength", "50"]),
    "ray-weights": ([], ["--ray-weights"]),
    "resolution": ([], ["--resolution", "24"]),
    "response": ([], ["--response", "linear"]),
    "samples-per-voxel": ([], ["--samples-per-voxel", "0.5"]),
    "spatial-prior": ([], ["--spatial-prior", "0"]),
    "surround": (UNKNOWN, ["--surround", "off"]),
    "tolerance": ([], ["--tolerance", "0.5"]),
    "uninformative": ([], ["--uninformative", "0.1"]),
    "update": ([], ["--update", "roxels"]),
    "voxel-size": ([], ["--voxel-size", "0.3"]),
    "white-point": ([], ["--white-point", "A"]),
}
# Options of the depth stage: what is given besides, and a value that must change the depth maps.
DEPTH_CHANGES = {
    "bp": ([], ["--no-bp"]),
    "bp-fill": ([], ["--bp-fill"]),
    "bp-prior": ([], ["--bp-prior", "plain"]),
    "bp-schedule": ([], ["--bp-schedule", "residual"]),
    "bp-sigma": ([], ["--bp-sigma", "0.3"]),
    "bp-sweeps": ([], ["--bp-sweeps", "2"]),
    "depth-estimate": ([], ["--depth-estimate", "median"]),
    "depth-weight": ([], ["--depth-weight", "times-opacity"]),
    "refine": ([], ["--no-refine"]),
    "refine-agree": ([], ["--no-refine-agree"]),
    "refine-noise": ([], ["--refine-noise", "0.2"]),
    "refine-pixel-sigma": ([], ["--refine-pixel-sigma", "1"]),
    "refine-radius": ([], ["--refine-radius", "2"]),
    "refine-rounds": ([], ["--refine-rounds", "0"]),
    "refine-scale": ([], ["--refine-scale", "2"]),
    "seed": ([], ["--seed", "7"]),
    "refine-sigmas": ([], ["--refine-sigmas", "0.5"]),
    "refine-views": ([], ["--refine-views", "1"]),
}
# Options that change files or what is said, and not the numbers; the tests of Switches and Depth are theirs.
ELSEWHERE = set(DEPTH_CHANGES) | {"checkpoints", "checkpoint-interval", "resume", "memory", "export", "depth", "dry-run", "init", "json", "quiet", "render", "report", "save-surround", "sky", "sky-again", "sky-light", "sky-masks", "sun", "threads", "verbose"}
# Those of the surface, in mesh_test.py.
MESH = {"colors", "faces", "hole-size", "level-seams", "mesh", "mesh-band", "mesh-error", "mesh-pictures", "mesh-smooth",
        "mesh-voxel-size", "min-views", "seam-cost", "smallest-part", "texture", "texture-size", "transient"}


def numbers(summary):
    """What a run found, apart from how it was asked for and how long it took."""
    kept = {k: summary[k] for k in ("termination", "levels", "passes", "views", "reprojection_rms_percent")}
    kept = json.loads(json.dumps(kept))
    for record in kept["levels"] + kept["passes"]:
        for key in list(record):
            if "seconds" in key or key in ("ns_per_step", "peak_memory_bytes"):
                del record[key]
    return kept


class Options(Case):
    def test_every_option_has_a_case(self):
        _, summary = self.reconstruct("names")
        self.assertEqual(set(summary["options"]), set(CHANGES) | ELSEWHERE | MESH)

    def test_every_option_changes_something(self):
        known = {}
        for option, (base, change) in CHANGES.items():
            with self.subTest(option):
                key = tuple(base)
                if key not in known:
                    known[key] = self.result(base)
                changed = self.result(base + change)
                self.assertNotEqual(known[key], changed)

    def result(self, arguments):
        out, summary = self.reconstruct("run", "--no-bp", "--no-refine", *arguments)
        # What decides about the photographs' reading is part of the result, too.
        return numbers(summary), summary["dataset"]["format"], digest(out / "voxels.ply")

    def test_every_option_is_in_help_and_in_the_docs(self):
        text = self.succeed("reconstruct", "--help").stdout
        docs = (SOURCE / "docs/options.md").read_text() + (SOURCE / "docs/commands.md").read_text()
        for option in set(CHANGES) | ELSEWHERE | MESH:
            pattern = rf"--(no-)?{option}\b"
            self.assertRegex(text, pattern)
            self.assertRegex(docs, pattern)

    def test_the_options_in_the_docs_are_those_of_the_program(self):
        page = (SOURCE / "docs/commands.md").read_text()
        made = self.succeed("help-markdown").stdout
        self.assertEqual(page[page.index(made.split("\n", 1)[0]):], made,
                         "docs/commands.md: its end is what `roxel help-markdown` prints")


class Depth(Case):
    REFINED = (b"Z.bp", b"V.bp", b"Z.refined", b"V.refined", b"N.x", b"N.y", b"N.z")

    def maps(self, out):
        return [digest(out / f"depth/00{i}.exr") for i in range(4)]

    def channels(self, out):
        head = (out / "depth/000.exr").read_bytes()[:2000]
        return [name for name in self.REFINED if name + b"\0" in head]

    def test_every_option_changes_the_depth_maps(self):
        out, _ = self.reconstruct("options", "--no-render", "--no-report")
        known = self.maps(out)
        for option, (base, change) in DEPTH_CHANGES.items():
            with self.subTest(option):
                self.succeed("depth", out, *base, *change, "--quiet")
                self.assertNotEqual(known, self.maps(out))

    def test_reconstruct_and_depth_make_the_same_maps_with_any_number_of_threads(self):
        out, summary = self.reconstruct("same", "--no-render", "--threads", "2")
        known = self.maps(out)
        self.assertEqual(self.channels(out), list(self.REFINED))
        for arguments in [["--threads", "1"], ["--threads", "3"], ["--from-volume"]]:
            self.succeed("depth", out, *arguments, "--quiet")
            self.assertEqual(known, self.maps(out), arguments)
        again = json.loads((out / "summary.json").read_text())
        self.assertEqual(sorted(s["name"] for s in summary["stages"]), sorted(s["name"] for s in again["stages"]))
        self.assertEqual(summary["depth"]["refined"]["pixels"], again["depth"]["refined"]["pixels"])
        self.assertLess(again["depth"]["bp"]["mean_variance_after"], again["depth"]["bp"]["mean_variance_before"])
        self.assertGreater(again["depth"]["refined"]["matched_pixels"], 100)
        self.assertFalse(any(name.startswith(".") for name in files_below(out)), files_below(out))

    def test_memory_changes_no_map_and_is_no_part_of_a_run(self):
        out, _ = self.reconstruct("held", "--no-render", "--no-report")
        known = self.maps(out)
        self.succeed("depth", out, "--memory", "0.01", "--quiet")
        self.assertEqual(known, self.maps(out))
        self.expect_error(2, "--memory", "depth", out, "--memory", "0")

    def test_the_runs_own_light_holds_when_its_volume_is_marched_through_again(self):
        out, summary = self.reconstruct("lit", "--no-render", "--illumination", "gain", "--matching", "local")
        self.assertGreater(len({tuple(view["light"]) for view in summary["views"]}), 1)
        known = self.maps(out)
        self.succeed("depth", out, "--from-volume", "--quiet")
        self.assertEqual(known, self.maps(out))

    def test_parts_can_be_left_out_and_leave_nothing_old(self):
        out, summary = self.reconstruct("parts", "--no-bp", "--no-refine", "--no-render")
        self.assertEqual(self.channels(out), [])
        self.assertNotIn("depth", summary)
        self.succeed("depth", out, "--quiet")
        self.succeed("depth", out, "--no-refine", "--quiet")
        self.assertEqual(self.channels(out), [b"Z.bp", b"V.bp"])
        self.succeed("depth", out, "--no-bp", "--quiet")
        self.assertEqual(self.channels(out), list(self.REFINED[2:]))

    def test_the_page_is_drawn_again(self):
        out, _ = self.reconstruct("page", "--no-bp", "--no-refine", "--no-mesh")
        before = (out / "report.html").read_text()
        self.assertNotIn("depth, refined", before)
        self.succeed("depth", out, "--quiet")
        after = (out / "report.html").read_text()
        for caption in ("depth, refined", "normals", "<figcaption>render", "<figcaption>error", "refine depth"):
            self.assertIn(caption, after)
        self.assertEqual(before.count("<svg"), after.count("<svg"))
        (out / "report.html").unlink()
        self.succeed("depth", out, "--quiet")
        self.assertFalse((out / "report.html").exists(), "a run without a page gets none")

    def test_a_full_disc_leaves_the_earlier_depth_maps(self):
        out, _ = self.reconstruct("full", "--no-render", "--no-mesh")
        with_room = self.folder / "with-room"
        shutil.copytree(out, with_room)
        change = ["--no-refine", "--bp-sigma", "0.5", "--quiet"]
        self.succeed("depth", with_room, *change)
        largest = max(file.stat().st_size for file in (with_room / "depth").glob("*.exr"))
        before = digests(out)
        # The last lets all be written but a file's last few bytes, which a careless writer loses in silence.
        for most_bytes in (largest // 10, largest // 2, largest - 10):
            with self.subTest(most_bytes):
                done = run_on_a_full_disc("depth", out, *change, most_bytes=most_bytes)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertIn("cannot write", done.stderr)
                self.assertEqual(digests(out), before)

    def test_a_run_without_depth_maps_is_marched_through(self):
        out, _ = self.reconstruct("bare", "--no-depth", "--no-render")
        said = json.loads(self.succeed("depth", out, "--json").stdout)
        self.assertGreater(said["refined"]["pixels"], 100)
        self.assertEqual(self.channels(out), list(self.REFINED))

    def test_eval_measures_the_methods_side_by_side(self):
        out, _ = self.reconstruct("measured", "--no-render")
        metrics = self.folder / "measured-metrics"
        text = self.succeed("eval", out, "-o", metrics).stdout
        self.assertRegex(text, r"\| volume .*\n\| bp .*\n\| refined ")
        methods = json.loads((metrics / "metrics.json").read_text())["depth"]["methods"]
        self.assertEqual(list(methods), ["volume", "bp", "refined"])
        for measured in methods.values():
            self.assertGreater(measured["median_sigma_voxels"], 0)
            self.assertTrue(0 <= measured["coverage_68"] <= measured["coverage_95"] <= 1)
        self.assertNotEqual(methods["volume"]["log_loss"], methods["refined"]["log_loss"])
        self.assertIn("depth error, refined", (metrics / "report.html").read_text())

    def test_depth_goes_to_colmap(self):
        out, _ = self.reconstruct("exported", "--export", "colmap", "--no-render")
        there = self.folder / "workspace"
        self.succeed("convert", out, "--to", "colmap-dense", "-o", there, "--quiet")
        self.assertEqual(digests(out / "colmap"), digests(there))
        for kind, planes in (("depth", 1), ("normal", 3)):
            data = (there / f"stereo/{kind}_maps/000.png.geometric.bin").read_bytes()
            head = f"64&48&{planes}&".encode()
            self.assertTrue(data.startswith(head), data[:20])
            self.assertEqual(len(data), len(head) + 4 * 64 * 48 * planes)
        self.assertEqual((there / "stereo/fusion.cfg").read_text(), "000.png\n001.png\n002.png\n003.png\n")
        tracks = (there / "sparse/points3D.txt").read_text().splitlines()[1:]
        self.assertTrue(tracks and all(len(line.split()) >= 12 for line in tracks))

    def test_a_disc_that_is_full_leaves_no_half_workspace(self):
        out, _ = self.reconstruct("full", "--no-render", "--no-report")
        there = self.folder / "half"
        largest = 4 * 64 * 48 * 3  # a normal map, but for its head
        for most_bytes in (5000, largest - 10):
            with self.subTest(most_bytes):
                done = run_on_a_full_disc("convert", out, "--to", "colmap-dense", "-o", there, "--quiet", most_bytes=most_bytes)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertRegex(done.stderr, "half.*(cannot write|writing failed)")
                self.assertFalse(there.exists())

    def test_a_box_that_nothing_is_in_has_no_depth(self):
        empty = ["--bounds=-1.5,-1.5,1.4,-1.2,-1.2,1.8", "--no-report", "--export", "colmap"]
        out, summary = self.reconstruct("nothing", *empty)
        self.assertTrue(any(note.startswith("no export: ") for note in summary["notes"]), summary["notes"])
        self.assertFalse((out / "colmap").exists())
        voxels = self.folder / "voxels-alone"
        finer = ["--resolution", "24", "--levels", "1", "--passes", "2", "--no-mesh", "--quiet"]
        self.succeed("reconstruct", self.data, "-o", voxels, *finer, *empty)
        there = self.folder / "of-nothing"
        table = [("volume.vdb: found no voxels", out, ["depth", out]),
                 ("no view has depth in the box", out, ["mesh", out]),
                 ("no pixel with depth in any view", out, ["convert", out, "--to", "colmap-dense", "-o", there]),
                 ("no pixel with depth in any view", voxels, ["depth", voxels]),
                 ("no pixel with depth in any view", voxels, ["depth", voxels, "--from-volume", "--no-bp"])]
        for message, folder, command in table:
            with self.subTest(command):
                before = digests(folder)
                self.expect_error(2, message, *command, "--quiet")
                self.assertEqual(digests(folder), before)
        self.assertFalse(there.exists())

    @unittest.skipIf(os.geteuid() == 0, "root may write anywhere")
    def test_folders_that_cannot_be_written_to_are_named(self):
        out, _ = self.reconstruct("locked", "--no-render", "--no-report")
        out.chmod(0o555)
        self.addCleanup(out.chmod, 0o755)
        self.expect_error(1, "locked: cannot be written to", "depth", out, "--quiet")

    def test_places_that_cannot_be_made_are_named(self):
        out, _ = self.reconstruct("placed", "--no-render", "--no-report")
        self.expect_error(1, "cannot be made", "convert", out, "--to", "colmap-dense", "-o", "/proc/roxel", "--quiet")
        (self.folder / "a-file").write_text("x")
        self.expect_error(2, "a file", "convert", out, "--to", "colmap-dense", "-o", self.folder / "a-file", "--quiet")

    def test_depth_without_either_method_leaves_the_volume_s_alone(self):
        out, _ = self.reconstruct("plain-again", "--no-report", "--export", "colmap")
        self.assertEqual(self.channels(out), list(self.REFINED))
        said = self.succeed("depth", out, "--no-bp", "--no-refine").stderr
        self.assertIn("colmap is still of the earlier depth maps", said)
        self.assertEqual(self.channels(out), [])
        summary = json.loads((out / "summary.json").read_text())
        self.assertIsNone(summary["depth"])
        self.assertFalse({"belief propagation", "refine depth"} & {stage["name"] for stage in summary["stages"]})

    def test_a_run_without_depth_has_nothing_to_convert(self):
        out, _ = self.reconstruct("no-maps", "--no-depth", "--no-render", "--no-report")
        self.expect_error(2, "no depth/000.exr, expected a run with depth maps", "convert", out, "--to", "colmap-dense", "-o",
                          self.folder / "none")
        self.assertFalse((self.folder / "none").exists())

    def test_filling_keeps_to_what_masks_call_foreground(self):
        plain, _ = self.reconstruct("unfilled", "--no-refine", "--no-report", "--export", "colmap")
        filled, _ = self.reconstruct("filled", "--no-refine", "--no-report", "--export", "colmap", "--bp-fill")
        count = {}
        for out in (plain, filled):
            data = (out / "colmap/stereo/depth_maps/000.png.geometric.bin").read_bytes()
            values = struct.unpack(f"<{64 * 48}f", data[-4 * 64 * 48:])
            count[out] = sum(z > 0 for z in values)
        self.assertGreater(count[filled], count[plain])
        self.assertLess(count[filled], 0.6 * 64 * 48, "the sky has no depth")

    def test_bad_runs_are_named(self):
        self.expect_error(2, "expected the folder of a finished run", "depth", self.data)
        self.expect_error(2, "a finished run", "convert", self.data, "--to", "colmap-dense", "-o", self.folder / "no")
        out, _ = self.reconstruct("bad", "--no-render")
        known = self.maps(out)[1:]
        summary = (out / "summary.json").read_text()
        (out / "depth/000.exr").write_bytes(b"not an image")
        self.expect_error(2, "000.exr", "depth", out, "--quiet")
        self.assertEqual(self.maps(out)[1:], known)
        self.assertEqual((out / "summary.json").read_text(), summary)
        self.expect_error(2, "--refine-views", "depth", out, "--refine-views", "0")


class Switches(Case):
    def test_stages_can_be_left_out(self):
        out, summary = self.reconstruct("bare", "--no-depth", "--no-render", "--no-report")
        self.assertEqual(files_below(out), ["summary.json", "volume.vdb", "voxels.ply"])
        self.assertIsNone(summary["reprojection_rms_percent"])
        out, summary = self.reconstruct("depth-only", "--no-render")
        self.assertEqual(files_below(out / "depth"), [f"00{i}.{s}" for i in range(4) for s in ("exr", "png")])
        self.assertFalse((out / "render").exists() or (out / "error").exists())
        out, summary = self.reconstruct("render-only", "--no-depth")
        self.assertEqual(files_below(out / "error"), [f"00{i}.png" for i in range(4)])
        self.assertFalse((out / "depth").exists())
        self.assertLess(summary["reprojection_rms_percent"], 40)

    def test_a_switch_takes_a_value(self):
        _, summary = self.reconstruct("off", "--depth=false", "--no-render=true", "--no-adaptive=on", "--dry-run=0")
        self.assertEqual([summary["options"][k] for k in ("depth", "render", "adaptive", "dry-run")], [False] * 4)
        _, summary = self.reconstruct("on", "--no-depth=false", "--no-render", "--no-render=off", "--adaptive=1")
        self.assertEqual([summary["options"][k] for k in ("depth", "render", "adaptive")], [True] * 3)

    def test_surround_is_saved_only_when_asked_for(self):
        plain, _ = self.reconstruct("plain", *UNKNOWN)
        all_lattices, summary = self.reconstruct("all", *UNKNOWN, "--save-surround")
        self.assertGreater(summary["scene"]["surround_lattices"], 0)
        self.assertGreater(summary["levels"][-1]["voxels_around"], 0)
        self.assertGreater((all_lattices / "volume.vdb").stat().st_size, (plain / "volume.vdb").stat().st_size)

    def test_init_goes_on_from_a_run(self):
        first, summary = self.reconstruct("first")
        _, fresh = self.reconstruct("fresh", "--levels", "1")
        _, warm = self.reconstruct("warm", "--levels", "1", "--init", first)
        rms = "reprojection_rms_percent"
        self.assertLess(warm[rms], fresh[rms])
        self.expect_error(2, "--color-space", "reconstruct", self.data, "-o", self.folder / "never", *TINY, "--init", first,
                  "--color-space", "rgb")

    def test_quiet_is_silent_and_verbose_says_more(self):
        arguments = ["reconstruct", self.data, "-o", self.folder / "talk", *TINY]
        quiet = self.succeed(*arguments, "--quiet")
        self.assertEqual(quiet.stdout + quiet.stderr, "")
        normal = self.succeed(*arguments)
        self.assertEqual(len(re.findall(r"level \d/2 pass \d/2: \d+ voxels", normal.stderr)), 4)
        verbose = self.succeed(*arguments, "--verbose")
        self.assertIn("background: mask", verbose.stderr)
        self.assertNotIn("background: mask", normal.stderr)

    def test_json_is_the_summary(self):
        out = self.folder / "json"
        done = self.succeed("reconstruct", self.data, "-o", out, *TINY, "--json")
        self.assertEqual(json.loads(done.stdout), json.loads((out / "summary.json").read_text()))
        for command in (["info", self.data], ["reconstruct", self.data, "--dry-run"], ["eval", out],
                        ["render", out, "-o", self.folder / "views"], ["synth", "demo", "-o", self.folder / "small"],
                        ["convert", self.data, "-o", self.folder / "converted"]):
            with self.subTest(command[0]):
                size = ["--images", "2", "--size", "16x16"] if command[0] == "synth" else []
                self.assertIsInstance(json.loads(self.succeed(*command, *size, "--json").stdout), dict)


class Files(Case):
    def test_a_run_holds_what_the_format_page_lists(self):
        out, summary = self.reconstruct("run")
        views = [f"00{i}" for i in range(4)]
        expected = ["summary.json", "volume.vdb", "voxels.ply", "overview.png", "report.html"]
        expected += [f"depth/{v}.exr" for v in views]
        expected += [f"{kind}/{v}.png" for kind in ("depth", "render", "error") for v in views]
        self.assertEqual(files_below(out), sorted(expected))
        self.assertEqual([v["name"] for v in summary["views"]], views)
        for view in summary["views"]:
            self.assertEqual(len(view["hash"]), 16)
            self.assertGreater(view["object_pixels"], 100)
            self.assertTrue(0.05 < view["depth_share"] < 0.9)
        self.assertEqual(len(summary["passes"]), 4)
        self.assertEqual(len(summary["levels"]), 2)

    def test_hashes_tell_data_sets_apart(self):
        other = self.folder / "other"
        shutil.copytree(self.data, other)
        shutil.copy(other / "images/000.png", other / "images/001.png")
        _, first = self.reconstruct("run")
        _, second = self.reconstruct("other-run", data=other)
        self.assertEqual(first["views"][0]["hash"], second["views"][0]["hash"])
        self.assertNotEqual(first["views"][1]["hash"], second["views"][1]["hash"])
        self.assertNotEqual(first["dataset"]["hash"], second["dataset"]["hash"])

    def test_a_second_run_leaves_nothing_of_the_first(self):
        out, _ = self.reconstruct("twice")
        mine = out / "depth/mine.txt"
        mine.write_text("not roxel's")
        self.reconstruct("twice", "--images", "00[01].png")
        self.assertEqual([f for f in files_below(out / "depth")], ["000.exr", "000.png", "001.exr", "001.png", "mine.txt"])

    def test_results_do_not_depend_on_threads(self):
        runs = []
        for threads in (1, 2, 4):
            out, summary = self.reconstruct(f"threads{threads}", "--threads", threads)
            self.assertEqual(summary["threads"], threads)
            names = [f for f in files_below(out) if f.endswith((".ply", ".png", ".exr"))]
            runs.append((numbers(summary), summary["dataset"], {f: digest(out / f) for f in names}))
        self.assertEqual(runs[0], runs[1])
        self.assertEqual(runs[0], runs[2])


class OtherCommands(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_folder = cls.folder / "base"
        done = run("reconstruct", cls.data, "-o", cls.run_folder, *TINY, "--passes", "4")
        assert done.returncode == 0, done.stderr

    def test_render_from_the_own_cameras_is_the_run_s_render(self):
        out = self.folder / "views"
        self.succeed("render", self.run_folder, "--cameras", self.data, "-o", out)
        self.assertEqual(len(files_below(out)), 4 * 4)
        for i in range(4):
            # The run draws along with depth, whose rays may end a ten-thousandth of their light earlier or later.
            same = subprocess.run(["oiiotool", "--fail", "0.001", "--failpercent", "1", "--hardfail", "0.004", "--diff",
                                   out / f"render/00{i}.png", self.run_folder / f"render/00{i}.png"], capture_output=True, text=True)
            self.assertEqual(same.returncode, 0, same.stdout)
        self.succeed("render", self.run_folder, "-o", self.folder / "again", "--background-color", "1,0,0")
        self.assertNotEqual(digest(self.folder / "again/render/000.png"), digest(out / "render/000.png"))

    def test_eval_measures_depth_against_the_truth(self):
        out = self.folder / "metrics"
        table = self.succeed("eval", self.run_folder, "--truth", self.data, "-o", out).stdout
        self.assertIn("| 003 |", table)
        metrics = json.loads((out / "metrics.json").read_text())
        within = metrics["depth"]["share_within_voxels"]
        self.assertEqual(list(within), ["0.5", "1", "2", "4", "8"])
        shares = list(within.values())
        self.assertEqual(shares, sorted(shares))
        self.assertGreater(within["4"], 0.5)
        self.assertLess(metrics["depth"]["share_of_empty_given_depth"], 0.2)
        self.assertEqual(len(metrics["depth"]["views"]), 4)
        # Measured against the truth of another world, it is wrong.
        other = self.folder / "other-world"
        self.succeed("synth", "demo", "-o", other, "--images", 5, "--size", "64x48", "--seed", 9, "--quiet")
        wrong = json.loads(self.succeed("eval", self.run_folder, "--truth", other, "--json").stdout)
        self.assertLess(wrong["depth"]["share_within_voxels"]["1"], 0.8 * within["1"])
        self.expect_error(2, "no folder depth", "eval", self.run_folder, "--truth", self.folder)

    def test_merge_of_halves_has_the_voxels_of_both(self):
        voxel = 3 / 16
        for name, bounds in (("left", f"-1.5,-1.5,-1.2,0,1.5,1.8"), ("right", f"0,-1.5,-1.2,1.5,1.5,1.8")):
            out = self.folder / name
            self.succeed("reconstruct", self.data, "-o", out, "--levels", "1", "--passes", "2", "--voxel-size", voxel,
                         f"--bounds={bounds}", "--no-depth", "--no-render")
        merged = self.folder / "merged"
        self.succeed("merge", self.folder / "left", self.folder / "right", "-o", merged)
        count = {n: json.loads((self.folder / n / "summary.json").read_text()) for n in ("left", "right", "merged")}
        halves = [count[n]["levels"][-1]["voxels_in_box"] for n in ("left", "right")]
        self.assertEqual(count["merged"]["voxels_in_box"], sum(halves))
        self.assertEqual(len(count["merged"]["merged_from"]), 2)
        self.succeed("render", merged, "--cameras", self.data, "-o", self.folder / "merged-views")

    def test_merge_refuses_what_does_not_fit(self):
        rgb, _ = self.reconstruct("rgb", "--color-space", "rgb")
        self.expect_error(2, "colour space rgb, expected luv", "merge", self.run_folder, rgb, "-o", self.folder / "never")
        self.expect_error(2, "given twice", "merge", self.run_folder, f"{self.run_folder}/.", "-o", self.folder / "never")
        self.assertFalse((self.folder / "never").exists())

    def test_convert_gives_the_same_cameras_in_both_formats(self):
        runs = []
        for target in ("transforms", "colmap"):
            out = self.folder / target
            self.succeed("convert", self.data, "-o", out, "--to", target)
            info = json.loads(self.succeed("info", out, "--json").stdout)
            self.assertEqual((info["format"], info["images"], info["masks"]), (target, 4, 4))
            runs.append(self.reconstruct("from-" + target, "--bounds", "-1.5,-1.5,-1.2,1.5,1.5,1.8", data=out)[1])
        original = self.reconstruct("from-data", "--bounds", "-1.5,-1.5,-1.2,1.5,1.5,1.8")[1]
        for converted in runs:
            self.assertAlmostEqual(converted["reprojection_rms_percent"], original["reprojection_rms_percent"], delta=0.2)

    def test_info_says_what_the_data_set_holds(self):
        info = json.loads(self.succeed("info", self.data, "--json", "--resolution", "256").stdout)
        self.assertEqual((info["format"], info["images"], info["nodes"], info["image_sizes"]), ("transforms", 4, 4, "64 x 48"))
        self.assertEqual(info["voxels"], [256, 256, 256])
        self.assertGreater(info["estimate"]["memory_bytes"], 1e6)
        seconds = [json.loads(self.succeed("info", self.data, "--json", *refining).stdout)["estimate"]["depth_seconds"]
                   for refining in ([], ["--refine-scale", "4"], ["--no-refine"])]
        self.assertEqual(seconds, sorted(seconds, reverse=True))
        self.assertEqual(len(set(seconds)), 3)
        fine = json.loads(self.succeed("info", self.data, "--json", "--resolution", "512").stdout)
        self.assertTrue(any("pixel" in warning for warning in fine["warnings"]), fine["warnings"])

    def test_info_foresees_what_a_run_needs(self):
        data = self.folder / "larger"
        self.synth(data, 8, "160x120")
        size = ["--resolution", "64", "--passes", "1", "--threads", "2"]
        foreseen = json.loads(self.succeed("info", data, *size, "--json").stdout)["estimate"]
        self.succeed("reconstruct", data, "-o", self.folder / "larger-run", *size, "--no-depth", "--no-render", "--quiet")
        used = json.loads((self.folder / "larger-run/summary.json").read_text())
        pairs = {"memory": (foreseen["memory_bytes"], used["peak_memory_bytes"])}
        for i, level in enumerate(used["levels"]):
            pairs[f"voxels of level {i + 1}"] = (foreseen["levels"][i]["voxels"], level["voxels_in_box"])
        for name, (expected, found) in pairs.items():
            self.assertTrue(0.5 < expected / found < 2, f"{name}: {expected} foreseen, {found} found")

    def test_memory_is_kept_to_and_changes_no_result(self):
        data = self.folder / "many"
        self.synth(data, 24, "320x240")
        size = ["--resolution", "32", "--levels", "2", "--passes", "2", "--threads", "1"]
        free = json.loads(self.succeed("info", data, *size, "--json").stdout)["estimate"]
        self.assertTrue(free["memory_fits"])
        self.assertNotIn("made anew", self.succeed("info", data, *size).stdout)
        tight = 0.9 * free["memory_bytes"] / 2**30
        said = self.succeed("info", data, *size, "--memory", tight).stdout
        self.assertIn("of samples are made anew in each pass", said)
        found = {}
        for name, arguments in (("ample", []), ("tight", ["--memory", str(tight)])):
            out = self.folder / name
            self.succeed("reconstruct", data, "-o", out, *size, *arguments, "--no-mesh", "--no-refine", "--quiet")
            found[name] = numbers(json.loads((out / "summary.json").read_text())), digest(out / "voxels.ply")
        self.assertEqual(found["ample"], found["tight"])
        used = json.loads((self.folder / "tight/summary.json").read_text())["peak_memory_bytes"]
        self.assertLess(used, tight * 2**30)

    def test_too_little_memory_is_said_before_the_start(self):
        out = self.folder / "never"
        self.assertIn("--voxel-size", self.expect_error(2, "--memory: found 0.30 GiB where about ", "reconstruct", self.data,
                                                        "-o", out, "--memory", "0.3", "--resolution", "512").stderr)
        self.assertFalse(out.exists())
        said = self.succeed("info", self.data, "--memory", "0.3", "--resolution", "512")
        self.assertRegex(said.stdout, r"WARNING +memory: 0.30 GiB where about .* would fit")

    def test_synth_depends_on_its_seed_alone(self):
        worlds = {}
        for name, seed in (("a", 5), ("b", 5), ("c", 6)):
            out = self.folder / ("world-" + name)
            self.succeed("synth", "demo", "-o", out, "--images", "2", "--size", "32x24", "--seed", seed)
            worlds[name] = {f: digest(out / f) for f in files_below(out)}
        self.assertEqual(worlds["a"], worlds["b"])
        self.assertNotEqual(worlds["a"]["images/000.png"], worlds["c"]["images/000.png"])


# What an option of synth changes: files of which folder, and which stay as they were.
SYNTH_CHANGES = {
    "background": (["plane"], ["--background", "sky"], "images", "depth"),
    "images": (["plane"], ["--images", "3"], "transforms.json", None),
    "light": (["plane"], ["--light", "daylight"], "images", "albedo"),
    "moving-shadows": (["plane", "--light", "daylight"], ["--no-moving-shadows"], "images", "albedo"),
    "noise": (["plane"], ["--noise", "0.05"], "images", "depth"),
    "pose-noise": (["plane"], ["--pose-noise", "0.5,0.01"], "transforms.json", "images"),
    "samples": (["plane"], ["--samples", "3"], "images", "depth"),
    "seed": (["plane"], ["--seed", "2"], "images", "depth"),
    "size": (["plane"], ["--size", "24x20"], "images", "mesh.ply"),
    "transients": (["plane"], ["--transients", "2"], "images", "depth"),
}


class Synth(Case):
    """The worlds of `roxel synth`, tiny."""

    def make(self, name, world, *arguments, size="32x24", images=2):
        out = self.folder / name
        given = [str(a) for a in arguments]
        if "--size" not in given: given += ["--size", size]
        if "--images" not in given: given += ["--images", str(images)]
        if "--samples" not in given: given += ["--samples", "2"]
        self.succeed("synth", world, "-o", out, *given, "--quiet")
        return out

    def test_every_option_changes_what_it_says(self):
        text = self.succeed("synth", "--help").stdout
        known = {"threads", "quiet", "verbose", "json", "config", "help"}
        named = set(re.findall(r"--(?:no-)?([a-z-]+)", text))
        self.assertEqual(named - known, set(SYNTH_CHANGES) & named)
        self.assertEqual(set(SYNTH_CHANGES) - named, set())
        for option, ((world, *base), change, moved, kept) in SYNTH_CHANGES.items():
            with self.subTest(option):
                before, after = self.make(option + "-a", world, *base), self.make(option + "-b", world, *base, *change)
                part = lambda folder, below: {f: d for f, d in digests(folder).items() if f.startswith(below)}
                self.assertTrue(part(before, moved))
                self.assertNotEqual(part(before, moved), part(after, moved))
                if kept: self.assertEqual(part(before, kept), part(after, kept))

    def test_every_world_can_be_read_and_reconstructed(self):
        for world, nodes in (("plane", 3), ("head", 3), ("mug", 3), ("table", 3), ("flights", 3), ("street", 1)):
            with self.subTest(world):
                data = self.make("read-" + world, world, images=3)
                info = json.loads(self.succeed("info", data, "--json").stdout)
                self.assertEqual((info["format"], info["images"], info["nodes"]), ("transforms", 3, nodes))
                self.assertEqual(info["masks"], 0 if world == "table" else 3)
                self.reconstruct("run-" + world, data=data)

    def test_a_new_world_takes_the_place_of_an_older_one_and_of_nothing_else(self):
        out = self.make("again", "plane", "--transients", "1", images=3)
        self.make("again", "table")
        fresh = self.make("fresh", "table")
        self.assertEqual(digests(out), digests(fresh))
        square = self.make("square", "street", images=21, size="16x16")
        self.make("square", "table")
        self.assertEqual(digests(square), digests(fresh))
        self.assertFalse((square / "mask").exists())
        mine = self.folder / "mine"
        mine.mkdir()
        (mine / "transforms.json").write_text('{"frames": []}')
        self.expect_error(2, "did not make", "synth", "plane", "-o", mine)
        self.assertEqual(files_below(mine), ["transforms.json"])
        photographs = self.folder / "photographs"
        (photographs / "images").mkdir(parents=True)
        (photographs / "images" / "000.png").write_text("mine")
        self.expect_error(2, "did not make", "synth", "plane", "-o", photographs)
        self.assertEqual((photographs / "images" / "000.png").read_text(), "mine")

    def test_options_without_effect_are_refused(self):
        for world, option in (("plane", ["--no-moving-shadows"]), ("street", ["--light", "constant", "--no-moving-shadows"]),
                              ("table", ["--background", "black"])):
            self.expect_error(2, option[-1].lstrip("-") if option[-1] != "black" else "background", "synth", world,
                              "-o", self.folder / "none", *option)

    def test_every_node_has_its_light(self):
        for light in ("constant", "mix"):
            street = self.make("street-" + light, "street", "--light", light, images=41, size="16x16")
            nodes = json.loads((street / "illumination.json").read_text())["nodes"]
            frames = json.loads((street / "transforms.json").read_text())["frames"]
            self.assertEqual([n["node"] for n in nodes], sorted({f["node"] for f in frames}))
            for node in nodes:
                self.assertEqual(len(node["center"]), 3)
                self.assertTrue((street / node["equirect"]).is_file())
                self.assertTrue((street / node["equirect_without_disc"]).is_file())

    def test_json_says_what_was_made(self):
        made = json.loads(self.succeed("synth", "street", "-o", self.folder / "json", "--images", "21", "--size", "16x16",
                                       "--samples", "1", "--json").stdout)
        self.assertEqual((made["world"], made["images"], made["size"], made["occasions"]), ("street", 21, [16, 16], 2))


def digests(folder):
    return {f: digest(pathlib.Path(folder) / f) for f in files_below(folder)}


def run_on_a_full_disc(*arguments, most_bytes):
    """Runs roxel where files cannot grow beyond a size; what it said."""
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))
    return run(*arguments, preexec_fn=limit, restore_signals=False)


class Safety(Case):
    """Sources are never written over, and older results only by whole new ones."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name in ("one", "two"):
            done = run("reconstruct", cls.data, "-o", cls.folder / name, *TINY)
            assert done.returncode == 0, done.stderr
        cls.link = cls.folder / "link"
        cls.link.symlink_to(cls.data)
        (cls.folder / "link-to-one").symlink_to(cls.folder / "one")

    def refuse(self, message, *arguments):
        before = digests(self.folder)
        with self.subTest(" ".join(map(str, arguments))):
            self.expect_error(2, message, *arguments)
            self.assertEqual(digests(self.folder), before)

    def test_a_data_set_is_no_output(self):
        for command in ("reconstruct", "convert"):
            for out in (self.data, self.link, self.data / "images/..", self.folder / "missing/../link"):
                self.refuse("the data set itself", command, self.data, "-o", out)
            self.refuse("the data set itself", command, self.data / "transforms.json", "-o", self.data)
            self.refuse("the data set itself", command, self.link / "transforms.json", "-o", self.data)
        self.refuse("the data set itself", "render", self.folder / "one", "-o", self.data)
        self.refuse("a folder that is read", "eval", self.folder / "one", "--truth", self.data, "-o", self.link)

    def test_a_folder_with_images_or_masks_in_it_is_no_output(self):
        for command in ("reconstruct", "convert"):
            self.refuse("000.png in it", command, self.data, "-o", self.folder)
            self.refuse("000.png in it", command, self.data, "-o", self.link / "images")
            self.refuse("000.png in it", command, self.data, "-o", self.data / "mask")
            self.refuse("000.png in it", command, self.data / "sparse/0", "-o", self.data)

    def test_links_into_the_sources_are_not_written_through(self):
        for name in ("depth", "images"):
            out = self.folder / f"with-{name}"
            out.mkdir()
            (out / name).symlink_to(self.data / name)
            self.refuse(f"a link {name}", "reconstruct", self.data, "-o", out)
            self.refuse(f"a link {name}", "convert", self.data, "-o", out)

    def test_a_run_that_is_read_is_no_output(self):
        one, two = self.folder / "one", self.folder / "two"
        for out in (one, self.folder / "link-to-one"):
            self.refuse("a folder that is read", "merge", one, two, "-o", out)
            self.refuse("a folder that is read", "merge", two, one, "-o", out)
            self.refuse("a folder that is read", "render", one, "-o", out)
            self.refuse("a folder that is read", "eval", one, "-o", out)
            self.refuse("a folder that is read", "reconstruct", self.data, "-o", out, "--init", one, *TINY)

    def test_a_folder_in_the_data_set_may_be_an_output(self):
        data = self.folder / "own"
        shutil.copytree(self.data, data)
        for _ in range(2):
            self.succeed("reconstruct", data, "-o", data / "run", *TINY)
        self.succeed("convert", data, "-o", data / "undistorted")

    def test_a_failing_command_leaves_the_older_run(self):
        older = self.folder / "older"
        shutil.copytree(self.folder / "one", older)
        before = digests(older)
        most_bytes = (older / "voxels.ply").stat().st_size // 2
        for command in (["reconstruct", self.data, *TINY], ["merge", self.folder / "one", self.folder / "two"]):
            with self.subTest(command[0]):
                done = run_on_a_full_disc(*command, "-o", older, most_bytes=most_bytes)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertEqual(digests(older), before)
                self.assertFalse((older / ".partial").exists())

    def test_a_result_in_whose_place_is_a_folder_leaves_the_older_run(self):
        older = self.folder / "blocked"
        shutil.copytree(self.folder / "one", older)
        (older / "depth/000.exr").unlink()
        (older / "depth/000.exr").mkdir()
        before = digests(older)
        self.assertEqual(run("reconstruct", self.data, "-o", older, *TINY, "--quiet").returncode, 1)
        kept = digests(older)
        self.assertIsNotNone(kept.pop("checkpoint/latest.roxel", None))  # without the folder it could go on
        kept.pop("checkpoint/previous.roxel", None)
        self.assertEqual(kept, before)
        self.assertFalse((older / ".partial").exists())

    def test_merge_replaces_an_older_run(self):
        older = self.folder / "merged"
        shutil.copytree(self.folder / "one", older)
        self.succeed("merge", self.folder / "one", self.folder / "two", "-o", older)
        self.assertEqual(files_below(older), ["summary.json", "volume.vdb", "voxels.ply"])

    def test_convert_of_a_broken_image_leaves_nothing(self):
        broken = self.folder / "broken"
        shutil.copytree(self.data, broken)
        (broken / "images/003.png").write_bytes((broken / "images/003.png").read_bytes()[:500])
        out = self.folder / "deep/converted"
        self.expect_error(2, "003.png", "convert", broken, "-o", out, "--threads", 1, "--quiet")
        self.assertFalse((self.folder / "deep").exists())
        self.succeed("convert", self.data, "-o", out)
        before = digests(out)
        self.expect_error(2, "003.png", "convert", broken, "-o", out, "--threads", 1, "--quiet")
        self.assertEqual(digests(out), before)


class Interrupt(Case):
    """Ctrl-C at different moments: code 130 soon, one line, and nothing half-written."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="roxel-cli-"))
        cls.data = cls.folder / "data"
        cls.synth(cls.data, 8, "160x120")

    PATIENCE_S = 10  # a second or two on an idle machine; builds and sanitizers share it

    def interrupt(self, out, moment, *arguments, number=signal.SIGINT):
        """Starts a run and signals it when `moment` is said; what it said, and how long it took to end."""
        job, said = start_until(moment, "reconstruct", self.data, "-o", out, *arguments)
        start = time.monotonic()
        job.send_signal(number)
        out_text, rest = job.communicate(timeout=60)
        self.assertLess(time.monotonic() - start, self.PATIENCE_S)
        self.assertEqual(job.returncode, 130, said + rest)
        self.assertEqual((said + rest).splitlines()[-1], "roxel: error: interrupted")
        self.assertEqual(out_text, "")

    LONG = ["--resolution", "128", "--levels", "2", "--passes", "200", "--all-passes"]

    def test_in_the_passes_leaves_nothing(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            out = self.folder / "fresh/run"
            self.interrupt(out, "level 1/2 pass 1/", *self.LONG, number=number)
            self.assertFalse((self.folder / "fresh").exists())

    def test_in_the_passes_leaves_an_older_run_as_it_was(self):
        out = self.folder / "older"
        self.succeed("reconstruct", self.data, "-o", out, *TINY)
        before = digests(out)
        self.interrupt(out, "level 1/2 pass 1/", *self.LONG)
        self.assertEqual(digests(out), before)

    def test_after_the_passes_leaves_an_older_run_as_it_was(self):
        out = self.folder / "older-late"
        self.succeed("reconstruct", self.data, "-o", out, *TINY)
        before = digests(out)
        self.interrupt(out, "writing", "--resolution", "128", "--levels", "1", "--passes", "1")
        kept = digests(out)
        self.assertIsNotNone(kept.pop("checkpoint/latest.roxel", None))  # resume_test.py goes on from such
        self.assertEqual(kept, before)
        self.assertFalse((out / ".partial").exists())

    def test_while_a_run_is_read_ends_in_order(self):
        run_folder = self.folder / "to-read"
        self.succeed("reconstruct", self.data, "-o", run_folder, *TINY)
        summary = (run_folder / "summary.json").read_text()
        (run_folder / "summary.json").unlink()
        os.mkfifo(run_folder / "summary.json")
        out = self.folder / "never"
        for command in (["eval", run_folder], ["render", run_folder], ["merge", run_folder, self.folder]):
            with self.subTest(command[0]):
                job = subprocess.Popen([ROXEL, *map(str, command), "-o", str(out)], stderr=subprocess.PIPE, text=True)
                with open(run_folder / "summary.json", "w") as pipe:  # opens when roxel does
                    job.send_signal(signal.SIGINT)
                    pipe.write(summary)
                self.assertEqual((job.communicate(timeout=60)[1], job.returncode), ("roxel: error: interrupted\n", 130))
                self.assertFalse(out.exists())

    def test_while_a_data_set_is_read_ends_in_order(self):
        slow = self.folder / "slow"
        shutil.copytree(self.data, slow)
        cameras = slow / "transforms.json"
        cameras.write_text(cameras.read_text() + " " * 50_000_000)
        out = self.folder / "never"
        for command in ("reconstruct", "convert"):
            with self.subTest(command):
                job = subprocess.Popen([ROXEL, command, str(cameras), "-o", str(out)], stderr=subprocess.PIPE, text=True)
                while job.poll() is None and not self.has_open(job, cameras):
                    pass
                job.send_signal(signal.SIGINT)
                self.assertEqual((job.communicate(timeout=60)[1], job.returncode), ("roxel: error: interrupted\n", 130))
                self.assertFalse(out.exists())

    @staticmethod
    def has_open(job, file):
        try:
            return any(f.exists() and f.samefile(file) for f in pathlib.Path(f"/proc/{job.pid}/fd").iterdir())
        except OSError:  # it has just been closed
            return False


class Terminal(Case):
    def test_a_bar_is_drawn_over_at_most_ten_times_a_second(self):
        import pty
        ours, theirs = pty.openpty()
        start = time.monotonic()
        job = subprocess.Popen([ROXEL, "reconstruct", str(self.data), "-o", str(self.folder / "run"), "--resolution", "32",
                                "--all-passes"], stdout=subprocess.DEVNULL, stderr=theirs)
        os.close(theirs)
        seen = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # the other end is closed
                break
            if not part:
                break
            seen += part
        self.assertEqual(job.wait(timeout=60), 0)
        seconds = time.monotonic() - start
        drawn = seen.decode().split("\r\033[K")
        self.assertEqual(drawn[0], "")
        self.assertEqual(drawn[-1], "", "the bar stays behind")
        self.assertLess(len(drawn), 10 * seconds + 5)
        percents = [int(m[1]) for m in (re.search(r"\] +(\d+) %", d) for d in drawn) if m]
        self.assertGreater(len(percents), 3)
        self.assertEqual(percents, sorted(percents))
        self.assertIn("volume [", seen.decode())
        self.assertRegex(seen.decode(), r"level \d/3, pass \d/8")


def main():
    global ROXEL, SOURCE
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    ROXEL = os.path.abspath(sys.argv.pop(1))
    SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
    unittest.main(argv=[sys.argv[0], *sys.argv[1:]])


if __name__ == "__main__":
    main()
