"""Scripts that measure into a csv, row by row, and draw it; or draw again what was kept."""
import csv
import sys
from pathlib import Path


def run(usage, columns, measure, draw):
    """Arguments: [BUILD_FOLDER] OUTPUT_STEM. measure(build) gives rows; draw(rows, stem) takes dicts."""
    if len(sys.argv) not in (2, 3):
        sys.exit(usage)
    stem = sys.argv[-1]
    if len(sys.argv) == 3:
        with open(stem + ".csv", "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            for row in measure(Path(sys.argv[1])):
                writer.writerow(row)
                file.flush()
    with open(stem + ".csv", newline="") as file:
        draw(list(csv.DictReader(file)), stem)
