#!/usr/bin/env python3
"""Tests of the command line: what is said of bad lines, --config, switches, the files of a run.

    usage_test.py ROXEL [unittest arguments]
"""

import json
import re
import shutil

from program import TINY, UNKNOWN, Case, digest, files_below, main, numbers, run


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
        commands = self.succeed("--help").stdout
        for command in ["info", "reconstruct", "mesh", "render", "eval", "merge", "synth", "convert"]:
            text = self.succeed(command, "--help").stdout
            self.assertIn(f"Usage: roxel {command} ", text)
            self.assertIn("--config", text)
            self.assertEqual(self.succeed("help", command).stdout, text)
            self.assertIn(f"\n  {command} ", commands)
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
        info = self.succeed("info", self.data, *TINY[:-1]).stdout
        for extra in ([], ["-o", out]):
            self.assertEqual(self.succeed("reconstruct", self.data, *extra, *TINY, "--dry-run").stdout, info)
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
        self.succeed("reconstruct", self.data, "-o", out, "--resolution", "16", "--no-mesh", "--config", file, "--adaptive", "--quiet")
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

    def test_options_that_cannot_act_are_named(self):
        out = self.folder / "idle"
        idle = ["--agreement-scale", "9", "--update", "roxels", "--acceleration", "3"]
        said = self.succeed("reconstruct", self.data, "-o", out, *TINY, *idle).stderr
        info = json.loads(self.succeed("info", self.data, *TINY[:-1], *idle, "--json").stdout)
        for warnings in (json.loads((out / "summary.json").read_text())["warnings"], info["warnings"]):
            named = [w.split()[0] for w in warnings if "has no effect here" in w]
            self.assertEqual(named, ["--agreement-scale", "--acceleration"])
        self.assertEqual(said.count("has no effect here"), 2, said)
        self.assertIn("--acceleration has no effect here", (out / "report.html").read_text())
        _, summary = self.reconstruct("not-idle", "--acceleration", "3")
        self.assertFalse([w for w in summary["warnings"] if "no effect" in w])

    def test_surround_is_saved_only_when_asked_for(self):
        plain, _ = self.reconstruct("plain", *UNKNOWN)
        all_lattices, summary = self.reconstruct("all", *UNKNOWN, "--save-surround")
        self.assertGreater(summary["scene"]["surround_lattices"], 0)
        self.assertGreater(summary["levels"][-1]["voxels_around"], 0)
        self.assertGreater((all_lattices / "volume.vdb").stat().st_size, (plain / "volume.vdb").stat().st_size)

    def test_init_goes_on_from_a_run(self):
        first, _ = self.reconstruct_once()
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
        self.assertEqual(re.findall(r"level (\d)/2 pass (\d/\d): \d+ voxels", normal.stderr),
                         [("1", "1/4"), ("1", "2/4"), ("1", "3/4"), ("1", "4/4"), ("2", "1/2"), ("2", "2/2")])
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
        out, summary = self.reconstruct_once()
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
        self.assertEqual([p["level"] for p in summary["passes"]], [1, 1, 1, 1, 2, 2])
        self.assertEqual(len(summary["levels"]), 2)

    def test_hashes_tell_data_sets_apart(self):
        other = self.folder / "other"
        shutil.copytree(self.data, other)
        shutil.copy(other / "images/000.png", other / "images/001.png")
        _, first = self.reconstruct_once()
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


if __name__ == "__main__":
    main()
