#!/usr/bin/env python3
"""What `roxel` reaches on ray-traced worlds with known depth and surface: figures below which it must not fall. All but Worlds
need the data sets plane, head and courtyard, in the folder that the environment variable ROXEL_TEST_DATA names or in a folder shared/data above this one.

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

    @classmethod
    def setUpClass(cls):
        data = data_set(cls.name) if cls.name else None
        if data is None:
            raise unittest.SkipTest(f"test data \"{cls.name}\" is not here; set ROXEL_TEST_DATA to its folder")
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="roxel-accuracy-"))
        out = cls.folder / "run"
        for command in (["reconstruct", data, "-o", out, f"--bounds={cls.bounds}", *cls.options, "--no-report", "--quiet"],
                        ["eval", out, "--truth", data, "-o", cls.folder / "metrics", "--opacity-threshold", "0.3", "--quiet"]):
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
    """Three of its eight nodes, at coarse voxels and without refinement: all of it, at half a metre, takes minutes."""

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


class CourtyardSkies(Case):
    """All eight nodes, against the true domes, suns and masks."""

    @classmethod
    def setUpClass(cls):
        data = data_set("courtyard")
        if data is None:
            raise unittest.SkipTest("test data \"courtyard\" is not here; set ROXEL_TEST_DATA to its folder")
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


if __name__ == "__main__":
    program.main()
