#!/usr/bin/env python3
"""Tests of light_table.py on metrics made by hand: what the page says, and that it says where an order does not hold."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import light_table  # noqa: E402
from light_table import Choice  # noqa: E402


def light(name, spread, albedo):
    return {"light": name, "shared_places": 1000, "places": 900, "mean_spread": spread, "median_spread": spread,
            "albedo": {"pixels": 77, "mean_log_error": albedo[0], "median_log_error": albedo[1]}}


def metrics(*lights):
    shares = {name: [{"distance": 0.5, "f_score": f}, {"distance": 1.0, "f_score": f + 0.1}]
              for name, f in (("depth points", 0.5), ("depth points by pixel", 0.7), ("depth points of sigma within 2 voxels", 0.6))}
    part = lambda share: {"voxels": 1, "share": share, "share_of_opacity": share / 2}
    return {"light": list(lights), "color": None, "images": {"object": {"rms": 0.2}},
            "depth": {"methods": {"volume": {"share_within_units": {"0.5": 0.4, "1": 0.5, "2": 0.7}}}},
            "surfaces": [{"name": name, "within": within} for name, within in shares.items()],
            "sky_debris": [{"opacity_threshold": a, "voxels": 4000, "in_the_open": part(0.02), "above_all": part(0.0001), "before_sky": part(0.001)} for a in (0.04, 0.3)]}


class Page(unittest.TestCase):
    def test_an_order_that_does_not_hold_is_said(self):
        measured = metrics(light("none", 1.2, (0.9, 0.746)), light("sky", 0.8, (0.8, 0.801)), light("run", 0.5, (0.5, 0.4)))
        self.assertEqual(light_table.orders(measured),
                         "\nFrom none over sky to sky-normal mean spread, median spread, mean off albedo fall, but **the order does not hold** for "
                         "median off albedo (0.746, 0.801, 0.400).\n")
        measured["light"][1] = light("sky", 0.8, (0.8, 0.7))
        self.assertNotIn("does not hold", light_table.orders(measured))
        measured["light"][0] = light("none", 0.1, (0.1, 0.1))
        self.assertNotIn(" fall", light_table.orders(measured))
        self.assertEqual(light_table.orders(metrics(light("none", 1, (1, 1)))), "")

    def test_each_row_has_its_columns(self):
        lit = metrics(light("none", 1.2, (0.9, 0.7)), light("sky", 0.8, (0.8, 0.6)), light("run", 0.5, (0.5, 0.4)))
        measured = {Choice("none", "canonical"): metrics(), light_table.LIT: lit}
        page = light_table.document(measured, {c: (70.4, 2**30, 800000) for c in measured}, "## By hand\n\nWhy.")
        self.assertIn("| none | canonical | 0.5 | 40.0 | 50.0 | 70.0 | 0.500 | 0.600 | 0.700 | 0.800 | - | - | 0.600 | 0.700 |", page)
        self.assertIn("| none | canonical | 0.5 | 4000 | 2.00 | 1.00 | 0.01 | 0.01 | 0.10 | 0.05 | 4000 |", page)
        self.assertIn("all at the same 900 places (of 1000", page)
        self.assertIn("| sky-normal | 0.500 | 0.500 | 0.500 | 0.400 |", page)
        self.assertIn("| none | canonical | 0.5 | 0.8 | 70 | 1.0 |", page)
        self.assertTrue(page.endswith("## By hand\n\nWhy.\n"))
        for part in page.split("\n\n"):
            lines = [line.count("|") for line in part.splitlines() if line.startswith("|")]
            self.assertLessEqual(len(set(lines)), 1, part)


if __name__ == "__main__":
    unittest.main()
