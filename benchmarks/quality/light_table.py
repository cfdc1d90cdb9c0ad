#!/usr/bin/env python3
"""What dividing light out comes to: a page light.md in DIR, as docs/results/light.md is, which was made run by run.

    light_table.py [--roxel PROGRAM] [--data DIR] [--work DIR] [--docs DIR] [--voxel-size S]

Reconstructs the data set `courtyard` (ray-traced; eight nodes, each in its own light; truth beside it) with each choice of light and
matching, with skies and sky masks that roxel finds, and measures the runs with `roxel eval`. Runs that are there are measured again, not
made again. Skips, and says so, where the data are not there. No picture of the data is written.
"""

import argparse
import pathlib
import sys

from sky_table import data_root, percent, roxel, table

BOX = "--bounds=-36,-32,-0.5,36,33,28"
CHOICES = {  # name: illumination, matching
    "none": ("none", "canonical"),
    "gain": ("gain", "canonical"),
    "sky": ("sky", "canonical"),
    "local": ("none", "local"),
    "gain, local": ("gain", "local"),
    "sky, local": ("sky", "local"),
    "sky-normal, local": ("sky-normal", "local"),
}
HEAD = """# Light

Made by `benchmarks/quality/light_table.py`. What each figure is: [evaluation.md](../evaluation.md#pixels); what is divided out and how:
[light.md](../light.md).

A ray-traced town square: eight nodes of about 20 images, each at its own date and time, six in the sun and two overcast; voxels of {size} m;
skies and sky masks as `roxel sky` finds them.
"""
SPREAD = """
## Colours

*spread*: standard deviation, over the nodes that see a place, of log colour; *off albedo*: deviation of log colour from log albedo, one scale free. Both of the photographs over the run's light. Then
of the voxels' own colours. The last rows are the floors: the true light divided out.
"""
DEPTH = """
## Geometry

Share of pixels whose depth is within 0.5, 1 and 2 m of the truth, in percent, of the volume and refined; F-scores of depth points at 0.5 and 1 m.
"""


def number(value, digits=3):
    return "-" if value is None else f"{value:.{digits}f}"


def light_row(name, light, color):
    albedo = light["albedo"] or {}
    return [name, number(light["mean_spread"]), number(light["median_spread"]), number(albedo.get("mean_log_error")),
            number(albedo.get("median_log_error")), percent(color and color["median_relative_error"], 1), number(color and color["mean_delta_e_2000"], 1)]


def within(depth, method):
    found = (depth or {}).get("methods", {}).get(method)
    return [percent(found["share_within_units"][d], 1) for d in ("0.5", "1", "2")] if found else ["-"] * 3


def f_score(surfaces, name, distance):
    for surface in surfaces:
        if surface["name"] == name:
            return next(number(s["f_score"]) for s in surface["within"] if abs(s["distance"] - distance) < 1e-9)
    return "-"


def main():
    parser = argparse.ArgumentParser()
    here = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--roxel", default=here / "build/release/apps/roxel/roxel")
    parser.add_argument("--data")
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("light-table"))
    parser.add_argument("--docs", type=pathlib.Path, default=pathlib.Path("light-table"))
    parser.add_argument("--voxel-size", type=float, default=0.5)
    arguments = parser.parse_args()
    root = data_root(arguments.data)
    if not root or not (root / "courtyard").is_dir():
        print("SKIPPED: no data set courtyard; see ROXEL_TEST_DATA")
        return
    data, work = root / "courtyard", arguments.work
    skies = work / "sky"
    if not (skies / "summary.json").exists(): roxel(arguments.roxel, "sky", data, "-o", skies, "--no-pictures")
    colours, depths, floors = [], [], []
    for name, (light, matching) in CHOICES.items():
        run = work / f"{light}-{matching}"
        if not (run / "summary.json").exists():
            roxel(arguments.roxel, "reconstruct", data, "-o", run, BOX, "--voxel-size", arguments.voxel_size, "--masks", "none", "--sky", skies,
                  "--illumination", light, "--matching", matching, "--no-mesh", "--no-report")
        m = roxel(arguments.roxel, "eval", run, "--truth", data, "--distances", "0.5,1", "--depth-within", "0.5,1,2")
        by = {entry["light"]: entry for entry in m["light"]}
        colours.append(light_row(name, by.get("run", by["none"]), m["color"]))
        floors = [light_row(k, by[k], None) for k in ("true dome", "true light on the surface") if k in by]
        depths.append([name, *within(m["depth"], "volume"), *within(m["depth"], "refined"),
                       *(f_score(m["surfaces"], points, d) for points in ("depth points", "refined depth points") for d in (0.5, 1))])
        print(name, colours[-1], depths[-1], flush=True)
    text = HEAD.format(size=f"{arguments.voxel_size:g}") + SPREAD + "\n"
    text += table(["light, matching", "spread, mean", "median", "off albedo, mean", "median", "voxels: albedo error %, median",
                   "CIEDE2000"], colours + floors)
    text += DEPTH + "\n"
    text += table(["light, matching", "0.5 m", "1 m", "2 m", "refined 0.5 m", "1 m", "2 m", "F 0.5 m", "F 1 m", "refined F 0.5 m", "F 1 m"], depths)
    (arguments.docs / "light.md").write_text(text)


if __name__ == "__main__":
    sys.exit(main())
