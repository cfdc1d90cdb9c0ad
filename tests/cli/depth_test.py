#!/usr/bin/env python3
"""Tests of the depth stage, of `roxel depth` and of what goes to COLMAP.

    depth_test.py ROXEL [unittest arguments]
"""

import json
import os
import shutil
import struct
import unittest

from program import Case, digest, digests, files_below, main, run_on_a_full_disc


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


class Depth(Case):
    REFINED = (b"Z.bp", b"V.bp", b"Z.refined", b"V.refined", b"N.x", b"N.y", b"N.z")

    def maps(self, out):
        return [digest(out / f"depth/00{i}.exr") for i in range(4)]

    def channels(self, out):
        head = (out / "depth/000.exr").read_bytes()[:2000]
        return [name for name in self.REFINED if name + b"\0" in head]

    def finished_run(self, name=None):
        """A run with all depth maps and no pictures: a copy of this name to change, or the one that all look at."""
        out, _ = self.reconstruct_once("--no-render", "--no-report")
        return shutil.copytree(out, self.folder / name) if name else out

    def test_every_option_changes_the_depth_maps(self):
        out = self.finished_run("options")
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
        out = self.finished_run("held")
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
        out, with_room = self.finished_run("full"), self.finished_run("with-room")
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
        out = self.finished_run()
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
        out = self.finished_run()
        there = self.folder / "half"
        largest = 4 * 64 * 48 * 3  # a normal map, but for its head
        for most_bytes in (5000, largest - 10):
            with self.subTest(most_bytes):
                done = run_on_a_full_disc("convert", out, "--to", "colmap-dense", "-o", there, "--quiet", most_bytes=most_bytes)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertRegex(done.stderr, "half.*(cannot write|writing failed)")
                self.assertFalse(there.exists())

    def test_a_box_that_nothing_is_in_has_no_depth(self):
        # Only pixels on the outline look through this corner and see the object, too.
        empty = ["--bounds=-1.5,-1.5,1.4,-1.2,-1.2,1.8", "--outline-weight", "1", "--no-report", "--export", "colmap"]
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
        out = self.finished_run("locked")
        out.chmod(0o555)
        self.addCleanup(out.chmod, 0o755)
        self.expect_error(1, "locked: cannot be written to", "depth", out, "--quiet")

    def test_places_that_cannot_be_made_are_named(self):
        out = self.finished_run()
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
        out = self.finished_run("bad")
        known = self.maps(out)[1:]
        summary = (out / "summary.json").read_text()
        (out / "depth/000.exr").write_bytes(b"not an image")
        self.expect_error(2, "000.exr", "depth", out, "--quiet")
        self.assertEqual(self.maps(out)[1:], known)
        self.assertEqual((out / "summary.json").read_text(), summary)
        self.expect_error(2, "--refine-views", "depth", out, "--refine-views", "0")


if __name__ == "__main__":
    main()
