#!/usr/bin/env python3
"""The thesis's tables 8.1 to 8.4, reproduced on synthetic worlds, with its own figures beside ours.

    tables.py [--roxel PROGRAM] [--work DIR] [--docs DIR] [--resolution N] [--only PATTERN] [--write-only]

Makes each world with a fixed seed, reconstructs it with every choice of agreement, colour space and update
rule, measures all at the same threshold of opacity, and writes tables.md, tables.csv and pictures. Runs that the
work folder has already, made by the same program and command, are not made again. The same for the data sets
plane and head of ROXEL_TEST_DATA, where that is set: figures only. Last, the still life in its room, without masks.
"""

import argparse
import csv
import dataclasses
import fnmatch
import json
import math
import os
import pathlib
import re
import subprocess
import sys

from runs import made_by, make

CHOICES = [("exponential", "srgb"), ("exponential", "rgb"), ("gaussian", "rgb"), ("gaussian", "luv"), ("exponential", "luv")]
COARSE = 96  # voxels along the longest side at which rules are compared: the thesis's keeps most of the box to the end
# The order that the thesis finds, best first.
THESIS_ORDER = [("gaussian", "luv"), ("gaussian", "rgb"), ("exponential", "rgb")]
SEED = 1
OPACITY_THRESHOLD = 0.3


@dataclasses.dataclass(frozen=True)
class Rule:
    update: tuple                  # options of reconstruct
    resolution: int = 0            # voxels along the longest side; 0: --resolution
    pictures: bool = True


RULES = {"posterior": Rule(("--update", "posterior")),
         "posterior-coarse": Rule(("--update", "posterior"), COARSE, pictures=False),
         "roxels": Rule(("--update", "roxels", "--no-predictive", "--outlier", "0"), COARSE)}


@dataclasses.dataclass(frozen=True)
class World:
    """A part of the page: one world, or one way of treating its light."""
    what: str
    data: str = ""                 # the world that is made; empty: the part's own name
    size: tuple = ()               # options that say how fine voxels are; empty: --resolution
    light: tuple = ()              # further options of reconstruct; "SKY" is the folder of the world's skies
    sections: tuple = ("section_x",)
    through: str = ""              # point of the sections; empty: the middle of the box
    view: str = ""                 # image whose renders are shown; empty: none
    updates: tuple = ("posterior", "posterior-coarse", "roxels")
    choices: tuple = tuple(CHOICES)
    table: str = ""                # the thesis's
    figures: str = ""              # of the thesis, which the pictures are like
    thesis: tuple = ()             # its rows: choice -> voxels, close to the truth (%), weighted mean opacity (%)
    shared: bool = False           # a data set of ROXEL_TEST_DATA


STREET = {"data": "street", "size": ("--voxel-size", "1"), "sections": ("section_z",), "through": "-1,0,5",
          "view": "n03_04", "updates": ("posterior", "roxels"), "choices": tuple(THESIS_ORDER[::-1])}
STREET_FIGURES = "8.20, 8.22, 8.27, 8.30 to 8.32"
WORLDS = {
    "plane": World("a printed board", view="007", table="Table 8.1", figures="8.3, 8.5, 8.6",
                   thesis=((21928, 73.2, 27.1), (35281, 81.4, 76.3), (32223, 83.3, 77.0))),
    "head": World("a head on a turntable", view="003", table="Table 8.2", figures="8.9, 8.11, 8.12",
                  thesis=((127245, 40.2, 29.3), (65890, 63.4, 57.7), (62996, 64.2, 59.9))),
    "mug": World("a hollow mug on a turntable", view="003", figures="8.16", sections=("section_z", "section_y")),
    "street": World("a street, its light as it is", light=("--illumination", "none", "--matching", "canonical"),
                    table="Table 8.3", figures=STREET_FIGURES,
                    thesis=((223721, 46.1, 25.3), (173755, 42.3, 26.2), (114488, 47.8, 39.5)), **STREET),
    "street-sky": World("the street, adjusted for the light of each node's sky",
                        light=("--illumination", "sky", "--matching", "canonical", "--sky", "SKY"),
                        table="Table 8.4", figures=STREET_FIGURES,
                        thesis=((212537, 45.2, 27.2), (118236, 40.6, 27.4), (116920, 47.3, 43.9)), **STREET),
    "street-local": World("the street, adjusted, and compared without local light",
                          light=("--illumination", "sky", "--matching", "local", "--sky", "SKY"),
                          **{**STREET, "updates": ("posterior",), "choices": (("gaussian", "luv"),)}),
    "shared-plane": World("the data set plane", data="plane", shared=True),
    "shared-head": World("the data set head", data="head", shared=True),
}
# A still life in a room that goes on beyond the box; nothing is masked.
ROOM, ROOM_RESOLUTION, ROOM_SHARES = "table", 160, (0.5, 1.0)  # ..., voxels, percent of the box's diagonal
# The default run at other thresholds: of opacity, of confidence.
THRESHOLDED = ["plane", "head", "shared-plane", "shared-head"]
THRESHOLDS = [(0.04, 0.001), (0.1, 0.001), (0.2, 0.001), (OPACITY_THRESHOLD, 0.001), (0.5, 0.001), (OPACITY_THRESHOLD, 0.05)]
BEST = ("posterior", "gaussian", "luv")  # the default choice

