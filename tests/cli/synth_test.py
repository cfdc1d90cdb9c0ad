#!/usr/bin/env python3
"""Tests of `roxel synth`: the worlds, tiny.

    synth_test.py ROXEL [unittest arguments]
"""

import json
import re

from program import Case, digests, files_below, main


# What an option of synth changes: files of which folder, and which stay as they were.
SYNTH_CHANGES = {
    "background": (["plane"], ["--background", "sky"], "images", "depth"),
    "images": (["plane"], ["--images", "3"], "transforms.json", None),
    "light": (["plane"], ["--light", "daylight"], "images", "albedo"),
    "moving-shadows": (["plane", "--light", "daylight"], ["--no-moving-shadows"], "images", "albedo"),
    "noise": (["plane"], ["--noise", "0.05"], "images", "depth"),
    "pose-noise": (["plane"], ["--pose-noise", "0.5,0.01"], "transforms.json", "images"),
    "samples": (["plane"], ["--samples", "3"], "images", "depth"),
    "seed": (["plane"], ["--seed", "2"], "images", "depth"),
    "size": (["plane"], ["--size", "24x20"], "images", "mesh.ply"),
    "transients": (["plane"], ["--transients", "2"], "images", "depth"),
}


class Synth(Case):
    """The worlds of `roxel synth`, tiny."""

    def make(self, name, world, *arguments, size="32x24", images=2):
        out = self.folder / name
        given = [str(a) for a in arguments]
        if "--size" not in given: given += ["--size", size]
        if "--images" not in given: given += ["--images", str(images)]
        if "--samples" not in given: given += ["--samples", "2"]
        self.succeed("synth", world, "-o", out, *given, "--quiet")
        return out

    def test_every_option_changes_what_it_says(self):
        text = self.succeed("synth", "--help").stdout
        known = {"threads", "quiet", "verbose", "json", "config", "help"}
        named = set(re.findall(r"--(?:no-)?([a-z-]+)", text))
        self.assertEqual(named - known, set(SYNTH_CHANGES) & named)
        self.assertEqual(set(SYNTH_CHANGES) - named, set())
        made = {}
        for option, ((world, *base), change, moved, kept) in SYNTH_CHANGES.items():
            with self.subTest(option):
                key = world, *base
                if key not in made:
                    made[key] = self.make("-".join(["before", *key]), *key)
                before, after = made[key], self.make(option, *key, *change)
                part = lambda folder, below: {f: d for f, d in digests(folder).items() if f.startswith(below)}
                self.assertTrue(part(before, moved))
                self.assertNotEqual(part(before, moved), part(after, moved))
                if kept: self.assertEqual(part(before, kept), part(after, kept))

    def test_every_world_can_be_read_and_reconstructed(self):
        for world, nodes in (("plane", 3), ("head", 3), ("mug", 3), ("table", 3), ("flights", 3), ("street", 1)):
            with self.subTest(world):
                data = self.make("read-" + world, world, images=3)
                info = json.loads(self.succeed("info", data, "--json").stdout)
                self.assertEqual((info["format"], info["images"], info["nodes"]), ("transforms", 3, nodes))
                self.assertEqual(info["masks"], 0 if world == "table" else 3)
                self.reconstruct("run-" + world, data=data)

    def test_a_new_world_takes_the_place_of_an_older_one_and_of_nothing_else(self):
        out = self.make("again", "plane", "--transients", "1", images=3)
        self.make("again", "table")
        fresh = self.make("fresh", "table")
        self.assertEqual(digests(out), digests(fresh))
        square = self.make("square", "street", images=21, size="16x16")
        self.make("square", "table")
        self.assertEqual(digests(square), digests(fresh))
        self.assertFalse((square / "mask").exists())
        mine = self.folder / "mine"
        mine.mkdir()
        (mine / "transforms.json").write_text('{"frames": []}')
        self.expect_error(2, "did not make", "synth", "plane", "-o", mine)
        self.assertEqual(files_below(mine), ["transforms.json"])
        photographs = self.folder / "photographs"
        (photographs / "images").mkdir(parents=True)
        (photographs / "images" / "000.png").write_text("mine")
        self.expect_error(2, "did not make", "synth", "plane", "-o", photographs)
        self.assertEqual((photographs / "images" / "000.png").read_text(), "mine")

    def test_options_without_effect_are_refused(self):
        for world, option in (("plane", ["--no-moving-shadows"]), ("street", ["--light", "constant", "--no-moving-shadows"]),
                              ("table", ["--background", "black"])):
            self.expect_error(2, option[-1].lstrip("-") if option[-1] != "black" else "background", "synth", world,
                              "-o", self.folder / "none", *option)

    def test_every_node_has_its_light(self):
        for light in ("constant", "mix"):
            street = self.make("street-" + light, "street", "--light", light, images=41, size="16x16")
            nodes = json.loads((street / "illumination.json").read_text())["nodes"]
            frames = json.loads((street / "transforms.json").read_text())["frames"]
            self.assertEqual([n["node"] for n in nodes], sorted({f["node"] for f in frames}))
            for node in nodes:
                self.assertEqual(len(node["center"]), 3)
                self.assertTrue((street / node["equirect"]).is_file())
                self.assertTrue((street / node["equirect_without_disc"]).is_file())

    def test_json_says_what_was_made(self):
        made = json.loads(self.succeed("synth", "street", "-o", self.folder / "json", "--images", "21", "--size", "16x16",
                                       "--samples", "1", "--json").stdout)
        self.assertEqual((made["world"], made["images"], made["size"], made["occasions"]), ("street", 21, [16, 16], 2))


if __name__ == "__main__":
    main()
