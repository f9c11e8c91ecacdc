#include "nodes/graph/value_arrays.h"

#include <algorithm>
#include <functional>

#include "fracture_tools/fragments/prefracture.h"
#include "fracture_tools/mesh/layer_property.h"
#include "fracture_tools/skin/particle_transforms.h"
#include "fracture_tools/skin/skinning.h"
#include "nodes/graph/body_edges.h"
#include "nodes/graph/nearest_name.h"
#include "solver/solver.h"

namespace sunder {
namespace {

template <class T>
constexpr ArrayType type_code() {
    if constexpr (std::is_same_v<T, uint8_t>)
        return ArrayType::uint8;
    else if constexpr (std::is_same_v<T, int32_t>)
        return ArrayType::int32;
    else if constexpr (std::is_same_v<T, uint32_t>)
        return ArrayType::uint32;
    else if constexpr (std::is_same_v<T, float>)
        return ArrayType::float32;
    else
        return ArrayType::float64;
}

// The numbers of `values` as they lie in memory: T is a number or a fixed-size row of numbers N.
template <class N, class T>
ArrayView as_is(const std::vector<T>& values) {
    static_assert(sizeof(T) % sizeof(N) == 0);
    ArrayView view{type_code<N>(), {values.size()}, values.data(), nullptr};
    if (sizeof(T) != sizeof(N)) view.shape.push_back(sizeof(T) / sizeof(N));
    return view;
}

template <class N, class T>
ArrayView as_is(const SharedArray<T>& values) {
    return as_is<N>(values.vector());
}

// A new array: `put(element)` returns an std::array of N for each element of `elements`.
template <class N, size_t Width, class Elements, class Put>
ArrayView made(const Elements& elements, Put&& put, std::vector<uint64_t> row_shape = {Width}) {
    auto numbers = std::make_shared<std::vector<N>>();
    numbers->reserve(elements.size() * Width);
    for (const auto& e : elements) {
        const std::array<N, Width> row = put(e);
        numbers->insert(numbers->end(), row.begin(), row.end());
    }
    ArrayView view{type_code<N>(), {elements.size()}, numbers->data(), numbers};
    if (Width > 1) view.shape.insert(view.shape.end(), row_shape.begin(), row_shape.end());
    return view;
}

// The same of the influences of a skin's vertices, one after the other.
template <class N, class Put>
ArrayView made_of_influences(const SkinBinding& skin, Put&& put) {
    auto numbers = std::make_shared<std::vector<N>>();
    for (const auto& chunk : skin.chunks)
        for (size_t v = 0; v < chunk->n_vertices(); ++v)
            for (const SkinInfluence& i : chunk->influences(v)) numbers->push_back(put(i));
    return {type_code<N>(), {numbers->size()}, numbers->data(), numbers};
}

ArrayView rest_positions(const SkinBinding& skin) {
    auto numbers = std::make_shared<std::vector<double>>();
    for (uint32_t v : skin.pool_vertices()) {
        const Vec3& x = (*skin.rest_vertex)[v];
        numbers->insert(numbers->end(), x.begin(), x.end());
    }
    return {type_code<double>(), {numbers->size() / 3, 3}, numbers->data(), numbers};
}

std::array<double, 3> row_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
std::array<double, 4> row_of(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

ArrayView quaternions(const std::vector<Quat>& values) {
    return made<double, 4>(values, [](const Quat& q) { return row_of(q); });
}

ArrayView matrices(const std::vector<Mat3>& values) {
    return made<double, 9>(values,
                           [](const Mat3& m) {
                               return std::array<double, 9>{m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1),
                                                            m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
                           },
                           {3, 3});
}

// For uint32_t that leave as such.
ArrayView own(std::vector<PieceId> values) {
    auto kept = std::make_shared<std::vector<PieceId>>(std::move(values));
    return {ArrayType::uint32, {kept->size()}, numbers(std::span<const PieceId>(*kept)).data(), kept};
}

ArrayView own(std::vector<double> values) {
    auto kept = std::make_shared<std::vector<double>>(std::move(values));
    return {ArrayType::float64, {kept->size()}, kept->data(), kept};
}

std::array<uint8_t, 1> kept(const Inactivity& i) { return {static_cast<uint8_t>(i.what & ~Inactivity::kTouched)}; }
std::array<int32_t, 2> pusher(const BrokenEdge& b) {
    return {static_cast<int32_t>(b.by.kind), static_cast<int32_t>(b.by.number)};
}

// Lists that may be left out keep their width when they are empty.
template <class N, size_t Width, class T>
ArrayView corners(const std::vector<T>& values) {
    return {type_code<N>(), {values.size(), Width}, values.data(), nullptr};
}

template <class N, size_t Width, class T>
ArrayView corners(const SharedArray<T>& values) {
    return corners<N, Width>(values.vector());
}

ParticleMaps particle_maps(const StateValue& s) {
    ParticleMaps maps;
    ParticleTransforms(s.scene->rest)
        .evaluate(s.state->position, s.state->orientation, s.state->plastic_deformation, s.state->edge_intact, maps);
    return maps;
}

// As rows of linear part and offset.
ArrayView affine_maps(const std::vector<Affine>& maps) {
    return made<double, 12>(maps,
                            [](const Affine& a) {
                                std::array<double, 12> rows;
                                for (int i = 0; i < 3; ++i)
                                    for (int j = 0; j < 4; ++j) rows[4 * i + j] = j < 3 ? a.linear(i, j) : a.offset(i);
                                return rows;
                            },
                            {3, 4});
}

// From rest to world.
ArrayView transforms(const StateValue& s) {
    const ParticleMaps maps = particle_maps(s);
    std::vector<Affine> whole;
    for (size_t i = 0; i < maps.carried.size(); ++i) whole.push_back(maps.whole(i));
    return affine_maps(whole);
}

// What turns as a vertex does, at rest where nothing does.
ArrayView turned_arms(const StateValue& s) {
    ParticleMaps maps = particle_maps(s);
    maps.turned.resize(maps.carried.size(), {Mat3::Zero(), Vec3::Zero()});
    return affine_maps(maps.turned);
}

ArrayView turns(const StateValue& s) {
    std::vector<Quat> turn;
    for (size_t i = 0; i < s.state->orientation.size(); ++i)
        turn.push_back(s.state->orientation[i].normalized() * s.scene->rest.rest_orientation[i].conjugate());
    return quaternions(turn);
}

template <class N, class Get>
ArrayView of_broken(const StateValue& s, const Get& get) {
    return made<N, 1>(s.state->broken, [&](const BrokenEdge& b) { return std::array<N, 1>{get(b)}; });
}

template <class T>
struct Entry {
    const char* name;
    ArrayView (*get)(const T&);
};

const std::vector<Entry<SimulationMesh>>& entries_of(const SimulationMesh*) {
    using M = SimulationMesh;
    static const std::vector<Entry<M>> entries = {
        {"rest_position", [](const M& m) { return as_is<double>(m.rest_position); }},
        {"rest_orientation", [](const M& m) { return quaternions(m.rest_orientation); }},
        {"radii", [](const M& m) { return as_is<double>(m.radii); }},
        {"volume", [](const M& m) { return as_is<double>(m.volume); }},
        {"mass", [](const M& m) { return as_is<double>(m.mass); }},
        {"edges",
         [](const M& m) {
             return made<uint32_t, 2>(m.edges, [](const Edge& e) { return std::array{e.a.value, e.b.value}; });
         }},
        {"edge_area",
         [](const M& m) { return made<double, 1>(m.edges, [](const Edge& e) { return std::array{e.area}; }); }},
        {"edge_toughness_factor", [](const M& m) {
             return made<double, 1>(m.edges, [](const Edge& e) { return std::array{e.toughness_factor}; });
         }}};
    return entries;
}

const std::vector<Entry<StateValue>>& entries_of(const StateValue*) {
    using S = StateValue;
    static const std::vector<Entry<S>> entries = {
        {"position", [](const S& s) { return as_is<double>(s.state->position); }},
        {"orientation", [](const S& s) { return quaternions(s.state->orientation); }},
        {"velocity", [](const S& s) { return as_is<double>(s.state->velocity); }},
        {"angular_velocity", [](const S& s) { return as_is<double>(s.state->angular_velocity); }},
        {"plastic_deformation", [](const S& s) { return matrices(s.state->plastic_deformation); }},
        {"plastic_curvature", [](const S& s) { return matrices(s.state->plastic_curvature); }},
        {"edge_damage", [](const S& s) { return as_is<double>(s.state->edge_damage); }},
        {"edge_toughness", [](const S& s) { return own(edge_toughness(s)); }},
        {"toughness", [](const S& s) { return own(fragment_toughness(s)); }},
        {"yield", [](const S& s) { return as_is<double>(s.state->yield); }},
        {"strain", [](const S& s) { return as_is<double>(s.state->strain); }},
        {"particle_transform", transforms},
        {"particle_turned", turned_arms},
        {"particle_turn", turns},
        {"group_rotation", [](const S& s) { return quaternions(s.state->group_rotation); }},
        {"body", [](const S& s) { return as_is<uint32_t>(s.scene->rest.body); }},
        {"fragment", [](const S& s) { return as_is<uint32_t>(s.scene->rest.fragment); }},
        {"piece", [](const S& s) { return own(connected_pieces(s.scene->rest, s.state->edge_intact)); }},
        {"asleep", [](const S& s) { return as_is<uint8_t>(s.state->asleep); }},
        {"kept", [](const S& s) { return made<uint8_t, 1>(s.state->inactive, kept); }},
        {"edge_intact", [](const S& s) { return as_is<uint8_t>(s.state->edge_intact); }},
        {"broken_edge", [](const S& s) { return of_broken<uint32_t>(s, [](auto& b) { return b.edge.value; }); }},
        {"broken_time", [](const S& s) { return of_broken<double>(s, [](auto& b) { return b.time; }); }},
        {"broken_strain", [](const S& s) { return of_broken<double>(s, [](auto& b) { return b.strain; }); }},
        {"broken_toughness", [](const S& s) { return of_broken<double>(s, [](auto& b) { return b.toughness; }); }},
        {"broken_by", [](const S& s) { return made<int32_t, 2>(s.state->broken, pusher); }},
        {"rigid_position",
         [](const S& s) {
             return made<double, 3>(s.state->rigid_bodies, [](const RigidBodyState& r) { return row_of(r.position); });
         }},
        {"rigid_orientation",
         [](const S& s) {
             return made<double, 4>(s.state->rigid_bodies,
                                    [](const RigidBodyState& r) { return row_of(r.orientation); });
         }},
        {"rigid_velocity",
         [](const S& s) {
             return made<double, 3>(s.state->rigid_bodies, [](const RigidBodyState& r) { return row_of(r.velocity); });
         }},
        {"rigid_angular_velocity", [](const S& s) {
             return made<double, 3>(s.state->rigid_bodies,
                                    [](const RigidBodyState& r) { return row_of(r.angular_velocity); });
         }}};
    return entries;
}

template <size_t Width, class Get>
ArrayView of_interfaces(const BodyValue& body, const Get& get) {
    return made<double, Width>(interface_places(body), get);
}

const std::vector<Entry<BodyValue>>& entries_of(const BodyValue*) {
    using B = BodyValue;
    using Place = InterfacePlace;
    static const std::vector<Entry<B>> entries = {
        {"edge_toughness", [](const B& b) { return own(edge_toughness(b)); }},
        {"edge_middle",
         [](const B& b) { return of_interfaces<3>(b, [](const Place& p) { return row_of(p.middle); }); }},
        {"edge_normal",
         [](const B& b) { return of_interfaces<3>(b, [](const Place& p) { return row_of(p.normal); }); }},
        {"edge_share",
         [](const B& b) { return of_interfaces<1>(b, [](const Place& p) { return std::array{p.share}; }); }},
        {"cluster", [](const B& b) {
             return made<int32_t, 1>(b.fragments->fragments, [](const Fragment& f) { return std::array{f.cluster}; });
         }}};
    return entries;
}

const std::vector<Entry<FragmentSet>>& entries_of(const FragmentSet*) {
    using F = FragmentSet;
    static const std::vector<Entry<F>> entries = {
        {"rest_position",
         [](const F& s) { return made<double, 3>(s.fragments, [](const Fragment& f) { return row_of(f.centroid); }); }},
        {"rest_orientation",
         [](const F& s) {
             return made<double, 4>(s.fragments, [](const Fragment& f) { return row_of(f.orientation); });
         }},
        {"radii",
         [](const F& s) { return made<double, 3>(s.fragments, [](const Fragment& f) { return row_of(f.radii); }); }},
        {"volume",
         [](const F& s) {
             return made<double, 1>(s.fragments, [](const Fragment& f) { return std::array{f.volume}; });
         }},
        {"cluster",
         [](const F& s) {
             return made<int32_t, 1>(s.fragments, [](const Fragment& f) { return std::array{f.cluster}; });
         }},
        {"toughness_factor",
         [](const F& s) {
             return made<double, 1>(s.fragments, [](const Fragment& f) { return std::array{f.toughness_factor}; });
         }},
        {"yield_factor",
         [](const F& s) {
             return made<double, 1>(s.fragments, [](const Fragment& f) { return std::array{f.yield_factor}; });
         }},
        {"density_factor",
         [](const F& s) {
             return made<double, 1>(s.fragments, [](const Fragment& f) { return std::array{f.density_factor}; });
         }},
        {"interface_toughness_factor",
         [](const F& s) {
             return made<double, 1>(s.interfaces, [](const Interface& i) { return std::array{i.toughness_factor}; });
         }},
        {"edges",
         [](const F& s) {
             return made<uint32_t, 2>(s.interfaces, [](const Interface& i) {
                 return std::array{i.a.value, i.b.value};
             });
         }},
        {"interface_area",
         [](const F& s) {
             return made<double, 1>(s.interfaces, [](const Interface& i) { return std::array{i.area}; });
         }},
        {"interface_normal",
         [](const F& s) { return made<double, 3>(s.interfaces, [](const Interface& i) { return row_of(i.normal); }); }},
        {"interface_centroid", [](const F& s) {
             return made<double, 3>(s.interfaces, [](const Interface& i) { return row_of(i.centroid); });
         }}};
    return entries;
}

const std::vector<Entry<TriMesh>>& entries_of(const TriMesh*) {
    using M = TriMesh;
    static const std::vector<Entry<M>> entries = {
        {"positions", [](const M& m) { return as_is<double>(m.positions); }},
        {"triangles", [](const M& m) { return as_is<uint32_t>(m.triangles); }},
        {"normals", [](const M& m) { return corners<float, 3>(m.corner_normals); }},
        {"uvs", [](const M& m) { return corners<float, 2>(m.corner_uvs); }},
        {"colors", [](const M& m) { return corners<float, 4>(m.corner_colors); }},
        {"face_material", [](const M& m) { return as_is<int32_t>(m.triangle_material); }}};
    return entries;
}

const std::vector<Entry<BodyMesh>>& entries_of(const BodyMesh*) {
    using M = BodyMesh;
    static const std::vector<Entry<M>> entries = {
        {"positions", [](const M& m) { return as_is<float>(m.mesh.positions); }},
        {"triangles", [](const M& m) { return as_is<uint32_t>(m.mesh.triangles); }},
        {"normals", [](const M& m) { return corners<float, 3>(m.mesh.corner_normals); }},
        {"uvs", [](const M& m) { return corners<float, 2>(m.mesh.corner_uvs); }},
        {"colors", [](const M& m) { return corners<float, 4>(m.mesh.corner_colors); }},
        {"rim", [](const M& m) { return as_is<float>(m.mesh.corner_rim); }},
        {"face_interface", [](const M& m) { return as_is<int32_t>(m.mesh.triangle_interface); }},
        {"face_material", [](const M& m) { return as_is<int32_t>(m.mesh.triangle_material); }},
        {"face_fragment", [](const M& m) { return as_is<uint32_t>(m.mesh.triangle_fragment); }},
        {"face_hidden", [](const M& m) { return as_is<uint8_t>(m.mesh.triangle_hidden); }},
        {"velocities", [](const M& m) { return corners<float, 3>(m.mesh.velocities); }},
        {"accelerations", [](const M& m) { return corners<float, 3>(m.mesh.accelerations); }},
        {"vertex_fragment", [](const M& m) { return as_is<uint32_t>(m.mesh.vertex_fragment); }},
        {"rest_positions", [](const M& m) { return rest_positions(*m.mesh.skin); }},
        {"influence_offset",
         [](const M& m) {
             return made<uint32_t, 1>(m.mesh.skin->influence_offset(), [](uint32_t o) { return std::array{o}; });
         }},
        {"influence_particle",
         [](const M& m) {
             return made_of_influences<uint32_t>(*m.mesh.skin, [](const SkinInfluence& i) { return i.particle; });
         }},
        {"influence_weight", [](const M& m) {
             return made_of_influences<double>(*m.mesh.skin, [](const SkinInfluence& i) { return double{i.weight}; });
         }}};
    return entries;
}

using Getter = std::function<ArrayView()>;
using Table = std::vector<std::pair<std::string, Getter>>;

template <class T>
void add(Table& table, const T& object) {
    for (const Entry<T>& e : entries_of(&object))
        table.emplace_back(e.name, [get = e.get, &object] { return get(object); });
}

// Layers by what they are and their names: "corner_uv:Wall .001".
template <class Layer>
void add_layers(Table& table, const std::vector<Layer>& layers) {
    for (const Layer& layer : layers)
        table.emplace_back(layer_prefix(layer) + layer.name, [&layer] {
            ArrayView view{layer.is_blended() ? ArrayType::float32 : ArrayType::int32,
                           {layer.n_rows()},
                           layer.values.data(),
                           nullptr};
            if (layer.width > 1) view.shape.push_back(layer.width);
            return view;
        });
}

// What can be read of a value. The getters hold as long as the value.
Table table_of(const Value& value) {
    Table table;
    std::visit(
        [&]<class T>(const std::shared_ptr<const T>& v) {
            if constexpr (std::is_same_v<T, StateValue>)
                add(table, *v), add(table, v->scene->rest);
            else if constexpr (std::is_same_v<T, BodyValue>)
                add(table, *v->rest), add(table, *v);
            else if constexpr (std::is_same_v<T, FragmentSet> || std::is_same_v<T, TriMesh> ||
                               std::is_same_v<T, BodyMesh>)
                add(table, *v);
            else if constexpr (std::is_same_v<T, PinValue>)
                table.emplace_back("particles", [&v] { return as_is<uint32_t>(*v->particles); });
            if constexpr (std::is_same_v<T, TriMesh>) add_layers(table, v->layers);
            if constexpr (std::is_same_v<T, BodyMesh>) add_layers(table, v->mesh.layers);
        },
        value);
    return table;
}

}  // namespace

std::vector<std::string> array_names(const Value& value) {
    std::vector<std::string> names;
    for (const auto& [name, unused] : table_of(value)) names.push_back(name);
    return names;
}

Result<ArrayView> value_array(const Value& value, std::string_view name) {
    for (const auto& [known, get] : table_of(value))
        if (known == name) return get();
    return bad_usage("a " + std::string(name_of(type_of(value))) + " has no array '" + std::string(name) + "'",
                     permitted_text(std::string(name), array_names(value)));
}

Result<Value> value_part(const Value& value, std::string_view name, uint64_t index) {
    const auto* set = std::get_if<std::shared_ptr<const FragmentSet>>(&value);
    if (!set || name != "fragment_mesh")
        return bad_usage("a " + std::string(name_of(type_of(value))) + " has no part '" + std::string(name) + "'",
                         set ? "fragment_mesh" : "");
    if (index >= (*set)->fragments.size())
        return bad_usage("there is no fragment " + std::to_string(index),
                         "0 to " + std::to_string((*set)->fragments.size()) + ", the last excluded");
    return make_value(fragment_mesh(**set, FragmentId(index)));
}

Value state_value(StateFile file) {
    auto scene = std::make_shared<Scene>();
    SimulationMesh& rest = scene->rest;
    const size_t n = file.body.size();
    // What the file does not tell is absent, not invented: not a number.
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    rest.rest_position.assign(n, Vec3::Constant(unknown));
    rest.rest_orientation.assign(n, Quat(unknown, unknown, unknown, unknown));
    rest.radii.assign(n, Vec3::Constant(unknown));
    rest.volume.assign(n, unknown), rest.mass.assign(n, unknown);
    rest.body = std::move(file.body), rest.fragment = std::move(file.fragment);
    for (const auto& [a, b] : file.edges) rest.edges.push_back({ParticleId(a), ParticleId(b), unknown});
    build_one_rings(rest);
    const auto state = std::make_shared<const FrameState>(std::move(file.state));
    return make_value(StateValue{.frame = file.frame, .at = file.at, .scene = scene, .state = state});
}

}  // namespace sunder
