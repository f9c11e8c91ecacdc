// USD in its text form: one time-sampled Mesh a body, one Mesh with a moving Xform a solid (openusd.org, UsdGeomMesh,
// UsdGeomSubset, UsdShadeMaterial).
//
// Attributes stand one after the other, each with all its frames, so frames are read once for each attribute; a shot
// need not fit into memory. What does not change from frame to frame is written once.
#include <algorithm>
#include <bit>
#include <map>

#include "nodes/exports/shot_export.h"
#include "nodes/exports/usda_text.h"
#include "nodes/files/frame_number.h"

namespace sunder {
namespace {

constexpr size_t kFlushBytes = size_t{1} << 20;
constexpr const char* kBound = "prepend apiSchemas = [\"MaterialBindingAPI\"]";

/// What one look at all frames of a mesh tells.
struct Survey {
    std::vector<size_t> points_change;         // all frames, or the first of a solid
    std::vector<std::array<Vec3f, 2>> extent;  // of each of those
    std::vector<size_t> faces_change;          // frames at which faces or what belongs to them differ from before
    std::vector<size_t> rest_change;           // empty if the shot tells no rest positions
    std::vector<size_t> hidden_change;
    std::vector<Surface> surfaces;  // by material
    std::vector<LayerId> layers;
    bool has_uvs = false, has_velocities = false, has_accelerations = false, has_hidden = false;
    bool has_colors = false, has_alpha = false, has_rim = false, has_interfaces = false;
};

bool same_faces(const VisualMesh& a, const VisualMesh& b) {
    return a.triangles == b.triangles && a.triangle_material == b.triangle_material &&
           a.triangle_fragment == b.triangle_fragment && a.corner_uvs == b.corner_uvs;
}

Result<Survey> survey(const Shot& shot, const ShotMesh& source, const Progress& progress) {
    Survey found;
    VisualMesh before;
    const size_t n = source.poses.empty() ? shot.frames.size() : 1;
    for (size_t i = 0; i < n; ++i) {
        if (!progress.report(double(i) / double(n), "exporting")) return cancelled();
        auto frame = source.read(i);
        if (!frame) return frame.error();
        found.points_change.push_back(i);
        VisualMesh& m = frame->mesh;
        if (i == 0) {
            found.surfaces = surfaces_of(source, *frame);
            found.has_uvs = !m.corner_uvs.empty(), found.has_velocities = !m.velocities.empty();
            found.has_accelerations = !m.accelerations.empty();
            found.has_hidden = !m.triangle_hidden.empty(), found.has_interfaces = !m.triangle_interface.empty();
            found.has_colors = !m.corner_colors.empty(), found.has_rim = !m.corner_rim.empty();
            found.layers.assign(m.layers.begin(), m.layers.end());
        }
        found.has_alpha |= std::ranges::any_of(m.corner_colors, [](const Color& c) { return c[3] != 1; });
        if (i == 0 || !same_faces(before, m)) found.faces_change.push_back(i);
        if (!m.rest_positions.empty() && (i == 0 || !(before.rest_positions == m.rest_positions)))
            found.rest_change.push_back(i);
        if (i == 0 || before.triangle_hidden != m.triangle_hidden) found.hidden_change.push_back(i);
        std::array<Vec3f, 2> extent = {Vec3f::Zero(), Vec3f::Zero()};
        for (size_t v = 0; v < m.positions.size(); ++v) {
            extent[0] = v ? Vec3f(extent[0].cwiseMin(m.positions[v])) : m.positions[v];
            extent[1] = v ? Vec3f(extent[1].cwiseMax(m.positions[v])) : m.positions[v];
        }
        found.extent.push_back(extent);
        before = std::move(m);
    }
    return found;
}

// Type of a layer's primvar without its brackets.
std::string type_of(const LayerId& layer) {
    switch (layer.kind) {
        case LayerKind::uv:
            return "texCoord2f";
        case LayerKind::color:
            return "color4f";
        case LayerKind::boolean:
            return "bool";
        default:
            return (layer.is_blended() ? "float" : "int") + (layer.width > 1 ? std::to_string(layer.width) : "");
    }
}

const char* interpolation_of(const LayerId& layer) {
    return layer.domain == LayerDomain::point    ? "vertex"
           : layer.domain == LayerDomain::corner ? "faceVarying"
                                                 : "uniform";
}

void put_layer(std::string& out, const VisualLayer& layer) {
    put_array(out, layer.n_rows(), [&](size_t i) {
        const bool is_tuple = layer.width > 1;
        for (size_t k = 0; k < layer.width; ++k) {
            out += k ? ", " : is_tuple ? "(" : "";
            if (layer.is_blended())
                put(out, layer.row(i)[k]);
            else
                put_integer(out, std::bit_cast<int32_t>(layer.row(i)[k]));
        }
        if (is_tuple) out += ')';
    });
}

class UsdaWriter {
public:
    UsdaWriter(const Shot& shot, FileWriter& file, const Progress& progress)
        : shot_(shot), file_(file), progress_(progress) {}

