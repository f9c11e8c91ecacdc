#include "fracture_tools/skin/visual_mesh.h"

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <numeric>
#include <optional>

#include "fracture_tools/fragments/fragment_faces.h"
#include "fracture_tools/skin/particle_transforms.h"
#include "fracture_tools/skin/side_by_side.h"
#include "fracture_tools/skin/skin_motion.h"
#include "fracture_tools/skin/skinning.h"
#include "fracture_tools/skin/source_skin.h"
#include "fracture_tools/skin/split_topology.h"
#include "fracture_tools/skin/surface_normals.h"
#include "fracture_tools/skin/visual_attributes.h"
#include "solver/data/disjoint_sets.h"

namespace sunder {

// An interface without an edge, and the pairs of edges that lead from one of its fragments to the other by way of a
// third.
struct Detour {
    uint32_t interface;
    std::vector<std::array<uint32_t, 2>> edges;
};

namespace {

// Of the body's particles when all is well with them.
Status check_rest(const SimulationMesh& rest, size_t n_fragments) {
    const std::string where = "simulation mesh";
    const size_t n = rest.n_particles();
    if (n != n_fragments)
        return bad_input(
            where, "there are " + std::to_string(n) + " particles for " + std::to_string(n_fragments) + " fragments",
            "pass the slice of this body alone");
    if (rest.rest_orientation.size() != n) return bad_input(where, "particles and orientations differ in number");
    for (size_t i = 0; i < n; ++i)
        if (!rest.rest_position[i].allFinite() || !rest.rest_orientation[i].coeffs().allFinite())
            return bad_input(where, "particle " + std::to_string(i) + " is not finite");
    for (size_t e = 0; e < rest.n_edges(); ++e)
        if (rest.edges[e].a >= rest.edges[e].b || rest.edges[e].b >= n)
            return bad_input(where, "edge " + std::to_string(e) + " joins no two particles of the body",
                             "pass the slice of this body alone, numbered from 0");
    if (rest.group_offset.size() != n + 1 || rest.group_member.size() != n + 2 * rest.n_edges() ||
        rest.member_edge.size() != rest.group_member.size())
        return bad_input(where, "one-rings are not built", "call build_one_rings");
    return {};
}

Error not_finite(const char* thing, size_t particle) {
    return {ErrorCode::numerical,
            std::string("the ") + thing + " of particle " + std::to_string(particle) + " is not finite",
            "frame",
            "take more substeps, or a softer or slower scene",
            {},
            {}};
}

// Interface of an edge, kNone for an edge whose fragments share none.
std::vector<uint32_t> edge_interfaces(const FragmentSet& set, const SimulationMesh& rest) {
    std::vector<uint32_t> of_edge;
    for (const Edge& e : rest.edges) {
        const std::pair wanted(FragmentId(e.a.value), FragmentId(e.b.value));
        const auto at = std::lower_bound(set.interfaces.begin(), set.interfaces.end(), wanted,
                                         [](const Interface& i, const auto& w) { return std::pair(i.a, i.b) < w; });
        const bool found = at != set.interfaces.end() && std::pair(at->a, at->b) == wanted;
        of_edge.push_back(found ? static_cast<uint32_t>(at - set.interfaces.begin()) : kNone);
    }
    return of_edge;
}

std::vector<Detour> find_detours(const FragmentSet& set, const SimulationMesh& rest,
                                 const std::vector<uint32_t>& edge_interface) {
    std::vector<uint8_t> has_edge(set.interfaces.size(), 0);
    for (uint32_t i : edge_interface)
        if (i != kNone) has_edge[i] = 1;
    std::vector<Detour> detours;
    for (uint32_t i = 0; i < has_edge.size(); ++i) {
        if (has_edge[i]) continue;
        Detour d{i, {}};
        const uint32_t a = set.interfaces[i].a.value, b = set.interfaces[i].b.value;
        uint32_t s = rest.group_offset[a], t = rest.group_offset[b];
        while (s < rest.group_offset[a + 1] && t < rest.group_offset[b + 1]) {  // both rings ascend
            if (rest.group_member[s] == rest.group_member[t])
                d.edges.push_back({rest.member_edge[s], rest.member_edge[t]});
            rest.group_member[s] < rest.group_member[t] ? ++s : ++t;
        }
        if (!d.edges.empty()) detours.push_back(std::move(d));
    }
    return detours;
}

// No other body may suffer, and nobody beyond a thread's start could catch what is thrown.
Status build_on_any_thread(const MovingBody& body, const RangeRunner& run) {
    try {
        Result<VisualMesh> mesh = body.builder->build(body.frame, run);
        if (!mesh) return mesh.error();
        *body.mesh = mesh.take();
        return {};
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::internal, "out of memory", {}, "fewer pieces need less", {}, {}};
    } catch (const std::exception& e) {
        return Error{ErrorCode::internal, std::string("unexpected: ") + e.what(), {}, {}, {}, {}};
    }
}

}  // namespace