COLUMNS = [("voxels", "voxels"), ("close", "within 4 voxels %"), ("opacity", "weighted mean opacity %"),
           ("covered", "surface covered %"), ("rms", "RMS %"), ("depth_1", "depth within 1 voxel %"),
           ("depth_4", "depth within 4 voxels %"), ("f_score", "F at 1 % of the diagonal")]
HISTOGRAM = "voxel_distances"


def thesis_rows(world):
    """The thesis's rows of a world by choice, worst first as there."""
    return dict(zip(THESIS_ORDER[::-1], WORLDS[world].thesis))


def all_runs():
    return [(name, update, *choice) for name, world in WORLDS.items() for update in world.updates
            for choice in world.choices]


def run_name(run):
    world, update, agreement, space = run
    return f"{world}-{update}-{agreement}-{space}"


def selected(pattern):
    return [run for run in all_runs() if not pattern or fnmatch.fnmatch(run_name(run), pattern)]


def resolution_of(run, resolution):
    """Voxels along the longest side, where the finest are asked to be `resolution`."""
    return RULES[run[1]].resolution or resolution


def along_the_box(run, resolution):
    """The same as text; empty where voxels have a size of their own."""
    return "" if WORLDS[run[0]].size else str(resolution_of(run, resolution))


def metrics_folder(run, options):
    return options.work / str(resolution_of(run, options.resolution)) / (run_name(run) + "-metrics")


def reconstruct_options(run, resolution, sky="SKY"):
    name, update, agreement, space = run
    world = WORLDS[name]
    return [*RULES[update].update, "--agreement", agreement, "--color-space", space,
            *(world.size or ("--resolution", str(resolution_of(run, resolution)))),
            *(str(sky) if option == "SKY" else option for option in world.light)]


def shared_folder(name):
    """A data set of ROXEL_TEST_DATA; None where that is not set, or without it."""
    root = os.environ.get("ROXEL_TEST_DATA")
    folder = pathlib.Path(root) / name if root else None
    return folder if folder and folder.is_dir() else None


def share_of_diagonal(dataset, percent):
    """World units; of the box that the data set asks for."""
    low, high = json.loads((dataset / "transforms.json").read_text())["scene_bounds"]
    return percent / 100 * math.dist(low, high)


def make_world(name, options):
    """The folder of a world, made where it is not there."""
    data = options.work / name
    make([str(options.roxel), "synth", name, "-o", str(data), "--seed", str(SEED), "--quiet"], data, "transforms.json")
    return data


def data_of(name, options):
    """The data set of a part of the page; None where it is not there."""
    world = WORLDS[name]
    if world.shared:
        return shared_folder(world.data)
    return make_world(world.data or name, options)


def sky_of(data, options):
    """The folder of a data set's skies, made where it is not there."""
    sky = data.with_name(data.name + "-sky")
    make([str(options.roxel), "sky", str(data), "-o", str(sky), "--no-pictures", "--quiet"], sky, "summary.json", [data])
    return sky


