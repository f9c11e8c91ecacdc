// Runs a fuzz target without libFuzzer: seeds, then a fixed number of mutations of them, the same in every run.
//
//   DRIVER RUNS [LAST_INPUT]    the input of the run in hand is in the file LAST_INPUT, for when it does not come back
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/mesh_seeds.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

/// Numbers that readers trip over.
const std::vector<std::string> kTokens = {"0",
                                          "-1",
                                          "4294967295",
                                          "4294967296",
                                          "18446744073709551615",
                                          "99999999999",
                                          "nan",
                                          "-inf",
                                          "1e999",
                                          "1e-320",
                                          "\n",
                                          "\r",
                                          "element",
                                          "list",
                                          "end_header",
                                          "property",
                                          "uchar",
                                          "double",
                                          "OFF",
                                          "3 0 1 2",
                                          "",
                                          "0x10",
                                          "+",
                                          "-",
                                          "1e"};

class Mutator {
public:
    explicit Mutator(uint32_t seed) : random_(seed) {}

    std::string mutate(std::string bytes, const std::string& other) {
        for (uint32_t n = 1 + below(4); n > 0; --n) step(bytes, other);
        return bytes;
    }
    uint32_t below(size_t n) { return n == 0 ? 0 : static_cast<uint32_t>(random_() % n); }

private:
    void step(std::string& io, const std::string& other) {
        const size_t at = below(io.size() + 1);
        switch (below(8)) {
            case 0:  // a bit
                if (at < io.size()) io[at] = static_cast<char>(io[at] ^ (1 << below(8)));
                break;
            case 1:  // a byte
                if (at < io.size()) io[at] = static_cast<char>(below(256));
                break;
            case 2:  // cut off
                io.resize(at);
                break;
            case 3:  // take out
                io.erase(at, below(32));
                break;
            case 4:  // double a part
                io.insert(at, io.substr(at, below(64)));
                break;
            case 5: {  // another number or word in place of one
                const size_t end = io.find_first_of(" \n", at);
                io.replace(at, end == io.npos ? io.npos : end - at, kTokens[below(kTokens.size())]);
                break;
            }
            case 6:  // four bytes of one value
                for (size_t k = at; k < at + 4 && k < io.size(); ++k) io[k] = static_cast<char>(at % 2 ? 0xff : 0x7f);
                break;
            default:  // go on as another file does
                io = io.substr(0, at) + other.substr(below(other.size()));
        }
    }
    std::mt19937 random_;
};

}  // namespace

int main(int argc, char** argv) {
    const long runs = argc > 1 ? std::strtol(argv[1], nullptr, 10) : 2000;
    const std::vector<std::string> seeds = sunder::testing::mesh_seeds();
    Mutator mutator(1);
    for (long run = 0; run < runs; ++run) {
        const std::string& seed = seeds[static_cast<size_t>(run) % seeds.size()];
        const std::string bytes =
            run < static_cast<long>(seeds.size()) ? seed : mutator.mutate(seed, seeds[mutator.below(seeds.size())]);
        if (argc > 2) std::ofstream(argv[2], std::ios::binary) << bytes;
        LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
    }
    std::printf("%ld inputs read or refused\n", runs);
    return 0;
}