    Status write() {
        std::vector<Survey> surveys;
        const double n = double(shot_.meshes.size());
        for (size_t k = 0; k < shot_.meshes.size(); ++k) {
            auto found = survey(shot_, shot_.meshes[k], progress_.part(0.2 * double(k) / n, 0.2 * double(k + 1) / n));
            if (!found) return found.error();
            surveys.push_back(found.take());
        }
        write_header();
        text_ += "def Xform \"shot\" (\n    kind = \"component\"\n)\n{\n";
        write_materials(surveys);
        PrimNames names;
        names.make("Looks");
        for (size_t k = 0; k < shot_.meshes.size(); ++k)
            if (Status s = write_mesh(shot_.meshes[k], names.make(shot_.meshes[k].name), surveys[k],
                                      progress_.part(0.2 + 0.8 * double(k) / n, 0.2 + 0.8 * double(k + 1) / n));
                !s)
                return s;
        text_ += "}\n";
        return file_.append(text_);
    }

private:
    void write_header() {
        text_ += "#usda 1.0\n(\n    doc = \"sunder shot 1, written by sunder " SUNDER_VERSION
                 "\"\n    defaultPrim = \"shot\"\n    metersPerUnit = 1\n    upAxis = \"Z\"\n    startTimeCode = ";
        text_ += frame_text(shot_.frames.front());
        text_ += "\n    endTimeCode = ";
        text_ += frame_text(shot_.frames.back());
        for (const char* name : {"timeCodesPerSecond", "framesPerSecond"}) {
            text_ += std::string("\n    ") + name + " = ";
            put(text_, shot_.frame_rate.per_second());
        }
        text_ += "\n)\n\n";
    }

    // A prim and the brace behind it. `label`: what it is called, which a prim's name may not be.
    void begin_prim(const std::string& indent, const char* type, const std::string& name, const std::string& label,
                    const char* metadata) {
        text_ += indent + "def " + type + " \"" + name + "\"";
        std::string lines;
        if (name != label) lines += indent + "    displayName = " + quoted(label) + "\n";
        if (*metadata) lines += indent + "    " + metadata + "\n";
        if (!lines.empty()) text_ += " (\n" + lines + indent + ")";
        text_ += "\n" + indent + "{\n";
    }

    // One material a surface; bodies that have the same share it.
    void write_materials(const std::vector<Survey>& surveys) {
        text_ += "    def Scope \"Looks\"\n    {\n";
        PrimNames names;
        for (const Survey& s : surveys)
            for (const Surface& surface : s.surfaces) {
                if (looks_.contains(surface)) continue;
                write_material(looks_[surface] = names.make(surface.name), surface);
            }
        text_ += "    }\n\n";
    }

