#!/usr/bin/env python3
"""Tests of checkpoints, through the program itself: runs are stopped, killed, starved of disc and damaged, and go on.

    resume_test.py ROXEL [unittest arguments]
"""

import json
import pathlib
import random
import shutil
import signal
import subprocess
import time

import program
from program import Case, digests, files_below, main, numbers, run, start_until

# Passes of some hundredths of a second each, and a checkpoint after each.
OFTEN = ["--resolution", "40", "--levels", "2", "--passes", "8", "--all-passes", "--no-mesh", "--no-refine",
         "--checkpoint-interval", "0"]


def results(folder):
    """Digests of what a run found. volume.vdb has an identity of its own in each file, and pictures of pages hold times."""
    kept = {name: value for name, value in digests(folder).items()
            if name.endswith((".ply", ".exr", ".png"))}
    assert any(name.startswith("depth/") for name in kept), kept
    return kept, numbers(json.loads((pathlib.Path(folder) / "summary.json").read_text()))


def lasting(folder):
    """Files but those that a process was killed over."""
    return [name for name in files_below(folder) if ".tmp." not in name] if pathlib.Path(folder).exists() else []


class Resume(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.whole = cls.folder / "whole"
        done = run("reconstruct", cls.data, "-o", cls.whole, *OFTEN, "--quiet")
        assert done.returncode == 0, done.stderr
        cls.expected = results(cls.whole)

    def stop_at(self, out, moment, *arguments, number=signal.SIGKILL):
        """Starts a run and signals it when `moment` is said: its exit code, and all that it said."""
        job, said = start_until(moment, "reconstruct", self.data, "-o", out, *OFTEN, *arguments)
        job.send_signal(number)
        rest = job.communicate(timeout=60)[1]
        return job.returncode, said + rest

    def resume(self, out, *arguments):
        return self.succeed("reconstruct", self.data, "-o", out, *OFTEN, "--resume", *arguments)

    def notes(self, out):
        return [note for note in json.loads((out / "summary.json").read_text())["notes"] if note.startswith("resumed after")]

    def test_a_finished_run_keeps_no_checkpoint(self):
        self.assertFalse((self.whole / "checkpoint").exists())

    def test_what_a_killed_run_had_put_aside_goes(self):
        out = self.folder / "untidy"
        for folder in (".aside/layers", ".partial/depth"):
            (out / folder).mkdir(parents=True)
            (out / folder / "000.kept").write_text("half a file")
        self.succeed("reconstruct", self.data, *OFTEN, "-o", out)
        self.assertEqual([path.name for path in out.iterdir() if path.name.startswith(".")], [])

    def test_killed_at_twenty_random_moments_it_ends_as_if_nothing_had_happened(self):
        out = self.folder / "killed"
        chance = random.Random(1)
        went_on = 0
        for _ in range(20):
            went_on += (out / "checkpoint/latest.roxel").exists()
            job = subprocess.Popen([program.ROXEL, "reconstruct", str(self.data), "-o", str(out), *OFTEN, "--resume"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            # Counted in what it says: how long a pass takes depends on what else the machine does.
            for _ in range(chance.randrange(12)):
                job.stderr.readline()
            time.sleep(chance.uniform(0, 0.1))
            job.kill()
            said = job.communicate(timeout=60)[1]
            self.assertIn(job.returncode, (0, -signal.SIGKILL), said)
        self.resume(out)
        self.assertEqual(results(out), self.expected)
        self.assertGreater(went_on, 4)
        self.assertFalse((out / "checkpoint").exists())
        self.assertEqual(files_below(out), files_below(self.whole))

    def test_a_run_killed_in_its_second_level_goes_on_there(self):
        out = self.folder / "second-level"
        self.stop_at(out, "level 2/2 pass 4/")
        done = self.resume(out)
        self.assertEqual(results(out), self.expected)
        self.assertRegex(self.notes(out)[0], r"^resumed after level 2, pass [345]$")
        summary = json.loads((out / "summary.json").read_text())
        self.assertGreater(summary["seconds"], sum(p["seconds"] for p in summary["passes"]))  # of all parts
        self.assertNotIn("level 1/2", done.stderr)

    def test_after_ctrl_c_it_says_how_to_go_on(self):
        out = self.folder / "interrupted"
        code, said = self.stop_at(out, "level 1/2 pass 3/", number=signal.SIGINT)
        self.assertEqual(code, 130)
        self.assertIn("--resume goes on from it", said)
        self.assertEqual(said.splitlines()[-1], "roxel: error: interrupted")
        self.resume(out)
        self.assertEqual(results(out), self.expected)

    def test_threads_may_change_when_it_goes_on(self):
        out = self.folder / "threads"
        self.stop_at(out, "level 1/2 pass 5/", "--threads", "1")
        self.resume(out, "--threads", "3")
        self.assertEqual(results(out), self.expected)

    def test_an_older_run_stays_until_the_new_one_is_whole(self):
        out = self.folder / "older"
        shutil.copytree(self.whole, out)
        before = digests(out)
        self.stop_at(out, "level 2/2 pass 2/", "--noise", "9")
        left = {name: digests(out)[name] for name in lasting(out) if not name.startswith(("checkpoint/", ".partial"))}
        self.assertEqual(left, before)
        self.resume(out, "--noise", "9")
        self.assertNotEqual(results(out), self.expected)

    def test_of_other_options_it_is_refused_by_name(self):
        out = self.folder / "options"
        self.stop_at(out, "level 1/2 pass 3/")
        before = lasting(out)
        self.expect_error(2, "options.noise ", "reconstruct", self.data, "-o", out, *OFTEN, "--noise", "9", "--resume")
        self.assertEqual(lasting(out), before)
        self.resume(out)
        self.assertEqual(results(out), self.expected)

    def test_a_damaged_checkpoint_falls_back_to_the_one_before(self):
        out = self.folder / "damaged"
        self.stop_at(out, "level 1/2 pass 5/")
        latest, previous = out / "checkpoint/latest.roxel", out / "checkpoint/previous.roxel"
        self.assertTrue(latest.exists() and previous.exists())
        content = bytearray(latest.read_bytes())
        content[len(content) // 2] ^= 1
        latest.write_bytes(content)
        said = self.resume(out).stderr
        self.assertIn("latest.roxel: found content that does not fit its checksum", said)
        self.assertIn("going on from the checkpoint before it", said)
        self.assertEqual(results(out), self.expected)

    def test_with_both_damaged_it_is_refused(self):
        out = self.folder / "both"
        self.stop_at(out, "level 1/2 pass 5/")
        for name in ("latest", "previous"):
            (out / f"checkpoint/{name}.roxel").write_bytes(b"roxel checkpoint\n")
        self.expect_error(2, "previous.roxel: found content that does not fit its checksum", "reconstruct", self.data, "-o", out, *OFTEN,
                          "--resume", "--quiet")
        self.assertEqual(lasting(out), ["checkpoint/latest.roxel", "checkpoint/previous.roxel"])

    def test_without_resume_it_starts_anew_and_says_so(self):
        out = self.folder / "anew"
        self.stop_at(out, "level 1/2 pass 3/")
        done = self.succeed("reconstruct", self.data, "-o", out, *OFTEN)
        self.assertIn("--resume would have gone on from it", done.stderr)
        self.assertEqual(self.notes(out), [])
        self.assertEqual(results(out), self.expected)

    def test_without_a_checkpoint_resume_starts_anew_and_says_so(self):
        out = self.folder / "nothing"
        self.assertIn("no checkpoint to go on from", self.resume(out).stderr)
        self.assertEqual(results(out), self.expected)

    def test_no_checkpoints_and_the_interval_decide_what_is_kept(self):
        for name, arguments, kept in [("never", ["--no-checkpoints"], []),
                                      ("seldom", ["--checkpoint-interval", "1000"], []),
                                      ("often", [], ["checkpoint/latest.roxel", "checkpoint/previous.roxel"])]:
            with self.subTest(name):
                out = self.folder / name
                self.stop_at(out, "level 1/2 pass 4/", *arguments)
                self.assertEqual(lasting(out), kept)
        out = self.folder / "seldom"  # the end of a level counts, however young the last one is
        self.stop_at(out, "level 2/2 pass 2/", "--checkpoint-interval", "1000")
        self.assertEqual(lasting(out), ["checkpoint/latest.roxel"])


class FullDisc(Case):
    def test_a_full_disc_keeps_the_last_checkpoint_and_with_room_the_run_goes_on(self):
        """On a file system of a few MB in memory, in a mount namespace of its own."""
        disc = self.folder / "disc"
        disc.mkdir()
        out = disc / "run"
        inside = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c"]
        if subprocess.run([*inside, f"mount -t tmpfs -o size=1m none {disc}"], capture_output=True).returncode != 0:
            self.skipTest("mounting in a namespace is not allowed here")
        roxel = f"{program.ROXEL} reconstruct {self.data} -o {out} {' '.join(OFTEN)} --resume"
        whole = self.folder / "whole"
        self.succeed("reconstruct", self.data, "-o", whole, *OFTEN, "--quiet")
        size = 64 * 1024  # KiB: all of a run fits
        script = f"""
            mount -t tmpfs -o size={size}k none {disc} && mkdir {out} || exit 99
            dd if=/dev/zero of={disc}/ballast bs=1k count={size - 2600} 2>/dev/null || exit 98
            {roxel}; echo "first $?"; ls {out}/checkpoint
            rm {disc}/ballast
            {roxel}; echo "second $?"
            cp -r {out} {self.folder}/grown
        """
        done = subprocess.run([*inside, script], capture_output=True, text=True, timeout=120)
        self.assertIn("first 1\nlatest.roxel", done.stdout, done.stderr)
        self.assertIn("second 0\n", done.stdout, done.stderr)
        self.assertIn("latest.roxel: writing failed (disc full, or no permission?); going on without this checkpoint",
                      done.stderr)
        self.assertEqual(results(self.folder / "grown"), results(whole))
        notes = json.loads((self.folder / "grown/summary.json").read_text())["notes"]
        self.assertTrue(any(note.startswith("resumed after") for note in notes), notes)


if __name__ == "__main__":
    main()
