#!/usr/bin/env python3
"""What dividing light out comes to: docs/results/light.md.

    light_table.py [--roxel PROGRAM] [--data DIR] [--work DIR] [--docs DIR] [--only PATTERN]

Reconstructs the data set `courtyard` (ray-traced; eight nodes, each in its own light; truth beside it) with each choice of light and
matching, with skies and sky masks that roxel finds, and measures the runs with `roxel eval`. Runs that the work folder has already, made
by the same program and command, are not made again; --only makes those whose names match and writes no page. Skips, and says so, where the
data are not there. No picture of the data is written.
"""

import argparse
import dataclasses
import fnmatch
import json
import os
import pathlib
import sys

from runs import make
from sky_table import data_root, percent, table

BOX = ("--bounds=-36,-32,-0.5,36,33,28",)
SURE_M = 1  # stated deviation of depth points that a run is sure of


@dataclasses.dataclass(frozen=True)
class Choice:
    light: str
    matching: str
    voxel_m: float = 0.5

    @property
    def name(self):
        return f"{self.light}-{self.matching}-{self.voxel_m:g}"


CHOICES = [Choice("none", "canonical"), Choice("gain", "canonical"), Choice("sky", "canonical"), Choice("none", "local"), Choice("gain", "local"),
           Choice("sky", "local"), Choice("sky-normal", "local"), Choice("sky", "local", 0.25)]
LIT = Choice("sky-normal", "local")  # whose lights are measured side by side
SETS = {"of all": "depth points", "by pixel": "depth points by pixel", "agreed on": "depth points that 2 views agree on", "sure": None}
HEAD = """# Light

Made by `benchmarks/quality/light_table.py`; do not edit: what is said by hand stands in `benchmarks/quality/light_remarks.md`. What each figure is:
[evaluation.md](../evaluation.md#pixels); what is divided out and how: [light.md](../light.md).

A ray-traced town square: eight nodes of about 20 images, each at its own date and time, six in the sun and two overcast; box -36,-32,-0.5 to
36,33,28; skies and sky masks as `roxel sky` finds them. A run is

```sh
roxel reconstruct courtyard -o run --bounds=-36,-32,-0.5,36,33,28 --voxel-size 0.5 --masks none --sky SKIES --illumination sky --matching local
roxel eval run --truth courtyard --distances 0.5,1 --depth-within 0.5,1,2 --sure-within 2      # voxels: 1 m
```

without belief propagation, refinement and mesh.
"""
COLORS = """
## Colours

*spread*: standard deviation, over the nodes that see a place, of log colour; *off albedo*: deviation of log colour from log albedo, one scale free. Of the
photographs over each light, all at the same {places} places (of {shared} that three nodes see: those whose light by normal the run of `sky-normal` knows) and {pixels}
pixels with known albedo. The last two rows are the floors: true light divided out.
"""
OWN = """
Then every run by itself: the photographs over its own light, at all places that it knows its light at; the voxels' own colours against albedo; and the error of renders in each image's own light.
"""
DEPTH = """
## Geometry

Share of pixels whose depth is within 0.5, 1 and 2 m of the truth, in percent, of the volume; F-scores at 0.5 and 1 m of its depth points: thinned to one a cell of half
a voxel (of all), each pixel a point (by pixel), of those that two views agree on, and of those whose deviation the run says is at most {sure:g} m.
"""
DEBRIS = """
## Sky debris

Voxels of an opacity of 0.04 or 0.3 and more that stand where no true surface is within a voxel, in percent of all such voxels, and of their summed opacity: *in the open*, nothing is above them;
*above all*, they are higher than the highest roof; *before the sky*, some photograph shows nothing but sky all over them.
"""
COST = """
## Cost

On {processors} processors, at times beside other work; without `roxel eval`.
"""


def number(value, digits=3):
    return "-" if value is None else f"{value:.{digits}f}"


def choice_cells(choice):
    return [choice.light, choice.matching, f"{choice.voxel_m:g}"]


def light_rows(metrics):
    """A row a light of a run by normal, "run" being that."""
    names = {"run": "sky-normal"}
    rows = []
    for light in metrics["light"]:
        albedo = light["albedo"] or {}
        rows.append([names.get(light["light"], light["light"]), number(light["mean_spread"]), number(light["median_spread"]),
                     number(albedo.get("mean_log_error")), number(albedo.get("median_log_error"))])
    return rows


def falls(values):
    return all(a > b for a, b in zip(values, values[1:]))


def orders(metrics):
    """Whether each column of the lights falls from none over sky to sky-normal, said from the figures."""
    by = {light["light"]: light for light in metrics["light"]}
    if not {"none", "sky", "run"} <= set(by): return ""
    columns = {"mean spread": lambda m: m["mean_spread"], "median spread": lambda m: m["median_spread"]}
    if all(by[name]["albedo"] for name in ("none", "sky", "run")):
        columns |= {"mean off albedo": lambda m: m["albedo"]["mean_log_error"], "median off albedo": lambda m: m["albedo"]["median_log_error"]}
    holds, breaks = [], []
    for name, of in columns.items():
        values = [of(by[light]) for light in ("none", "sky", "run")]
        if falls(values): holds.append(name)
        else: breaks.append(f"{name} ({', '.join(number(v) for v in values)})")
    text = "From none over sky to sky-normal"
    text += f" {', '.join(holds)} fall" + ("s" if len(holds) == 1 else "") if holds else ""
    text += (", but" if holds else "") + f" **the order does not hold** for {', '.join(breaks)}" if breaks else ""
    return "\n" + text + ".\n"


