#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "fracture_tools/mesh/layer_property.h"
#include "fracture_tools/mesh/layer_reader.h"
#include "fracture_tools/mesh/mesh_assembler.h"
#include "fracture_tools/mesh/polygon_files.h"
#include "fracture_tools/mesh/text_scanner.h"
#include "fracture_tools/mesh/utf8_text.h"

namespace sunder {
namespace {

constexpr double kMostEntries = 20'000;  // of one list: two UVs for each corner of the largest polygon
constexpr int32_t kMostMaterials = 100'000;

struct Type {
    size_t size = 0;
    bool is_float = false, is_signed = false;
};

std::optional<Type> type_named(std::string_view name) {
    struct Named {
        std::string_view name, alias;
        Type type;
    };
    static constexpr std::array<Named, 8> kTypes = {{{"char", "int8", {1, false, true}},
                                                     {"uchar", "uint8", {1, false, false}},
                                                     {"short", "int16", {2, false, true}},
                                                     {"ushort", "uint16", {2, false, false}},
                                                     {"int", "int32", {4, false, true}},
                                                     {"uint", "uint32", {4, false, false}},
                                                     {"float", "float32", {4, true, true}},
                                                     {"double", "float64", {8, true, true}}}};
    for (const Named& t : kTypes)
        if (name == t.name || name == t.alias) return t.type;
    return std::nullopt;
}

struct Property {
    std::string name;
    Type type;
    std::optional<Type> count_type;  // a list
};

struct Element {
    std::string name;
    uint64_t count = 0;
    std::vector<Property> properties;

    /// Index of the first property that has one of these names, or -1.
    int find(std::initializer_list<std::string_view> names) const {
        for (size_t k = 0; k < properties.size(); ++k)
            if (std::find(names.begin(), names.end(), properties[k].name) != names.end()) return static_cast<int>(k);
        return -1;
    }
};

enum class Format { text, little_endian, big_endian };

struct Header {
    Format format = Format::text;
    std::vector<Element> elements;

    const Element* find(std::string_view name) const {
        for (const Element& e : elements)
            if (e.name == name) return &e;
        return nullptr;
    }
};

/// Takes the header off the front of `io_bytes`; a sentence if it is none.
std::string read_header(std::string_view& io_bytes, Header& out) {
    if (next_line(io_bytes) != "ply") return "this is no PLY file";
    while (!io_bytes.empty()) {
        const std::string_view whole = next_line(io_bytes);
        std::string_view line = whole;
        const std::string_view word = next_word(line);
        const std::string complaint = "the PLY header has the line '" + std::string(whole.substr(0, 60)) + "'";
        if (word == "end_header") return {};
        if (word == "format") {
            const std::string_view format = next_word(line);
            if (format == "ascii")
                out.format = Format::text;
            else if (format == "binary_little_endian")
                out.format = Format::little_endian;
            else if (format == "binary_big_endian")
                out.format = Format::big_endian;
            else
                return complaint;
        } else if (word == "element") {
            Element element;
            element.name = next_word(line);
            if (!to_number(next_word(line), element.count) || out.find(element.name)) return complaint;  // twice
            out.elements.push_back(element);
        } else if (word == "property") {
            Property property;
            std::string_view type = next_word(line);
            if (type == "list") {
                property.count_type = type_named(next_word(line));
                if (!property.count_type || property.count_type->is_float) return complaint;
                type = next_word(line);
            }
            const std::optional<Type> known = type_named(type);
            property.name = next_word(line);
            if (!known || property.name.empty() || out.elements.empty()) return complaint;
            property.type = *known;
            out.elements.back().properties.push_back(property);
        } else if (word != "comment" && word != "obj_info" && !word.empty()) {
            return complaint;
        }
    }
    return "the PLY header has no end";
}

/// The numbers of the body, one after the other.
class Body {
public:
    Body(std::string_view bytes, Format format) : bytes_(bytes), format_(format) {}

    /// False at the end of the file and where there is no number.
    bool next(const Type& type, double& out) {
        if (format_ == Format::text) return to_number(next_word(bytes_), out);
        if (bytes_.size() < type.size) return false;
        std::array<char, 8> raw{};
        std::memcpy(raw.data(), bytes_.data(), type.size);
        bytes_.remove_prefix(type.size);
        const bool is_native = (format_ == Format::little_endian) == (std::endian::native == std::endian::little);
        if (!is_native) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(type.size));
        out = type.is_float ? (type.size == 4 ? read<float>(raw) : read<double>(raw)) : read_integer(raw, type);
        return true;
    }

