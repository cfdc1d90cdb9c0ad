#!/usr/bin/env python3
"""Tests of `roxel sky`, through the program itself, on small panoramas and data sets made here.

    sky_test.py ROXEL [unittest arguments, e.g. Sky]
"""

import json
import math
import os
import pathlib
import re
import struct
import sys
import unittest
import zlib

import program
from program import digest, files_below, start_until

WIDTH, HEIGHT = 128, 64


def rgbe(rgb):
    """A pixel of a Radiance file."""
    top = max(rgb)
    if top < 1e-32: return bytes(4)
    mantissa, exponent = math.frexp(top)
    scale = mantissa * 256 / top
    return bytes([min(255, int(c * scale)) for c in rgb] + [exponent + 128])


def direction(x, y):
    azimuth, elevation = ((x + 0.5) / WIDTH - 0.5) * 2 * math.pi, (0.5 - (y + 0.5) / HEIGHT) * math.pi
    return (math.cos(elevation) * math.sin(azimuth), math.cos(elevation) * math.cos(azimuth), math.sin(elevation))


def clear_sky(x, y, sun=(0.5, -0.6, 0.6245)):
    """A blue sky over a wall with texture; the sun is one pixel."""
    d = direction(x, y)
    if d[2] < 0.15: return [0.3 * (1 + 0.5 * ((x * 7 + y * 13) % 5 - 2) / 2) * c for c in (1, 0.9, 0.7)]
    cosine = sum(a * b for a, b in zip(d, sun))
    if cosine > math.cos(math.radians(1.6)): return [900, 800, 700]
    phi = math.acos(min(1, cosine))
    bright = (1 - 0.98 * math.exp(-0.3 / d[2])) * (1 + 9 * math.exp(-3 * phi) + 0.5 * cosine * cosine)
    return [bright * c for c in (0.08, 0.11, 0.17)]


def panorama(path, sky=clear_sky):
    with open(path, "wb") as out:
        out.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (HEIGHT, WIDTH))
        out.write(b"".join(rgbe(sky(x, y)) for y in range(HEIGHT) for x in range(WIDTH)))
    return path


# What every option changes, beside what is common: options, and what of the result.
CHANGES = {
    "contrast-limit": ["--contrast-limit", "0.005"],
    "exponent": ["--no-exponent"],
    "facets": ["--facets", "6"],
    "lowest-elevation": ["--lowest-elevation", "40"],
    "red-blue-limit": ["--red-blue-limit", "0.3"],
    "residual": ["--residual", "2"],
    "response": ["--response", "gamma:1.2"],
    "sky-rounds": ["--sky-rounds", "1"],
    "sun": ["--sun", "10,20"],
}
ELSEWHERE = {"format", "images", "node-tolerance", "nodes", "up", "sky-masks", "pictures", "threads", "quiet", "verbose", "json", "config", "help"}