def measure(run, options):
    """The folder with a run's metrics, made where it is not there; None where its data are not."""
    roxel = str(options.roxel)
    metrics, world = metrics_folder(run, options), WORLDS[run[0]]
    data = data_of(run[0], options)
    if data is None:
        return None
    metrics.parent.mkdir(parents=True, exist_ok=True)
    made = metrics.with_name(run_name(run))
    sky = sky_of(data, options) if "SKY" in world.light else None
    command = [roxel, "reconstruct", str(data), "-o", str(made), *reconstruct_options(run, options.resolution, sky)]
    make([*command, "--no-bp", "--no-refine", "--no-mesh", "--no-report", "--quiet"], made, "summary.json",
         [data, sky] if sky else [data])
    make([roxel, "eval", str(made), "--truth", str(data), "-o", str(metrics), "--opacity-threshold",
          str(OPACITY_THRESHOLD), "--distances", f"{share_of_diagonal(data, 1):.6g}",
          *(["--section=" + world.through] if world.through else []), "--quiet"],
         metrics, "metrics.json", [made])
    return metrics


def threshold_folder(run, thresholds, options):
    return metrics_folder(run, options).with_name(run_name(run) + "-at-{:g}-{:g}".format(*thresholds))


def measure_thresholds(run, options):
    """Metrics of a run at each of THRESHOLDS; nothing where its data are not there."""
    metrics, data = measure(run, options), data_of(run[0], options)
    if metrics is None:
        return
    made = metrics.with_name(run_name(run))
    for opacity, confidence in THRESHOLDS:
        folder = threshold_folder(run, (opacity, confidence), options)
        make([str(options.roxel), "eval", str(made), "--truth", str(data), "-o", str(folder), "--opacity-threshold", str(opacity),
              "--confidence-threshold", str(confidence), "--quiet"], folder, "metrics.json", [made])


def measure_room(options):
    """The folder with the room's metrics: the whole default run, with depth refined and a surface."""
    data = make_world(ROOM, options)
    made, metrics = options.work / f"{ROOM}-{ROOM_RESOLUTION}", options.work / f"{ROOM}-{ROOM_RESOLUTION}-metrics"
    make([str(options.roxel), "reconstruct", str(data), "-o", str(made), "--resolution", str(ROOM_RESOLUTION), "--no-report",
          "--quiet"], made, "summary.json", [data])
    distances = ",".join(f"{share_of_diagonal(data, share):.6g}" for share in ROOM_SHARES)
    make([str(options.roxel), "eval", str(made), "--truth", str(data), "-o", str(metrics), "--distances", distances, "--quiet"],
         metrics, "metrics.json", [made])
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
    names = {("exponential", "srgb"): "exponential sRGB", ("exponential", "rgb"): "exponential RGB (Roxels)", ("gaussian", "rgb"): "Gaussian RGB",
             ("gaussian", "luv"): "Gaussian Luv", ("exponential", "luv"): "exponential Luv"}
    return names[choice]


def world_table(world, results, resolution):
    """One world's table: the thesis's rows first, then ours for each update rule."""
    lines = [row(["rule", "along the box", "agreement"] + [title for _, title in COLUMNS]),
             row(["---", "---:", "---"] + ["---:"] * len(COLUMNS))]
    for choice, known in thesis_rows(world).items():
        values = dict(zip(["voxels", "close", "opacity"], known))
        lines.append(row([f"thesis, {WORLDS[world].table}", "-", choice_name(choice)] +
                         [cell(key, values.get(key)) for key, _ in COLUMNS]))
    for update in WORLDS[world].updates:
        for choice in WORLDS[world].choices:
            run = (world, update, *choice)
            values = results.get(run)
            if values:
                rule = RULES[update].update[1]
                lines.append(row([f"ours, `{rule}`" if rule == "posterior" else f"the thesis's, `{rule}`", along_the_box(run, resolution) or "-", choice_name(choice)] +
                                 [cell(key, values[key]) for key, _ in COLUMNS]))
    return lines


def pictures_of(run):
    """Pairs of a picture's file beside a run's metrics and its file beside the page."""
    return [(f"{stem}.svg", f"{run_name(run)}-{stem}.svg") for stem in (*WORLDS[run[0]].sections, HISTOGRAM)]


SHORTEST = 0.5  # voxels


