#include "nodes/graph/field_json.h"
#include "nodes/graph/field_parameters.h"
#include "nodes/graph/json.h"
#include "nodes/graph/json_value.h"
#include "nodes/graph/value_arrays.h"
#include "solver/scene/scene_fields.h"

namespace sunder {
namespace {

Json json_of(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }
Json json_of(const Quat& q) { return Json::array({q.w(), q.x(), q.y(), q.z()}); }
Json json_of(const Pose& p) { return {{"position", json_of(p.position)}, {"orientation", json_of(p.orientation)}}; }

Json json_of(const Shape& s) {
    switch (s.kind) {
        case ShapeKind::plane:
            return {{"kind", "plane"}};
        case ShapeKind::sphere:
            return {{"kind", "sphere"}, {"radius", s.radius}};
        case ShapeKind::box:
            return {{"kind", "box"}, {"half_extents", json_of(s.half_extents)}};
        case ShapeKind::capsule:
            return {{"kind", "capsule"}, {"radius", s.radius}, {"half_height", s.half_height}};
        case ShapeKind::mesh:
            return {{"kind", "mesh"},
                    {"voxel_size", s.grid->voxel_size},
                    {"nodes", s.grid->nodes},
                    {"bounds", {json_of(s.grid->bounds.min), json_of(s.grid->bounds.max)}}};
    }
    return nullptr;
}

Json info_of(const TriMesh& m) { return {{"materials", m.material_names}}; }
Json info_of(const FragmentSet& s) {
    return {{"materials", s.material_names}, {"interior_material", s.interior_material},
            {"source_path", s.source_path},  {"source_volume", s.source_volume},
            {"source_area", s.source_area},  {"warnings", s.warnings}};
}
Json info_of(const BodyValue& b) {
    return {{"name", b.name},
            {"pose", json_of(b.pose)},
            {"velocity", json_of(b.velocity)},
            {"angular_velocity", json_of(b.angular_velocity)},
            {"material", json_of_fields(material_fields(), b.material)}};
}
Json info_of(const RigidBody& r) {
    return {{"name", r.name}, {"shape", json_of(r.shape)}, {"mass", r.mass}, {"pose", json_of(r.pose)}};
}
Json info_of(const ColliderValue& c) {
    return {{"name", c.collider.name},
            {"shape", c.surface ? Json{{"kind", "mesh"}} : json_of(c.collider.shape)},
            {"pose", json_of(c.pose)},
            {"warnings", c.warnings}};
}
Json info_of(const PinValue& p) {
    return {{"name", p.name}, {"on_body", p.body}, {"pose", json_of(p.pose)}, {"active", p.active}};
}
Json info_of(const Force& f) {
    return {{"acceleration", json_of(f.acceleration)}, {"wind", json_of(f.wind)}, {"drag", f.drag}};
}
Json info_of(const StateValue& s) {
    Json bodies = Json::array(), rigid = Json::array();
    for (const Body& b : s.scene->bodies)
        bodies.push_back({{"name", b.name},
                          {"particles", {b.particle_begin, b.particle_end}},
                          {"edges", {b.edge_begin, b.edge_end}}});
    for (const RigidBody& r : s.scene->rigid_bodies) rigid.push_back(r.name);
    return {{"frame", number_json(s.frame)},
            {"simulated_frame", s.at.frame},
            {"time_scale", s.at.scale},
            {"time", s.state->time},
            {"bodies", bodies},
            {"rigid_bodies", rigid},
            {"report", json_of_fields(report_fields(), s.report)},
            {"warnings", s.warnings}};
}
Json info_of(const BodyMesh& m) {
    return {{"on_body", m.body},
            {"materials", m.fragments->material_names},
            {"interior_material", m.fragments->interior_material}};
}
Json info_of(const BakeItem& b) { return {{"path", b.path}}; }

}  // namespace

Json value_info(const Value& value) {
    return std::visit([](const auto& v) { return info_of(*v); }, value);
}

}  // namespace sunder