    bool is_at_end() const { return bytes_.empty(); }

private:
    template <class T>
    static double read(const std::array<char, 8>& raw) {
        T value;
        std::memcpy(&value, raw.data(), sizeof value);
        return static_cast<double>(value);
    }
    static double read_integer(const std::array<char, 8>& raw, const Type& type) {
        switch (type.size) {
            case 1:
                return type.is_signed ? read<int8_t>(raw) : read<uint8_t>(raw);
            case 2:
                return type.is_signed ? read<int16_t>(raw) : read<uint16_t>(raw);
            default:
                return type.is_signed ? read<int32_t>(raw) : read<uint32_t>(raw);
        }
    }

    std::string_view bytes_;
    Format format_;
};

/// Reads one item of an element: scalars have one value, lists as many as they say. False: damaged.
bool next_item(Body& io_body, const Element& element, std::vector<std::vector<double>>& out) {
    out.resize(element.properties.size());
    for (size_t k = 0; k < element.properties.size(); ++k) {
        const Property& property = element.properties[k];
        double n = 1;
        if (property.count_type && (!io_body.next(*property.count_type, n) || !(n >= 0) || n > kMostEntries))
            return false;
        out[k].resize(static_cast<size_t>(n));
        for (double& value : out[k])
            if (!io_body.next(property.type, value)) return false;
    }
    return true;
}

class PlyMesh {
public:
    PlyMesh(const Header& header, Body body, std::string where, double scale)
        : header_(header),
          body_(body),
          where_(std::move(where)),
          scale_(scale),
          assembler_(has_uvs(header), has_normals(header), has_colors(header)) {}

    Result<TriMesh> read() {
        for (const Element& element : header_.elements) {
            if (element.properties.empty()) continue;
            for (uint64_t i = 0; i < element.count; ++i) {
                if (!next_item(body_, element, item_))
                    return bad_input(where_, "the file ends, or is damaged, at " + element.name + " " +
                                                 std::to_string(i) + " of " + std::to_string(element.count));
                Status s;
                if (element.name == "vertex")
                    s = add_vertex(element, i);
                else if (element.name == "face")
                    s = add_face(element, i);
                if (!s) return s.error();
            }
        }
        if (assembler_.n_triangles() == 0) return bad_input(where_, "the file has no triangles");
        TriMesh mesh = assembler_.finish();
        for (Attribute& a : attributes_) {
            a.value.resize(mesh.positions.size());
            mesh.vertex_attributes[a.name] = std::move(a.value);
        }
        mesh.layers = layers_.finish(mesh.positions.size(), assembler_.corner_numbers());
        return mesh;
    }

private:
    static int uv_property(const Element& e, int axis) {
        return axis == 0 ? e.find({"u", "s", "texture_u"}) : e.find({"v", "t", "texture_v"});
    }
    static bool has_uvs(const Header& h) {
        const Element *v = h.find("vertex"), *f = h.find("face");
        return (v && uv_property(*v, 0) >= 0 && uv_property(*v, 1) >= 0) || (f && f->find({"texcoord"}) >= 0);
    }
    static bool has_normals(const Header& h) {
        const Element* v = h.find("vertex");
        return v && v->find({"nx"}) >= 0 && v->find({"ny"}) >= 0 && v->find({"nz"}) >= 0;
    }

    static bool has_colors(const Header& h) {
        const Element* v = h.find("vertex");
        return v && v->find({"red"}) >= 0 && v->find({"green"}) >= 0 && v->find({"blue"}) >= 0;
    }

    /// Properties that are layers by their names.
    void find_layers(const Element& e) {
        for (size_t k = 0; k < e.properties.size(); ++k)
            layers_.add(e.properties[k].name, k, e.name == "face", !e.properties[k].type.is_float);
        if (layers_.has_face_layers()) assembler_.keep_corner_numbers();
    }

    /// Single numbers that we give no meaning to are the artist's own maps.
    void find_attributes(const Element& e) {
        constexpr std::array<std::string_view, 17> kKnown = {"x",   "y",     "z",    "nx",    "ny",        "nz",
                                                             "u",   "v",     "s",    "t",     "texture_u", "texture_v",
                                                             "red", "green", "blue", "alpha", "fragment"};
        for (size_t k = 0; k < e.properties.size(); ++k)
            if (!e.properties[k].count_type &&
                !layer_of_property(e.properties[k].name, false, !e.properties[k].type.is_float) &&
                std::find(kKnown.begin(), kKnown.end(), e.properties[k].name) == kKnown.end())
                attributes_.push_back({to_utf8(e.properties[k].name), static_cast<int>(k), {}});
    }
    /// Colours are bytes, or shares.
    float color(const Element& e, int channel) const {
        const int property = color_[static_cast<size_t>(channel)];
        if (property < 0) return 1;
        const Type& type = e.properties[static_cast<size_t>(property)].type;
        return static_cast<float>(value(property) / (type.is_float ? 1.0 : type.size == 1 ? 255.0 : 65535.0));
    }