struct VisualMeshBuilder::Impl {
    Impl(std::shared_ptr<const FragmentSet> fragments, const SimulationMesh& rest, const Pose& pose,
         VisualTopology wanted, std::shared_ptr<const VertexMotion> followed)
        : is_constant(wanted == VisualTopology::constant) {
        if (!fragments) {
            status = bad_usage("no fragments were given");
            return;
        }
        set = std::move(fragments);
        status = prepare(rest, pose);
        if (!status || !followed) return;
        follow_breaks(std::vector<uint8_t>(edges.size(), 1), run_serially);
        source.emplace(std::move(followed), rest, skin->binding());
    }

    Status prepare(const SimulationMesh& rest, const Pose& pose) {
        Result<FragmentFaces> faces = make_fragment_faces(*set);
        if (!faces) return faces.error();
        if (Status s = check_rest(rest, set->fragments.size()); !s) return s;
        if (!pose.position.allFinite() || !pose.orientation.coeffs().allFinite())
            return bad_input("pose", "it is not finite");
        Result<SplitTopology> split =
            SplitTopology::make(faces.take(), is_constant ? ListedFaces::all : ListedFaces::visible);
        if (!split) return split.error();
        topology = split.take();

        std::vector<Vec3> rest_vertex, artist_normals, interface_normals;
        for (const Vec3& v : set->vertices) rest_vertex.push_back(pose.apply(v));
        for (const Vec3f& n : set->outer_corner_normals) artist_normals.push_back(pose.orientation * n.cast<double>());
        for (const Interface& i : set->interfaces) interface_normals.push_back(pose.orientation * i.normal);
        normals.emplace(*topology, rest_vertex, artist_normals, interface_normals, set->interior_smooth_angle);
        motion.emplace(normals->needs(), topology->n_fans());
        skin.emplace(std::move(rest_vertex), rest);
        attributes.emplace(set);

        transforms.emplace(rest);
        n_particles = rest.n_particles(), edges = rest.edges;
        edge_interface = edge_interfaces(*set, rest);
        detours = find_detours(*set, rest, edge_interface);
        std::vector<uint8_t> is_lone(set->interfaces.size(), 1);
        for (const uint32_t i : edge_interface)
            if (i != kNone) is_lone[i] = 0;
        for (const Detour& d : detours) is_lone[d.interface] = 0;
        for (uint32_t i = 0; i < is_lone.size(); ++i)
            if (is_lone[i]) lone_interfaces.push_back(i);
        return {};
    }

    Status check_frame(const BodyFrame& frame) const {
        const size_t n = n_particles;
        if (frame.position.size() != n || frame.orientation.size() != n || frame.plastic_deformation.size() != n)
            return bad_input("frame", "it has " + std::to_string(frame.position.size()) + " positions, " +
                                          std::to_string(frame.orientation.size()) + " orientations and " +
                                          std::to_string(frame.plastic_deformation.size()) +
                                          " plastic deformations for " + std::to_string(n) + " particles");
        if (frame.edge_intact.size() != edges.size())
            return bad_input("frame", "it tells of " + std::to_string(frame.edge_intact.size()) +
                                          " edges, the body has " + std::to_string(edges.size()));
        if (source.has_value() != (frame.source != nullptr) || (source && frame.source->until.size() != n))
            return bad_input("frame", "it does not tell until when each fragment followed its source");
        const size_t n_moving = frame.velocity.size();
        if ((n_moving != n && n_moving != 0) || frame.angular_velocity.size() != n_moving)
            return bad_input("frame", "it has " + std::to_string(n_moving) + " velocities and " +
                                          std::to_string(frame.angular_velocity.size()) + " angular velocities for " +
                                          std::to_string(n) + " particles");
        if (!frame.piece.empty() && (frame.piece.size() != n || n_moving != n))
            return bad_input("frame", "it has " + std::to_string(frame.piece.size()) + " motions of pieces for " +
                                          std::to_string(n) + " particles, or no velocities");
        for (size_t i = 0; i < n_moving; ++i)
            if (!frame.velocity[i].allFinite() || !frame.angular_velocity[i].allFinite())
                return not_finite("velocity", i);
        for (size_t i = 0; i < n; ++i)
            if (!frame.position[i].allFinite() || !frame.orientation[i].coeffs().allFinite() ||
                !(frame.orientation[i].norm() > 0) || !frame.plastic_deformation[i].allFinite())
                return not_finite("state", i);
        return {};
    }

