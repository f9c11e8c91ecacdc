"""Two builds of the benchmark against one another, run by turns so that both see the same moods of the machine.

    python3 tests/benchmarks/bench/compare.py BASE_BENCH HEAD_BENCH [--rounds N] [SCENE ...] [-- options of the benchmark]

Prints, for each scene, method and number of threads, the least time a frame of each and head over base: below 1 is faster.
"""
import argparse
import csv
import subprocess
import sys
import tempfile
from pathlib import Path


def run(program, arguments):
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "bench.csv"
        subprocess.run([program, *arguments, "--repeats", "1", "--csv", table], check=True, stdout=subprocess.DEVNULL)
        with open(table, newline="") as file:
            return {(r["scene"], r["method"], r["threads"]): r for r in csv.DictReader(file)}


def compare(base, head, arguments, rounds):
    """{(scene, method, threads): {column: [least of base, least of head]}} and whether the last states are the same."""
    least, same = {}, {}
    for _ in range(rounds):
        for side, program in enumerate((base, head)):
            for key, row in run(program, arguments).items():
                for column in ("median_ms", "ns_group", "skin_ms"):
                    pair = least.setdefault(key, {}).setdefault(column, [float("inf")] * 2)
                    pair[side] = min(pair[side], float(row[column]))
                same.setdefault(key, set()).add(row["hash"])
    return least, {key: len(hashes) == 1 for key, hashes in same.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base")
    parser.add_argument("head")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("arguments", nargs="*", metavar="SCENE")
    options, rest = parser.parse_known_args()
    least, same = compare(options.base, options.head, options.arguments + rest, options.rounds)
    print(f"{'scene':10}{'method':12}{'th':>3}{'base ms':>10}{'head ms':>10}{'ratio':>7}{'ns/group':>18}{'ratio':>7}{'skin':>7}  bits")
    for key, columns in least.items():
        (ms0, ms1), (ns0, ns1), (skin0, skin1) = columns["median_ms"], columns["ns_group"], columns["skin_ms"]
        ratio = (lambda base, head, least: f"{head / base:7.2f}" if base > least else f"{'-':>7}")
        print(f"{key[0]:10}{key[1]:12}{key[2]:>3}{ms0:10.3f}{ms1:10.3f}{ratio(ms0, ms1, 0)}{ns0:9.1f}{ns1:9.1f}{ratio(ns0, ns1, 0.05)}{ratio(skin0, skin1, 0.01)}"
              f"  {'same' if same[key] else 'other'}")


if __name__ == "__main__":
    sys.exit(main())