    void write_material(const std::string& name, const Surface& surface) {
        const std::string path = "</shot/Looks/" + name + "/";
        std::string readers;  // shaders that give what the mesh has
        const auto write_input = [&](const std::string& input, const std::string& value, const std::string& primvar,
                                     const std::string& type) {
            text_ += "                " + input;
            text_ += primvar.empty() ? " = " + value + "\n" : ".connect = " + path + primvar + ".outputs:result>\n";
            if (primvar.empty()) return;
            readers += "\n            def Shader \"" + primvar +
                       "\"\n            {\n"
                       "                uniform token info:id = \"UsdPrimvarReader_" +
                       type + "\"\n                string inputs:varname = \"" + primvar + "\"\n                " +
                       type + " inputs:fallback = " + value + "\n                " + type +
                       " outputs:result\n            }\n";
        };
        std::string color;
        put_tuple(color, Vec3(surface.color[0], surface.color[1], surface.color[2]));
        // Seen through: USD's preview has no transmission of its own, only opacity.
        const double opacity = surface.color[3] * (1 - surface.transmission);

        begin_prim("        ", "Material", name, surface.name, "");
        text_ += "            token outputs:surface.connect = " + path +
                 "surface.outputs:surface>\n\n"
                 "            def Shader \"surface\"\n            {\n"
                 "                uniform token info:id = \"UsdPreviewSurface\"\n";
        write_input("color3f inputs:diffuseColor", color, surface.takes_vertex_colors ? "displayColor" : "", "float3");
        write_input("float inputs:opacity", number_text(opacity),
                    surface.takes_vertex_alpha && opacity == 1 ? "displayOpacity" : "", "float");
        write_input("float inputs:metallic", number_text(surface.metallic), "", "float");
        write_input("float inputs:roughness", number_text(surface.roughness), "", "float");
        text_ += "                token outputs:surface\n            }\n" + readers + "        }\n\n";
    }

    // An attribute with a value for each of `frames`, or without time samples if there is but one. `metadata` as it
    // stands in parentheses, may be empty.
    template <class Put>
    Status attribute(const ShotMesh& source, const std::string& declaration, const char* metadata,
                     const std::vector<size_t>& frames, const Progress& progress, Put&& put_value) {
        const std::string indent = depth_ > 2 ? "            " : "        ";
        const bool is_still = frames.size() == 1;
        text_ += indent + declaration;
        const std::string in_parentheses =
            *metadata ? std::string(" (\n") + indent + "    " + metadata + "\n" + indent + ")" : "";
        if (is_still)
            text_ += " = ";
        else
            text_ += (*metadata ? in_parentheses + "\n" + indent + declaration : "") + ".timeSamples = {\n";
        for (size_t k = 0; k < frames.size(); ++k) {
            if (!progress.report(double(k) / double(frames.size()), "exporting")) return cancelled();
            const auto frame = source.read(frames[k]);
            if (!frame) return frame.error();
            if (!is_still) {
                text_ += indent + "    " + frame_text(shot_.frames[frames[k]]) + ": ";
            }
            put_value(frame->mesh, frames[k]);
            if (!is_still) text_ += ",\n";
            if (text_.size() > kFlushBytes) {
                if (Status s = file_.append(text_); !s) return s;
                text_.clear();
            }
        }
        text_ += is_still ? in_parentheses + "\n" : indent + "}\n";
        return {};
    }

