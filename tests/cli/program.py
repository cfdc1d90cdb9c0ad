"""What the tests of the command line share: the program, a folder with a tiny data set, what is said and written."""

import hashlib
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

ROXEL = None  # the program, set in main
SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
TINY = ["--resolution", "16", "--levels", "2", "--passes", "2", "--no-mesh"]  # mesh_test.py has the mesh
BLACK = ["--masks", "none"]  # the demo's black background is then a known colour
UNKNOWN = ["--masks", "none", "--background", "unknown"]


def run(*arguments, **kwargs):
    """Runs roxel and returns what it said."""
    return subprocess.run([ROXEL, *map(str, arguments)], capture_output=True, text=True, **{"timeout": 120, **kwargs})


def start_until(moment, *arguments):
    """Starts roxel and returns once `moment` is said: the process, which is still at work, and all that it said."""
    job = subprocess.Popen([ROXEL, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    said = ""
    for line in job.stderr:
        said += line
        if moment in line:
            break
    assert job.poll() is None, said
    return job, said


def files_below(folder):
    return sorted(str(p.relative_to(folder)) for p in pathlib.Path(folder).rglob("*") if p.is_file())


def digest(path):
    return hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()


def digests(folder):
    return {f: digest(pathlib.Path(folder) / f) for f in files_below(folder)}


def run_on_a_full_disc(*arguments, most_bytes):
    """Runs roxel where files cannot grow beyond a size; what it said."""
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))
    return run(*arguments, preexec_fn=limit, restore_signals=False)


def numbers(summary):
    """What a run found, apart from how it was asked for and how long it took."""
    kept = {k: summary[k] for k in ("termination", "levels", "passes", "views", "reprojection_rms_percent")}
    kept = json.loads(json.dumps(kept))
    for record in kept["levels"] + kept["passes"]:
        for key in list(record):
            if "seconds" in key or key in ("ns_per_step", "peak_memory_bytes"):
                del record[key]
    return kept


class Case(unittest.TestCase):
    """A folder of its own with a data set of four photographs, 64 x 48."""

    shared = {}  # by class and options: runs and their summaries

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="roxel-cli-"))
        cls.data = cls.folder / "data"
        cls.synth(cls.data, 4, "64x48")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    @classmethod
    def synth(cls, folder, images, size):
        made = run("synth", "demo", "-o", folder, "--images", images, "--size", size)
        assert made.returncode == 0, made.stderr

    def succeed(self, *arguments, **kwargs):
        done = run(*arguments, **kwargs)
        self.assertEqual(done.returncode, 0, f"roxel {' '.join(map(str, arguments))}\n{done.stderr}")
        return done

    def expect_error(self, code, message, *arguments):
        """The command ends with this code and one line that holds `message`."""
        done = run(*arguments)
        line = f"roxel {' '.join(map(str, arguments))}"
        self.assertEqual(done.returncode, code, f"{line}\n{done.stderr}")
        self.assertEqual(done.stderr.count("\n"), 1, f"{line}\n{done.stderr}")
        self.assertTrue(done.stderr.startswith("roxel: error: "), done.stderr)
        self.assertIn(message, done.stderr, line)
        self.assertEqual(done.stdout, "")
        return done

    def reconstruct(self, name, *arguments, data=None):
        """A tiny run; its folder and its summary."""
        out = self.folder / name
        self.succeed("reconstruct", data or self.data, "-o", out, *TINY, *arguments, "--quiet")
        return out, json.loads((out / "summary.json").read_text())

    def reconstruct_once(self, *arguments):
        """The same, made once for all tests of the class that ask for it; they leave it as it is."""
        key = type(self), arguments
        if key not in self.shared:
            self.shared[key] = self.reconstruct(f"shared-{len(self.shared)}", *arguments)
        return self.shared[key]


def main():
    global ROXEL
    if len(sys.argv) < 2:
        sys.exit(sys.modules["__main__"].__doc__)
    ROXEL = os.path.abspath(sys.argv.pop(1))
    unittest.main(module="__main__", argv=[sys.argv[0], *sys.argv[1:]])
