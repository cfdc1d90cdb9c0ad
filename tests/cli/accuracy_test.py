#!/usr/bin/env python3
"""What `roxel` reaches on ray-traced worlds with known depth and surface, and on photographs that were left out: figures
below which it must not fall. All but Worlds need the data sets plane, head, courtyard and statue-of-liberty, in the folder
that the environment variable ROXEL_TEST_DATA names or in a folder shared/data above this one. What takes minutes runs only
where ROXEL_LONG_TESTS is set.

    accuracy_test.py ROXEL [unittest arguments, e.g. Plane]
"""

import json
import os
import pathlib
import tempfile
import unittest

import program
from program import Case


def data_set(name):
    chosen = os.environ.get("ROXEL_TEST_DATA")
    folders = [pathlib.Path(chosen)] if chosen else [p / "shared/data" for p in pathlib.Path(__file__).resolve().parents]
    return next((folder / name for folder in folders if (folder / name).is_dir()), None)


def present(name):
    """A data set's folder. Where it is absent tests are skipped."""
    folder = data_set(name) if name else None
    if folder is None:
        raise unittest.SkipTest(f"test data \"{name}\" is not here; set ROXEL_TEST_DATA to its folder")
    return folder


def skip_unless_long():
    if not os.environ.get("ROXEL_LONG_TESTS"):
        raise unittest.SkipTest("takes minutes; set ROXEL_LONG_TESTS=1")


def check_voxels(case, volume, opacity, within_4, covered):
    """Least distance-weighted mean opacity, shares of voxels near the surface and of the surface near one, in percent."""
    case.assertGreaterEqual(100 * volume["weighted_mean_opacity"], opacity)
    case.assertGreaterEqual(100 * volume["share_within_4_voxels"], within_4)
    case.assertGreaterEqual(100 * volume["share_of_surface_covered"], covered)


class AccuracyCase(program.Case):
    """A run of one data set, measured against the truth."""

    name = None  # of the data set
    bounds = None
    diagonal = None  # of the bounds, world units
    options = ["--voxel-size", "0.02", "--texture", "none", "--no-mesh-pictures"]
    measures = ["--opacity-threshold", "0.3"]

    @classmethod
    def setUpClass(cls):
        data = present(cls.name)
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="roxel-accuracy-"))
        out = cls.folder / "run"
        for command in (["reconstruct", data, "-o", out, f"--bounds={cls.bounds}", *cls.options, "--no-report", "--quiet"],
                        ["eval", out, "--truth", data, "-o", cls.folder / "metrics", *cls.measures, "--quiet"]):
            done = program.run(*command, timeout=1000)
            assert done.returncode == 0, done.stderr
        cls.metrics = json.loads((cls.folder / "metrics/metrics.json").read_text())

    def within(self, method):
        shares = self.metrics["depth"]["methods"][method]["share_within_voxels"]
        return [100 * shares[voxels] for voxels in ("0.5", "1", "2")]

    def check_volume(self, within_1, within_4, empty_given_depth, rms_percent):
        """Least shares of true pixels, most of empty ones, and the error of renders over the object."""
        shares = self.metrics["depth"]["methods"]["volume"]["share_within_voxels"]
        self.assertGreaterEqual(100 * shares["1"], within_1)
        self.assertGreaterEqual(100 * shares["4"], within_4)
        self.assertLess(100 * self.metrics["depth"]["share_of_empty_given_depth"], empty_given_depth)
        self.assertLessEqual(self.metrics["reprojection_rms_percent"], rms_percent)

    def f_score(self, share_of_diagonal):
        within = self.metrics["surfaces"][-1]["within"]
        return min(within, key=lambda entry: abs(entry["distance"] - share_of_diagonal * self.diagonal))["f_score"]

    def check(self, within, f_scores, log_loss):
        self.assertEqual(self.metrics["surfaces"][-1]["name"], "mesh")
        volume, bp, refined = (self.within(method) for method in ("volume", "bp", "refined"))
        for v, b, r, least in zip(volume, bp, refined, within):
            self.assertGreaterEqual(b, v - 0.5)
            self.assertGreater(r, min(max(v, b), 99.8))
            self.assertGreater(r, least)
        for share, least in zip((0.005, 0.01), f_scores):
            self.assertGreaterEqual(self.f_score(share), least)
        refined = self.metrics["depth"]["methods"]["refined"]
        self.assertTrue(0.58 <= refined["coverage_68"] <= 0.80, refined)
        self.assertTrue(0.88 <= refined["coverage_95"] <= 0.99, refined)
        self.assertLess(refined["log_loss"], log_loss)