def without_specks(svg):
    """A section whose outline has no pieces shorter than SHORTEST: leaves of trees, which are most of its size."""
    def kept(piece):
        x0, y0, x1, y1 = (float(number) for number in piece.groups())
        return piece.group() if math.hypot(x1 - x0, y1 - y0) >= SHORTEST else ""
    return re.sub(r"M([\d.-]+) ([\d.-]+)L([\d.-]+) ([\d.-]+)(?=M|\")", kept, svg)


def copy_pictures(results, folders, docs):
    for run in results:
        if run[2:] in THESIS_ORDER and RULES[run[1]].pictures and not WORLDS[run[0]].shared:
            for source, target in pictures_of(run):
                text = (folders[run] / source).read_text()
                (docs / target).write_text(without_specks(text) if WORLDS[run[0]].data == "street" else text)


def shown_choices(world):
    """Of the thesis's, worst first as there."""
    return [choice for choice in THESIS_ORDER[::-1] if choice in WORLDS[world].choices]


def with_pictures(world):
    return [update for update in WORLDS[world].updates if RULES[update].pictures]


def render_sheet(world, results, options):
    """Renders of one view as JPEG beside the page: a row a rule, the photograph first. Returns whether it is there."""
    name, view = f"{world}-renders.jpg", WORLDS[world].view
    if not view or not options.sheets.exists():
        return (options.docs / name).exists()
    photo = next((str(p) for p in [(options.work / (WORLDS[world].data or world) / "images" / (view + suffix))
                                   for suffix in (".png", ".exr")] if p.exists()), "-")
    choices, files = shown_choices(world), []
    for update in with_pictures(world):
        runs = [(world, update, *choice) for choice in choices]
        renders = [metrics_folder(run, options).with_name(run_name(run)) / "render" / (view + ".png") for run in runs]
        if any(path.exists() for path in renders):
            files += [photo, *(str(path) if path.exists() else "-" for path in renders)]
    if not files:
        return False
    subprocess.run([str(options.sheets), str(options.docs / name), str(1 + len(choices)), "240", *files], check=True)
    return True


def picture_table(world, results):
    """Sections and histograms, a column for each of the thesis's choices, worst first as there."""
    choices = shown_choices(world)
    lines = [row(["rule"] + [choice_name(choice) for choice in choices]), row(["---"] * (1 + len(choices)))]
    for update in with_pictures(world):
        for i in range(len(WORLDS[world].sections) + 1):
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


def ordering_table(results, resolution):
    keys = [("close", "within 4 voxels"), ("opacity", "weighted mean opacity"), ("covered", "surface covered"),
            ("depth_1", "depth within 1 voxel"), ("f_score", "F at 1 %"), ("rms", "RMS (less is better)")]
    lines = [row(["world", "rule", "along the box"] + [title for _, title in keys]), row(["---"] * (3 + len(keys)))]
    for world in WORLDS:
        for update in WORLDS[world].updates:
            found = [ordering(world, update, key, results, key == "rms") for key, _ in keys]
            along = along_the_box((world, update), resolution) or "-"
            if None not in found:
                lines.append(row([world, f"`{RULES[update].update[1]}`", along, *found]))
    return lines


def threshold_part(results):
    """Opacity, closeness and covering by threshold; `results`: figures by world and thresholds."""
    worlds = [world for world in THRESHOLDED if any(key[0] == world for key in results)]
    lines = ["## The default at other thresholds", "",
             "Weighted mean opacity / voxels within four / surface covered, in percent, of Gaussian Luv with `posterior`, by the opacity and the confidence from "
             "which a voxel counts. (0.04 is what `reconstruct` saves; a confidence of 0.05 leaves out what hardly a ray reaches.)", "",
             row(["opacity", "confidence", *worlds]), row(["---:"] * 2 + ["---"] * len(worlds))]
    for thresholds in THRESHOLDS:
        found = [results.get((world, thresholds)) for world in worlds]
        lines.append(row(["{:g}".format(t) for t in thresholds] +
                         [" / ".join(cell(key, f[key]) for key in ("opacity", "close", "covered")) if f else "-" for f in found]))
    return lines + [""]