class SkyCase(program.Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.panorama = panorama(cls.folder / "square.hdr")

    def sky(self, name, *arguments, data=None):
        out = self.folder / name
        done = self.succeed("sky", data or self.panorama, "-o", out, *arguments, "--json", "--quiet")
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual(json.loads(done.stdout), summary)
        return out, summary

    def frames(self, name, change=lambda frames: None, **top):
        """The demo's data set again with other keys."""
        data = json.loads((self.data / "transforms.json").read_text())
        data.update(top)
        for frame in data["frames"]: frame["file_path"] = str(self.data / frame["file_path"])
        change(data["frames"])
        path = self.folder / (name + ".json")
        path.write_text(json.dumps(data))
        return path


class Panoramas(SkyCase):
    def test_a_clear_sky_is_found_with_its_sun(self):
        out, summary = self.sky("clear")
        node = summary["skies"][0]
        self.assertEqual((node["node"], node["model"], node["sun_source"], node["sun_light"]),
                         ("square", "perez", "images", "measured"))
        self.assertLess(node["mean_error"], 0.03)
        self.assertAlmostEqual(node["sun"][0], math.degrees(math.atan2(0.5, -0.6)), delta=2)
        self.assertAlmostEqual(node["sun"][1], math.degrees(math.asin(0.6245)), delta=2)
        self.assertEqual(node["masks"]["red_blue"], "used")
        below = files_below(out)
        for name in ("summary.json", "sky/square.json", "sky/square.exr", "sky/square_nosun.exr", "sky/square.png",
                     "sky/square_variance.png", "sky/square_error.png", "sky/mask/square.png", "report.html"):
            self.assertIn(name, below)

    def test_threads_change_nothing(self):
        one, _ = self.sky("one", "--threads", "1", "--nodes", "0:2", data=self.data)
        two, _ = self.sky("two", "--threads", "2", "--nodes", "0:2", data=self.data)
        below = lambda out: {f: digest(out / f) for f in files_below(out) if f.startswith("sky/")}
        self.assertGreater(len(below(one)), 4)
        self.assertEqual(below(one), below(two))

    def test_pictures_can_be_left_out(self):
        out, _ = self.sky("bare", "--no-pictures")
        self.assertEqual([f for f in files_below(out) if f.endswith(".png")], ["sky/mask/square.png"])

    def test_a_second_run_replaces_the_first_and_nothing_else(self):
        out, _ = self.sky("again", "--facets", "4")
        (out / "mine.txt").write_text("keep")
        self.sky("again", "--no-pictures", "--facets", "4")
        self.assertNotIn("sky/square.png", files_below(out))
        self.assertIn("mine.txt", files_below(out))


class SkyOptions(SkyCase):
    def test_every_option_changes_something(self):
        numbers = lambda summary: [summary["skies"][0][k] for k in ("relative_sigma", "facets_used", "sun", "horizontal_irradiance", "rounds")]
        coarse = ["--no-pictures", "--facets", "4"]
        _, plain = self.sky("plain", *coarse)
        self.assertEqual(set(plain["options"]), (set(CHANGES) | ELSEWHERE) - {"config", "help"})
        for option, change in CHANGES.items():
            with self.subTest(option):
                _, changed = self.sky("changed", *coarse, *change)
                self.assertNotEqual(numbers(plain), numbers(changed))

    def test_every_option_is_in_help_and_in_the_docs(self):
        text = self.succeed("sky", "--help").stdout
        docs = (program.SOURCE / "docs/commands.md").read_text() + (program.SOURCE / "docs/options.md").read_text()
        for option in set(CHANGES) | ELSEWHERE:
            self.assertRegex(text, rf"--(no-)?{option}\b")
            self.assertRegex(docs, rf"--(no-)?{option}\b")

    def test_masks_by_hand_decide_and_stand(self):
        first, _ = self.sky("first", "--no-pictures", "--facets", "4")
        masks = self.folder / "by-hand"
        masks.mkdir()
        (masks / "square.png").write_bytes((first / "sky/mask/square.png").read_bytes())
        out, summary = self.sky("by-hand-run", "--no-pictures", "--facets", "4", "--sky-masks", masks)
        self.assertEqual(summary["skies"][0]["masks"]["reason"], "masks by hand say what is sky")
        self.assertEqual(digest(out / "sky/mask/square.png"), digest(masks / "square.png"))

    def test_images_nodes_and_format_choose_views(self):
        _, all_views = self.sky("all", "--no-pictures", "--facets", "4", data=self.data)
        _, some = self.sky("some", "--no-pictures", "--facets", "4", "--images", "00[01]*", data=self.data)
        _, one = self.sky("one-node", "--no-pictures", "--facets", "4", "--nodes", "1:2", data=self.data)
        _, colmap = self.sky("colmap", "--no-pictures", "--facets", "4", "--format", "colmap", data=self.data)
        self.assertEqual([len(s["skies"]) for s in (all_views, some, one)], [4, 2, 1])
        self.assertEqual(colmap["dataset"]["format"], "colmap")

    def test_up_turns_the_sky(self):
        turns = [self.sky("up", "--no-pictures", "--facets", "4", "--up", up, data=self.data)[0] for up in ("0,0,1", "0,1,0")]
        json_of = lambda: json.loads((self.folder / "up/sky/n00.json").read_text())["sky_from_world"]
        self.assertEqual(len(turns), 2)
        self.assertAlmostEqual(json_of()[2][1], 1)


class SkyInput(SkyCase):
    def test_bad_input_ends_with_code_2(self):
        square = self.folder / "flat.hdr"
        square.write_bytes(self.panorama.read_bytes().replace(b"-Y 64 +X 128", b"-Y 128 +X 64"))
        empty = self.folder / "empty"
        empty.mkdir()
        run, _ = self.reconstruct("run")

        def node_twice(frames):
            for frame, hour in zip(frames, (9, 15, 9, 9)): frame.update(node=1, time_utc=f"2003-08-21T{hour:02}:00:00Z")

        def no_zone(frames): frames[2]["time_utc"] = "2003-08-21T09:00:00"

        out = self.folder / "never"
        for message, arguments in [
            ("flat.hdr: found 64 x 128 pixels, expected a panorama", [square]),
            ("nothing-here", [self.folder / "nothing-here"]),
            ("a reconstruction, expected another folder", [self.panorama, "-o", run]),
            ("--sky-masks", [self.panorama, "--sky-masks", self.folder / "nothing"]),
            ("no mask of any image", [self.panorama, "--sky-masks", empty]),
            ("from -90 to 90", [self.panorama, "--sun", "10,95"]),
            ("--sun: found", [self.panorama, "--sun", "10"]),
            ("up must not be 0,0,0", [self.panorama, "--up", "0,0,0"]),
            ("--facets: found", [self.panorama, "--facets", "9"]),
            ("node 1: found a time 360 minutes from that of", [self.frames("twice", node_twice)]),
            ("frames[2].time_utc", [self.frames("no-zone", no_zone)]),
            ("latitude: found 91", [self.frames("latitude", latitude=91, longitude=0)]),
        ]:
            with self.subTest(message):
                given = [str(a) for a in arguments]
                self.expect_error(2, message, "sky", *given, *([] if "-o" in given else ["-o", out]))
                self.assertFalse(out.exists())

    def test_what_cannot_be_had_is_a_named_fallback(self):
        grey = lambda x, y: [0.05 + 0.03 * ((x * 7 + y * 13) % 5)] * 3
        white = lambda x, y: [1.0] * 3 if direction(x, y)[2] > 0.1 else grey(x, y)  # the walls do not clip
        cases = {"no sky in view": panorama(self.folder / "room.hdr", grey), "clipped": panorama(self.folder / "white.hdr", white)}
        for name, path in cases.items():
            with self.subTest(name):
                _, summary = self.sky("fallback", "--facets", "4", data=path)
                node = summary["skies"][0]
                self.assertEqual((node["model"], node["fallback"]), ("none", name))
                self.assertEqual([w for w in summary["warnings"] if "sky that clips: its light" in w or "no light is known" in w] != [],
                                 name == "clipped")
                self.assertAlmostEqual(node["clipped_share"], 0.9 if name == "clipped" else 0, delta=0.05)
                self.assertAlmostEqual(node["mask_share"], 0.46 if name == "clipped" else 0, delta=0.03)

        def night(frames):
            for frame in frames: frame.update(node=1, time_utc="2003-08-21T04:50:00Z", latitude=42.36, longitude=-71.09)

        _, summary = self.sky("night", data=self.frames("night", night))
        self.assertEqual([(s["model"], s["fallback"], s["images"]) for s in summary["skies"]], [("none", "night", 4)])
        self.assertFalse([f for f in files_below(self.folder / "night") if f.startswith("sky/mask")])  # unknown, not "no sky"

    def test_a_node_of_one_image_says_what_it_is_too_little_for(self):
        street = self.folder / "street"
        self.succeed("synth", "street", "-o", street, "--images", "28", "--size", "36x28", "--samples", "1", "--quiet")
        names = [pathlib.Path(frame["file_path"]).stem for frame in json.loads((street / "transforms.json").read_text())["frames"]]
        fallbacks = set()
        for name in names[:8]:
            _, summary = self.sky("one-image", "--images", f"*{name}*", "--facets", "4", "--no-pictures", data=street)
            (node,) = summary["skies"]
            self.assertEqual(node["images"], 1)
            self.assertEqual(node["model"] == "perez", node["fallback"] == "")
            self.assertLess(node["sky_share"], 0.4)
            fallbacks.add((node["model"], node["fallback"]))
        self.assertIn(("published", "little sky in view"), fallbacks)

    def test_what_the_reader_warns_of_is_said(self):
        def two_places(frames):  # of one node, nearer to each other than to the others
            for frame in frames[:2]: frame.update(node=1)
            for i in range(3):
                here, there = frames[0]["transform_matrix"][i], frames[1]["transform_matrix"][i]
                there[3] = 0.7 * here[3] + 0.3 * there[3]

        data = self.frames("two-places", two_places)
        done = self.succeed("sky", data, "-o", self.folder / "warned", "--no-pictures", "--facets", "4")
        warnings = json.loads((self.folder / "warned/summary.json").read_text())["warnings"]
        self.assertTrue(any("frames[1]: node 1: a camera " in w and "frames[0]" in w for w in warnings), warnings)
        for warning in warnings: self.assertIn(warning, done.stderr)


def write_grey_png(path, width, rows):
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, len(rows), 8, 0, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(b"".join(b"\0" + bytes(row) for row in rows))) + chunk(b"IEND", b""))


