"""No library or program calls a function of libm that is not exact: these differ from processor to processor.

Arguments: readelf, and the files to look at. What may stay has one right result, which every libm gives."""
import re
import subprocess
import sys

EXACT = {
    name + kind
    for kind in ("", "f", "l")
    for name in (
        "sqrt fma fmod remainder frexp ldexp scalbn scalbln ilogb logb modf copysign nextafter nexttoward "
        "floor ceil trunc round rint nearbyint lround llround lrint llrint fabs fmin fmax fdim"
    ).split()
} | {
    "fegetround", "fesetround",  # of libstdc++, where it is linked in
    "nan",  # has one result
    "logl",  # of std::generate_canonical in tests and benchmarks: how many draws a number takes, rounded up
}


def called(readelf, file):
    """(library, function) of all that `file` wants of shared libraries, by the versions that it asks each for."""
    text = subprocess.run([readelf, "--wide", "--version-info", "--dyn-syms", file],
                          capture_output=True, text=True, check=True).stdout
    needs = re.search(r"^Version needs section.*?(?=^\S|\Z)", text, re.M | re.S)
    library_of = {}
    for library, versions in re.findall(r"File: (\S+)(.*?)(?=File: |\Z)", needs[0] if needs else "", re.S):
        library_of |= dict.fromkeys(re.findall(r"Name: .*Version: (\d+)", versions), library)
    return {(library_of[version], name) for name, version in re.findall(r" UND (\w+)@\S+ \((\d+)\)", text)}


readelf, *files = sys.argv[1:]
wrong = False
for file in files:
    names = called(readelf, file)
    assert names, f"{file} calls no library: it was not understood"
    for library, name in sorted(names):
        if library.startswith("libm.so") and name not in EXACT:
            print(f"{file} calls {name} of libm: give it a name in solver/data/libm_names.cpp, and --wrap it")
            wrong = True
sys.exit(wrong)
