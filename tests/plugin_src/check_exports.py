"""The library shows exactly the functions of its header. Arguments: library, header, nm."""
import re
import subprocess
import sys

library, header, nm = sys.argv[1:]
shown = {
    line.split()[-1]
    for line in subprocess.run(
        [nm, "-D", "--defined-only", library], capture_output=True, text=True, check=True
    ).stdout.splitlines()
}
with open(header, encoding="utf-8") as file:
    declared = set(re.findall(r"^SUNDER_API [^;(]*?\b(sunder_\w+)\(", file.read(), re.M))
assert len(declared) > 30, "the header was not understood"
for name in sorted(shown ^ declared):
    print(name, "is declared but not there" if name in declared else "is visible but not declared")
sys.exit(shown != declared)