def room_part(metrics):
    """The still life: precision, recall and F-score of its points and surface."""
    lines = [f"## {ROOM}: a still life in a room, without masks", "",
             f"`roxel reconstruct {ROOM} --resolution {ROOM_RESOLUTION}`: bounds around the still life alone, all else as it is. Precision / recall / "
             "**F-score** at shares of the box's diagonal:", "",
             row(["", *(f"{share:g} %" for share in ROOM_SHARES)]), row(["---"] * (1 + len(ROOM_SHARES)))]
    for surface in metrics["surfaces"]:
        if surface["name"] != "voxels":
            lines.append(row([surface["name"], *(f"{w['precision']:.3f} / {w['recall']:.3f} / **{w['f_score']:.3f}**"
                                                 for w in surface["within"])]))
    within = metrics["depth"]["share_within_voxels"]
    return lines + ["", "Of the pixels of the still life, " + ", ".join(f"{100 * within[v]:.1f} %" for v in ("0.5", "1", "4")) +
                    " have depth within 0.5, 1 and 4 voxels.", ""]


HEAD = """# Tables 8.1 to 8.4 of the thesis, reproduced

Made by `benchmarks/quality/tables.py`; do not edit: what is said by hand stands in `benchmarks/quality/tables_remarks.md`. Figures
as CSV: [tables.csv](tables.csv).

```sh
benchmarks/quality/tables.py --resolution {resolution}
```

Worlds: `roxel synth WORLD --seed {seed}` with its other options at their defaults. Runs: `roxel reconstruct --update RULE --agreement
AGREEMENT --color-space SPACE --resolution N`, where N is in the column *along the box* (the street: `--voxel-size 1`, light as its heading
says), all else at its default, so masks are used and noise and scale are the space's own. `posterior` is our rule; `roxels` is the one that
the thesis prints, with what rays are compared with there ({roxels}). It keeps most of the box to the end, and is compared with ours at {coarse}
voxels; ours is also shown at the program's own resolution. **Gaussian Luv with `posterior` is the default.**
Measured by `roxel eval --opacity-threshold {opacity}`: one threshold for all
([evaluation.md](../evaluation.md)). *RMS* is over the object; *surface covered* is the share of what two views see that has a counted voxel
within one voxel; *F* is of the depth points at 1 % of the box's diagonal.

The thesis's rows are [Jethwa04] tables 8.1 to 8.4: other objects of the same kind, other cameras and another size of voxels, so the
numbers of voxels do not compare and the rest does so roughly. The thesis measures from the nearest voxel of the true surface, `roxel eval`
from the surface.
"""


def world_part(world, results, sheets, resolution):
    lines = [f"## {world}: {WORLDS[world].what}", ""]
    if WORLDS[world].light:
        lines += ["`" + " ".join("SKIES" if o == "SKY" else o for o in WORLDS[world].light) + "`", ""]
    lines += [*world_table(world, results, resolution), ""]
    if WORLDS[world].shared:
        return lines
    if world in sheets:
        rules = ", then ".join(f"`{update}`" for update in with_pictures(world))
        shown = ", ".join(choice_name(choice) for choice in shown_choices(world))
        lines += [f"Photograph {WORLDS[world].view} and its renders with {shown}; {rules}:", "",
                  f"![renders of {world}]({world}-renders.jpg)", ""]
    thesis = f", as figures {WORLDS[world].figures} of the thesis" if WORLDS[world].figures else ""
    if WORLDS[world].data == "street":
        thesis += f"; pieces of the outline shorter than {SHORTEST} voxels, which are leaves, are not drawn"
    return lines + [f"Cross-sections (opacity in grey, the true outline in red) and voxels by distance{thesis}:", "",
                    *picture_table(world, results), ""]


def document(results, resolution, remarks="", room=None, sheets=(), thresholds={}):
    lines = HEAD.format(resolution=resolution, coarse=COARSE, seed=SEED, opacity=OPACITY_THRESHOLD,
                        roxels="`" + " ".join(RULES["roxels"].update) + "`").splitlines() + [""]
    for world in WORLDS:
        if any(run[0] == world for run in results):
            lines += world_part(world, results, sheets, resolution)
    lines += threshold_part(thresholds) if thresholds else []
    lines += room_part(room) if room else []
    lines += ["## Does the thesis's order hold: Luv before RGB before exponential?", "", *ordering_table(results, resolution), ""]
    return "\n".join(lines) + (f"\n{remarks.strip()}\n" if remarks.strip() else "")


