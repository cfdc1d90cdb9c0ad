#!/usr/bin/env python3
"""The thesis's tables 8.1 and 8.2, reproduced on synthetic worlds, with its own figures beside ours.

    tables.py [--roxel PROGRAM] [--work DIR] [--docs DIR] [--resolution N] [--only PATTERN] [--write-only]

Makes each world with a fixed seed, reconstructs it with every choice of agreement, colour space and update
rule, measures all at one opacity threshold, and writes tables.md and tables.csv. Runs that the work folder
has already, made by the same command, are not made again.
"""

import argparse
import csv
import fnmatch
import json
import math
import pathlib
import shlex
import shutil
import subprocess
import sys
import time

WORLDS = {"plane": "a printed board", "head": "a head on a turntable", "mug": "a hollow mug on a turntable"}
CHOICES = [("exponential", "rgb"), ("gaussian", "rgb"), ("gaussian", "luv"), ("exponential", "luv")]
UPDATES = ["posterior", "roxels"]
SEED = 1
OPACITY_THRESHOLD = 0.3

# [Jethwa04] tables 8.1 and 8.2: voxels, close to the truth (%), distance-weighted mean opacity (%).
THESIS = {
    "plane": {("exponential", "rgb"): (21928, 73.2, 27.1), ("gaussian", "rgb"): (35281, 81.4, 76.3),
              ("gaussian", "luv"): (32223, 83.3, 77.0)},
    "head": {("exponential", "rgb"): (127245, 40.2, 29.3), ("gaussian", "rgb"): (65890, 63.4, 57.7),
             ("gaussian", "luv"): (62996, 64.2, 59.9)},
}
THESIS_TABLE = {"plane": "Table 8.1", "head": "Table 8.2"}

COLUMNS = [("voxels", "voxels"), ("close", "within 4 voxels %"), ("opacity", "weighted mean opacity %"),
           ("covered", "surface covered %"), ("rms", "RMS %"), ("depth_1", "depth within 1 voxel %"),
           ("depth_4", "depth within 4 voxels %"), ("f_score", "F at 1 % of the diagonal")]
# The order that the thesis finds, best first.
THESIS_ORDER = [("gaussian", "luv"), ("gaussian", "rgb"), ("exponential", "rgb")]
# What the page shows of each run: a cross-section that eval draws, and its histogram of distances.
PICTURES = {"plane": "section_x", "head": "section_x", "mug": "section_x"}
HISTOGRAM = "voxel_distances"
THESIS_PICTURES = {"plane": "8.5, 8.6", "head": "8.11, 8.12"}


def all_runs():
    return [(world, update, *choice) for world in WORLDS for update in UPDATES for choice in CHOICES]


def run_name(run):
    world, update, agreement, space = run
    return f"{world}-{update}-{agreement}-{space}"


def selected(pattern):
    return [run for run in all_runs() if not pattern or fnmatch.fnmatch(run_name(run), pattern)]


def reconstruct_options(run, resolution):
    _, update, agreement, space = run
    return ["--update", update, "--agreement", agreement, "--color-space", space, "--resolution", str(resolution)]


def make(command, folder, done):
    """Runs a command, unless the file `done` of its folder is there and came from the same command."""
    stamp = folder.with_name(folder.name + ".command")
    text = shlex.join(command)
    if (folder / done).exists() and stamp.exists() and stamp.read_text() == text:
        return False
    stamp.unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)
    print(text, flush=True)
    begun = time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    print(f"  {time.monotonic() - begun:.0f} s", flush=True)
    stamp.write_text(text)
    return True


def one_percent_of_diagonal(dataset):
    """World units; of the box that the data set asks for."""
    low, high = json.loads((dataset / "transforms.json").read_text())["scene_bounds"]
    return 0.01 * math.dist(low, high)


def measure(run, options):
    """The folder with a run's metrics, made where it is not there."""
    roxel, work = str(options.roxel), options.work / str(options.resolution)
    work.mkdir(parents=True, exist_ok=True)
    data, made, metrics = options.work / run[0], work / run_name(run), work / (run_name(run) + "-metrics")
    anew = make([roxel, "synth", run[0], "-o", str(data), "--seed", str(SEED), "--quiet"], data, "transforms.json")
    command = [roxel, "reconstruct", str(data), "-o", str(made), *reconstruct_options(run, options.resolution)]
    if make([*command, "--no-bp", "--no-refine", "--no-mesh", "--no-report", "--quiet"], made, "summary.json") or anew:
        shutil.rmtree(metrics, ignore_errors=True)
    make([roxel, "eval", str(made), "--truth", str(data), "-o", str(metrics), "--opacity-threshold",
          str(OPACITY_THRESHOLD), "--distances", f"{one_percent_of_diagonal(data):.6g}", "--quiet"], metrics, "metrics.json")
    return metrics


