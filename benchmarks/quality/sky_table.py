#!/usr/bin/env python3
"""Fitted skies against true ones: docs/results/sky.md.

    sky_table.py [--roxel PROGRAM] [--data DIR] [--work DIR] [--docs DIR]

Fits the skies of the data set `courtyard` (ray-traced; true skies, suns and masks beside it) with each choice of model, measures
them with `roxel eval`; again as photographs of 8 bits from dark to far too bright, and without the images that see the sun; and fits
the panoramas of `sky`, with and without their suns. Skips, and says so, where the data are not there. No picture of the data is
written beside the results.
"""

import argparse
import json
import math
import os
import pathlib
import subprocess
import sys

import radiance_files

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


GAINS = [1, 4, 6, 8, 10, 14, 20]


def luminance(rgb):
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]


def without_truth(frame):
    return {key: value for key, value in frame.items() if key not in ("depth_path", "albedo_path", "mask_path")}


def write_photographs(data, folder):
    """The data set's images as sRGB PNG at each of the gains, white at 1 / gain."""
    scene = json.loads((data / "transforms.json").read_text())
    photograph = radiance_files.Photograph()
    for gain in GAINS: (folder / str(gain)).mkdir(parents=True, exist_ok=True)
    for frame in scene["frames"]:
        width, height, rows = radiance_files.read_exr(data / frame["file_path"])
        for gain in GAINS:
            photograph.write(folder / str(gain) / (pathlib.Path(frame["file_path"]).stem + ".png"), width, height, rows, gain)
    for gain in GAINS:
        frames = [dict(without_truth(f), file_path=pathlib.Path(f["file_path"]).stem + ".png") for f in scene["frames"]]
        (folder / str(gain) / "transforms.json").write_text(json.dumps(dict(scene, frames=frames)))


def photographs(program, data, work):
    write_photographs(data, work / "photographs")
    cells, worst = {}, 1
    for gain in GAINS:
        run = work / f"photographs-{gain}"
        fitted = {sky["node"]: sky for sky in roxel(program, "sky", work / "photographs" / str(gain), "-o", run, "--no-pictures")["skies"]}
        for m in roxel(program, "eval", run, "--truth", data)["skies"]:
            sky = fitted[m["node"]]
            clipped = "clipped" if sky["fallback"] == "clipped" else f"{100 * sky['clipped_share']:.0f} %"
            cells.setdefault(m["node"], []).append(f"{m['mask_iou']:.3f}, {clipped}")
            worst = min(worst, m["mask_iou"])
    return ("\n## Photographs\n\nThe same images as sRGB of 8 bits, white at 1 / gain: mask IoU, and how much of the dome is sky that clips, or "
            "`clipped` where\nthat is more than was fitted, so that no light is known. A sunny square is well exposed at 1 to 2, its shade at 8, n03 at "
            "6 to 10, n06 at\n10 to 20.\n\n" + table(["node", *(f"gain {g}" for g in GAINS)], [[node, *row] for node, row in cells.items()]) +
            f"\nWorst IoU: {worst:.3f}.\n")


def sees(scene, frame, direction):
    """Whether a direction is in a frame's picture, or up to 20 pixels beyond."""
    pose, key = frame["transform_matrix"], lambda name: frame.get(name, scene.get(name))
    x, y, z = (sum(pose[row][column] * direction[row] for row in range(3)) for column in range(3))
    if z >= 0: return False
    u, v = key("fl_x") * x / -z + key("cx"), key("fl_y") * y / z + key("cy")
    return -20 < u < key("w") + 20 and -20 < v < key("h") + 20


def sunlight_row(name, sun_elevation, true, sky, what):
    off = [100 * (a / b - 1) for a, b in zip(sky["sun_irradiance"], true)]
    return [name, what, f"{sun_elevation:.0f}", sky["sun_light"], f"{luminance(true):.2f}", f"{luminance(sky['sun_irradiance']):.2f}",
            f"{100 * (luminance(sky['sun_irradiance']) / luminance(true) - 1):+.0f}", " ".join(f"{o:+.0f}" for o in off)]


