#!/usr/bin/env python3
"""Tests of figures.py on metrics made by hand: what the page says, and that it shows only what is drawn."""

import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import figures  # noqa: E402
import tables  # noqa: E402


def method(within, sigma):
    return {"share_within_voxels": {"0.5": within, "1": within, "2": 0.9, "4": 1.0}, "median_error_voxels": 0.25,
            "median_sigma_voxels": sigma, "coverage_68": 0.7, "coverage_95": 0.96}


METRICS = {"voxel_size": 0.5, "depth": {"methods": {"volume": method(0.5, 2), "bp": method(0.625, 1)}}}


class Page(unittest.TestCase):
    def test_depths_stand_side_by_side(self):
        rows = figures.depth_rows("mug", METRICS)
        self.assertEqual(rows[0], ["mug", "volume", "50.0", "50.0", "90.0", "100.0", "0.25", "2.00", "1", "70.0", "96.0"])
        self.assertEqual(rows[1][:3], ["mug", "bp", "62.5"])
        table = figures.depth_table({"mug": METRICS})
        self.assertEqual(len({line.count("|") for line in table}), 1)

    def test_every_picture_of_the_page_is_one_that_is_drawn(self):
        page = figures.document({"mug": METRICS}, "## By hand\n\nWhy.")
        drawn = {f"figure_5_6_{level}.svg" for level in figures.LEVELS}
        drawn |= {f"figure_8_{i}.jpg" for i in (25, 33, 34, 35)}
        self.assertEqual(set(re.findall(r"\]\(([^)]*\.(?:svg|jpg))\)", page)), drawn)
        self.assertTrue(page.endswith("## By hand\n\nWhy.\n"))

    def test_finest_level_is_that_of_the_tables(self):
        self.assertEqual(figures.voxels_of(figures.LEVELS[-1]), tables.parse([]).resolution)
        self.assertEqual([figures.voxels_of(level) for level in figures.LEVELS], [64, 128, 256])


if __name__ == "__main__":
    unittest.main()