    Status write_mesh(const ShotMesh& source, const std::string& name, const Survey& found, const Progress& progress) {
        depth_ = 2;
        begin_prim("    ", "Mesh", name, source.name, kBound);
        text_ +=
            "        uniform token subdivisionScheme = \"none\"\n        uniform token orientation = "
            "\"rightHanded\"\n"
            "        uniform token subsetFamily:materialBind:familyType = \"partition\"\n";
        if (!source.poses.empty()) write_poses(source.poses);
        std::string& out = text_;
        struct Attribute {
            bool is_there;
            std::string declaration, metadata;
            const std::vector<size_t>& frames;
            std::function<void(const VisualMesh&, size_t)> put;
        };
        std::vector<Attribute> attributes = {
            {true, "float3[] extent", "", found.points_change,
             [&](const VisualMesh&, size_t i) {
                 put_array(out, 2, [&](size_t k) { put_tuple(out, found.extent[i][k]); });
             }},
            {true, "int[] faceVertexCounts", "", found.faces_change,
             [&](const VisualMesh& m, size_t) { put_array(out, m.triangles.size(), [&](size_t) { out += '3'; }); }},
            {true, "int[] faceVertexIndices", "", found.faces_change,
             [&](const VisualMesh& m, size_t) {
                 put_array(out, 3 * m.triangles.size(), [&](size_t c) { put_integer(out, m.triangles[c / 3][c % 3]); });
             }},
            {true, "point3f[] points", "", found.points_change,
             [&](const VisualMesh& m, size_t) { put_tuples(out, m.positions.vector()); }},
            {found.has_velocities, "vector3f[] velocities", "", found.points_change,
             [&](const VisualMesh& m, size_t) { put_tuples(out, m.velocities.vector()); }},
            {found.has_accelerations, "vector3f[] accelerations", "", found.points_change,
             [&](const VisualMesh& m, size_t) { put_tuples(out, m.accelerations.vector()); }},
            {!found.rest_change.empty(), "point3f[] primvars:Pref", "interpolation = \"vertex\"", found.rest_change,
             [&](const VisualMesh& m, size_t) { put_tuples(out, m.rest_positions.vector()); }},
            {true, "normal3f[] normals", "interpolation = \"faceVarying\"", found.points_change,
             [&](const VisualMesh& m, size_t) { put_tuples(out, m.corner_normals.vector()); }},
            {found.has_uvs, "texCoord2f[] primvars:st", "interpolation = \"faceVarying\"", found.faces_change,
             [&](const VisualMesh& m, size_t) { put_tuples(out, m.corner_uvs.vector()); }},
            {found.has_colors, "color3f[] primvars:displayColor", "interpolation = \"faceVarying\"", found.faces_change,
             [&](const VisualMesh& m, size_t) {
                 put_array(out, m.corner_colors.size(), [&](size_t c) {
                     put_tuple(out, Vec3f(Eigen::Map<const Vec3f>(m.corner_colors[c].data())));
                 });
             }},
            {found.has_alpha, "float[] primvars:displayOpacity", "interpolation = \"faceVarying\"", found.faces_change,
             [&](const VisualMesh& m, size_t) {
                 put_array(out, m.corner_colors.size(), [&](size_t c) { put(out, m.corner_colors[c][3]); });
             }},
            {found.has_rim, "float[] primvars:rim", "interpolation = \"faceVarying\"", found.faces_change,
             [&](const VisualMesh& m, size_t) {
                 put_array(out, m.corner_rim.size(), [&](size_t c) { put(out, m.corner_rim[c]); });
             }},
            {found.has_interfaces, "int[] primvars:interface", "interpolation = \"uniform\"", found.faces_change,
             [&](const VisualMesh& m, size_t) {
                 put_array(out, m.triangles.size(), [&](size_t t) { put_integer(out, m.triangle_interface[t]); });
             }},
            {true, "int[] primvars:fragment", "interpolation = \"uniform\"", found.faces_change,
             [&](const VisualMesh& m, size_t) {
                 put_array(out, m.triangles.size(), [&](size_t t) { put_integer(out, m.triangle_fragment[t]); });
             }},
            {found.has_hidden, "int[] primvars:hidden", "interpolation = \"uniform\"", found.hidden_change,
             [&](const VisualMesh& m, size_t) {
                 put_array(out, m.triangles.size(), [&](size_t t) { put_integer(out, m.triangle_hidden[t]); });
             }},
        };
        PrimNames primvars({"st", "displayColor", "displayOpacity", "Pref", "rim", "interface", "fragment", "hidden"});
        for (const LayerId& layer : found.layers) {
            const std::string primvar = primvars.make(layer.name);
            attributes.push_back(
                {true, type_of(layer) + "[] primvars:" + primvar,
                 std::string("interpolation = \"") + interpolation_of(layer) + "\"" +
                     (primvar == layer.name ? "" : "\n            displayName = " + quoted(layer.name)),
                 found.faces_change, [&](const VisualMesh& m, size_t) {
                     const auto of_frame = std::ranges::find_if(m.layers, [&](const LayerId& l) { return l == layer; });
                     put_layer(out, of_frame == m.layers.end() ? VisualLayer{layer, {}} : *of_frame);
                 }});
        }
        const double n = double(attributes.size() + found.surfaces.size());
        for (size_t a = 0; a < attributes.size(); ++a)
            if (const Attribute& it = attributes[a]; it.is_there)
                if (Status s = attribute(source, it.declaration, it.metadata.c_str(), it.frames,
                                         progress.part(double(a) / n, double(a + 1) / n), it.put);
                    !s)
                    return s;
        depth_ = 3;
        PrimNames names;
        for (size_t material = 0; material < found.surfaces.size(); ++material) {
            const std::string& label = found.surfaces[material].name;
            text_ += "\n";
            begin_prim("        ", "GeomSubset", names.make(label), label, kBound);
            text_ +=
                "            uniform token elementType = \"face\"\n"
                "            uniform token familyName = \"materialBind\"\n"
                "            rel material:binding = </shot/Looks/" +
                looks_[found.surfaces[material]] + ">\n";
            const double begin = double(attributes.size() + material);
            if (Status s = attribute(source, "int[] indices", "", found.faces_change,
                                     progress.part(begin / n, (begin + 1) / n),
                                     [&](const VisualMesh& m, size_t) { put_faces_of(m, int32_t(material)); });
                !s)
                return s;
            text_ += "        }\n";
        }
        text_ += "    }\n";
        return {};
    }