    // An interface is as intact as its edge. One that was left without an edge (a contact too weak to count) goes with
    // what is around it: it holds as long as a third fragment is joined to both of its own, or, where there is none, as
    // long as these are in one piece. Torn sooner it would leak, later it would tie two sides of a crack together.
    std::vector<uint8_t> interface_intact(std::span<const uint8_t> edge_intact) const {
        std::vector<uint8_t> intact(set->interfaces.size());
        if (!lone_interfaces.empty()) {
            std::vector<uint32_t> piece = disjoint_sets(n_particles);
            for (size_t e = 0; e < edges.size(); ++e)
                if (edge_intact[e]) unite(piece, edges[e].a, edges[e].b);
            for (const uint32_t i : lone_interfaces)
                intact[i] = lowest(piece, set->interfaces[i].a.value) == lowest(piece, set->interfaces[i].b.value);
        }
        for (const Detour& d : detours)
            intact[d.interface] = std::any_of(d.edges.begin(), d.edges.end(), [&](const auto& pair) {
                return edge_intact[pair[0]] && edge_intact[pair[1]];
            });
        for (size_t e = 0; e < edges.size(); ++e)
            if (edge_interface[e] != kNone) intact[edge_interface[e]] = edge_intact[e] != 0;
        return intact;
    }

    // Whether vertices are other ones than before.
    bool follow_breaks(std::span<const uint8_t> edge_intact, const RangeRunner& run) {
        if (bound && std::equal(edge_intact.begin(), edge_intact.end(), bound_edges.begin(), bound_edges.end(),
                                [](uint8_t x, uint8_t y) { return bool(x) == bool(y); }))
            return false;
        mesh.triangles = {}, mesh.skin = nullptr;
        const bool split = topology->update(interface_intact(edge_intact), run);
        skin->bind(*topology, edge_intact, run);
        if (split) normals->bind(*topology, run), attributes->list(*topology, run, mesh);
        list_triangles(split, run);
        mesh.skin = is_constant ? instances(*skin->binding()) : skin->binding();
        if (split) attributes->list_points(mesh);
        list_nearest(run);
        bound_edges.assign(edge_intact.begin(), edge_intact.end());
        bound = true;
        return true;
    }

    void list_triangles(bool split, const RangeRunner& run) {
        if (!is_constant) {
            mesh.triangles = topology->triangles();
            return;
        }
        const size_t n = topology->faces().n_faces();  // all faces are listed
        if (instance_triangles.empty()) {
            std::vector<Triangle> fans(n);
            for (uint32_t f = 0; f < n; ++f)
                for (uint32_t c = 0; c < 3; ++c) fans[f][c] = topology->corner_fan(3 * f + c);
            instance_triangles = std::move(fans);
        }
        mesh.triangles = instance_triangles;
        if (!split) return;
        const auto is_hidden = topology->face_hidden();
        auto& slot = hidden.take(n);
        run(n, 65536, [&](size_t begin, size_t end) {
            std::copy(is_hidden.begin() + begin, is_hidden.begin() + end, slot.object->begin() + begin);
        });
        mesh.triangle_hidden = ArrayRecycler<uint8_t>::share(slot);
    }

