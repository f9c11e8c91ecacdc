// What cutting costs and gives: mesh x method x pieces, as a table (docs/meshes.md).
//
//   fracture_table [--pieces N,N,...] [--methods voronoi,kmeans] [--split N] MESH...
//
// --split splits each triangle in four, N times over. Each cut is made in a process of its own, on one thread, so that
// processor time and peak memory are its own.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/mesh_checks.h"
#include "fracture_tools/mesh/mesh_io.h"
#include "tests/support/finer_mesh.h"

namespace {

using namespace sunder;

struct Job {
    std::string path;
    CutMethod method;
    int pieces, split;
};

struct Row {
    double read_s = 0, cut_s = 0, volume_error = 0, least = 0, largest = 0;  // CPU s; share; shares of the mean volume
    size_t triangles = 0, pieces = 0, not_closed = 0, warnings = 0;
    char told[200] = {};
};

double cpu_seconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * double(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

void tell(Row& io_row, const std::string& sentence) {
    std::snprintf(io_row.told, sizeof io_row.told, "%s", sentence.c_str());
}

Row cut(const Job& job) {
    Row row;
    const double start = cpu_seconds();
    const Result<TriMesh> mesh = read_mesh(job.path);
    row.read_s = cpu_seconds() - start;
    if (!mesh) return tell(row, mesh.error().what), row;
    const TriMesh fine = finer_mesh(*mesh, job.split);
    row.triangles = fine.triangles.size();
    PrefractureSettings settings;
    settings.method = job.method, settings.pieces = job.pieces, settings.threads = 1;
    const double read = cpu_seconds();
    const Result<FragmentSet> set = prefracture(fine, settings, "mesh");
    row.cut_s = cpu_seconds() - read;
    if (!set) return tell(row, set.error().what), row;
    row.pieces = set->fragments.size();
    double sum = 0;
    row.least = HUGE_VAL;
    const FragmentMeshes pieces(*set);
    for (uint32_t i = 0; i < set->fragments.size(); ++i) {
        const double v = set->fragments[i].volume;
        sum += v, row.least = std::min(row.least, v), row.largest = std::max(row.largest, v);
        row.not_closed += !check_mesh(pieces.mesh(FragmentId(i))).is_solid();
    }
    row.volume_error = std::abs(sum - set->source_volume) / set->source_volume;
    const double mean = sum / double(set->fragments.size());
    row.least /= mean, row.largest /= mean;
    row.warnings = set->warnings.size();
    if (!set->warnings.empty()) {
        const std::string& last = set->warnings.back();
        tell(row, last.substr(last.find(": ") + 2, last.find('(') - last.find(": ") - 2));
    }
    return row;
}

/// Runs a cut in a child and prints its row. False: the child did not come back whole.
bool run(const Job& job) {
    int channel[2];
    if (pipe(channel) != 0) return false;
    std::fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
        const Row row = cut(job);
        const bool sent = write(channel[1], &row, sizeof row) == ssize_t(sizeof row);
        _exit(sent ? 0 : 1);
    }
    close(channel[1]);
    Row row;
    const bool received = read(channel[0], &row, sizeof row) == ssize_t(sizeof row);
    close(channel[0]);
    int status = 0;
    rusage usage{};
    wait4(child, &status, 0, &usage);
    const std::string name = std::filesystem::path(job.path).stem().string();
    const char* method = job.method == CutMethod::voronoi ? "voronoi" : "kmeans";
    std::printf("| %s | %zu | %s | %d | ", name.c_str(), row.triangles, method, job.pieces);
    if (!received)
        std::printf("| | | | | | the process ended with status %d |\n", status);
    else if (row.pieces == 0)
        std::printf("| %.2f | %ld | | | | refused: %s |\n", row.cut_s, usage.ru_maxrss / 1024, row.told);
    else
        std::printf("%zu | %.2f | %ld | %.1e | %zu of %zu | %.2f - %.2f | %s |\n", row.pieces, row.cut_s,
                    usage.ru_maxrss / 1024, row.volume_error, row.pieces - row.not_closed, row.pieces, row.least,
                    row.largest, row.told);
    return received;
}

std::vector<std::string> split(const std::string& list) {
    std::vector<std::string> parts;
    std::istringstream stream(list);
    for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
    return parts;
}

}  // namespace

int main(int argc, char** argv) {
    std::vector<std::string> pieces = {"20", "300"}, methods = {"voronoi", "kmeans"}, meshes;
    int times = 0;
    for (int k = 1; k < argc; ++k) {
        const std::string word = argv[k];
        if (word == "--split" && k + 1 < argc)
            times = std::stoi(argv[++k]);
        else if ((word == "--pieces" || word == "--methods") && k + 1 < argc)
            (word == "--pieces" ? pieces : methods) = split(argv[++k]);
        else
            meshes.push_back(word);
    }
    if (meshes.empty()) {
        std::fprintf(stderr,
                     "usage: fracture_table [--pieces N,N,...] [--methods voronoi,kmeans] [--split N] MESH...\n");
        return 2;
    }
    std::printf(
        "| mesh | triangles | method | wanted | pieces | CPU s | peak MB | volume error | closed | smallest - largest, "
        "of the mean | told |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
    bool whole = true;
    for (const std::string& mesh : meshes)
        for (const std::string& method : methods)
            for (const std::string& n : pieces)
                whole &= run({mesh, method == "kmeans" ? CutMethod::kmeans : CutMethod::voronoi, std::stoi(n), times});
    return whole ? 0 : 1;
}
