// Runs a fuzz target without libFuzzer: the kept corpus, then mutations of it for a while, the same ones in every run.
//
//   DRIVER CORPUS SECONDS LAST_INPUT    the input in hand is in the file LAST_INPUT, for when it does not come back
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_target.h"

namespace {

constexpr size_t kMostBytes = 1 << 16;
constexpr unsigned kSecondsOfOne = 60;  // after which an input hangs; the slowest takes one under sanitizers

/// Numbers and words that readers trip over.
constexpr std::array kTokens = {"0",
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
                                "\t",
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
                                "1e",
                                "null",
                                "true",
                                "{}",
                                "[]",
                                "[[",
                                "\"\"",
                                "\"@a.b\"",
                                "\\ud800",
                                "..",
                                "/",
                                "~",
                                "{\"keys\": [[1, 2]]}"};

class Mutator {
public:
    std::string mutate(std::string bytes, const std::string& other) {
        for (uint32_t n = 1 + below(4); n > 0; --n) step(bytes, other);
        if (bytes.size() > kMostBytes) bytes.resize(kMostBytes);
        return bytes;
    }
    uint32_t below(size_t n) { return n == 0 ? 0 : static_cast<uint32_t>(random_() % n); }

private:
    void step(std::string& io, const std::string& other) {
        const size_t at = below(io.size() + 1);
        switch (below(9)) {
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
                const size_t end = io.find_first_of(" \n\t,]}", at);
                io.replace(at, end == io.npos ? io.npos : end - at, kTokens[below(kTokens.size())]);
                break;
            }
            case 6:  // four bytes of one value
                for (size_t k = at; k < at + 4 && k < io.size(); ++k) io[k] = static_cast<char>(at % 2 ? 0xff : 0x7f);
                break;
            case 7: {  // another's line in place of one
                const size_t begin = io.rfind('\n', at) + 1, end = std::min(io.find('\n', at), io.size());
                const size_t from = other.rfind('\n', below(other.size())) + 1;
                if (begin <= end) io.replace(begin, end - begin, other.substr(from, other.find('\n', from) - from));
                break;
            }
            default:  // go on as another file does
                io = io.substr(0, at) + other.substr(below(other.size()));
        }
    }
    std::mt19937 random_;
};

/// The input in hand, in a file that is whole however the process ends.
class LastInput {
public:
    explicit LastInput(const char* path) : file_(open(path, O_RDWR | O_CREAT | O_TRUNC, 0644)) {
        sunder::testing::require(file_ >= 0 && ftruncate(file_, kMostBytes) == 0,
                                 "the last input's file cannot be made");
        memory_ = mmap(nullptr, kMostBytes, PROT_WRITE, MAP_SHARED, file_, 0);
        sunder::testing::require(memory_ != MAP_FAILED, "the last input's file cannot be mapped");
    }
    void keep(const std::string& bytes) {
        sunder::testing::require(ftruncate(file_, static_cast<off_t>(bytes.size())) == 0,
                                 "the last input's file cannot be cut");
        std::memcpy(memory_, bytes.data(), bytes.size());
    }

private:
    int file_;
    void* memory_ = nullptr;
};

std::vector<std::string> read_corpus(const char* folder) {
    std::vector<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    std::vector<std::string> corpus;
    for (const auto& path : paths) {
        std::ifstream file(path, std::ios::binary);
        corpus.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
        sunder::testing::require(corpus.back().size() <= kMostBytes, "a file of the corpus is too large");
    }
    return corpus;
}

}  // namespace

int main(int argc, char** argv) {
    using Clock = std::chrono::steady_clock;
    if (argc != 4) return std::fprintf(stderr, "%s CORPUS SECONDS LAST_INPUT\n", argv[0]), 2;
    const std::vector<std::string> corpus = read_corpus(argv[1]);
    const auto end = Clock::now() + std::chrono::duration<double>(std::strtod(argv[2], nullptr));
    LastInput last(argv[3]);
    sunder::testing::require(!corpus.empty(), "there is no corpus");
    Mutator mutator;
    size_t n = 0;
    for (; n < corpus.size() || Clock::now() < end; ++n) {
        const std::string& seed = corpus[n % corpus.size()];
        const std::string bytes = n < corpus.size() ? seed : mutator.mutate(seed, corpus[mutator.below(corpus.size())]);
        last.keep(bytes);
        alarm(kSecondsOfOne);
        LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
    }
    std::printf("%zu inputs taken or refused, %zu of them kept\n", n, corpus.size());
    return 0;
}
