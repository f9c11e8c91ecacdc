// Whatever an artist brings is cut into closed pieces, or refused with the fault by name; and the documents tell what
// happens to each kind.
#include "tests/fracture_tools/ugly_meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <regex>
#include <sstream>

#include "fracture_tools/mesh/mesh_checks.h"
#include "tests/fracture_tools/voronoi/cut_checks.h"

namespace sunder {
namespace {

using testing::ugly_meshes;
using testing::UglyMesh;

struct Outcome {
    Result<FragmentSet> set;
    std::string told;  // warnings, or the error

    Outcome(const UglyMesh& ugly, CutMethod method) : set(cut(ugly, method)) {
        if (!set) {
            told = set.error().what;
            return;
        }
        for (const std::string& w : set->warnings) told += (told.empty() ? "" : "; ") + w.substr(w.find(": ") + 2);
    }

private:
    static Result<FragmentSet> cut(const UglyMesh& ugly, CutMethod method) {
        PrefractureSettings settings;
        settings.method = method;
        settings.pieces = 12;
        settings.sites.kind = SiteKind::poisson;
        settings.repair = ugly.repair;
        settings.threads = 1;
        return prefracture(ugly.make(), settings, "mesh");
    }
};

void expect_pieces(const FragmentSet& set) {
    double volume = 0;
    for (uint32_t i = 0; i < set.fragments.size(); ++i) {
        const MeshReport r = check_mesh(fragment_mesh(set, FragmentId(i)));
        EXPECT_TRUE(r.is_solid()) << "piece " << i << ": " << (r.faults.empty() ? "no volume" : r.faults[0]);
        volume += r.volume;
    }
    EXPECT_NEAR(volume, set.source_volume, 1e-9 * set.source_volume);
    EXPECT_GE(set.fragments.size(), 1u);
}

class Ugly : public ::testing::TestWithParam<UglyMesh> {};

TEST_P(Ugly, is_cut_into_closed_pieces_or_refused_by_name) {
    const UglyMesh& ugly = GetParam();
    const Outcome outcome(ugly, CutMethod::voronoi);
    std::cout << ugly.name << ": " << outcome.told << "\n";
    EXPECT_NE(outcome.told.find(ugly.expected), std::string::npos) << outcome.told;
    ASSERT_EQ(bool(outcome.set), ugly.is_cut) << outcome.told;
    if (!ugly.is_cut) {
        EXPECT_EQ(outcome.set.error().code, ErrorCode::bad_input);
        EXPECT_EQ(outcome.set.error().where, "mesh");
        return;
    }
    expect_pieces(*outcome.set);
    if (ugly.volume > 0) {
        EXPECT_NEAR(outcome.set->source_volume, ugly.volume, ugly.volume_tolerance * ugly.volume) << outcome.told;
    }
}

class UglyTets : public ::testing::TestWithParam<UglyMesh> {};

TEST_P(UglyTets, is_cut_into_closed_pieces_or_refused) {
    const Outcome outcome(GetParam(), CutMethod::kmeans);
    if (!outcome.set) {
        EXPECT_EQ(outcome.set.error().code, ErrorCode::bad_input);
        EXPECT_FALSE(outcome.told.empty());
        return;
    }
    double volume = 0;
    for (uint32_t i = 0; i < outcome.set->fragments.size(); ++i) {
        const MeshReport r = check_mesh(fragment_mesh(*outcome.set, FragmentId(i)));
        EXPECT_TRUE(r.is_solid()) << "piece " << i;
        volume += r.volume;
    }
    EXPECT_NEAR(volume, outcome.set->source_volume, kMaxVolumeError * outcome.set->source_volume);
}

INSTANTIATE_TEST_SUITE_P(Meshes, Ugly, ::testing::ValuesIn(ugly_meshes()),
                         [](const auto& info) { return info.param.name; });

/// Tetrahedra take seconds for thin walls and wraps; of the dangers that are theirs, too, the quick ones.
std::vector<UglyMesh> meshes_for_tetrahedra() {
    std::vector<UglyMesh> chosen;
    for (const UglyMesh& ugly : ugly_meshes())
        for (const char* name : {"degenerate", "small_holes", "loose_vertices", "no_such_vertex", "one_triangle",
                                 "shared_edge", "shared_vertex", "inner_wall", "solid_in_cavity", "overlap", "touching",
                                 "nan", "tiny", "huge", "far_away", "empty", "flat"})
            if (ugly.name == name) chosen.push_back(ugly);
    return chosen;
}
INSTANTIATE_TEST_SUITE_P(Meshes, UglyTets, ::testing::ValuesIn(meshes_for_tetrahedra()),
                         [](const auto& info) { return info.param.name; });

/// What every wrap loses is told once, above the table.
std::string without_losses(std::string told) {
    const size_t begin = told.find("): UVs"), end = told.find("; volume", begin == told.npos ? 0 : begin);
    return begin == told.npos || end == told.npos ? told : told.replace(begin + 1, end - begin - 1, "");
}

/// The table of docs/meshes.md, as it must read.
std::string table() {
    std::ostringstream out;
    out << "| mesh | pieces | volume | what is told |\n|---|---|---|---|\n";
    for (const UglyMesh& ugly : ugly_meshes()) {
        const Outcome outcome(ugly, CutMethod::voronoi);
        out << "| " << ugly.what << " | ";
        if (outcome.set) {
            char text[64];
            std::snprintf(text, sizeof text, "%zu | %.4g | ", outcome.set->fragments.size(),
                          outcome.set->source_volume);
            out << text << (outcome.told.empty() ? "-" : without_losses(outcome.told)) << " |\n";
        } else {
            out << "| | refused: " << outcome.told << " |\n";
        }
    }
    return out.str();
}

// Where another version of CGAL puts the points of a wrap elsewhere its volume and area differ by less than this.
constexpr double kOfAWrap = 0.01;

// Whether two rows say the same: to the letter, or of a wrap but for its numbers.
bool is_same(const std::string& row, const std::string& other) {
    static const std::regex kNumber("-?[0-9]+(\\.[0-9]+)?(e-?[0-9]+)?");
    if (row == other) return true;
    if (row.find("made anew") == std::string::npos) return false;
    if (std::regex_replace(row, kNumber, "#") != std::regex_replace(other, kNumber, "#")) return false;
    std::sregex_iterator a(row.begin(), row.end(), kNumber), b(other.begin(), other.end(), kNumber);
    for (; a != std::sregex_iterator(); ++a, ++b) {
        const double x = std::stod(a->str()), y = std::stod(b->str());
        if (!(std::abs(x - y) <= kOfAWrap * std::abs(y))) return false;
    }
    return true;
}

TEST(UglyMeshes, the_documents_tell_what_happens_to_each) {
    std::ifstream file(SUNDER_SOURCE_DIR "/docs/meshes.md");
    std::istringstream wanted(table());
    std::string row, told;
    ASSERT_TRUE(std::getline(wanted, row));
    while (std::getline(file, told) && told != row) continue;
    do {
        EXPECT_PRED2(is_same, row, told) << "docs/meshes.md should have the first of these";
        std::getline(file, told);
    } while (std::getline(wanted, row));
    EXPECT_EQ(told, "") << "docs/meshes.md has a row that is of no mesh";
}

}  // namespace
}  // namespace sunder