def figures(metrics):
    """The columns of one run from its metrics.json; shares in percent, None where something was not measured."""
    volume, depth, images = metrics["volume"], metrics["depth"], metrics["images"]
    points = [s for s in metrics["surfaces"] or [] if s["name"] == "depth points"]
    within = depth["share_within_voxels"] if depth else {}
    percent = lambda value: None if value is None else 100 * value
    return {
        "voxels": volume["voxels"] if volume else None,
        "close": percent(volume["share_within_4_voxels"]) if volume else None,
        "opacity": percent(volume["weighted_mean_opacity"]) if volume else None,
        "covered": percent(volume["share_of_surface_covered"]) if volume else None,
        "rms": percent(images["object"]["rms"]) if images else None,
        "depth_1": percent(within.get("1")),
        "depth_4": percent(within.get("4")),
        "f_score": points[0]["within"][0]["f_score"] if points else None,
    }


def read_figures(folder):
    return figures(json.loads((folder / "metrics.json").read_text()))


def cell(key, value):
    if value is None:
        return "-"
    if key == "voxels":
        return f"{value}"
    return f"{value:.3f}" if key == "f_score" else f"{value:.1f}"


def row(cells):
    return "| " + " | ".join(cells) + " |"


def choice_name(choice):
    names = {("exponential", "rgb"): "exponential RGB (Roxels)", ("gaussian", "rgb"): "Gaussian RGB",
             ("gaussian", "luv"): "Gaussian Luv", ("exponential", "luv"): "exponential Luv"}
    return names[choice]


def world_table(world, results):
    """One world's table: the thesis's rows first, then ours for each update rule."""
    lines = [row(["rule", "agreement"] + [title for _, title in COLUMNS]),
             row(["---", "---"] + ["---:"] * len(COLUMNS))]
    for choice, known in THESIS.get(world, {}).items():
        values = dict(zip(["voxels", "close", "opacity"], known))
        lines.append(row([f"thesis, {THESIS_TABLE[world]}", choice_name(choice)] +
                         [cell(key, values.get(key)) for key, _ in COLUMNS]))
    for update in UPDATES:
        for choice in CHOICES:
            values = results.get((world, update, *choice))
            if values:
                lines.append(row([f"ours, `{update}`", choice_name(choice)] +
                                 [cell(key, values[key]) for key, _ in COLUMNS]))
    return lines


def pictures_of(run):
    """Pairs of a picture's file beside a run's metrics and its file beside the page."""
    return [(f"{stem}.svg", f"{run_name(run)}-{stem}.svg") for stem in (PICTURES[run[0]], HISTOGRAM)]


def copy_pictures(results, folders, docs):
    for run in results:
        if run[2:] in THESIS_ORDER:
            for source, target in pictures_of(run):
                shutil.copyfile(folders[run] / source, docs / target)


def picture_table(world, results):
    """Sections and histograms, a column for each of the thesis's choices, worst first as there."""
    choices = THESIS_ORDER[::-1]
    lines = [row(["rule"] + [choice_name(choice) for choice in choices]), row(["---"] * (1 + len(choices)))]
    for update in UPDATES:
        for i in range(2):
            runs = [(world, update, *choice) for choice in choices]
            shown = [f"![{run_name(run)}]({pictures_of(run)[i][1]})" if run in results else "-" for run in runs]
            if any(run in results for run in runs):
                lines.append(row([f"`{update}`", *shown]))
    return lines


def ordering(world, update, key, results, less_is_better=False):
    """What a column says of the thesis's order Luv > RGB > exponential; None without all three runs."""
    values = [(results.get((world, update, *choice)) or {}).get(key) for choice in THESIS_ORDER]
    if None in values:
        return None
    shown = [round(-value if less_is_better else value, 3 if key == "f_score" else 1) for value in values]
    luv, rgb, exponential = shown
    if luv >= rgb >= exponential and luv > exponential:
        return "holds" if luv > rgb > exponential else "holds, with a tie"
    if luv >= exponential and rgb >= exponential and rgb > luv:
        return "RGB before Luv, both before exponential"
    if luv >= rgb:
        return "Luv before RGB, but exponential " + ("between" if luv >= exponential else "first")
    return "RGB before Luv, exponential " + ("between" if rgb >= exponential else "first")


def ordering_table(results):
    keys = [("close", "within 4 voxels"), ("opacity", "weighted mean opacity"), ("covered", "surface covered"),
            ("depth_1", "depth within 1 voxel"), ("f_score", "F at 1 %"), ("rms", "RMS (less is better)")]
    lines = [row(["world", "rule"] + [title for _, title in keys]), row(["---"] * (2 + len(keys)))]
    for world in WORLDS:
        for update in UPDATES:
            found = [ordering(world, update, key, results, key == "rms") for key, _ in keys]
            if None not in found:
                lines.append(row([world, f"`{update}`", *found]))
    return lines


