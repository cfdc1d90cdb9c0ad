#!/usr/bin/env python3
"""Fitted skies against true ones: docs/results/sky.md.

    sky_table.py [--roxel PROGRAM] [--data DIR] [--work DIR] [--docs DIR]

Fits the skies of the data set `courtyard` (ray-traced; true skies, suns and masks beside it) with each choice of model, measures
them with `roxel eval`, and fits the panoramas of `sky`. Skips, and says so, where the data are not there. No picture of the data is
written.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys

CHOICES = {"h free (default)": [], "published model (h = 1)": ["--no-exponent"],
           "h free, spherical functions of order 2": ["--residual", "2"]}
REGIONS = {"above_60": "above 60°", "30_to_60": "30 to 60°", "10_to_30": "10 to 30°", "below_10": "below 10°",
           "within_20_of_sun": "within 20° of the sun"}
HEAD = """# Skies

Made by `benchmarks/quality/sky_table.py`. What each figure is: [evaluation.md](../evaluation.md#sky); how skies are found:
[sky.md](../sky.md).

## Courtyard

A ray-traced town square: eight nodes of about 20 images, each at its own date and time, six clear with more or less haze (Nishita's sky), two overcast
with unrest. Errors in percent. *oracle*: the same model fitted to the true dome itself.
"""


def data_root(given):
    if given: return pathlib.Path(given)
    if os.environ.get("ROXEL_TEST_DATA"): return pathlib.Path(os.environ["ROXEL_TEST_DATA"])
    for folder in pathlib.Path(__file__).resolve().parents:
        if (folder / "shared/data").is_dir(): return folder / "shared/data"
    return None


def roxel(program, *arguments):
    done = subprocess.run([program, *map(str, arguments), "--json", "--quiet"], capture_output=True, text=True)
    if done.returncode: sys.exit(done.stderr)
    return json.loads(done.stdout)


def percent(value, digits=2):
    return "-" if value is None else f"{100 * value:.{digits}f}"


def row(cells):
    return "| " + " | ".join(cells) + " |"


def table(head, rows):
    return "\n".join([row(head), row(["---"] * len(head)), *map(row, rows)]) + "\n"


def courtyard(program, data, work):
    text = HEAD
    for number, (choice, options) in enumerate(CHOICES.items()):
        run = work / f"courtyard-{number}"
        seconds = roxel(program, "sky", data, "-o", run, *options)["seconds"]
        rows = []
        skies = roxel(program, "eval", run, "--truth", data)["skies"]
        for m in skies:
            found = "-" if m["found_sun_error_deg"] is None else f"{m['found_sun_error_deg']:.2f}"
            rows.append([m["node"], percent(m["fit_error"]), percent(m["dome_error"]), percent(m["oracle_error"]),
                         f"{m['dome_error'] / m['oracle_error']:.2f}", found, percent(m["horizontal_error"]),
                         percent(m["horizontal_sky_error"]), m["sun_light"], f"{m['mask_iou']:.4f}"])
        worst = max(m["dome_error"] / m["oracle_error"] for m in skies)
        text += f"\n### {choice}\n\n" + table(
            ["node", "fit", "dome", "oracle", "dome / oracle", "sun found in the images, degrees off", "light with sun", "sky alone",
             "sun's light", "mask IoU"], rows)
        text += (f"\nWorst: fit {percent(max(m['fit_error'] for m in skies))} %, dome {worst:.2f} times the oracle, IoU "
                 f"{min(m['mask_iou'] for m in skies):.4f}. {seconds:.0f} s with pictures.\n")
    return text


def panoramas(program, folder, work):
    rows = []
    for path in sorted(folder.glob("*.hdr")):
        node = roxel(program, "sky", path, "-o", work / path.stem)["skies"][0]
        sun = "-" if node["sun"] is None else f"{node['sun'][0]:.1f}, {node['sun'][1]:.1f}"
        rows.append([path.stem, node["model"], sun, percent(node["mean_error"]), percent(node["sky_share"], 0),
                     *(percent(node["error_by_region"][r], 1) for r in REGIONS)])
    return ("\n## Panoramas\n\nOutdoor panoramas without time or place, so the sun is found in them. Errors in percent, over the facets of the fit and, by "
            "region, over those that the masks took for sky, too.\n\n" +
            table(["panorama", "model", "sun", "fit", "of the dome", *REGIONS.values()], rows))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    root = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--roxel", default=root / "build/release/apps/roxel/roxel")
    parser.add_argument("--data")
    parser.add_argument("--work", default=root / "build/sky-table")
    parser.add_argument("--docs", default=root / "docs/results")
    given = parser.parse_args()
    data = data_root(given.data)
    if not data or not (data / "courtyard/illumination.json").is_file():
        print("SKIPPED: the data set courtyard is not here (--data, ROXEL_TEST_DATA)", file=sys.stderr)
        return
    work = pathlib.Path(given.work)
    text = courtyard(given.roxel, data / "courtyard", work)
    if (data / "sky").is_dir(): text += panoramas(given.roxel, data / "sky", work)
    (pathlib.Path(given.docs) / "sky.md").write_text(text)


if __name__ == "__main__":
    main()