def own_colors(metrics):
    color, images = metrics["color"] or {}, (metrics["images"] or {}).get("object", {})
    by = {light["light"]: light for light in metrics["light"]}
    light = by.get("run", by.get("none", {}))
    albedo = light.get("albedo") or {}
    return [str(light.get("places", "-")), number(light.get("mean_spread")), number(albedo.get("mean_log_error")), number(albedo.get("median_log_error")),
            number(color.get("mean_delta_e_2000"), 1), number(color.get("median_delta_e_2000"), 1), percent(images.get("rms"), 1)]


def within(metrics):
    found = (metrics["depth"] or {}).get("methods", {}).get("volume")
    return [percent(found["share_within_units"][d], 1) for d in ("0.5", "1", "2")] if found else ["-"] * 3


def f_scores(metrics, name):
    """At 0.5 and 1 m of a set; `name` None: the sure points, whose name says how sure in voxels."""
    for surface in metrics["surfaces"]:
        if surface["name"] == name or name is None and surface["name"].startswith("depth points of sigma"):
            return [number(next(s["f_score"] for s in surface["within"] if abs(s["distance"] - d) < 1e-9)) for d in (0.5, 1)]
    return ["-", "-"]


def debris_cells(metrics):
    cells = []
    for at in metrics.get("sky_debris", []):
        cells += [f"{at['voxels']}", *(percent(at[kind][share], 2) for kind in ("in_the_open", "above_all", "before_sky") for share in ("share", "share_of_opacity"))]
    return cells or ["-"] * 14


def document(measured, costs, remarks=""):
    """`measured`: metrics by choice; `costs`: seconds, bytes at most and voxels by choice."""
    text = HEAD
    if LIT in measured and measured[LIT]["light"]:
        light = measured[LIT]["light"]
        places = light[0]
        text += COLORS.format(places=places["places"], shared=places["shared_places"], pixels=(places["albedo"] or {}).get("pixels", 0)) + "\n"
        text += table(["photographs over", "spread, mean", "median", "off albedo, mean", "median"], light_rows(measured[LIT])) + orders(measured[LIT])
        text += OWN + "\n" + table(["light", "matching", "voxel", "places", "spread, mean", "off albedo, mean", "median", "voxels: CIEDE2000, mean", "median", "renders: RMS %"],
                                   [choice_cells(c) + own_colors(m) for c, m in measured.items()])
    text += DEPTH.format(sure=SURE_M) + "\n"
    text += table(["light", "matching", "voxel", "within 0.5 m", "1 m", "2 m", *(cell for name in SETS for cell in (f"F {name}: 0.5 m", "1 m"))],
                  [choice_cells(c) + within(m) + [cell for name in SETS.values() for cell in f_scores(m, name)] for c, m in measured.items()])
    text += DEBRIS + "\n"
    text += table(["light", "matching", "voxel", *(cell for a in ("0.04", "0.3") for cell in (f"voxels ≥ {a}", "in the open %", "of opacity %", "above all %", "of opacity %", "before the sky %", "of opacity %"))],
                  [choice_cells(c) + debris_cells(m) for c, m in measured.items()])
    text += COST.format(processors=os.cpu_count()) + "\n"
    text += table(["light", "matching", "voxel", "million voxels", "seconds", "GiB"],
                  [[*choice_cells(c), f"{voxels / 1e6:.1f}", f"{seconds:.0f}", f"{peak / 2**30:.1f}"] for c, (seconds, peak, voxels) in costs.items()])
    return text + (f"\n{remarks.strip()}\n" if remarks.strip() else "")


def measure(choice, data, options):
    """The folder of a run and that of its metrics, made where they are not there."""
    roxel, skies = str(options.roxel), options.work / "sky"
    make([roxel, "sky", str(data), "-o", str(skies), "--no-pictures", "--quiet"], skies, "summary.json")
    run, metrics = options.work / choice.name, options.work / (choice.name + "-metrics")
    make([roxel, "reconstruct", str(data), "-o", str(run), *BOX, "--voxel-size", f"{choice.voxel_m:g}", "--masks", "none", "--sky", str(skies),
          "--illumination", choice.light, "--matching", choice.matching, "--no-mesh", "--no-refine", "--no-bp", "--no-report", "--quiet"],
         run, "summary.json", [skies])
    make([roxel, "eval", str(run), "--truth", str(data), "-o", str(metrics), "--distances", "0.5,1", "--depth-within", "0.5,1,2",
          "--sure-within", f"{SURE_M / choice.voxel_m:g}", "--quiet"], metrics, "metrics.json", [run])
    return run, metrics


def cost(run):
    summary = json.loads((run / "summary.json").read_text())
    return summary["seconds"], summary["peak_memory_bytes"], summary["levels"][-1]["voxels_in_box"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    root = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--roxel", type=pathlib.Path, default=root / "build/release/apps/roxel/roxel")
    parser.add_argument("--data")
    parser.add_argument("--work", type=pathlib.Path, default=root / "build/light-table")
    parser.add_argument("--docs", type=pathlib.Path, default=root / "docs/results")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    data = data_root(options.data)
    if not data or not (data / "courtyard/illumination.json").is_file():
        print("SKIPPED: the data set courtyard is not here (--data, ROXEL_TEST_DATA)", file=sys.stderr)
        return
    options.work.mkdir(parents=True, exist_ok=True)
    made = {choice: measure(choice, data / "courtyard", options) for choice in CHOICES
            if not options.only or fnmatch.fnmatch(choice.name, options.only)}
    if options.only: return
    remarks = pathlib.Path(__file__).with_name("light_remarks.md")
    page = document({c: json.loads((metrics / "metrics.json").read_text()) for c, (_, metrics) in made.items()},
                    {c: cost(run) for c, (run, _) in made.items()}, remarks.read_text() if remarks.exists() else "")
    (options.docs / "light.md").write_text(page)
    print(f"-> {options.docs / 'light.md'}")


if __name__ == "__main__":
    main()
