#include "nodes/types/mesh_fault_report.h"

#include <array>
#include <cstdio>

#include "fracture_tools/repair/mesh_faults.h"
#include "nodes/files/ply_file.h"

namespace sunder {
namespace {

/// By fault id: hues that are told apart on grey.
constexpr std::array<std::array<uint8_t, 3>, 8> kColours = {{{230, 25, 75},
                                                             {60, 180, 75},
                                                             {255, 225, 25},
                                                             {0, 130, 200},
                                                             {245, 130, 48},
                                                             {145, 30, 180},
                                                             {70, 240, 240},
                                                             {240, 50, 230}}};

ByteBuffer encode_faces(const MeshFaults& found) {
    ByteBuffer bytes;
    if (found.faces.triangles.empty()) return bytes;
    PlyHeader header;
    header.comments = {"sunder faults: faces with a fault, by its id"};
    header.elements = {{"vertex", found.faces.positions.size(), ply_scalars("x y z", PlyType::float64)},
                       {"face", found.faces.triangles.size(), {}}};
    std::vector<PlyProperty>& face = header.elements[1].properties;
    face.push_back({"vertex_indices", PlyType::int32, PlyType::uint8});
    face.push_back({"fault", PlyType::int32, {}});
    for (const PlyProperty& p : ply_scalars("red green blue", PlyType::uint8)) face.push_back(p);
    write_ply_header(bytes, header);
    for (const Vec3& p : found.faces.positions)
        for (int k = 0; k < 3; ++k) bytes.number(p[k]);
    for (size_t id = 0; id < found.faults.size(); ++id)
        for (uint32_t t : found.faults[id].triangles) {
            bytes.number(uint8_t{3});
            for (uint32_t v : found.faces.triangles[t]) bytes.number(static_cast<int32_t>(v));
            bytes.number(static_cast<int32_t>(id));
            for (uint8_t c : kColours[id % kColours.size()]) bytes.number(c);
        }
    return bytes;
}

std::string row(const std::string& id, const std::string& fault, const std::string& count, const std::string& first,
                const std::string& repair) {
    char text[256];
    std::snprintf(text, sizeof text, "%3s  %-20s %9s  %-36s %s", id.c_str(), fault.c_str(), count.c_str(),
                  first.c_str(), repair.c_str());
    return text;
}

}  // namespace

MeshFaultReport report_mesh_faults(const TriMesh& mesh) {
    const MeshFaults found = find_mesh_faults(mesh);
    const MeshReport& r = found.report;
    MeshFaultReport out;
    out.n_faults = found.faults.size();
    out.faces = encode_faces(found);
    out.json = {{"triangles", r.n_triangles}, {"vertices", r.n_vertices}, {"shells", r.n_components},
                {"volume", r.volume},         {"area", r.area},           {"faults", Json::array()}};
    if (out.n_faults > 0) out.table.push_back(row("id", "fault", "count", "first near", "repair"));
    for (size_t id = 0; id < found.faults.size(); ++id) {
        const MeshFault& f = found.faults[id];
        const bool has_place = !f.triangles.empty() || f.kind == MeshFaultKind::isolated_vertex;
        const std::string text = f.kind == MeshFaultKind::bad_number ? r.faults[id] : fault_text(f);
        Json entry = {{"kind", name_of(f.kind)}, {"id", id}, {"count", f.count}};
        if (has_place) {
            entry["triangles"] = f.triangles.size();
            entry["first"] = {f.first.x(), f.first.y(), f.first.z()};
        }
        entry["text"] = text;
        entry["repair"] = repair_of(f.kind);
        out.json["faults"].push_back(std::move(entry));
        out.table.push_back(row(std::to_string(id), name_of(f.kind), std::to_string(f.count),
                                has_place                             ? place_text(f.first)
                                : f.kind == MeshFaultKind::bad_number ? text
                                                                      : "",
                                repair_of(f.kind)));
    }
    return out;
}

}  // namespace sunder