def hidden_suns(program, data, work):
    """Estimates of the sun's light from the images that do not see it."""
    scene = json.loads((data / "transforms.json").read_text())
    nodes = {n["node"]: n for n in json.loads((data / "illumination.json").read_text())["nodes"]}
    hidden = work / "hidden-suns"
    hidden.mkdir(parents=True, exist_ok=True)
    frames = [dict(without_truth(f), file_path=str((data / f["file_path"]).resolve())) for f in scene["frames"]
              if not sees(scene, f, nodes[f["node"]]["sun_direction"])]
    (hidden / "transforms.json").write_text(json.dumps(dict(scene, frames=frames)))
    rows = []
    for sky in roxel(program, "sky", hidden, "-o", work / "hidden-suns-run", "--no-pictures")["skies"]:
        node = nodes[int(sky["node"][1:])]
        if node["sun_disc"]:
            rows.append((sky, sunlight_row(sky["node"], node["sun_elevation_deg"], node["sun_irradiance_normal_rgb"], sky, "not in any image")))
    return rows


def clipped_suns(program, folder, work):
    """The panoramas with their suns cut off at about twenty times the median of what is above the horizon."""
    rows = []
    for path in sorted(folder.glob("*.hdr")):
        measured = roxel(program, "sky", path, "-o", work / path.stem, "--no-pictures")["skies"][0]
        if measured["sun_light"] != "measured": continue
        width, height, lines = radiance_files.read_hdr(path)
        values = radiance_files.values_of_hdr(lines)
        bright = sorted(max(v) for line in values[:height // 2] for v in zip(*line))
        limit = 2 ** round(math.log2(20 * bright[len(bright) // 2]))
        clipped = work / "clipped-suns" / path.name
        clipped.parent.mkdir(parents=True, exist_ok=True)
        radiance_files.write_hdr(clipped, width, [[[min(v, limit) for v in channel] for channel in line] for line in values])
        sky = roxel(program, "sky", clipped, "-o", work / (path.stem + "-clipped"), "--no-pictures")["skies"][0]
        rows.append((sky, sunlight_row(path.stem, measured["sun"][1], measured["sun_irradiance"], sky, "clipped")))
    return rows


def sunlight(program, data, work):
    both = hidden_suns(program, data / "courtyard", work)
    if (data / "sky").is_dir(): both += clipped_suns(program, data / "sky", work)
    logs = [math.log(float(row[5]) / float(row[4])) for sky, row in both if sky["sun_light"] == "estimated"]
    spread = math.sqrt(sum(v * v for v in logs) / len(logs))
    return ("\n## Sunlight that is estimated\n\nThe sun's light where no image shows it unclipped, on a surface that faces it, against the truth (courtyard) or what is "
            "measured with the sun\n(panoramas). Luminance, its error in percent, and that of red, green, blue.\n\n" +
            table(["sky", "sun", "elevation", "light", "true", "found", "error", "red green blue"], [row for _, row in both]) +
            f"\nRoot mean square of log(found / true): {spread:.2f}, a factor of {math.exp(spread):.2f}.\n")


def panoramas(program, folder, work):
    rows = []
    for path in sorted(folder.glob("*.hdr")):
        node = roxel(program, "sky", path, "-o", work / path.stem)["skies"][0]
        sun = "-" if node["sun"] is None else f"{node['sun'][0]:.1f}, {node['sun'][1]:.1f}"
        rows.append([path.stem, node["model"], sun, node["sun_light"], percent(node["mean_error"]), percent(node["sky_share"], 0),
                     *(percent(node["error_by_region"][r], 1) for r in REGIONS)])
    return ("\n## Panoramas\n\nOutdoor panoramas without time or place, so the sun is found in them. Errors in percent, over the facets of the fit and, by "
            "region, over those that the masks took for sky, too.\n\n" +
            table(["panorama", "model", "sun", "sun's light", "fit", "of the dome", *REGIONS.values()], rows))


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
    text += photographs(given.roxel, data / "courtyard", work)
    text += sunlight(given.roxel, data, work)
    if (data / "sky").is_dir(): text += panoramas(given.roxel, data / "sky", work)
    (pathlib.Path(given.docs) / "sky.md").write_text(text)


if __name__ == "__main__":
    main()
