#!/usr/bin/env python3
"""Shows that check_layers.py finds what it is there to find, and nothing else."""

import pathlib
import tempfile
import unittest

import check_layers

ALLOWED = {
    "src/roxel/volume/volume.cc": '#include "roxel/volume/volume.h"\n#include <openvdb/openvdb.h>\n',
    "src/roxel/volume/volume.h": '#pragma once\n#include <vector>\n#include "roxel/base/error.h"\n',
    "src/roxel/volume/volume_test.cc": '#include "roxel/synth/world.h"\n',
    "apps/roxel/main.cc": '#include "roxel/report/page.h"\n#include "apps.h"\n',
}

FORBIDDEN = {
    ("src/roxel/volume/volume.cc", '#include "roxel/io/vdb.h"'): "higher row",
    ("src/roxel/volume/volume.h", '#include "roxel/image/image.h"'): "same row",
    ("src/roxel/base/error.h", '  #  include "roxel/camera/camera.h"'): "higher row",
    ("src/roxel/base/error.h", "#include <roxel/camera/camera.h>"): "higher row",
    ("src/roxel/io/vdb.h", "#include <openvdb/openvdb.h>"): "OpenVDB",
    ("src/roxel/sky/fit.h", "#include <ceres/ceres.h>"): "Ceres",
    ("src/roxel/volume/volume.cc", '#include "roxel/novel/x.h"'): "not on the ladder",
    ("src/roxel/novel/x.cc", "#include <vector>"): "not on the ladder",
}


class CheckLayers(unittest.TestCase):
    def check(self, files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in files.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            return check_layers.violations(root)

    def test_allowed_includes_pass(self):
        found, count = self.check(ALLOWED)
        self.assertEqual(found, [])
        self.assertEqual(count, len(ALLOWED))

    def test_a_type_that_two_headers_define_is_found(self):
        light = "struct Light {\n  int a;\n};\n"
        found, _ = self.check({"src/roxel/solve/light.h": light, "src/roxel/synth/lights.h": "\n" + light})
        self.assertEqual(found, ["src/roxel/synth/lights.h:2: Light is defined in src/roxel/solve/light.h:1, too"])

    def test_declarations_specialisations_and_sources_may_repeat_names(self):
        self.assertEqual(self.check({"src/roxel/solve/a.h": "struct A {\n};\nclass B;\ntemplate <>\nstruct T<int> {\n};\n",
                                     "src/roxel/synth/b.h": "struct A;\nclass B {\n};\ntemplate <>\nstruct T<float> {\n};\n",
                                     "src/roxel/synth/c.cc": "namespace {\nstruct A {\n};\n}\n"})[0], [])

    def test_each_forbidden_include_is_found_at_its_line(self):
        for (name, line), reason in FORBIDDEN.items():
            with self.subTest(name=name, line=line):
                found, _ = self.check({name: "// first line\n" + line + "\n"})
                self.assertEqual(len(found), 1, found)
                self.assertIn(reason, found[0])
                self.assertTrue(found[0].startswith(name + ":"))

    def test_every_row_may_not_look_up(self):
        for module, row in check_layers.ROW.items():
            for other, other_row in check_layers.ROW.items():
                if module in ("apps", "python") or other in ("apps", "python"):
                    continue
                name = f"src/roxel/{module}/x.cc"
                found, _ = self.check({name: f'#include "roxel/{other}/x.h"\n'})
                self.assertEqual(not found, other_row < row or other == module, (module, other))


if __name__ == "__main__":
    unittest.main()
