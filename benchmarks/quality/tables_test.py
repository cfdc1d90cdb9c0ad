#!/usr/bin/env python3
"""Tests of tables.py on metrics made by hand: what is read, how tables say it, which runs are made again."""

import json
import pathlib
import re
import sys
import tempfile
import unittest
import unittest.mock

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import runs  # noqa: E402
import tables  # noqa: E402


def metrics(voxels=1000, close=0.9, opacity=0.8, rms=0.05):
    return {
        "depth": {"share_within_voxels": {"0.5": 0.3, "1": 0.61, "2": 0.7, "4": 0.84, "8": 0.9}},
        "surfaces": [{"name": "voxels", "within": [{"distance": 0.02, "f_score": 0.1}]},
                     {"name": "depth points", "within": [{"distance": 0.02, "f_score": 0.9876}]}],
        "volume": {"voxels": voxels, "share_within_4_voxels": close, "weighted_mean_opacity": opacity,
                   "share_of_surface_covered": 0.955},
        "images": {"object": {"rms": rms}, "all": {"rms": 0.5}},
    }


def results_of(update, luv, rgb, exponential):
    values = {("gaussian", "luv"): luv, ("gaussian", "rgb"): rgb, ("exponential", "rgb"): exponential}
    return {("plane", update, *choice): tables.figures(metrics(close=close)) for choice, close in values.items()}


class Figures(unittest.TestCase):
    def test_each_column_is_its_measure(self):
        found = tables.figures(metrics())
        expected = {"voxels": 1000, "close": 90, "opacity": 80, "covered": 95.5, "rms": 5, "depth_1": 61,
                    "depth_4": 84, "f_score": 0.9876}
        self.assertEqual(list(found), [key for key, _ in tables.COLUMNS])
        for key, value in expected.items():
            self.assertAlmostEqual(found[key], value, msg=key)

    def test_what_was_not_measured_is_a_dash(self):
        found = tables.figures({"depth": None, "surfaces": [], "volume": None, "images": None})
        self.assertEqual({tables.cell(key, value) for key, value in found.items()}, {"-"})


