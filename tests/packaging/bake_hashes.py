"""`bake_hashes.py GRAPH FOLDER LAST`: bakes the frames from 1 to LAST with the package on the path; prints the hashes of all states
and meshes."""
import hashlib
import json
import sys
from pathlib import Path

import sunder

graph, folder = sys.argv[1], Path(sys.argv[2])
sunder.bake(graph, folder, frames=(1, int(sys.argv[3])))
files = sorted(p for p in folder.rglob("*") if p.is_file() and p.name != "manifest.json")
print("RESULT", json.dumps({str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}))
