#!/usr/bin/env python3
"""What one gain an image is worth on tourists' photographs: docs/results/gain.md.

    gain_table.py [--roxel PROGRAM] [--data DIR] [--work DIR] [--docs DIR] [--voxel-size S] [--folds N]

Reconstructs the data set `statue-of-liberty` (90 photographs from the internet, from clear noon to sunset) N times (8), each time without every
Nth photograph, once with `--illumination none` and once with `gain`, and measures the photographs left out. What the same program has made by the
same command is not made again. Skips, and says so, where the data are not there. No picture of the data is written.
"""

import argparse
import json
import math
import os
import pathlib
import sys

from runs import make
from sky_table import data_root, table

BOX = "--bounds=0.2,-1.15,-0.45,1.05,1.35,1.7"  # statue and pedestal; the longest side is 2.5
LIGHTS = ("none", "gain")
TARGET = 0.80  # gain / none
HEAD = """# Gain

Made by `benchmarks/quality/gain_table.py`. What a gain is: [light.md](../light.md); how photographs that were left out are measured: [evaluation.md](../evaluation.md#pixels).

90 photographs of a statue from the internet, of 400 x 600 pixels, with masks, from clear noon to sunset; cameras good to a pixel or two. Each run
lacks every {folds}th photograph and is measured on these: RMS difference to the render over the statue's pixels, of full scale, after fitting nothing but the
photograph's own gains where the run fitted gains. `roxel reconstruct DATA {box} --voxel-size {size:g} --illumination LIGHT`.
"""
NOTE = """
*All*: over the pixels of all {images} photographs, each measured by the run that lacks it. Our target was a ratio of {target:.2f}:
met over all, and missed by {missed} of the {folds} parts, those whose photographs happen to be in much the same light as the others.

What is left with gains is not theirs: the sun stands elsewhere in every photograph, and one factor an image cannot move shading and shadow;
cameras are off by a pixel or two, so outlines and folds do not meet.
"""


def fold_data(data, folder, fold, folds):
    """A data set without every nth frame, and those for measuring."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("images", "masks"):
        if not (folder / name).exists(): os.symlink(data / name, folder / name)
    frames = json.loads((data / "transforms.json").read_text())
    for name, kept in (("transforms.json", lambda i: i % folds != fold), ("transforms_test.json", lambda i: i % folds == fold)):
        part = dict(frames, frames=[f for i, f in enumerate(frames["frames"]) if kept(i)])
        (folder / name).write_text(json.dumps(part))


def measured(program, data, run, light, size):
    """Square error and pixels of the photographs left out, over the object."""
    make([program, "reconstruct", str(data), "-o", str(run), BOX, "--voxel-size", f"{size:g}", "--illumination", light, "--no-mesh", "--no-depth",
          "--no-report", "--quiet"], run, "summary.json")
    metrics = run.with_name(run.name + "-metrics")
    make([program, "eval", str(run), "--truth", str(data), "-o", str(metrics), "--quiet"], metrics, "metrics.json", [run])
    held_out = json.loads((metrics / "metrics.json").read_text())["held_out"]["object"]
    return held_out["rms"] ** 2 * held_out["pixels"], held_out["pixels"]


def rms_row(name, images, squares):
    rms = {light: math.sqrt(squares[light][0] / squares[light][1]) for light in LIGHTS}
    return [name, str(images), *(f"{100 * rms[light]:.1f}" for light in LIGHTS), f"{rms['gain'] / rms['none']:.2f}"]


def main():
    parser = argparse.ArgumentParser()
    here = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--roxel", default=here / "build/release/apps/roxel/roxel")
    parser.add_argument("--data")
    parser.add_argument("--work", type=pathlib.Path, default=here / "build/gain-table")
    parser.add_argument("--docs", type=pathlib.Path, default=here / "docs/results")
    parser.add_argument("--voxel-size", type=float, default=0.012)
    parser.add_argument("--folds", type=int, default=8)
    arguments = parser.parse_args()
    root = data_root(arguments.data)
    if not root or not (root / "statue-of-liberty").is_dir():
        print("SKIPPED: no data set statue-of-liberty; see ROXEL_TEST_DATA")
        return
    data = root / "statue-of-liberty"
    rows, all_squares, images = [], {light: [0, 0] for light in LIGHTS}, 0
    for fold in range(arguments.folds):
        folder = arguments.work / f"{fold}-of-{arguments.folds}"
        fold_data(data, folder / "data", fold, arguments.folds)
        squares = {light: measured(str(arguments.roxel), folder / "data", folder / light, light, arguments.voxel_size) for light in LIGHTS}
        for light in LIGHTS:
            for i in range(2): all_squares[light][i] += squares[light][i]
        count = len(json.loads((folder / "data/transforms_test.json").read_text())["frames"])
        images += count
        rows.append(rms_row(f"{fold}, {fold + arguments.folds}, ...", count, squares))
        print(rows[-1], flush=True)
    rows.append(rms_row("all", images, all_squares))
    print(rows[-1])
    missed = sum(float(row[-1]) > TARGET for row in rows[:-1])
    text = HEAD.format(folds=arguments.folds, box=BOX, size=arguments.voxel_size) + "\n"
    text += table(["left out", "photographs", "none, RMS %", "gain, RMS %", "gain / none"], rows)
    (arguments.docs / "gain.md").write_text(text + NOTE.format(images=images, target=TARGET, missed=missed, folds=arguments.folds))


if __name__ == "__main__":
    sys.exit(main())
