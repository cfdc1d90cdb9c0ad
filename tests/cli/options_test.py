#!/usr/bin/env python3
"""Every option of `roxel reconstruct` changes something, and is in help and docs.

    options_test.py ROXEL [unittest arguments]
"""

import program
from depth_test import DEPTH_CHANGES
from program import BLACK, UNKNOWN, Case, digest, main, numbers


# Each option of `reconstruct`: what the run has besides, and a value that must change its result.
CHANGES = {
    "acceleration": ([], ["--acceleration", "1"]),
    "adaptive": (["--samples-per-voxel", "1"], ["--no-adaptive"]),
    "agreement": ([], ["--agreement", "linear"]),
    "agreement-scale": (["--agreement", "exponential"], ["--agreement-scale", "40"]),
    "all-passes": (["--tolerance", "0.5", "--passes", "6"], ["--all-passes"]),
    "background": (BLACK, ["--background", "none"]),
    "background-color": (BLACK + ["--background", "constant"], ["--background-color", "0.2,0.1,0.4"]),
    "bounds": ([], ["--bounds", "-1,-1,-1,1,1,1"]),
    "coarse-passes": ([], ["--coarse-passes", "1"]),
    "color-space": ([], ["--color-space", "hsv"]),
    "confidence-threshold": ([], ["--confidence-threshold", "0.5"]),
    "draft-passes": ([], ["--draft-passes", "0"]),
    "evidence-half": ([], ["--evidence-half", "2"]),
    "far": ([], ["--far", "5"]),
    "filter-background": (BLACK, ["--filter-background"]),
    "filter-rays": ([], ["--filter-rays"]),
    "fit-colors": ([], ["--no-fit-colors"]),
    "format": ([], ["--format", "colmap"]),
    "illumination": ([], ["--illumination", "gain"]),
    "images": ([], ["--images", "00[012]*"]),
    "interpolate": ([], ["--interpolate"]),
    "levels": ([], ["--levels", "1"]),
    "masks": ([], ["--masks", "none"]),
    "matching": ([], ["--matching", "local"]),
    "matching-blur": (["--matching", "local"], ["--matching-blur", "20"]),
    "min-overlap": ([], ["--min-overlap", "1"]),
    "near": ([], ["--near", "5"]),
    "node-tolerance": ([], ["--node-tolerance", "100"]),
    "nodes": ([], ["--nodes", "1:4"]),
    "noise": ([], ["--noise", "9"]),
    "observation-weight": ([], ["--observation-weight", "6"]),
    "opacity-threshold": ([], ["--opacity-threshold", "0.3"]),
    "outlier": ([], ["--outlier", "0.01"]),
    "outline-weight": ([], ["--outline-weight", "0.5"]),
    "passes": ([], ["--passes", "1"]),
    "predictive": ([], ["--no-predictive"]),
    "prior-opacity": ([], ["--prior-opacity", "0.1"]),
    "prior-sharpness": ([], ["--prior-sharpness", "1"]),
    "prior-strength": ([], ["--prior-strength", "50"]),
    "ray-weights": ([], ["--ray-weights"]),
    "resolution": ([], ["--resolution", "24"]),
    "response": ([], ["--response", "linear"]),
    "samples-per-voxel": ([], ["--samples-per-voxel", "0.5"]),
    "spatial-prior": ([], ["--spatial-prior", "0"]),
    "surround": (UNKNOWN, ["--surround", "off"]),
    "tolerance": ([], ["--tolerance", "0.5"]),
    "uninformative": ([], ["--uninformative", "0.1"]),
    "update": ([], ["--update", "roxels"]),
    "voxel-size": ([], ["--voxel-size", "0.3"]),
    "white-point": ([], ["--white-point", "A"]),
}
# Options that change files or what is said, and not the numbers; the tests of Switches and Depth are theirs.
ELSEWHERE = set(DEPTH_CHANGES) | {"checkpoints", "checkpoint-interval", "resume", "memory", "export", "depth", "dry-run", "empty-sky", "init", "json", "quiet", "render", "report", "save-surround", "sky", "sky-again", "sky-light", "sky-masks", "sun", "threads", "verbose"}
# Those of the surface, in mesh_test.py.
MESH = {"colors", "faces", "hole-size", "level-seams", "mesh", "mesh-band", "mesh-error", "mesh-pictures", "mesh-smooth",
        "mesh-voxel-size", "min-views", "seam-cost", "smallest-part", "texture", "texture-size", "transient"}


class Options(Case):
    def test_every_option_has_a_case(self):
        _, summary = self.reconstruct("names", "--no-depth", "--no-render", "--no-report")
        self.assertEqual(set(summary["options"]), set(CHANGES) | ELSEWHERE | MESH)

    def test_every_option_changes_something(self):
        known = {}
        for option, (base, change) in CHANGES.items():
            with self.subTest(option):
                key = tuple(base)
                if key not in known:
                    known[key] = self.result(base)
                changed = self.result(base + change)
                self.assertNotEqual(known[key], changed)

    def result(self, arguments):
        out, summary = self.reconstruct("run", "--no-depth", "--no-report", *arguments)
        # What decides about the photographs' reading is part of the result, too.
        return numbers(summary), summary["dataset"]["format"], digest(out / "voxels.ply")

    def test_every_option_is_in_help_and_in_the_docs(self):
        text = self.succeed("reconstruct", "--help").stdout
        docs = (program.SOURCE / "docs/options.md").read_text() + (program.SOURCE / "docs/commands.md").read_text()
        for option in set(CHANGES) | ELSEWHERE | MESH:
            pattern = rf"--(no-)?{option}\b"
            self.assertRegex(text, pattern)
            self.assertRegex(docs, pattern)

    def test_the_options_in_the_docs_are_those_of_the_program(self):
        page = (program.SOURCE / "docs/commands.md").read_text()
        made = self.succeed("help-markdown").stdout
        self.assertEqual(page[page.index(made.split("\n", 1)[0]):], made,
                         "docs/commands.md: its end is what `roxel help-markdown` prints")


if __name__ == "__main__":
    main()