def document(results, resolution, remarks=""):
    lines = ["# Tables 8.1 and 8.2 of the thesis, reproduced", "",
             "Made by `benchmarks/quality/tables.py`; do not edit: what is said by hand stands in "
             "`benchmarks/quality/tables_remarks.md`. Figures as CSV: [tables.csv](tables.csv).", "",
             "```sh", f"benchmarks/quality/tables.py --resolution {resolution}", "```", "",
             f"Worlds: `roxel synth WORLD --seed {SEED}` with its other options at their defaults. Runs: "
             f"`roxel reconstruct --resolution {resolution} --update RULE --agreement AGREEMENT --color-space SPACE`, all else "
             "at its default, so masks are used and noise and scale are the space's own. Measured by `roxel eval "
             f"--opacity-threshold {OPACITY_THRESHOLD}`: one threshold for all ([evaluation.md](../evaluation.md)). "
             "*RMS* is over the object; *surface covered* is the share of what two views see that has a counted voxel "
             "within one voxel; *F* is of the depth points at 1 % of the box's diagonal.", "",
             "The thesis's rows are [Jethwa04] tables 8.1 and 8.2: other objects of the same kind, other cameras and another "
             "size of voxels, so the numbers of voxels do not compare and the rest does so roughly. The thesis measures from the "
             "nearest voxel of the true surface, `roxel eval` from the surface.", ""]
    for world, what in WORLDS.items():
        thesis = f", as figures {THESIS_PICTURES[world]} of the thesis" if world in THESIS_PICTURES else ""
        lines += [f"## {world}: {what}", "", *world_table(world, results), "",
                  f"Cross-sections (opacity in grey, the true outline in red) and voxels by distance{thesis}:", "",
                  *picture_table(world, results), ""]
    lines += ["## Does the thesis's order hold: Luv before RGB before exponential?", "", *ordering_table(results), ""]
    return "\n".join(lines) + (f"\n{remarks.strip()}\n" if remarks.strip() else "")


def write_csv(path, results):
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["source", "world", "update", "agreement", "color_space"] + [key for key, _ in COLUMNS])
        for world, rows in THESIS.items():
            for choice, known in rows.items():
                writer.writerow(["thesis", world, "", *choice, *known] + [""] * (len(COLUMNS) - 3))
        for run, values in results.items():
            shown = ["" if values[key] is None else f"{values[key]:.6g}" for key, _ in COLUMNS]
            writer.writerow(["roxel", *run, *shown])


def parse(arguments):
    root = pathlib.Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--roxel", type=pathlib.Path, default=root / "build/release/apps/roxel/roxel",
                        help="the program [build/release/apps/roxel/roxel]")
    parser.add_argument("--work", type=pathlib.Path, default=root / "build/quality",
                        help="where data sets and runs go and stay [build/quality]")
    parser.add_argument("--docs", type=pathlib.Path, default=root / "docs/results",
                        help="where tables.md and tables.csv go [docs/results]")
    parser.add_argument("--resolution", type=int, default=96,
                        help="finest voxels along the longest side; 256 is the program's own [96]")
    parser.add_argument("--only", default="", help="make the runs whose name WORLD-RULE-AGREEMENT-SPACE "
                        "matches, e.g. 'head-*'; others are in the tables where they were made before")
    parser.add_argument("--write-only", action="store_true", help="make nothing; write tables of what is there")
    return parser.parse_args(arguments)


def main(arguments):
    options = parse(arguments)
    wanted = [] if options.write_only else selected(options.only)
    if not wanted and not options.write_only:
        sys.exit(f"tables: no run matches --only {options.only}; they are named like {run_name(all_runs()[0])}")
    for run in wanted:
        measure(run, options)
    folders = {run: options.work / str(options.resolution) / (run_name(run) + "-metrics") for run in all_runs()}
    results = {run: read_figures(folder) for run, folder in folders.items() if (folder / "metrics.json").exists()}
    options.docs.mkdir(parents=True, exist_ok=True)
    copy_pictures(results, folders, options.docs)
    remarks = pathlib.Path(__file__).with_name("tables_remarks.md")
    (options.docs / "tables.md").write_text(
        document(results, options.resolution, remarks.read_text() if remarks.exists() else ""))
    write_csv(options.docs / "tables.csv", results)
    print(f"{len(results)} of {len(all_runs())} runs -> {options.docs / 'tables.md'}")


if __name__ == "__main__":
    main(sys.argv[1:])