class Plane(AccuracyCase):
    name, bounds, diagonal = "plane", "-1.3,-0.5,-1.3,1.3,0.5,1.3", 3.8105

    def test_depth_uncertainty_and_surface(self):
        self.check([99, 99.5, 99.8], [0.96, 0.995], -1.1)

    def test_the_volume_and_its_renders(self):
        self.check_volume(97.5, 99.8, 3, 2.3)
        check_voxels(self, self.metrics["volume"], 90, 99.9, 95)

    def test_the_median_of_the_surface_is_near_a_hundredth_of_a_percent_of_the_diagonal(self):
        self.assertLess(self.metrics["surfaces"][-1]["median_to_truth"], 1e-4 * self.diagonal)


class Head(AccuracyCase):
    name, bounds, diagonal = "head", "-1.5,-1.3,-2.5,1.5,1.3,1.4", 5.5651

    def test_depth_uncertainty_and_surface(self):
        self.check([73, 87.5, 94], [0.93, 0.98], 1.15)

    def test_the_volume_and_its_renders(self):
        self.check_volume(84, 97.2, 2, 2.95)
        check_voxels(self, self.metrics["volume"], 86.5, 98, 95.5)


class Worlds(Case):
    """The program's own worlds at a coarse resolution, so that there are floors without data sets, too."""

    # Weighted mean opacity, share of voxels within four, of the surface covered; at most RMS over the object. In percent.
    FLOORS = {"plane": (95, 99.9, 99.5, 7.4), "head": (87.5, 99.5, 97.8, 5.3), "mug": (88, 85, 97.5, 5.45)}

    def test_voxels_and_renders(self):
        for world, (opacity, within_4, covered, rms) in self.FLOORS.items():
            with self.subTest(world):
                data, out, measures = (self.folder / f"{world}{part}" for part in ("", "-run", "-metrics"))
                self.succeed("synth", world, "-o", data, "--size", "160x120", "--quiet")
                self.succeed("reconstruct", data, "-o", out, "--resolution", 64, "--no-bp", "--no-refine", "--no-mesh", "--no-report", "--quiet")
                self.succeed("eval", out, "--truth", data, "-o", measures, "--opacity-threshold", 0.3, "--samples", 20000, "--quiet")
                found = json.loads((measures / "metrics.json").read_text())
                check_voxels(self, found["volume"], opacity, within_4, covered)
                self.assertLessEqual(100 * found["images"]["object"]["rms"], rms)


class Courtyard(AccuracyCase):
    """Three of its eight nodes, at coarse voxels and without refinement."""

    name, bounds, diagonal = "courtyard", "-36,-32,-0.5,36,33,28", 101.04
    options = ["--nodes", "0:3", "--voxel-size", "1", "--illumination", "sky-normal", "--matching", "local", "--no-refine", "--no-mesh"]

    def test_belief_propagation_costs_little_where_the_volume_errs(self):
        for volume, bp in zip(self.within("volume"), self.within("bp")):
            self.assertGreaterEqual(bp, volume - 0.5)

    def test_geometry_keeps_to_its_floors(self):
        for share, floor in zip(self.within("volume"), (12, 21.5, 37)): self.assertGreaterEqual(share, floor)
        by_pixel = next(s for s in self.metrics["surfaces"] if s["name"] == "depth points by pixel")["within"]
        for distance, floor in ((1, 0.59), (2, 0.78)):
            self.assertGreaterEqual(next(w["f_score"] for w in by_pixel if w["distance"] == distance), floor)

    def test_light_brings_nodes_together_and_near_to_albedo_the_more_of_it_is_divided_out(self):
        by = {light["light"]: light for light in self.metrics["light"]}
        none, sky, normal = (by[name] for name in ("none", "sky", "run"))
        self.assertGreater(normal["places"], 200)
        self.assertEqual(len({(light["places"], light["albedo"]["pixels"]) for light in by.values()}), 1)  # all at the same places
        for measure in (lambda light: light["mean_spread"], lambda light: light["albedo"]["mean_log_error"]):
            self.assertGreater(measure(none), measure(sky))
            self.assertGreater(measure(sky), measure(normal))

    def test_the_sky_is_left_empty(self):
        opaque = self.metrics["sky_debris"][0]
        self.assertEqual(opaque["opacity_threshold"], 0.3)
        self.assertLess(opaque["before_sky"]["share"], 0.001)
        self.assertLess(opaque["above_all"]["share"], 0.001)