    void list_nearest(const RangeRunner& run) {
        const SkinBinding& binding = *mesh.skin;
        mesh.vertex_fragment = {};
        auto& slot = nearest.take(binding.n_vertices(), topology->n_fans());
        run(binding.chunks.size(), 16, [&](size_t begin, size_t end) {
            for (size_t c = begin; c < end; ++c)
                std::copy(binding.chunks[c]->nearest.begin(), binding.chunks[c]->nearest.end(),
                          slot.object->begin() + binding.first_vertex[c]);
        });
        mesh.vertex_fragment = ArrayRecycler<uint32_t>::share(slot);
    }

    // What a chunk's visual vertices of the split topology have, as vertices of the mesh have it.
    void list_chunk(size_t chunk, std::span<const Vec3> of_split, ArrayRecycler<Vec3f>::Slot& io_slot) const {
        if (motion->changed(chunk) <= io_slot.written) return;
        Vec3f* out = io_slot.object->data();
        for (uint32_t v = mesh.skin->first_vertex[chunk]; v < mesh.skin->first_vertex[chunk + 1]; ++v)
            out[v] = of_split[is_constant ? topology->vertex_of_fan(v) : v].cast<float>();
    }

    std::shared_ptr<const SkinBinding> instances(const SkinBinding& of_split) const {
        auto out = std::make_shared<SkinBinding>();
        out->rest_vertex = of_split.rest_vertex;
        for (size_t c = 0; c < topology->n_chunks(); ++c) {
            const SkinChunk& split = *of_split.chunks[c];
            SkinChunk chunk;
            chunk.influence = split.influence;
            for (uint32_t fan = topology->chunk_fan(c); fan < topology->chunk_fan(c + 1); ++fan) {
                const uint32_t v = topology->vertex_of_fan(fan) - of_split.first_vertex[c];
                chunk.vertex.push_back(split.vertex[v]), chunk.nearest.push_back(split.nearest[v]);
            }
            out->chunks.push_back(std::make_shared<const SkinChunk>(std::move(chunk)));
            out->first_vertex.push_back(topology->chunk_fan(c + 1));
        }
        return out;
    }

    Status follow_particles(const BodyFrame& frame, bool is_rebound, const RangeRunner& run) {
        if (source) {
            const Result<bool> is_new =
                source->take(*frame.source, frame.orientation, frame.angular_velocity, *skin->binding(), run);
            if (!is_new) return is_new.error();
            is_rebound = is_rebound || *is_new;
        }
        transforms->evaluate(frame.position, frame.orientation, frame.plastic_deformation, frame.edge_intact, particle,
                             run);
        rate.carried.clear(), rate.turned.clear(), rate.turn.clear();
        if (!frame.velocity.empty())
            transforms->rates(frame.position, frame.velocity, frame.angular_velocity, frame.edge_intact, rate, run);
        const SkinBinding& binding = *skin->binding();
        if (!motion->take(is_rebound, particle, rate)) return {};
        // Free for the next lines to write over:
        mesh.positions = {}, mesh.velocities = stated_velocities = {}, mesh.corner_normals = {};
        const size_t n = mesh.skin->n_vertices(), most = topology->n_fans();
        auto& position = positions.take(n, most);
        auto* velocity = rate.carried.empty() ? nullptr : &velocities.take(n, most);
        SkinMotion::Corrected correct;
        if (source)
            correct = [&](size_t chunk, std::span<const uint8_t> moved, std::span<Vec3> x, std::span<Vec3> v) {
                source->correct(binding, chunk, moved, x, v);
            };
        const auto placed = [&](size_t chunk, std::span<const NormalMap> normal_map) {
            normals->place_chunk(*topology, *motion, chunk, normal_map);
            list_chunk(chunk, motion->positions(), position);
            if (velocity) list_chunk(chunk, motion->velocities(), *velocity);
        };
        motion->move(binding, run, placed, correct);
        position.written = motion->frame();
        mesh.positions = ArrayRecycler<Vec3f>::share(position);
        if (velocity) velocity->written = motion->frame(), stated_velocities = ArrayRecycler<Vec3f>::share(*velocity);
        mesh.corner_normals = normals->evaluate(*topology, binding, *motion, run);
        return {};
    }

