#!/usr/bin/env python3
"""What whole runs cost, and how that grows with photographs, voxels and threads.

    end_to_end.py [--roxel PROGRAM] [--work DIR] [--images N] [--size WxH] [--resolution R] [--repeat N] [-- OPTIONS]

Makes a synthetic head on a turntable with N, 2 N and 4 N photographs, and runs `roxel reconstruct` on it with all that it does by default,
or with OPTIONS. Prints wall and processor time, peak memory beside what `roxel info` announced, live voxels, exponents fitted in the logarithm,
and the speed-up by a second thread. The machine should have nothing else to do; of several runs (--repeat) the fastest counts.
"""

import argparse
import dataclasses
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import time


@dataclasses.dataclass
class Cost:
    wall: float = math.inf
    cpu: float = 0.0
    peak: int = 0  # bytes, resident
    announced: float = 0.0  # bytes
    voxels: int = 0
    images: int = 0


def spent(command):
    """Wall and processor seconds and peak resident bytes of a command."""
    begun = time.monotonic()
    child = subprocess.Popen([str(part) for part in command], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    wall = time.monotonic() - begun
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0: raise SystemExit(f"end_to_end: {' '.join(map(str, command))}: exit code {child.returncode}")
    return wall, usage.ru_utime + usage.ru_stime, 1024 * usage.ru_maxrss


def exponent(sizes, costs):
    """Slope of log cost over log size."""
    xs, ys = [math.log(s) for s in sizes], [math.log(c) for c in costs]
    mx, my = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)


class Bench:
    def __init__(self, options):
        self.options = options
        self.options.work.mkdir(parents=True, exist_ok=True)

    def data(self, images):
        folder = self.options.work / f"head-{images}-{self.options.size}"
        if not (folder / "transforms.json").exists():
            shutil.rmtree(folder, ignore_errors=True)
            spent([self.options.roxel, "synth", "head", "-o", folder, "--images", images, "--size", self.options.size, "--samples", 4, "--quiet"])
        return folder

    def run(self, images, resolution, threads):
        data, run = self.data(images), self.options.work / "run"
        arguments = [data, "--resolution", resolution, "--threads", threads, *self.options.options]
        info = json.loads(subprocess.run([self.options.roxel, "info", *map(str, arguments), "--json", "--quiet"], check=True, capture_output=True).stdout)
        best = Cost(images=images, announced=announced_bytes(info))
        for _ in range(self.options.repeat):
            shutil.rmtree(run, ignore_errors=True)
            wall, cpu, peak = spent([self.options.roxel, "reconstruct", *arguments, "-o", run, "--quiet"])
            if wall < best.wall: best.wall, best.cpu = wall, cpu
            best.peak = max(best.peak, peak)
            best.voxels = json.loads((run / "summary.json").read_text())["levels"][-1]["voxels_in_box"]
        shutil.rmtree(run)
        return best


def announced_bytes(info):
    return info["estimate"]["memory_bytes"]


def row(first, cost):
    print(f"{first:>11} {cost.images:>7} {cost.voxels:>10} {cost.wall:>8.1f} {cost.cpu:>8.1f} {cost.peak / 2**20:>10.0f} {cost.announced / 2**20:>14.0f}", flush=True)


def head(first):
    print(f"\n{first:>11} {'images':>7} {'voxels':>10} {'wall s':>8} {'cpu s':>8} {'peak MiB':>10} {'announced MiB':>14}")


def main():
    here = pathlib.Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--roxel", type=pathlib.Path, default=here / "build/release/apps/roxel/roxel")
    parser.add_argument("--work", type=pathlib.Path, default=here / "build/end-to-end")
    parser.add_argument("--images", type=int, default=12)
    parser.add_argument("--size", default="400x300")
    parser.add_argument("--resolution", type=int, default=96)
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("options", nargs="*", help="for roxel reconstruct and roxel info")
    options = parser.parse_args()
    bench, n, threads = Bench(options), options.images, os.cpu_count()

    head("resolution")
    counts = [n, 2 * n, 4 * n]
    by_images = [bench.run(count, options.resolution, threads) for count in counts]
    for cost in by_images: row(options.resolution, cost)
    print(f"exponent in images: processor time {exponent(counts, [c.cpu for c in by_images]):.2f}, wall time "
          f"{exponent(counts, [c.wall for c in by_images]):.2f}, peak memory {exponent(counts, [c.peak for c in by_images]):.2f}")

    head("resolution")
    sides = [options.resolution, round(options.resolution * math.sqrt(2) / 8) * 8, 2 * options.resolution]
    by_side = [bench.run(2 * n, side, threads) for side in sides]
    for side, cost in zip(sides, by_side): row(side, cost)
    voxels = [c.voxels for c in by_side]
    print(f"exponent in voxels: processor time {exponent(voxels, [c.cpu for c in by_side]):.2f}, wall time "
          f"{exponent(voxels, [c.wall for c in by_side]):.2f}")

    head("threads")
    by_threads = [bench.run(2 * n, options.resolution, count) for count in (1, 2)]
    for count, cost in zip((1, 2), by_threads): row(count, cost)
    print(f"speed-up by a second thread: {by_threads[0].wall / by_threads[1].wall:.2f}")


if __name__ == "__main__":
    sys.exit(main())