class CourtyardAtHalfAMetre(AccuracyCase):
    """All eight nodes with the skies that the run finds, voxels of half a metre."""

    name, bounds = "courtyard", "-36,-32,-0.5,36,33,28"
    options = ["--voxel-size", "0.5", "--masks", "none", "--illumination", "sky", "--matching", "local", "--no-bp", "--no-refine", "--no-mesh"]
    measures = ["--distances", "0.5,1", "--depth-within", "0.5,1,2"]

    @classmethod
    def setUpClass(cls):
        skip_unless_long()
        super().setUpClass()

    def test_depth_keeps_to_its_targets(self):
        shares = self.metrics["depth"]["share_within_units"]
        self.assertGreaterEqual(shares["0.5"], 0.40)
        self.assertGreaterEqual(shares["2"], 0.72)

    def test_depth_points_keep_to_their_targets(self):
        by_pixel = next(s for s in self.metrics["surfaces"] if s["name"] == "depth points by pixel")["within"]
        found = {entry["distance"]: entry["f_score"] for entry in by_pixel}
        self.assertGreaterEqual(found[0.5], 0.72)
        self.assertGreaterEqual(found[1], 0.86)

    def test_no_sky_is_built(self):
        for voxels in self.metrics["sky_debris"]:
            with self.subTest(voxels["opacity_threshold"]):
                for where in ("above_all", "before_sky"): self.assertLess(voxels[where]["share"], 0.001)

    def test_the_second_look_at_the_skies_is_on_record(self):
        summary = json.loads((self.folder / "run/summary.json").read_text())
        self.assertEqual([sky["node"] for sky in summary["skies_again"]], [sky["node"] for sky in summary["skies"]])
        for sky in summary["skies_again"]: self.assertGreater(sky["unexplained_share"], 0.2)


class CourtyardSkies(Case):
    """All eight nodes, against the true domes, suns and masks."""

    @classmethod
    def setUpClass(cls):
        data = present("courtyard")
        super().setUpClass()
        run = cls.folder / "skies"
        for command in (["sky", data, "-o", run, "--no-pictures", "--quiet"], ["eval", run, "--truth", data, "-o", cls.folder / "metrics", "--quiet"]):
            done = program.run(*command, timeout=600)
            assert done.returncode == 0, done.stderr
        cls.skies = json.loads((cls.folder / "metrics/metrics.json").read_text())["skies"]

    def test_domes_suns_and_masks(self):
        self.assertEqual(len(self.skies), 8)
        for sky in self.skies:
            with self.subTest(sky["node"]):
                self.assertLessEqual(sky["fit_error"], 0.03)
                self.assertLessEqual(sky["dome_error"], 1.3 * sky["oracle_error"])
                self.assertGreaterEqual(sky["mask_iou"], 0.98)
                self.assertLessEqual(sky["sun_error_deg"], 2)

    def test_suns_are_found_in_the_images_alone(self):
        found = [sky["found_sun_error_deg"] for sky in self.skies if sky["found_sun_error_deg"] is not None]
        self.assertGreaterEqual(len(found), 5)
        for error in found: self.assertLessEqual(error, 2)


class Statue(Case):
    """Internet photographs, of which every 8th is left out: one of eight parts that differ (docs/results/gain.md)."""

    @classmethod
    def setUpClass(cls):
        skip_unless_long()
        super().setUpClass()

    def test_gains_are_worth_a_fifth_of_the_error_of_photographs_left_out(self):
        given, data = present("statue-of-liberty"), self.folder / "statue"
        data.mkdir()
        for folder in ("images", "masks"): (data / folder).symlink_to(given / folder)
        all_of_it = json.loads((given / "transforms.json").read_text())
        for file, kept in (("transforms.json", lambda number: number % 8), ("transforms_test.json", lambda number: number % 8 == 0)):
            frames = [frame for number, frame in enumerate(all_of_it["frames"], 1) if kept(number)]
            (data / file).write_text(json.dumps(dict(all_of_it, frames=frames)))
        rms = {}
        for light in ("none", "gain"):
            run, metrics = self.folder / light, self.folder / f"{light}-metrics"
            self.succeed("reconstruct", data, "-o", run, "--bounds=0.2,-1.15,-0.45,1.05,1.35,1.7", "--voxel-size", "0.012", "--illumination", light,
                         "--no-mesh", "--no-depth", "--no-report", "--quiet")
            self.succeed("eval", run, "--truth", data, "-o", metrics, "--quiet")
            rms[light] = json.loads((metrics / "metrics.json").read_text())["held_out"]["object"]["rms"]
        self.assertLessEqual(rms["gain"], 0.8 * rms["none"])


if __name__ == "__main__":
    program.main()