def write_csv(path, results, resolution):
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["source", "world", "update", "along_the_box", "agreement", "color_space"] + [key for key, _ in COLUMNS])
        for world in WORLDS:
            for choice, known in thesis_rows(world).items():
                writer.writerow(["thesis", world, "", "", *choice, *known] + [""] * (len(COLUMNS) - 3))
        for run, values in results.items():
            shown = ["" if values[key] is None else f"{values[key]:.6g}" for key, _ in COLUMNS]
            writer.writerow(["roxel", run[0], RULES[run[1]].update[1], along_the_box(run, resolution), *run[2:], *shown])


def add_places(parser):
    """Options for programs and folders that all pages share."""
    root = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--roxel", type=pathlib.Path, default=root / "build/release/apps/roxel/roxel",
                        help="the program [build/release/apps/roxel/roxel]")
    parser.add_argument("--work", type=pathlib.Path, default=root / "build/quality",
                        help="where data sets and runs go and stay [build/quality]")
    parser.add_argument("--docs", type=pathlib.Path, default=root / "docs/results", help="where pages go [docs/results]")
    parser.add_argument("--sheets", type=pathlib.Path, default=root / "build/release/benchmarks/quality/contact_sheet",
                        help="the program that puts pictures side by side [build/release/benchmarks/quality/contact_sheet]")


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_places(parser)
    parser.add_argument("--resolution", type=int, default=256,
                        help="finest voxels along the longest side; rules are compared at %d [256, the program's own]" % COARSE)
    parser.add_argument("--only", default="", help="make the runs whose name WORLD-RULE-AGREEMENT-SPACE "
                        "matches, e.g. 'head-*'; others are in the tables where they were made before")
    parser.add_argument("--write-only", action="store_true", help="make nothing; write tables of what is there")
    return parser.parse_args(arguments)


def main(arguments):
    options = parse(arguments)
    wanted = [] if options.write_only else selected(options.only)
    with_room = not options.write_only and fnmatch.fnmatch(ROOM, options.only or "*")
    if not wanted and not with_room and not options.write_only:
        sys.exit(f"tables: no run matches --only {options.only}; they are named like {run_name(all_runs()[0])}, and {ROOM}")
    for run in wanted:
        if measure(run, options) is None:
            print(f"skipped: {run_name(run)}, as ROXEL_TEST_DATA has no {WORLDS[run[0]].data}", file=sys.stderr)
        elif run[1:] == BEST and run[0] in THRESHOLDED:
            measure_thresholds(run, options)
    if with_room:
        measure_room(options)
    there = lambda folder: (folder / "metrics.json").exists()
    folders = {run: metrics_folder(run, options) for run in all_runs()}
    results = {run: read_figures(folder) for run, folder in folders.items() if there(folder)}
    room = options.work / f"{ROOM}-{ROOM_RESOLUTION}-metrics" / "metrics.json"
    at = {(world, t): threshold_folder((world, *BEST), t, options) for world in THRESHOLDED for t in THRESHOLDS}
    thresholds = {key: read_figures(folder) for key, folder in at.items() if there(folder)}
    programs = {made_by(folder).splitlines()[1] for folder in [*folders.values(), *at.values(), room.parent]
                if there(folder) and made_by(folder)}
    if len(programs) > 1:
        print(f"tables: the page holds measures by {len(programs)} builds of the program", file=sys.stderr)
    options.docs.mkdir(parents=True, exist_ok=True)
    copy_pictures(results, folders, options.docs)
    sheets = [world for world in WORLDS if render_sheet(world, results, options)]
    remarks = pathlib.Path(__file__).with_name("tables_remarks.md")
    (options.docs / "tables.md").write_text(
        document(results, options.resolution, remarks.read_text() if remarks.exists() else "",
                 json.loads(room.read_text()) if room.exists() else None, sheets, thresholds))
    write_csv(options.docs / "tables.csv", results, options.resolution)
    print(f"{len(results)} of {len(all_runs())} runs -> {options.docs / 'tables.md'}")


if __name__ == "__main__":
    main(sys.argv[1:])
