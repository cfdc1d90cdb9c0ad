#!/usr/bin/env python3
"""The thesis's figures of a volume as it grows and of depth before and after belief propagation, from our own worlds.

    figures.py [--roxel PROGRAM] [--sheets PROGRAM] [--work DIR] [--docs DIR]

Figures 5.6, 8.25, 8.33, 8.34 and 8.35 into docs/results, and figures.md with what they say in numbers. Worlds and runs are those of
tables.py where that has made them; what the work folder has already, made by the same command, is not made again.
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys

import runs
import tables

LEVELS = [1, 2, 3]                # figure 5.6: the head after each level, the last at FINEST voxels
FINEST = 256
STREET_VOXELS_M = [4, 2, 1]       # figure 8.25
STREET_PASSES = [1, 3, 8]
# Depth: part of tables.py, image that is shown, options of `roxel depth`, what the thesis calls it.
DEPTHS = {"mug": ("003", [], "8.33"), "street-sky": ("n03_04", ["--no-refine"], "8.35")}
HEAD = """# Figures 5.6, 8.25 and 8.33 to 8.35 of the thesis, reproduced

Made by `benchmarks/quality/figures.py`; do not edit: what is said by hand stands in `benchmarks/quality/figures_remarks.md`. Worlds and
runs as for [the tables](tables.md), with Gaussian Luv and `posterior`.

```sh
benchmarks/quality/figures.py
```
"""


def voxels_of(level):
    """Voxels along the head's box after this level."""
    return FINEST >> (LEVELS[-1] - level)


def quiet(options, *command):
    return [str(options.roxel), *map(str, command), "--quiet"]


