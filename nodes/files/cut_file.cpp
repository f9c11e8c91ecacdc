#include "nodes/files/cut_file.h"

#include <cstring>
#include <type_traits>

#include "nodes/files/file_io.h"

namespace sunder {
namespace {

namespace fs = std::filesystem;

// Raise the number when the same input is cut into other pieces: what was written before is then cut again.
constexpr std::string_view kMark = "sunder cut 2, sunder " SUNDER_VERSION "\n";
constexpr std::string_view kEnding = ".cut";

/// Arrays of these are written as they lie in memory: numbers side by side, without gaps.
template <class T>
constexpr bool is_plain = std::is_same_v<T, Vec3> || std::is_same_v<T, Vec3f> || std::is_same_v<T, Vec2f> ||
                          std::is_same_v<T, Triangle> || std::is_same_v<T, Color> || std::is_same_v<T, FragmentId> ||
                          std::is_same_v<T, LayerDomain> || std::is_same_v<T, LayerKind> || std::is_arithmetic_v<T>;

class Writer {
public:
    static constexpr bool is_reader = false;
    ByteBuffer out;

    void raw(const void* data, size_t n) { out.append(data, n); }
    void size(size_t n) { out.number(static_cast<uint64_t>(n)); }
};

/// Stays whole until something is asked for that is not there.
class Reader {
public:
    static constexpr bool is_reader = true;
    explicit Reader(std::string_view bytes) : bytes_(bytes) {}

