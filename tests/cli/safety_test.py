#!/usr/bin/env python3
"""Tests of what must not be lost: sources, older runs, Ctrl-C at any moment; the bar on a terminal.

    safety_test.py ROXEL [unittest arguments]
"""

import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time

import program
from program import TINY, Case, digests, files_below, main, run, run_on_a_full_disc, start_until


class Safety(Case):
    """Sources are never written over, and older results only by whole new ones."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        done = run("reconstruct", cls.data, "-o", cls.folder / "one", *TINY)
        assert done.returncode == 0, done.stderr
        shutil.copytree(cls.folder / "one", cls.folder / "two")
        cls.link = cls.folder / "link"
        cls.link.symlink_to(cls.data)
        (cls.folder / "link-to-one").symlink_to(cls.folder / "one")

    def refuse(self, message, *arguments):
        before = digests(self.folder)
        with self.subTest(" ".join(map(str, arguments))):
            self.expect_error(2, message, *arguments)
            self.assertEqual(digests(self.folder), before)

    def test_a_data_set_is_no_output(self):
        for command in ("reconstruct", "convert"):
            for out in (self.data, self.link, self.data / "images/..", self.folder / "missing/../link"):
                self.refuse("the data set itself", command, self.data, "-o", out)
            self.refuse("the data set itself", command, self.data / "transforms.json", "-o", self.data)
            self.refuse("the data set itself", command, self.link / "transforms.json", "-o", self.data)
        self.refuse("the data set itself", "render", self.folder / "one", "-o", self.data)
        self.refuse("a folder that is read", "eval", self.folder / "one", "--truth", self.data, "-o", self.link)

    def test_a_folder_with_images_or_masks_in_it_is_no_output(self):
        for command in ("reconstruct", "convert"):
            self.refuse("000.png in it", command, self.data, "-o", self.folder)
            self.refuse("000.png in it", command, self.data, "-o", self.link / "images")
            self.refuse("000.png in it", command, self.data, "-o", self.data / "mask")
            self.refuse("000.png in it", command, self.data / "sparse/0", "-o", self.data)

    def test_links_into_the_sources_are_not_written_through(self):
        for name in ("depth", "images"):
            out = self.folder / f"with-{name}"
            out.mkdir()
            (out / name).symlink_to(self.data / name)
            self.refuse(f"a link {name}", "reconstruct", self.data, "-o", out)
            self.refuse(f"a link {name}", "convert", self.data, "-o", out)

    def test_a_run_that_is_read_is_no_output(self):
        one, two = self.folder / "one", self.folder / "two"
        for out in (one, self.folder / "link-to-one"):
            self.refuse("a folder that is read", "merge", one, two, "-o", out)
            self.refuse("a folder that is read", "merge", two, one, "-o", out)
            self.refuse("a folder that is read", "render", one, "-o", out)
            self.refuse("a folder that is read", "eval", one, "-o", out)
            self.refuse("a folder that is read", "reconstruct", self.data, "-o", out, "--init", one, *TINY)

    def test_a_folder_in_the_data_set_may_be_an_output(self):
        data = self.folder / "own"
        shutil.copytree(self.data, data)
        for _ in range(2):
            self.succeed("reconstruct", data, "-o", data / "run", *TINY)
        self.succeed("convert", data, "-o", data / "undistorted")

    def test_a_failing_command_leaves_the_older_run(self):
        older = self.folder / "older"
        shutil.copytree(self.folder / "one", older)
        before = digests(older)
        most_bytes = (older / "voxels.ply").stat().st_size // 2
        for command in (["reconstruct", self.data, *TINY], ["merge", self.folder / "one", self.folder / "two"]):
            with self.subTest(command[0]):
                done = run_on_a_full_disc(*command, "-o", older, most_bytes=most_bytes)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertEqual(digests(older), before)
                self.assertFalse((older / ".partial").exists())

    def test_a_result_in_whose_place_is_a_folder_leaves_the_older_run(self):
        older = self.folder / "blocked"
        shutil.copytree(self.folder / "one", older)
        (older / "depth/000.exr").unlink()
        (older / "depth/000.exr").mkdir()
        before = digests(older)
        self.assertEqual(run("reconstruct", self.data, "-o", older, *TINY, "--quiet").returncode, 1)
        kept = digests(older)
        self.assertIsNotNone(kept.pop("checkpoint/latest.roxel", None))  # without the folder it could go on
        kept.pop("checkpoint/previous.roxel", None)
        self.assertEqual(kept, before)
        self.assertFalse((older / ".partial").exists())

    def test_merge_replaces_an_older_run(self):
        older = self.folder / "merged"
        shutil.copytree(self.folder / "one", older)
        self.succeed("merge", self.folder / "one", self.folder / "two", "-o", older)
        self.assertEqual(files_below(older), ["summary.json", "volume.vdb", "voxels.ply"])

    def test_convert_of_a_broken_image_leaves_nothing(self):
        broken = self.folder / "broken"
        shutil.copytree(self.data, broken)
        (broken / "images/003.png").write_bytes((broken / "images/003.png").read_bytes()[:500])
        out = self.folder / "deep/converted"
        self.expect_error(2, "003.png", "convert", broken, "-o", out, "--threads", 1, "--quiet")
        self.assertFalse((self.folder / "deep").exists())
        self.succeed("convert", self.data, "-o", out)
        before = digests(out)
        self.expect_error(2, "003.png", "convert", broken, "-o", out, "--threads", 1, "--quiet")
        self.assertEqual(digests(out), before)


class Interrupt(Case):
    """Ctrl-C at different moments: code 130 soon, one line, and nothing half-written."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="roxel-cli-"))
        cls.data = cls.folder / "data"
        cls.synth(cls.data, 8, "160x120")
        cls.run_folder = cls.folder / "run"
        done = run("reconstruct", cls.data, "-o", cls.run_folder, *TINY)
        assert done.returncode == 0, done.stderr

    PATIENCE_S = 10  # a second or two on an idle machine; builds and sanitizers share it

    def interrupt(self, out, moment, *arguments, number=signal.SIGINT):
        """Starts a run and signals it when `moment` is said; what it said, and how long it took to end."""
        job, said = start_until(moment, "reconstruct", self.data, "-o", out, *arguments)
        start = time.monotonic()
        job.send_signal(number)
        out_text, rest = job.communicate(timeout=60)
        self.assertLess(time.monotonic() - start, self.PATIENCE_S)
        self.assertEqual(job.returncode, 130, said + rest)
        self.assertEqual((said + rest).splitlines()[-1], "roxel: error: interrupted")
        self.assertEqual(out_text, "")

    LONG = ["--resolution", "128", "--levels", "2", "--passes", "200", "--all-passes"]

    def test_in_the_passes_leaves_nothing(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            out = self.folder / "fresh/run"
            self.interrupt(out, "level 1/2 pass 1/", *self.LONG, number=number)
            self.assertFalse((self.folder / "fresh").exists())

    def test_in_the_passes_leaves_an_older_run_as_it_was(self):
        out = self.folder / "older"
        shutil.copytree(self.run_folder, out)
        before = digests(out)
        self.interrupt(out, "level 1/2 pass 1/", *self.LONG)
        self.assertEqual(digests(out), before)

    def test_after_the_passes_leaves_an_older_run_as_it_was(self):
        out = self.folder / "older-late"
        shutil.copytree(self.run_folder, out)
        before = digests(out)
        self.interrupt(out, "writing", "--resolution", "96", "--levels", "1", "--passes", "1", "--no-report")
        kept = digests(out)
        self.assertIsNotNone(kept.pop("checkpoint/latest.roxel", None))  # resume_test.py goes on from such
        self.assertEqual(kept, before)
        self.assertFalse((out / ".partial").exists())

    def test_while_a_run_is_read_ends_in_order(self):
        run_folder = self.folder / "to-read"
        shutil.copytree(self.run_folder, run_folder)
        summary = (run_folder / "summary.json").read_text()
        (run_folder / "summary.json").unlink()
        os.mkfifo(run_folder / "summary.json")
        out = self.folder / "never"
        for command in (["eval", run_folder], ["render", run_folder], ["merge", run_folder, self.folder]):
            with self.subTest(command[0]):
                job = subprocess.Popen([program.ROXEL, *map(str, command), "-o", str(out)], stderr=subprocess.PIPE, text=True)
                with open(run_folder / "summary.json", "w") as pipe:  # opens when roxel does
                    job.send_signal(signal.SIGINT)
                    pipe.write(summary)
                self.assertEqual((job.communicate(timeout=60)[1], job.returncode), ("roxel: error: interrupted\n", 130))
                self.assertFalse(out.exists())

    def test_while_a_data_set_is_read_ends_in_order(self):
        slow = self.folder / "slow"
        shutil.copytree(self.data, slow)
        cameras = slow / "transforms.json"
        cameras.write_text(cameras.read_text() + " " * 50_000_000)
        out = self.folder / "never"
        for command in ("reconstruct", "convert"):
            with self.subTest(command):
                job = subprocess.Popen([program.ROXEL, command, str(cameras), "-o", str(out)], stderr=subprocess.PIPE, text=True)
                while job.poll() is None and not self.has_open(job, cameras):
                    pass
                job.send_signal(signal.SIGINT)
                self.assertEqual((job.communicate(timeout=60)[1], job.returncode), ("roxel: error: interrupted\n", 130))
                self.assertFalse(out.exists())

    @staticmethod
    def has_open(job, file):
        try:
            return any(f.exists() and f.samefile(file) for f in pathlib.Path(f"/proc/{job.pid}/fd").iterdir())
        except OSError:  # it has just been closed
            return False


class Terminal(Case):
    def test_a_bar_is_drawn_over_at_most_ten_times_a_second(self):
        import pty
        ours, theirs = pty.openpty()
        start = time.monotonic()
        job = subprocess.Popen([program.ROXEL, "reconstruct", str(self.data), "-o", str(self.folder / "run"), "--resolution", "32",
                                "--all-passes"], stdout=subprocess.DEVNULL, stderr=theirs)
        os.close(theirs)
        seen = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # the other end is closed
                break
            if not part:
                break
            seen += part
        self.assertEqual(job.wait(timeout=60), 0)
        seconds = time.monotonic() - start
        drawn = seen.decode().split("\r\033[K")
        self.assertEqual(drawn[0], "")
        self.assertEqual(drawn[-1], "", "the bar stays behind")
        self.assertLess(len(drawn), 10 * seconds + 5)
        percents = [int(m[1]) for m in (re.search(r"\] +(\d+) %", d) for d in drawn) if m]
        self.assertGreater(len(percents), 3)
        self.assertEqual(percents, sorted(percents))
        self.assertIn("volume [", seen.decode())
        self.assertRegex(seen.decode(), r"level \d/3, pass \d/8")


if __name__ == "__main__":
    main()