def read_grey_png(path):
    """Width and rows of an 8-bit grey PNG."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IHDR": width, = struct.unpack_from(">I", data, at + 8)
        if kind == b"IDAT": packed += data[at + 8:at + 8 + size]
        at += size + 12
    raw, rows, above = zlib.decompress(packed), [], bytes(width)
    for start in range(0, len(raw), width + 1):
        line = bytearray(raw[start + 1:start + 1 + width])
        for x in range(width):
            left, up, corner = (line[x - 1], above[x], above[x - 1]) if x else (0, above[x], 0)
            nearest = min((left, up, corner), key=lambda value: abs(left + up - corner - value))
            line[x] = (line[x] + (0, left, up, (left + up) // 2, nearest)[raw[start]]) & 255
        rows.append(bytes(line))
        above = rows[-1]
    return width, rows


class LargePhotographs(SkyCase):
    """Of pixels so fine that they are looked at smaller, by three; neither side is a multiple of that."""

    WIDTH, HEIGHT, COUNT = 301, 203, 8

    def is_sky(self, x, y): return y < 150 + (x % 60) // 10

    def telephoto(self):
        """Photographs side by side, each of 5 x 3 degrees, 20 degrees up."""
        folder, lift, low = self.folder / "telephoto", math.sin(math.radians(20)), math.cos(math.radians(20))
        folder.mkdir()
        pixels = b"".join(rgbe([0.1, 0.13, 0.2] if self.is_sky(x, y) else [0.03 * (1 + (x * 7 + y * 13) % 5)] * 3)
                          for y in range(self.HEIGHT) for x in range(self.WIDTH))
        frames = []
        for n in range(self.COUNT):
            name, east, north = f"v{n}.hdr", math.sin(math.radians(5 * n)), math.cos(math.radians(5 * n))
            (folder / name).write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (self.HEIGHT, self.WIDTH) + pixels)
            right, up, back = (north, -east, 0), (-east * lift, -north * lift, low), (-east * low, -north * low, -lift)
            frames.append({"file_path": name, "transform_matrix": [[*axes, 0] for axes in zip(right, up, back)] + [[0, 0, 0, 1]]})
        (folder / "transforms.json").write_text(json.dumps({"fl_x": 3450, "fl_y": 3450, "w": self.WIDTH, "h": self.HEIGHT,
                                                            "cx": self.WIDTH / 2, "cy": self.HEIGHT / 2, "frames": frames}))
        return folder

    def test_masks_are_as_large_as_photographs_and_those_by_hand_as_they_are(self):
        data, masks = self.telephoto(), self.folder / "by-hand"
        out, _ = self.sky("found", "--up", "0,0,1", "--no-pictures", data=data)
        width, found = read_grey_png(out / "sky/mask/v3.png")
        self.assertEqual((width, len(found)), (self.WIDTH, self.HEIGHT))
        wrong = sum((found[y][x] >= 128) != self.is_sky(x, y) for y in range(self.HEIGHT) for x in range(self.WIDTH))
        self.assertLess(wrong, 0.02 * self.WIDTH * self.HEIGHT)
        masks.mkdir()
        by_hand = [bytes(255 if self.is_sky(x, y) else 0 for x in range(self.WIDTH)) for y in range(self.HEIGHT)]
        write_grey_png(masks / "v3.png", self.WIDTH, by_hand)
        out, _ = self.sky("told", "--up", "0,0,1", "--sky-masks", masks, "--no-pictures", data=data)
        self.assertEqual(read_grey_png(out / "sky/mask/v3.png"), (self.WIDTH, by_hand))


class SkySun(SkyCase):
    def test_a_sun_is_measured_at_the_seam_and_near_the_zenith(self):
        for azimuth, elevation in ((180, 40), (179, 40), (150, 85)):
            with self.subTest(f"{azimuth}, {elevation}"):
                a, e = math.radians(azimuth), math.radians(elevation)
                sun = (math.cos(e) * math.sin(a), math.cos(e) * math.cos(a), math.sin(e))
                # A disc of one value over several pixels would be taken for one that clips.
                grain = lambda x, y: 1 + 0.02 * ((3 * x + y) % 8)
                path = panorama(self.folder / "seam.hdr", lambda x, y: [v * grain(x, y) if v > 100 else v for v in clear_sky(x, y, sun)])
                _, summary = self.sky("seam", "--no-pictures", "--facets", "4", "--sun", f"{azimuth},{elevation}", data=path)
                self.assertEqual(summary["skies"][0]["sun_light"], "measured")
                self.assertEqual(summary["skies"][0]["sun_relative_sigma"], 0.02)

    def test_a_sun_that_clips_is_estimated_and_says_how_well(self):
        path = panorama(self.folder / "photo.hdr", lambda x, y: [min(1.0, 2 * v) for v in clear_sky(x, y)])
        out, summary = self.sky("photo", "--no-pictures", "--facets", "4", "--sun", "140.19,38.64", data=path)
        node = summary["skies"][0]
        self.assertEqual((node["sun_light"], node["sun_relative_sigma"]), ("estimated", 0.47))
        self.assertTrue(any("estimated, within a factor of 1.6" in w for w in summary["warnings"]), summary["warnings"])
        self.assertEqual(json.loads((out / "sky/photo.json").read_text())["sun"]["irradiance_relative_sigma"], 0.47)

    def test_a_sun_by_hand_says_whether_it_is_night(self):
        def night(frames):
            for frame in frames: frame.update(node=1, time_utc="2003-08-21T04:50:00Z", latitude=42.36, longitude=-71.09)

        _, day = self.sky("day", "--no-pictures", "--sun", "181,60", data=self.frames("day", night))
        _, below = self.sky("below", "--no-pictures", "--sun", "181,-20")
        self.assertNotEqual(day["skies"][0]["fallback"], "night")
        self.assertEqual((below["skies"][0]["model"], below["skies"][0]["fallback"]), ("none", "night"))


class SkyMeasures(SkyCase):
    def test_eval_measures_the_skies_of_a_street(self):
        data, out = self.folder / "street", self.folder / "street-sky"
        self.succeed("synth", "street", "-o", data, "--images", "20", "--size", "48x36", "--samples", "1", "--quiet")
        self.sky("street-sky", "--facets", "4", "--no-pictures", data=data)
        measured = json.loads(self.succeed("eval", out, "--truth", data, "--json").stdout)["skies"]
        self.assertEqual([m["node"] for m in measured], ["n00"])
        self.assertLess(measured[0]["sun_error_deg"], 0.1)
        self.assertEqual(measured[0]["masks"], 20)
        self.assertGreater(measured[0]["mask_iou"], 0.5)
        self.assertLess(measured[0]["oracle_error"], 0.3)
        self.succeed("eval", out, "--truth", data, "-o", self.folder / "figures")
        self.assertEqual(files_below(self.folder / "figures"), ["metrics.json", "skies.csv"])
        self.assertEqual(len((self.folder / "figures/skies.csv").read_text().splitlines()), 2)
        self.expect_error(2, "illumination.json", "eval", out, "--truth", self.data)


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    program.ROXEL = os.path.abspath(sys.argv.pop(1))
    unittest.main(argv=[sys.argv[0], *sys.argv[1:]])



SMALL = ["--resolution", "24", "--levels", "1", "--passes", "2", "--masks", "none", "--no-depth", "--no-render", "--no-report", "--quiet"]
NO_SURROUND = ["--surround", "off"]  # where nobody looks at what lies beyond the box, which takes longer than the box


def unpack_runs(data):
    """Of the EXR files' run-length compression."""
    out, at = bytearray(), 0
    while at < len(data):
        count = data[at]
        if count > 127: out += data[at + 1:at + 257 - count]
        else: out += data[at + 1:at + 2] * (count + 1)
        at += 257 - count if count > 127 else 2
    return out