    void raw(void* data, size_t n) {
        is_whole_ = is_whole_ && n <= bytes_.size();
        if (!is_whole_ || n == 0) return;
        std::memcpy(data, bytes_.data(), n);
        bytes_.remove_prefix(n);
    }
    /// Of a list whose entries take at least `entry_bytes`.
    size_t count(size_t entry_bytes) {
        uint64_t n = 0;
        raw(&n, sizeof n);
        is_whole_ = is_whole_ && n <= bytes_.size() / entry_bytes;
        return is_whole_ ? static_cast<size_t>(n) : 0;
    }
    bool is_at_end() const { return is_whole_ && bytes_.empty(); }

private:
    std::string_view bytes_;
    bool is_whole_ = true;
};

// One walk over all fields serves both directions; `T` is const for the writer.
template <class Stream, class T>
void number(Stream& stream, T& value) {
    static_assert(is_plain<std::remove_const_t<T>> || std::is_same_v<std::remove_const_t<T>, Mat3>);
    if constexpr (std::is_same_v<std::remove_const_t<T>, Vec3> || std::is_same_v<std::remove_const_t<T>, Mat3>)
        stream.raw(value.data(), sizeof(double) * static_cast<size_t>(value.size()));
    else
        stream.raw(&value, sizeof value);
}

template <class Stream, class List, class Each>
void list(Stream& stream, List& values, size_t entry_bytes, Each&& each) {
    if constexpr (Stream::is_reader)
        values.resize(stream.count(entry_bytes));
    else
        stream.size(values.size());
    for (auto& v : values) each(v);
}

template <class Stream, class List>
void array(Stream& stream, List& values) {
    using T = typename List::value_type;
    static_assert(is_plain<T>);
    if constexpr (Stream::is_reader)
        values.resize(stream.count(sizeof(T)));
    else
        stream.size(values.size());
    stream.raw(values.data(), sizeof(T) * values.size());
}

template <class Stream, class Texts>
void texts(Stream& stream, Texts& values) {
    list(stream, values, sizeof(uint64_t), [&](auto& text) { array(stream, text); });
}

template <class Stream, class Groups>
void groups(Stream& stream, Groups& values) {
    if constexpr (Stream::is_reader) {
        for (size_t n = stream.count(2 * sizeof(uint64_t)); n > 0; --n) {
            std::string name;
            array(stream, name);
            array(stream, values[name]);
        }
    } else {
        stream.size(values.size());
        for (const auto& [name, members] : values) array(stream, name), array(stream, members);
    }
}

/// Of a set without layers nothing is written.
bool has_layers(const Writer&, const FragmentSet& set) { return !set.outer_layers.empty(); }
bool has_layers(const Reader& reader, const FragmentSet&) { return !reader.is_at_end(); }

template <class Stream, class Set>
void walk(Stream& stream, Set& set) {
    array(stream, set.vertices);
    list(stream, set.fragments, 8 * sizeof(double), [&](auto& f) {
        number(stream, f.volume), number(stream, f.centroid), number(stream, f.covariance);
        stream.raw(f.orientation.coeffs().data(), 4 * sizeof(double));
        number(stream, f.radii), number(stream, f.cluster), number(stream, f.toughness_factor);
        number(stream, f.yield_factor), number(stream, f.density_factor);
        number(stream, f.outer_begin), number(stream, f.outer_end);
    });
    list(stream, set.interfaces, 8 * sizeof(double), [&](auto& i) {
        number(stream, i.a), number(stream, i.b), number(stream, i.area), number(stream, i.normal);
        number(stream, i.centroid), number(stream, i.triangle_begin), number(stream, i.triangle_end);
        number(stream, i.toughness_factor), number(stream, i.joins);
    });
    array(stream, set.outer_triangles), array(stream, set.outer_material), array(stream, set.outer_corner_uvs);
    array(stream, set.outer_corner_normals), array(stream, set.outer_corner_colors);
    array(stream, set.interface_triangles), array(stream, set.interface_corner_uvs);
    array(stream, set.interface_corner_rim);
    number(stream, set.interior_smooth_angle), number(stream, set.interior_material);
    texts(stream, set.material_names);
    groups(stream, set.vertex_groups);
    number(stream, set.source_volume), number(stream, set.source_area);
    array(stream, set.source_path);
    texts(stream, set.warnings);
    if (has_layers(stream, set))
        list(stream, set.outer_layers, 2 * sizeof(uint64_t), [&](auto& layer) {
            array(stream, layer.name);
            number(stream, layer.domain), number(stream, layer.kind), number(stream, layer.width);
            array(stream, layer.values);
        });
}

}  // namespace

ByteBuffer encode_cut(const FragmentSet& fragments, ContentKey key) {
    Writer writer;
    writer.out.text(kMark);
    writer.out.number(key);
    walk(writer, fragments);
    writer.out.number(stamp_of(writer.out.view()).hash);
    return std::move(writer.out);
}

std::optional<FragmentSet> decode_cut(std::string_view bytes, ContentKey key) {
    constexpr size_t kHead = kMark.size() + sizeof key, kTail = sizeof(uint64_t);
    if (bytes.size() < kHead + kTail || !bytes.starts_with(kMark)) return {};
    const std::string_view content = bytes.substr(0, bytes.size() - kTail);
    if (read_number<ContentKey>(bytes.data() + kMark.size()) != key ||
        read_number<uint64_t>(content.data() + content.size()) != stamp_of(content).hash)
        return {};
    Reader reader(content.substr(kHead));
    FragmentSet set;
    walk(reader, set);
    if (!reader.is_at_end()) return {};
    return set;
}

fs::path CutFolder::path_of(const std::string& node, ContentKey key) const {
    KeyHasher hasher;
    hasher.add(std::string_view(node));
    return folder_ / (hex(hasher.key()) + "-" + hex(key) + std::string(kEnding));
}

std::optional<FragmentSet> CutFolder::read(const std::string& node, ContentKey key) const {
    const auto bytes = read_file(path_of(node, key));
    return bytes ? decode_cut(*bytes, key) : std::nullopt;
}

void CutFolder::write(const std::string& node, ContentKey key, const FragmentSet& fragments) const {
    const fs::path path = path_of(node, key);
    std::error_code code;
    if (!make_folders(folder_) || !write_file(path, encode_cut(fragments, key).view())) return;
    const std::string prefix = path.filename().string().substr(0, hex(key).size() + 1);
    for (const auto& entry : fs::directory_iterator(folder_, code)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with(prefix) && name.ends_with(kEnding) && entry.path() != path) fs::remove(entry.path(), code);
    }
}

}  // namespace sunder