    // Where a solid is: a value a frame, or one.
    void write_poses(const std::vector<Pose>& poses) {
        const auto write = [&](const char* declaration, auto&& put_value) {
            text_ += std::string("        ") + declaration;
            if (poses.size() > 1) text_ += ".timeSamples = {\n";
            for (size_t i = 0; i < poses.size(); ++i) {
                if (poses.size() > 1) text_ += "            " + frame_text(shot_.frames[i]);
                text_ += poses.size() > 1 ? ": " : " = ";
                put_value(poses[i]);
                text_ += poses.size() > 1 ? ",\n" : "\n";
            }
            if (poses.size() > 1) text_ += "        }\n";
        };
        write("double3 xformOp:translate", [&](const Pose& p) { put_tuple(text_, p.position); });
        Eigen::Vector4f before = Eigen::Vector4f::Zero();  // neighbours on one side, to blend the short way round
        write("quatf xformOp:orient", [&](const Pose& p) {
            const Quat& o = p.orientation;
            Eigen::Vector4f q = Eigen::Vector4d(o.w(), o.x(), o.y(), o.z()).cast<float>();
            if (before.dot(q) < 0) q = -q;
            put_tuple(text_, before = q);
        });
        text_ += "        uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]\n";
    }

    void put_faces_of(const VisualMesh& m, int32_t material) {
        std::vector<size_t> faces;
        for (size_t t = 0; t < m.triangles.size(); ++t)
            if (m.triangle_material[t] == material) faces.push_back(t);
        put_array(text_, faces.size(), [&](size_t k) { put_integer(text_, faces[k]); });
    }

    const Shot& shot_;
    FileWriter& file_;
    const Progress& progress_;
    std::map<Surface, std::string> looks_;  // its prim
    std::string text_;                      // not yet in the file
    int depth_ = 2;                         // prims around the attributes that are being written
};

}  // namespace

Result<ExportReport> export_usda(const Shot& shot, const ExportSettings& settings, const Progress& progress) {
    std::string notes;
    const auto whole = with_solids(shot, Deforming::taken, notes);
    if (!whole) return whole.error();
    auto file = FileWriter::open(settings.file);
    if (!file) return file.error();
    if (Status s = UsdaWriter(*whole, *file, progress).write(); !s) return s.error();
    const auto stamp = file->commit();
    if (!stamp) return stamp.error();
    return ExportReport{{}, {{settings.file, *stamp}}, notes};
}

}  // namespace sunder