class Tables(unittest.TestCase):
    def test_the_thesis_stands_above_ours(self):
        lines = tables.world_table("plane", {**results_of("roxels", 0.912, 0.8, 0.7), **results_of("posterior", 0.9, 0.8, 0.7)}, 256)
        self.assertIn("| thesis, Table 8.1 | - | Gaussian Luv | 32223 | 83.3 | 77.0 | - | - | - | - | - |", lines)
        self.assertEqual(lines[-1], "| the thesis's, `roxels` | 96 | Gaussian Luv | 1000 | 91.2 | 80.0 | 95.5 | 5.0 | 61.0 | 84.0 | 0.988 |")
        self.assertIn("| ours, `posterior` | 256 | Gaussian Luv |", "\n".join(lines))
        self.assertEqual(len({line.count("|") for line in lines}), 1)
        self.assertLess(max(i for i, line in enumerate(lines) if "thesis, Table" in line),
                        min(i for i, line in enumerate(lines) if "`posterior`" in line))

    def test_the_rule_as_printed_is_told_in_full(self):
        self.assertIn("`--update roxels --no-predictive --outlier 0`", tables.document({}, 77))

    def test_thresholds_have_a_row_each_and_worlds_a_column(self):
        results = {("plane", thresholds): tables.figures(metrics(opacity=thresholds[0])) for thresholds in tables.THRESHOLDS}
        lines = tables.threshold_part(results)
        self.assertIn("| 0.04 | 0.001 | 4.0 / 90.0 / 95.5 |", lines)
        self.assertIn("| 0.3 | 0.05 | 30.0 / 90.0 / 95.5 |", lines)
        self.assertEqual(len([line for line in lines if line.startswith("| 0")]), len(tables.THRESHOLDS))
        self.assertIn("## The default at other thresholds", tables.document({}, 77, thresholds=results))

    def test_the_rooms_points_and_surface_have_a_row_each(self):
        surfaces = [{"name": name, "within": [{"distance": d, "precision": 0.5, "recall": 0.25, "f_score": f} for d, f in ((1, 0.333), (2, 0.75))]}
                    for name in ("voxels", "depth points", "mesh")]
        lines = tables.room_part({"surfaces": surfaces, "depth": {"share_within_voxels": {"0.5": 0.3, "1": 0.6, "4": 0.9}}})
        self.assertIn("| mesh | 0.500 / 0.250 / **0.333** | 0.500 / 0.250 / **0.750** |", lines)
        self.assertFalse(any("voxels |" in line for line in lines))
        self.assertIn("30.0 %, 60.0 %, 90.0 %", lines[-2])

    def test_the_order_is_told_from_the_figures(self):
        said = {(0.9, 0.8, 0.7): "holds", (0.9, 0.9, 0.7): "holds, with a tie",
                (0.8, 0.9, 0.7): "RGB before Luv, both before exponential",
                (0.9, 0.7, 0.8): "Luv before RGB, but exponential between",
                (0.8, 0.7, 0.9): "Luv before RGB, but exponential first",
                (0.7, 0.9, 0.8): "RGB before Luv, exponential between",
                (0.7, 0.8, 0.9): "RGB before Luv, exponential first"}
        for values, words in said.items():
            results = results_of("posterior", *values)
            self.assertEqual(tables.ordering("plane", "posterior", "close", results), words, values)
            back = tables.ordering("plane", "posterior", "close", results, less_is_better=True)
            self.assertNotEqual(back, words)
        self.assertIsNone(tables.ordering("plane", "roxels", "close", results))

    def test_page_and_csv_hold_what_there_is(self):
        results = results_of("posterior", 0.9, 0.8, 0.7)
        page = tables.document(results, 77, "## By hand\n\nWhy.")
        self.assertIn("tables.py --resolution 77", page)
        self.assertIn("| plane | `posterior` | 77 | holds |", page)
        self.assertIn("(plane-posterior-gaussian-luv-section_x.svg)", page)
        self.assertNotIn("(plane-roxels", page)
        self.assertTrue(page.endswith("## By hand\n\nWhy.\n"))
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "tables.csv"
            tables.write_csv(path, results, 77)
            lines = path.read_text().splitlines()
        self.assertEqual(len(lines), 1 + 12 + 3)
        self.assertIn("thesis,head,,,gaussian,luv,62996,64.2,59.9,,,,,", lines)
        self.assertIn("roxel,plane,posterior,77,gaussian,luv,1000,90,80,95.5,5,61,84,0.9876", lines)


    def test_every_picture_of_the_page_is_copied(self):
        results = results_of("posterior", 0.9, 0.8, 0.7)
        with tempfile.TemporaryDirectory() as name:
            docs = pathlib.Path(name)
            folders = {run: docs / tables.run_name(run) for run in results}
            for folder in folders.values():
                folder.mkdir()
                (folder / "section_x.svg").write_text(folder.name)
                (folder / "voxel_distances.svg").write_text("bars")
            tables.copy_pictures(results, folders, docs)
            linked = re.findall(r"\]\(([^)]*\.svg)\)", tables.document(results, 77))
            self.assertEqual(len(linked), 6)
            for target in linked:
                self.assertTrue((docs / target).is_file(), target)
            self.assertEqual((docs / "plane-posterior-gaussian-rgb-section_x.svg").read_text(), "plane-posterior-gaussian-rgb")


    def test_specks_of_an_outline_are_left_out(self):
        self.assertEqual(tables.without_specks('<path d="M1 1L1.2 1M0 0L3 0.5M9 9L9 9.4" fill="none"/>'),
                         '<path d="M0 0L3 0.5" fill="none"/>')
        self.assertEqual(tables.without_specks('<path d="M1 1L1.1 1L5 5"/>'), '<path d="M1 1L1.1 1L5 5"/>')