    // Of all vertices: even where nothing moves the shown time may.
    void list_accelerations(const BodyFrame& frame, const RangeRunner& run) {
        mesh.accelerations = {}, mesh.velocities = stated_velocities;
        if (frame.piece.empty()) return;
        const size_t n = mesh.skin->n_vertices();
        auto& slot = accelerations.take(n, topology->n_fans());
        const bool any_lags = std::ranges::any_of(frame.piece, [](const PieceMotion& p) { return p.velocity_lag > 0; });
        auto* const caught_up = any_lags ? &later_velocities.take(n, topology->n_fans()) : nullptr;
        const auto [scale, scale_rate] = frame.time;
        const std::span<const uint32_t> follows = mesh.vertex_fragment.vector();
        run(n, 4096, [&, scale = scale, scale_rate = scale_rate](size_t begin, size_t end) {
            for (size_t v = begin; v < end; ++v) {
                const size_t i = is_constant ? topology->vertex_of_fan(static_cast<uint32_t>(v)) : v;
                const PieceMotion& piece = frame.piece[follows[v]];
                const Vec3 &x = motion->positions()[i], a = piece.acceleration_at(x);
                const Vec3 seen = motion->velocities()[i] + scale * piece.velocity_lag * a;
                if (caught_up) (*caught_up->object)[v] = seen.cast<float>();
                // x(s(t))'' = x'' s'^2 + x' s''. Where time stands still no velocity is seen: it is the piece's.
                const Vec3 velocity = scale > 0 ? Vec3(seen / scale) : piece.velocity_at(x);
                (*slot.object)[v] = (scale * scale * a + scale_rate * velocity).cast<float>();
            }
        });
        mesh.accelerations = ArrayRecycler<Vec3f>::share(slot);
        if (caught_up) mesh.velocities = ArrayRecycler<Vec3f>::share(*caught_up);
    }

    const bool is_constant;
    Status status;
    std::shared_ptr<const FragmentSet> set;
    std::optional<SplitTopology> topology;
    std::optional<Skin> skin;
    std::optional<SurfaceNormals> normals;
    std::optional<VisualAttributes> attributes;
    std::optional<ParticleTransforms> transforms;
    size_t n_particles = 0;
    std::vector<Edge> edges;
    std::vector<uint32_t> edge_interface;
    std::vector<Detour> detours;
    std::vector<uint32_t> lone_interfaces;  // with neither an edge nor a detour

    bool bound = false;
    std::vector<uint8_t> bound_edges;          // what topology, skin and normals stand for
    SharedArray<Triangle> instance_triangles;  // of a constant topology
    ArrayRecycler<uint8_t> hidden;
    ArrayRecycler<uint32_t> nearest;
    std::optional<SkinMotion> motion;
    std::optional<SourceSkin> source;
    ParticleMaps particle;
    ParticleMapRates rate;
    SharedArray<Vec3f> stated_velocities;  // as the state tells them
    ArrayRecycler<Vec3f> positions, velocities, later_velocities, accelerations;
    VisualMesh mesh;
};

VisualMeshBuilder::VisualMeshBuilder(std::shared_ptr<const FragmentSet> fragments, const SimulationMesh& rest,
                                     const Pose& pose, VisualTopology topology,
                                     std::shared_ptr<const VertexMotion> motion)
    : impl_(std::make_unique<Impl>(std::move(fragments), rest, pose, topology, std::move(motion))) {}

VisualMeshBuilder::~VisualMeshBuilder() = default;

Result<VisualMesh> VisualMeshBuilder::build(const BodyFrame& frame, const RangeRunner& run) {
    Impl& self = *impl_;
    if (!self.status) return self.status.error();
    if (Status s = self.check_frame(frame); !s) return s.error();
    const bool is_rebound = self.follow_breaks(frame.edge_intact, run);
    if (Status s = self.follow_particles(frame, is_rebound, run); !s) return s.error();
    self.list_accelerations(frame, run);
    return self.mesh;
}

size_t VisualMeshBuilder::size() const { return impl_->topology ? impl_->topology->n_fans() : 0; }

std::vector<Status> build_meshes(std::span<const MovingBody> bodies, const RangeRunner& run) {
    std::vector<size_t> order(bodies.size());  // the largest first: none of them is begun last
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return bodies[a].builder->size() > bodies[b].builder->size(); });
    std::vector<Status> status(bodies.size());
    run_side_by_side(bodies.size(), run, [&](size_t i, const RangeRunner& of_body) {
        const MovingBody& body = bodies[order[i]];
        status[order[i]] = build_on_any_thread(body, of_body);
    });
    return status;
}

}  // namespace sunder
