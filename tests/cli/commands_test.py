#!/usr/bin/env python3
"""Tests of `roxel info`, `render`, `eval`, `merge` and `convert`, through the program itself.

    commands_test.py ROXEL [unittest arguments]
"""

import json
import re
import subprocess

from program import TINY, Case, digest, files_below, main, numbers, run


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

    def test_render_from_cameras_of_another_data_set(self):
        other = self.folder / "between"
        self.succeed("synth", "demo", "-o", other, "--images", 5, "--size", "64x48", "--quiet")
        out = self.folder / "between-views"
        self.succeed("render", self.run_folder, "--cameras", other, "-o", out)

        def mean_error(render, photograph):
            said = subprocess.run(["oiiotool", "--fail", "1", "--hardfail", "1", "--diff", render, photograph], capture_output=True, text=True)
            return float(re.search(r"Mean error = (\S+)", said.stdout + said.stderr).group(1))

        renders = sorted((out / "render").glob("*.png"))
        photographs = sorted((other / "images").glob("*.png"))
        self.assertEqual(len(renders), 5)
        # The first is where the run's own first is; in sum, as plain parts look alike from all sides.
        right, wrong = (sum(mean_error(renders[i], photographs[(i + step) % 5]) for i in (1, 2, 3)) for step in (0, 2))
        self.assertLess(right, 0.85 * wrong)

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
        self.assertEqual(count["merged"]["warnings"], [], "boxes side by side may share their photographs")
        self.assertEqual(len(count["merged"]["merged_from"]), 2)
        self.succeed("render", merged, "--cameras", self.data, "-o", self.folder / "merged-views")

    def test_merge_warns_of_photographs_that_count_twice(self):
        box = "--bounds=-1.5,-1.5,-1.2,1.5,1.5,1.8"
        for name, images in (("first", "00[01].png"), ("second", "00[23].png"), ("mixed", "00[12].png")):
            self.reconstruct(name, box, "--images", images, "--no-depth", "--no-render")
        first, second, mixed, out = (self.folder / n for n in ("first", "second", "mixed", "joined"))
        for runs, pairs in (((first, second), 0), ((first, mixed), 1), ((first, second, mixed), 2)):
            with self.subTest([r.name for r in runs]):
                said = self.succeed("merge", *runs, "-o", out).stderr
                self.assertEqual(said.count("count twice"), pairs, said)
                warnings = json.loads((out / "summary.json").read_text())["warnings"]
                self.assertEqual(len(warnings), pairs)
                self.assertTrue(all(": 1 photographs are in both" in w for w in warnings), warnings)
        again = self.folder / "joined-again"
        self.succeed("merge", first, second, "-o", out)
        self.assertIn("joined: 2 photographs are in both", self.succeed("merge", mixed, out, "-o", again).stderr)

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
        self.synth(data, 24, "160x120")
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
        eight = ["info", self.data, "--resolution", "256", "--threads", "8"]
        ample = json.loads(self.succeed(*eight, "--json").stdout)["estimate"]["memory_bytes"]
        self.assertRegex(self.succeed(*eight, "--memory", 0.8 * ample / 2**30).stdout, r"passes run on [1-7] threads?\n")
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


if __name__ == "__main__":
    main()