def read_exr(path):
    """Channels by name, each a list of rows; of the scanlines that roxel writes."""
    data = path.read_bytes()
    at, header = 8, {}
    while data[at]:
        name, kind = data[at:].split(b"\0", 2)[:2]
        at += len(name) + len(kind) + 2
        size, = struct.unpack_from("<i", data, at)
        header[name.decode()] = data[at + 4:at + 4 + size]
        at += 4 + size
    at += 1
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    channels, rest = [], header["channels"]
    while rest[0]:
        name, rest = rest.split(b"\0", 1)
        channels.append((name.decode(), "e" if rest[0] == 1 else "f"))
        rest = rest[16:]
    lines = 16 if header["compression"][0] == 3 else 1
    rows = {name: [] for name, _ in channels}
    for offset in struct.unpack_from("<%dQ" % -(-height // lines), data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        block, count = data[offset + 8:offset + 8 + size], min(lines, height - (y - y0))
        if header["compression"][0] and size < count * width * sum(2 if kind == "e" else 4 for _, kind in channels):
            packed = unpack_runs(block) if header["compression"][0] == 1 else bytearray(zlib.decompress(block))
            for i in range(1, len(packed)): packed[i] = (packed[i - 1] + packed[i] - 128) & 255
            block, half = bytearray(len(packed)), (len(packed) + 1) // 2
            block[0::2], block[1::2] = packed[:half], packed[half:]
        at_row = 0
        for _ in range(count):
            for name, kind in channels:
                rows[name].append(struct.unpack_from("<%d%s" % (width, kind), block, at_row))
                at_row += width * struct.calcsize(kind)
    return rows


def clouded_street(street, folder, node=0, towards=(300, 50), radius_deg=22, color=(0.35, 0.36, 0.38)):
    """The street under one white cloud over one node; and the cloud's pixels (x, y) by view."""
    folder.mkdir()
    azimuth, elevation = map(math.radians, towards)
    middle = (math.cos(elevation) * math.sin(azimuth), math.cos(elevation) * math.cos(azimuth), math.sin(elevation))
    data, cloud = json.loads((street / "transforms.json").read_text()), {}
    for frame in data["frames"]:
        image = street / frame["file_path"]
        depth = read_exr(street / frame["depth_path"])
        for key in ("mask_path", "depth_path", "albedo_path", "normal_path", "sky_path"): frame.pop(key)
        frame["file_path"] = str(image)
        if frame["node"] != node: continue
        picture, pixels, (depth,) = read_exr(image), [], depth.values()
        for y, row in enumerate(picture["R"]):
            for x in range(len(row)):
                in_camera = ((x + 0.5 - data["cx"]) / data["fl_x"], (data["cy"] - y - 0.5) / data["fl_y"], -1)
                ray = [sum(m * c for m, c in zip(line, in_camera)) for line in frame["transform_matrix"][:3]]
                cosine = sum(a * b for a, b in zip(ray, middle)) / math.hypot(*ray)
                in_cloud = not 0 < depth[y][x] < 1e6 and cosine > math.cos(math.radians(radius_deg))
                if in_cloud: cloud.setdefault(image.stem, []).append((x, y))
                pixels.append(rgbe(color if in_cloud else [picture[c][y][x] for c in "RGB"]))
        file = folder / f"{image.stem}.hdr"
        file.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (len(picture["R"]), len(picture["R"][0])) + b"".join(pixels))
        frame["file_path"] = file.name
    (folder / "transforms.json").write_text(json.dumps(data))
    return folder, cloud


def set_up_street(cls):
    """Two nodes, each with its own time, of 20 and 8 photographs; and their skies."""
    super(cls, cls).setUpClass()
    cls.street, cls.skies = cls.folder / "street", cls.folder / "street-skies"
    made = program.run("synth", "street", "-o", cls.street, "--images", "28", "--size", "36x28", "--samples", "1", "--quiet")
    assert made.returncode == 0, made.stderr
    made = program.run("sky", cls.street, "-o", cls.skies, *cls.sky_options, "--no-pictures", "--quiet")
    assert made.returncode == 0, made.stderr


def reconstruct_street(self, name, *arguments):
    out = self.folder / name
    self.succeed("reconstruct", self.street, "-o", out, *SMALL, *arguments)
    return out, json.loads((out / "summary.json").read_text())


def lights_of_nodes(self, summary):
    by_node = {}
    for view in summary["views"]: by_node.setdefault(view["name"].split("/")[-1][:3], set()).add(tuple(view["light"]))
    return by_node


class SkyInReconstruct(SkyCase):
    """A street of two nodes, each with its own time."""

    sky_options = []  # those of reconstruct, to whose skies these are compared
    setUpClass, reconstruct, lights = classmethod(set_up_street), reconstruct_street, lights_of_nodes

    def test_skies_of_another_run_give_light_and_background(self):
        skies = self.skies
        without, plain = self.reconstruct_once("--illumination", "none")
        out, lit = self.reconstruct("lit", "--sky", skies)
        self.assertEqual(plain["scene"]["light"]["illumination"], "none")
        self.assertEqual((lit["scene"]["light"]["illumination"], lit["scene"]["light"]["matching"]), ("sky", "local"))
        self.assertEqual((plain["scene"]["background"]["kind"], lit["scene"]["background"]["kind"]), ("unknown", "mask"))
        lights = self.lights(lit)
        self.assertEqual({len(l) for l in lights.values()}, {1})  # one light a node
        self.assertEqual(len(set.union(*lights.values())), len(lights))
        self.assertNotEqual(digest(out / "voxels.ply"), digest(without / "voxels.ply"))

    def test_skies_are_fitted_where_they_are_asked_for(self):
        skies = self.skies
        _, given = self.reconstruct("given", "--sky", skies, "--illumination", "sky")
        out, fitted = self.reconstruct("fitted", "--illumination", "sky")
        self.assertEqual(self.lights(given), self.lights(fitted))
        self.assertEqual(len(fitted["skies"]), len(self.lights(fitted)))
        self.assertIn("sky", [stage["name"] for stage in fitted["stages"]])
        self.assertIn("sky/n00.json", files_below(out))
        again, refitted = self.reconstruct("again", "--sky", out)  # a reconstruction's skies serve as well
        self.assertEqual(self.lights(fitted), self.lights(refitted))
        self.reconstruct("fitted", "--illumination", "none", *NO_SURROUND)  # a run that is replaced takes its skies with it
        self.assertNotIn("sky/n00.json", files_below(out))

    def test_skies_may_be_background_alone(self):
        plain, none = self.reconstruct_once("--illumination", "none")
        fitted, sky = self.reconstruct("background", "--illumination", "none", "--background", "sky")
        given, same = self.reconstruct("background-given", "--illumination", "none", "--background", "sky", "--sky", self.skies)
        self.assertEqual((none["scene"]["background"]["kind"], sky["scene"]["background"]["kind"]), ("unknown", "mask"))
        self.assertEqual(sky["scene"]["light"]["illumination"], "none")
        self.assertNotEqual(digest(plain / "voxels.ply"), digest(fitted / "voxels.ply"))
        self.assertEqual(digest(given / "voxels.ply"), digest(fitted / "voxels.ply"))

    def test_skies_of_other_photographs_are_refused(self):
        skies, _ = self.sky("square")
        self.expect_error(2, "skies of other photographs", "reconstruct", self.street, "-o", self.folder / "no", "--sky", skies)
        self.expect_error(2, "missing", "reconstruct", self.street, "-o", self.folder / "no", "--sky", self.folder / "missing")
        self.assertFalse((self.folder / "no").exists())


class LightInReconstruct(SkyCase):
    """The same street: what its light is worth, and how it is found."""

    OFTEN = ["--levels", "2", "--passes", "5", "--all-passes", "--checkpoint-interval", "0"]  # a checkpoint after each of many passes
    LOOK_AGAIN = [*OFTEN, "--illumination", "sky"]

    sky_options = ["--facets", "4"]
    setUpClass, reconstruct, lights = classmethod(set_up_street), reconstruct_street, lights_of_nodes

    def test_photographs_of_several_times_of_day_are_brought_to_one_light(self):
        _, found = self.reconstruct_once()
        self.assertEqual(found["scene"]["light"]["illumination"], "sky")
        self.assertTrue(any("several times of day" in note for note in found["notes"]), found["notes"])

    def test_shading_and_shadow_are_divided_out_where_that_is_asked_for(self):
        skies = self.skies
        flat, _ = self.reconstruct("flat", "--render", "--report", "--sky", skies, "--illumination", "sky")
        out, summary = self.reconstruct("shaded", "--render", "--sky", skies, "--illumination", "sky-normal", "--threads", "1")
        again, _ = self.reconstruct("shaded2", "--render", "--sky", skies, "--illumination", "sky-normal", "--threads", "3")
        self.assertEqual(summary["scene"]["light"]["illumination"], "sky-normal")
        self.assertNotEqual(digest(flat / "voxels.ply"), digest(out / "voxels.ply"))
        self.assertEqual(digest(out / "voxels.ply"), digest(again / "voxels.ply"))
        name = summary["views"][0]["name"]
        self.assertIn(f"light/{name}.exr", files_below(out))
        self.assertEqual(digest(out / f"light/{name}.exr"), digest(again / f"light/{name}.exr"))
        self.assertNotIn(f"light/{name}.exr", files_below(flat))
        self.reconstruct("shaded", "--render", "--report", "--illumination", "none", *NO_SURROUND)
        self.assertNotIn(f"light/{name}.exr", files_below(out))
        for run, captions in ((flat, ["photograph", "photograph over its light", "render"]), (out, ["photograph", "render"])):  # before and after
            found = re.findall(f'alt="([^"]*) of {name}"', (run / "report.html").read_text())
            self.assertEqual(found[:len(captions)], captions)

    def test_rays_that_the_volume_leaves_unexplained_feed_the_next_fit(self):
        _, looked = self.reconstruct_once(*self.LOOK_AGAIN)
        self.assertEqual([node["node"] for node in looked["skies_again"]], [node["node"] for node in looked["skies"]])
        for node in looked["skies_again"]:
            self.assertGreater(node["unexplained_share"], 0)
            self.assertIs(node["taken"], False)  # nothing is wrong with the first
            self.assertEqual(node["refused"], "hardly more sky")

    def test_a_second_look_loses_no_sky(self):
        """Nothing hides the sky of this street but walls, of which its coarse first levels explain few."""
        for levels in ("2", "3"):
            shares = []
            for options in (["--no-sky-again"], []):
                _, summary = self.reconstruct_once("--levels", levels, "--passes", "3", "--illumination", "sky", *options)
                shares.append([(sky["model"], sky["mask_share"], sky["horizontal_irradiance"]) for sky in summary["skies"]])
            for node, (before, after) in enumerate(zip(*shares)):
                with self.subTest(levels=levels, node=node):
                    self.assertEqual(before[0], after[0])
                    self.assertLess(abs(after[1] / before[1] - 1), 0.02)
                    for a, b in zip(before[2], after[2]): self.assertLess(abs(b / a - 1), 0.02)

    def test_a_cloud_that_the_first_fit_lacks_is_sky_after_the_second(self):
        data, cloud = clouded_street(self.street, self.folder / "clouded")
        self.assertGreater(sum(map(len, cloud.values())), 500)
        found = {}
        for name, options in (("first", ["--no-sky-again"]), ("second", [])):
            out = self.folder / name
            self.succeed("reconstruct", data, "-o", out, *SMALL, "--levels", "2", "--passes", "4", "--depth", "--no-bp", "--no-refine",
                         "--no-mesh", "--illumination", "sky", *options)
            summary = json.loads((out / "summary.json").read_text())
            depths = {view: read_exr(out / f"depth/{view}.exr")["A"] for view in cloud}
            opacity = [depths[view][y][x] for view, pixels in cloud.items() for x, y in pixels]
            found[name] = (summary["skies"][0]["mask_share"], sum(opacity) / len(opacity), summary)
        self.assertGreater(found["first"][1], 0.9)  # what is no sky must be built
        self.assertLess(found["second"][1], 0.1)
        self.assertGreater(found["second"][0], found["first"][0] + 0.02)
        self.assertNotIn("skies_again", found["first"][2])
        again = found["second"][2]["skies_again"][0]
        self.assertEqual((again["node"], again["taken"]), ("n00", True))
        self.assertEqual((again["mask_share_before"], again["mask_share"]), (found["first"][0], found["second"][0]))

    def test_masks_by_hand_are_not_doubted(self):
        for name, masks in (("found", []), ("by hand", ["--sky-masks", self.skies / "sky/mask"])):
            with self.subTest(name):
                one, two = (digest(self.reconstruct(f"doubt{number}", "--levels", "2", "--illumination", "sky", *masks, *options)[0] / "voxels.ply")
                            for number, options in enumerate((["--no-sky-again"], [])))
                self.assertEqual(one == two, name == "by hand")

    def test_a_second_fit_that_cannot_be_is_named(self):
        for why, options in (("taken from --sky RUN", ["--sky", self.skies]), ("no skies are fitted", ["--illumination", "none", *NO_SURROUND]),
                             ("but one level", [])):
            with self.subTest(why):
                _, summary = self.reconstruct_once("--no-sky-again", *options)
                self.assertTrue(any(w.startswith("--no-sky-again has no effect here") and why in w for w in summary["warnings"]), summary["warnings"])

    def test_a_killed_run_goes_on_with_its_light_and_the_skies_that_it_found(self):
        for name, arguments in (("again", self.LOOK_AGAIN),
                                ("normal", [*self.OFTEN, "--sky", str(self.skies), "--illumination", "sky-normal"])):
            with self.subTest(name):
                whole, _ = self.reconstruct_once(*arguments)
                out, options = self.folder / f"killed-{name}", [*SMALL, *arguments]
                talking = [option for option in options if option != "--quiet"]
                job, _ = start_until("level 2/2 pass 3/", "reconstruct", self.street, "-o", out, *talking)
                job.kill()
                job.communicate(timeout=60)
                self.succeed("reconstruct", self.street, "-o", out, *options, "--resume")
                expected, found = (json.loads((run / "summary.json").read_text()) for run in (whole, out))
                self.assertTrue(any(note.startswith("resumed after level 2") for note in found["notes"]), found["notes"])
                self.assertEqual(digest(out / "voxels.ply"), digest(whole / "voxels.ply"))
                for key in ("skies", "skies_again", "views"): self.assertEqual(found.get(key), expected.get(key))
                for file in files_below(whole):
                    if file.startswith("sky/") and file.endswith((".exr", ".png")):
                        self.assertEqual(digest(out / file), digest(whole / file), file)

    def test_sun_and_sky_may_be_given_by_hand(self):
        _, given = self.reconstruct("by-hand", "--illumination", "sky", "--sun", "200,35")
        for node in given["skies"]:
            self.assertEqual(node["sun_source"], "given")
            self.assertAlmostEqual(node["sun"][0], 200, places=6)
        self.expect_error(2, "--sun: found no sky that is fitted", "reconstruct", self.street, "-o", self.folder / "no", "--sun", "200,35",
                          "--illumination", "none")
        self.expect_error(2, "--sky-masks", "reconstruct", self.street, "-o", self.folder / "no", "--sky-masks", self.folder,
                          "--illumination", "sky")

    def street_with(self, name, change):
        """The street again with other keys in its frames."""
        data = json.loads((self.street / "transforms.json").read_text())
        for frame in data["frames"]:
            for key in ("file_path", "mask_path", "depth_path", "albedo_path", "normal_path", "sky_path"):
                frame[key] = str(self.street / frame[key])
            change(frame)
        path = self.folder / f"{name}.json"
        path.write_text(json.dumps(data))
        return path

    def reconstruct_with(self, name, data, *arguments):
        out = self.folder / f"run-{name}"
        options = [option for option in SMALL if option != "--quiet"]
        done = self.succeed("reconstruct", data, "-o", out, *options, *arguments)
        return out, json.loads((out / "summary.json").read_text()), done.stderr

    def test_a_node_at_night_has_a_gain_and_no_mask(self):
        def night(frame):
            if frame["node"] == 0: frame["time_utc"] = "2023-06-15T00:30:00Z"

        out, summary, said = self.reconstruct_with("night", self.street_with("night", night), "--illumination", "sky", "--levels", "2", "--verbose")
        warning = next(w for w in summary["warnings"] if "out of 8 of 28 views" in w)
        self.assertIn("20 night (n00)", warning)
        self.assertIn(warning, said)
        masks = [f for f in files_below(out) if f.startswith("sky/mask/")]
        self.assertEqual((len(masks), len([f for f in masks if "n00_" in f])), (8, 0))
        lights = self.lights(summary)
        self.assertEqual([len(lights[node]) for node in ("n00", "n01")], [1, 1])
        self.assertNotEqual(lights["n00"], {(1, 1, 1)})
        self.assertEqual(summary["light"][-1]["fitted_views"], 20)  # all of the node's, and no other
        self.assertEqual(summary["scene"]["background"]["kind"], "mask")

    def test_without_any_light_each_node_says_why(self):
        def night(frame): frame["time_utc"] = f"2023-06-{15 + frame['node']}T00:30:00Z"

        data = self.street_with("dark", night)
        out, summary, said = self.reconstruct_with("dark", data, *NO_SURROUND)
        self.assertEqual([(sky["node"], sky["fallback"]) for sky in summary["skies"]], [(f"n0{n}", "night") for n in range(2)])
        self.assertIn("28 night (n00, n01)", said)
        self.assertEqual(summary["scene"]["light"]["illumination"], "none")
        self.assertFalse([f for f in files_below(out) if f.startswith("sky/")])
        for option in (["--illumination", "sky"], ["--background", "sky"]):
            self.expect_error(2, "28 night (n00, n01)", "reconstruct", data, "-o", self.folder / "no", *SMALL, *option)

    def test_without_the_sun_light_is_not_taken_for_whole(self):
        def no_time(frame): frame.pop("time_utc")

        _, summary, said = self.reconstruct_with("no-time", self.street_with("no-time", no_time), "--illumination", "none", "--background", "sky")
        self.assertEqual(summary["scene"]["background"]["kind"], "mask")
        self.assertEqual(summary["scene"]["light"]["illumination"], "none")
        self.assertEqual({sky["node"] for sky in summary["skies"]}, {"n00", "n01"})

    def test_what_a_fit_warns_of_is_said(self):
        def another_hour(frame): frame["time_utc"] = frame["time_utc"].replace("T08:30", "T14:30")

        _, summary, said = self.reconstruct_with("wrong", self.street_with("wrong", another_hour), "--illumination", "sky")
        apart = [w for w in summary["warnings"] if "degrees apart" in w]
        self.assertTrue(apart)
        for warning in apart: self.assertEqual(said.count(warning), 1)

    def test_what_photographs_show_as_sky_alone_is_emptied_unless_told_otherwise(self):
        found = {}
        for name, option in (("emptied", []), ("left", ["--no-empty-sky"]), ("unknown", ["--background", "unknown"])):
            out, summary = self.reconstruct(name, "--sky", self.skies, "--opacity-threshold", "0.0001", *NO_SURROUND, *option)
            found[name] = digest(out / "voxels.ply"), any("sky alone were emptied" in note for note in summary["notes"])
        self.assertEqual([emptied for _, emptied in found.values()], [True, False, False])
        self.assertNotEqual(found["emptied"][0], found["left"][0])

    def test_photographs_without_a_sky_share_their_node_s(self):
        some = self.folder / "some"
        self.succeed("sky", self.street, "-o", some, "--images", "*_0[0-9]*", *self.sky_options, "--no-pictures", "--quiet")
        _, summary = self.reconstruct("some-skies", "--sky", some, *NO_SURROUND)
        self.assertLess(len(json.loads((some / "sky/n00.json").read_text())["views"]), sum("n00_" in v["name"] for v in summary["views"]))
        self.assertEqual({len(lights) for lights in self.lights(summary).values()}, {1})
        self.assertFalse([w for w in summary["warnings"] if "no sky fitted" in w])

    def test_skies_of_other_photographs_of_the_same_names_are_refused(self):
        data = json.loads((self.street / "transforms.json").read_text())
        frame = next(f for f in data["frames"] if "n01_03" in f["file_path"])
        frame["transform_matrix"][0][3] += 5
        elsewhere = self.street / "elsewhere.json"
        elsewhere.write_text(json.dumps(data))
        self.expect_error(2, "n01.json: centres: found n01_03 at ", "reconstruct", elsewhere, "-o", self.folder / "no", *SMALL, "--sky", self.skies)

    def test_the_mean_of_the_dome_is_another_light(self):
        skies = self.skies
        _, horizontal = self.reconstruct("horizontal", "--sky", skies)
        _, mean = self.reconstruct("mean", "--sky", skies, "--sky-light", "mean")
        self.assertNotEqual(self.lights(horizontal), self.lights(mean))


if __name__ == "__main__":
    main()