    /// Value of a scalar property, or 0 where it is not there.
    double value(int property) const { return property < 0 || item_[property].empty() ? 0 : item_[property][0]; }

    Status add_vertex(const Element& e, uint64_t index) {
        if (index == 0) {
            place_ = {e.find({"x"}), e.find({"y"}), e.find({"z"})};
            normal_ = {e.find({"nx"}), e.find({"ny"}), e.find({"nz"})};
            uv_ = {uv_property(e, 0), uv_property(e, 1)};
            color_ = {e.find({"red"}), e.find({"green"}), e.find({"blue"}), e.find({"alpha"})};
            find_attributes(e);
            find_layers(e);
            if (*std::min_element(place_.begin(), place_.end()) < 0)
                return bad_input(where_, "the vertices have no x, y and z");
        }
        const Vec3 p = scale_ * Vec3(value(place_[0]), value(place_[1]), value(place_[2]));
        if (!p.allFinite())
            return bad_input(where_, "vertex " + std::to_string(index) + " has a coordinate that is no finite number");
        vertices_.push_back({assembler_.weld(p),
                             Vec2f(float(value(uv_[0])), float(value(uv_[1]))),
                             Vec3(value(normal_[0]), value(normal_[1]), value(normal_[2])),
                             {color(e, 0), color(e, 1), color(e, 2), color(e, 3)}});
        for (Attribute& a : attributes_) {
            const uint32_t v = vertices_.back().vertex;
            if (a.value.size() == v)
                a.value.push_back(static_cast<float>(value(a.property)));  // a welded one: the first
            if (!std::isfinite(a.value[v]))
                return bad_input(
                    where_, "attribute '" + a.name + "' of vertex " + std::to_string(index) + " is no finite number");
        }
        return layers_.add_vertex(item_, vertices_.back().vertex, where_, index);
    }

    Status add_face(const Element& e, uint64_t index) {
        const std::string name = "face " + std::to_string(index);
        if (index == 0) {
            corners_ = e.find({"vertex_indices", "vertex_index"});
            texcoord_ = e.find({"texcoord"});
            material_ = e.find({"material", "material_index"});
            if (corners_ < 0) return bad_input(where_, "the faces have no vertex_indices");
            find_layers(e);
        }
        const std::vector<double>& vertex = item_[corners_];
        const Result<uint32_t> first = layers_.add_face(item_, vertex.size(), where_, index);
        if (!first) return first.error();
        polygon_.clear();
        for (size_t c = 0; c < vertex.size(); ++c) {
            if (!(vertex[c] >= 0 && vertex[c] < double(vertices_.size())))
                return bad_input(where_, name + " names a vertex that is not there");
            polygon_.push_back(vertices_[static_cast<size_t>(vertex[c])]);
            polygon_.back().number = *first + static_cast<uint32_t>(c);
            if (texcoord_ >= 0 && item_[texcoord_].size() == 2 * vertex.size())
                polygon_.back().uv = Vec2f(float(item_[texcoord_][2 * c]), float(item_[texcoord_][2 * c + 1]));
        }
        const double material = value(material_);
        if (!(material >= 0 && material < kMostMaterials))
            return bad_input(where_, name + " has a material number out of range");
        assembler_.add_polygon(polygon_, static_cast<int32_t>(material));
        return {};
    }

    const Header& header_;
    Body body_;
    std::string where_;
    double scale_;
    MeshAssembler assembler_;
    LayerReader layers_;
    std::vector<FileCorner> vertices_, polygon_;
    std::vector<std::vector<double>> item_;
    std::array<int, 3> place_{-1, -1, -1}, normal_{-1, -1, -1};
    std::array<int, 2> uv_{-1, -1};
    std::array<int, 4> color_{-1, -1, -1, -1};
    int corners_ = -1, texcoord_ = -1, material_ = -1;
    struct Attribute {
        std::string name;
        int property;
        std::vector<float> value;  // of each welded vertex
    };
    std::vector<Attribute> attributes_;
};

}  // namespace

Result<TriMesh> read_ply(std::string_view bytes, const std::string& where, double scale) {
    Header header;
    if (const std::string complaint = read_header(bytes, header); !complaint.empty())
        return bad_input(where, complaint);
    return PlyMesh(header, Body(bytes, header.format), where, scale).read();
}

}  // namespace sunder
