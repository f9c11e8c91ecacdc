#include "tests/benchmarks/bench/skin_recording.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>

namespace sunder::bench {
namespace {

constexpr std::array<char, 16> kMagic = {'s', 'u', 'n', 'd', 'e', 'r', ' ', 's', 'k', 'i', 'n', 's', ' ', '1', '\n', 0};

struct Writer {
    std::ofstream file;

    template <class T>
    void one(const T& x) {
        file.write(reinterpret_cast<const char*>(&x), sizeof x);
    }
    template <class T>
    void all(const std::vector<T>& x) {
        one(static_cast<uint64_t>(x.size()));
        file.write(reinterpret_cast<const char*>(x.data()), static_cast<std::streamsize>(x.size() * sizeof(T)));
    }
};

struct Reader {
    std::ifstream file;
    std::string path;
    uint64_t left;  // bytes

    void take(void* to, uint64_t bytes) {
        if (bytes > left) throw std::runtime_error(path + ": it is cut short (record it again)");
        file.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes)), left -= bytes;
    }
    template <class T>
    void one(T& x) {
        take(&x, sizeof x);
    }
    template <class T>
    void all(std::vector<T>& x) {
        uint64_t n = 0;
        one(n);
        if (n > left / sizeof(T)) throw std::runtime_error(path + ": it is cut short (record it again)");
        x.resize(n);
        take(x.data(), n * sizeof(T));
    }
};

// What is read has the order of what is written.
template <class Io, class Set>
void pass_set(Io& io, Set& s) {
    io.all(s.vertices), io.all(s.fragments), io.all(s.interfaces);
    io.all(s.outer_triangles), io.all(s.outer_material);
    io.all(s.outer_corner_uvs), io.all(s.outer_corner_normals), io.all(s.outer_corner_colors);
    io.all(s.interface_triangles), io.all(s.interface_corner_uvs), io.all(s.interface_corner_rim);
    io.one(s.interior_smooth_angle), io.one(s.interior_material);
}

template <class Io, class Mesh>
void pass_rest(Io& io, Mesh& rest) {
    io.all(rest.rest_position), io.all(rest.rest_orientation), io.all(rest.radii), io.all(rest.volume);
    io.all(rest.mass), io.all(rest.fragment), io.all(rest.edges);
}

template <class Io, class State>
void pass_frame(Io& io, State& s) {
    io.all(s.position), io.all(s.orientation), io.all(s.plastic_deformation), io.all(s.edge_intact);
}

template <class Io, class B>
void pass_body(Io& io, B& body) {
    io.one(body.particle_begin), io.one(body.particle_end), io.one(body.edge_begin), io.one(body.edge_end);
}

// Whether every body's particles and edges are there, in the rest and in each frame.
bool is_whole(const SkinRecording& recording) {
    const SimulationMesh& rest = recording.scene.scene.rest;
    const size_t n = rest.rest_position.size(), n_edges = rest.edges.size();
    const auto are_in = [](size_t begin, size_t end, size_t size) { return begin <= end && end <= size; };
    const auto fits = [&](const FrameState& f) {
        return f.position.size() == n && f.orientation.size() == n && f.plastic_deformation.size() == n &&
               f.edge_intact.size() == n_edges;
    };
    return rest.rest_orientation.size() == n && rest.radii.size() == n && rest.volume.size() == n &&
           rest.mass.size() == n && rest.fragment.size() == n &&
           std::ranges::all_of(recording.scene.scene.bodies,
                               [&](const Body& b) {
                                   return are_in(b.particle_begin, b.particle_end, n) &&
                                          are_in(b.edge_begin, b.edge_end, n_edges);
                               }) &&
           std::ranges::all_of(recording.frames, fits);
}

}  // namespace

void write_recording(const SkinRecording& recording, const std::string& path) {
    Writer io{std::ofstream(path, std::ios::binary)};
    const BenchScene& s = recording.scene;
    std::vector<const FragmentSet*> sets;  // bodies share them
    for (const SkinnedBody& skin : s.skins)
        if (std::ranges::find(sets, skin.fragments.get()) == sets.end()) sets.push_back(skin.fragments.get());
    io.one(kMagic);
    io.one(std::array<uint64_t, 3>{sets.size(), s.skins.size(), recording.frames.size()});
    for (const FragmentSet* set : sets) pass_set(io, *set);
    for (size_t b = 0; b < s.skins.size(); ++b) {
        const auto set = std::find(sets.begin(), sets.end(), s.skins[b].fragments.get());
        io.one(static_cast<uint64_t>(set - sets.begin()));
        io.one(s.skins[b].pose);
        pass_body(io, s.scene.bodies[b]);
    }
    pass_rest(io, s.scene.rest);
    for (const FrameState& frame : recording.frames) pass_frame(io, frame);
    if (!io.file.flush()) throw std::runtime_error(path + ": it cannot be written");
}

SkinRecording read_recording(const std::string& path) {
    Reader io{std::ifstream(path, std::ios::binary | std::ios::ate), path, 0};
    if (!io.file) throw std::runtime_error(path + ": it cannot be read");
    io.left = static_cast<uint64_t>(io.file.tellg());
    io.file.seekg(0);
    std::array<char, 16> magic{};
    if (io.left >= sizeof magic) io.one(magic);
    if (magic != kMagic) throw std::runtime_error(path + ": it is no recording for deformers of this version");
    std::array<uint64_t, 3> count{};
    io.one(count);
    if (*std::max_element(count.begin(), count.end()) > io.left)
        throw std::runtime_error(path + ": it is cut short (record it again)");

    std::vector<std::shared_ptr<const FragmentSet>> sets;
    for (uint64_t i = 0; i < count[0]; ++i) {
        auto set = std::make_shared<FragmentSet>();
        pass_set(io, *set);
        sets.push_back(std::move(set));
    }
    SkinRecording recording;
    BenchScene& s = recording.scene;
    for (uint64_t b = 0; b < count[1]; ++b) {
        uint64_t set = 0;
        io.one(set);
        SkinnedBody skin{sets.at(set), {}};
        io.one(skin.pose);
        s.skins.push_back(skin);
        pass_body(io, s.scene.bodies.emplace_back());
    }
    pass_rest(io, s.scene.rest);
    for (uint64_t f = 0; f < count[2]; ++f) pass_frame(io, recording.frames.emplace_back());
    if (!is_whole(recording)) throw std::runtime_error(path + ": its parts do not fit together (record it again)");
    return recording;
}

}  // namespace sunder::bench