def run_again(options, folder, done, command, sources):
    """Makes `folder` by the command, which reads `sources`, unless it is there."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    runs.make(quiet(options, *command), folder, done, sources)


def sheet(options, name, columns, width, files):
    subprocess.run([str(options.sheets), str(options.docs / name), str(columns), str(width),
                    *(str(f) if f == "-" or pathlib.Path(f).exists() else "-" for f in files)], check=True)


def levels_of_head(options):
    """Figure 5.6: folders of metrics, one a level."""
    data = tables.data_of("head", options)
    folders = []
    for level in LEVELS:
        voxels = voxels_of(level)
        run = options.work / "figures" / f"head-{voxels}"
        run_again(options, run, "summary.json",
                  ["reconstruct", data, "-o", run, "--resolution", voxels, "--levels", level, "--no-bp", "--no-refine",
                   "--no-mesh", "--no-report"], [data])
        metrics = run.with_name(run.name + "-metrics")
        run_again(options, metrics, "metrics.json", ["eval", run, "--truth", data, "-o", metrics], [run])
        folders.append(metrics)
    return folders


def growing_street(options):
    """Figure 8.25: renders, a row a voxel size, a column a number of passes. Each size starts from the one before."""
    data = tables.data_of("street-sky", options)
    sky = tables.sky_of(data, options)
    renders, before = [], None
    for voxel in STREET_VOXELS_M:
        for passes in STREET_PASSES:
            run = options.work / "figures" / f"street-{voxel}m-{passes}"
            start = ["--init", before] if before else []
            run_again(options, run, "summary.json",
                      ["reconstruct", data, "-o", run, "--voxel-size", voxel, "--levels", 1, "--passes", passes, "--illumination", "sky",
                       "--sky", sky, "--matching", "canonical", *start, "--no-depth", "--no-mesh", "--no-report"],
                      [data, sky, *([before] if before else [])])
            renders.append(run / "render" / (DEPTHS["street-sky"][0] + ".png"))
        before = options.work / "figures" / f"street-{voxel}m-{STREET_PASSES[-1]}"
    return renders


def depth_of(part, options):
    """A copy of a run of tables.py with depth after belief propagation: the run it was made from, it, and its metrics."""
    run = (part, *tables.BEST)
    metrics_before = tables.measure(run, options)
    before = metrics_before.with_name(tables.run_name(run))
    data = tables.data_of(part, options)
    after = options.work / "figures" / (part + "-depth")
    runs.make(quiet(options, "depth", after, *DEPTHS[part][1]), after, "summary.json", [before],
                lambda folder: shutil.copytree(before, folder))
    if part == "mug" and not (after / "mesh_views.png").exists():
        subprocess.run(quiet(options, "mesh", after), check=True, stdout=subprocess.DEVNULL)
    metrics = after.with_name(after.name + "-metrics")
    run_again(options, metrics, "metrics.json", ["eval", after, "--truth", data, "-o", metrics], [after])
    return before, after, metrics


def percent(value):
    return "-" if value is None else f"{100 * value:.1f}"


def depth_rows(part, metrics):
    """Volume, belief propagation and refinement side by side, as eval measures them on the same pixels."""
    voxel = metrics["voxel_size"]
    rows = []
    for name, figures in metrics["depth"]["methods"].items():
        within = figures["share_within_voxels"]
        rows.append([part, name, *(percent(within[d]) for d in ("0.5", "1", "2", "4")),
                     f"{figures['median_error_voxels']:.2f}", f"{figures['median_sigma_voxels']:.2f}",
                     f"{figures['median_sigma_voxels'] * voxel:.3g}", percent(figures["coverage_68"]), percent(figures["coverage_95"])])
    return rows


def depth_table(measured):
    head = ["world", "depth", "within 0.5 voxels %", "1", "2", "4", "median error [voxels]", "median σ [voxels]", "median σ [world units]",
            "errors within σ % (honest: 68.3)", "within 1.96 σ % (95.0)"]
    lines = [tables.row(head), tables.row(["---", "---"] + ["---:"] * (len(head) - 2))]
    return lines + [tables.row(cells) for part, metrics in measured.items()
                    for cells in depth_rows(part, metrics)]


def document(measured, remarks):
    grown = " | ".join(f"![the head, {voxels_of(level)} voxels](figure_5_6_{level}.svg)" for level in LEVELS)
    lines = [HEAD, "## 5.6: the volume as its voxels are divided", "",
             f"The head after {', '.join(str(level) for level in LEVELS)} levels: {', '.join(str(voxels_of(level)) for level in LEVELS)} voxels along "
             "the box. Opacity in grey, the true outline in red.", "", "| 1 | 2 | 3 |", "| --- | --- | --- |", f"| {grown} |", "",
             "## 8.25: a street as it grows", "",
             f"Rows: voxels of {', '.join(str(v) for v in STREET_VOXELS_M)} m, each started from the end of the row above; columns: after "
             f"{', '.join(str(p) for p in STREET_PASSES)} passes. Adjusted for the light of each node's sky.", "",
             "![the street as it grows](figure_8_25.jpg)", "",
             "## 8.33, 8.34, 8.35: depth before and after belief propagation", "",
             "The mug: photograph, depth of the volume, after belief propagation and refinement; below, its surface.", "",
             "![the mug's depth](figure_8_33.jpg)", "", "![the mug's surface](figure_8_34.jpg)", "",
             "The street: photograph, depth of the volume, after belief propagation alone.", "", "![the street's depth](figure_8_35.jpg)", "",
             *depth_table(measured), ""]
    return "\n".join(lines) + (f"\n{remarks.strip()}\n" if remarks.strip() else "")


def draw(options):
    for level, metrics in zip(LEVELS, levels_of_head(options)):
        shutil.copyfile(metrics / "section_x.svg", options.docs / f"figure_5_6_{level}.svg")
    measured = {}
    for part, (view, _, number) in DEPTHS.items():
        before, after, metrics = depth_of(part, options)
        images = tables.data_of(part, options) / "images"
        photo = next(images.glob(view + ".*"))
        name = f"figure_{number.replace('.', '_')}.jpg"
        sheet(options, name, 3, 300, [photo, before / "depth" / (view + ".png"), after / "depth" / (view + ".png")])
        if (after / "mesh_views.png").exists():
            sheet(options, "figure_8_34.jpg", 1, 900, [after / "mesh_views.png"])
        measured[part] = json.loads((metrics / "metrics.json").read_text())
    sheet(options, "figure_8_25.jpg", len(STREET_PASSES), 300, growing_street(options))
    return measured


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tables.add_places(parser)
    options = parser.parse_args(arguments)
    options.resolution = FINEST
    options.docs.mkdir(parents=True, exist_ok=True)
    remarks = pathlib.Path(__file__).with_name("figures_remarks.md")
    page = document(draw(options), remarks.read_text() if remarks.exists() else "")
    (options.docs / "figures.md").write_text(page)
    print(f"-> {options.docs / 'figures.md'}")


if __name__ == "__main__":
    main(sys.argv[1:])