class Runs(unittest.TestCase):
    def test_names_select(self):
        self.assertEqual(len(tables.selected("")), 5 * 15 + 2 * 6 + 1)
        self.assertEqual(len(tables.selected("head-roxels-*")), 5)
        self.assertEqual(tables.selected("nothing"), [])

    def test_a_streets_light_is_in_its_command(self):
        run = ("street-sky", "roxels", "gaussian", "luv")
        self.assertEqual(tables.reconstruct_options(run, 96, "there"),
                         ["--update", "roxels", "--no-predictive", "--outlier", "0", "--agreement", "gaussian", "--color-space", "luv", "--voxel-size", "1",
                          "--illumination", "sky", "--matching", "canonical", "--sky", "there"])
        for rule, along in [("posterior", "300"), ("posterior-coarse", "96"), ("roxels", "96")]:
            self.assertIn(along, tables.reconstruct_options(("plane", rule, "gaussian", "luv"), 300))

    def test_the_thesis_has_its_four_tables(self):
        self.assertEqual([tables.WORLDS[w].table for w in tables.WORLDS if tables.WORLDS[w].table],
                         [f"Table 8.{i}" for i in (1, 2, 3, 4)])
        self.assertEqual(tables.thesis_rows("street-sky")[("gaussian", "luv")], (116920, 47.3, 43.9))
        self.assertEqual(tables.thesis_rows("mug"), {})

    def test_shared_data_are_skipped_where_there_are_none(self):
        run = ("shared-plane", "posterior", "gaussian", "luv")
        options = type("Options", (), {"roxel": "none", "resolution": 96})()
        with tempfile.TemporaryDirectory() as name, unittest.mock.patch.dict(tables.os.environ, ROXEL_TEST_DATA=name):
            options.work = pathlib.Path(name) / "work"
            self.assertIsNone(tables.measure(run, options))
        self.assertNotIn("section", "".join(tables.world_part("shared-plane", {run: tables.figures(metrics())}, [], 96)))

    def test_a_run_is_made_once_and_again_when_its_command_changes(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name) / "run"
            count = pathlib.Path(name) / "count"
            script = f"mkdir {folder}; touch {folder}/done; echo x >> {count}"
            for command, made in [(script, True), (script, False), (script + " ", True)]:
                self.assertEqual(runs.make(["sh", "-c", command], folder, "done"), made)
            self.assertEqual(count.read_text(), "x\nx\n")

    def test_a_run_is_made_again_by_another_program(self):
        with tempfile.TemporaryDirectory() as name:
            folder, program = pathlib.Path(name) / "run", pathlib.Path(name) / "program"
            for text, made in [("one", True), ("one", False), ("two", True)]:
                program.write_text(f"#!/bin/sh\nmkdir {folder} && touch {folder}/done && echo {text} > {folder}/by\n")
                program.chmod(0o755)
                runs.digest.cache_clear()
                self.assertEqual(runs.make([str(program)], folder, "done"), made)
            self.assertEqual((folder / "by").read_text(), "two\n")

    def test_a_run_is_made_again_after_what_it_reads(self):
        with tempfile.TemporaryDirectory() as name:
            world, run = pathlib.Path(name) / "world", pathlib.Path(name) / "run"
            command = lambda folder, more="": ["sh", "-c", f"mkdir {folder} && touch {folder}/done {more}"]
            for seed, made in [("", True), ("", False), ("--seed 2", True), ("--seed 2", False)]:
                runs.make(["sh", "-c", f"mkdir {world}; touch {world}/done; : {seed}"], world, "done")
                self.assertEqual(runs.make(command(run), run, "done", [world]), made)

    def test_a_prepared_folder_is_there_for_the_command(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name) / "run"
            command = ["sh", "-c", f"mv {folder}/begun {folder}/done"]
            prepare = lambda f: (f.mkdir(), (f / "begun").write_text("x"))
            self.assertEqual([runs.make(command, folder, "done", (), prepare) for _ in range(2)], [True, False])

    def test_shares_are_of_the_data_sets_diagonal(self):
        with tempfile.TemporaryDirectory() as name:
            (pathlib.Path(name) / "transforms.json").write_text(json.dumps({"scene_bounds": [[0, 0, 0], [2, 3, 6]]}))
            self.assertAlmostEqual(tables.share_of_diagonal(pathlib.Path(name), 1), 0.07)
            self.assertAlmostEqual(tables.share_of_diagonal(pathlib.Path(name), 0.5), 0.035)


if __name__ == "__main__":
    unittest.main()
