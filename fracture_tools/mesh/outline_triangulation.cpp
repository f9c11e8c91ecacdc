// The only file that includes CGAL's Triangulation_2.
#include "fracture_tools/mesh/outline_triangulation.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <map>

#include "solver/data/ids.h"

namespace sunder {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<uint32_t, Kernel>;
enum class Place : uint8_t { unknown, outside, inside };
using FaceBase =
    CGAL::Triangulation_face_base_with_info_2<Place, Kernel, CGAL::Constrained_triangulation_face_base_2<Kernel>>;
using Plane =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;
using Loops = std::span<const std::span<const uint32_t>>;

/// One side of a loop, from the vertex at `corner` to the next one.
struct OutlineSide {
    uint32_t from, to, corner;
    auto operator<=>(const OutlineSide&) const = default;
};

class Filling {
public:
    Filling(std::span<const Vec3> points, Loops loops, const PlaneProjection& project) {
        is_simple_ = insert(points, loops, project);
        std::sort(sides_.begin(), sides_.end());
    }

    std::optional<std::vector<Triangle>> run() {
        // Of collinear points CGAL's faces are segments, which have two neighbours.
        if (!is_simple_ || plane_.dimension() < 2) return std::nullopt;
        mark_inside();
        std::vector<Triangle> triangles;
        for (auto f = plane_.finite_faces_begin(); f != plane_.finite_faces_end(); ++f) {
            if (f->info() != Place::inside) continue;
            Triangle& t = triangles.emplace_back();
            for (int k = 0; k < 3; ++k) {
                t[k] = corner_of(f, k);
                if (t[k] == kNone || runs_backward(f, k)) return std::nullopt;
            }
        }
        return triangles;
    }

private:
    bool insert(std::span<const Vec3> points, Loops loops, const PlaneProjection& project) {
        std::map<uint32_t, Plane::Vertex_handle> handle;
        uint32_t corner = 0;
        try {
            for (const auto& loop : loops) {
                for (uint32_t v : loop) {
                    const auto [at, is_new] = handle.try_emplace(v);
                    if (!is_new) continue;
                    const auto [x, y] = project(points[v]);
                    at->second = plane_.insert(Kernel::Point_2(x, y));
                    if (plane_.number_of_vertices() != handle.size()) return false;  // two vertices in one point
                    at->second->info() = v;
                }
                for (size_t k = 0; k < loop.size(); ++k, ++corner) {
                    const uint32_t v = loop[k], w = loop[(k + 1) % loop.size()];
                    sides_.push_back({v, w, corner});
                    plane_.insert_constraint(handle[v], handle[w]);
                    if (!plane_.is_edge(handle[v], handle[w])) return false;  // a vertex lies on it
                }
            }
        } catch (const Plane::Intersection_of_constraints_exception&) {
            return false;
        }
        return true;
    }

    size_t n_sides(uint32_t from, uint32_t to) const {
        const auto begin = std::lower_bound(sides_.begin(), sides_.end(), OutlineSide{from, to, 0});
        return static_cast<size_t>(std::upper_bound(begin, sides_.end(), OutlineSide{from, to, kNone}) - begin);
    }

    /// What runs there and back parts nothing.
    bool parts(const Plane::Face_handle& face, int k) const {
        if (!plane_.is_constrained({face, k})) return false;
        const uint32_t v = face->vertex(Plane::cw(k))->info(), w = face->vertex(Plane::ccw(k))->info();
        return (n_sides(v, w) + n_sides(w, v)) % 2 == 1;
    }

    /// Whether a loop goes along the side of an inner face the wrong way round.
    bool runs_backward(const Plane::Face_handle& face, int k) const {
        const uint32_t v = face->vertex(Plane::ccw(k))->info(), w = face->vertex(Plane::cw(k))->info();
        return parts(face, k) && n_sides(v, w) < n_sides(w, v);
    }

    void mark_inside() {
        for (auto f = plane_.all_faces_begin(); f != plane_.all_faces_end(); ++f) f->info() = Place::unknown;
        std::vector<Plane::Face_handle> stack = {plane_.infinite_face()};
        stack[0]->info() = Place::outside;
        while (!stack.empty()) {
            const Plane::Face_handle face = stack.back();
            stack.pop_back();
            for (int k = 0; k < 3; ++k) {
                const Plane::Face_handle other = face->neighbor(k);
                if (other->info() != Place::unknown) continue;
                const bool inside = (face->info() == Place::inside) != parts(face, k);
                other->info() = inside ? Place::inside : Place::outside;
                stack.push_back(other);
            }
        }
    }

    /// The side that the k-th corner of a face is first met from, going clockwise around its vertex, begins there.
    uint32_t corner_of(Plane::Face_handle face, int k) const {
        const Plane::Vertex_handle v = face->vertex(k);
        for (const Plane::Face_handle first = face;;) {
            k = face->index(v);
            const uint32_t next = face->vertex(Plane::ccw(k))->info();
            const auto side = std::lower_bound(sides_.begin(), sides_.end(), OutlineSide{v->info(), next, 0});
            if (side != sides_.end() && side->from == v->info() && side->to == next) return side->corner;
            face = face->neighbor(Plane::cw(k));
            if (face == first || plane_.is_infinite(face)) return kNone;
        }
    }

    Plane plane_;
    std::vector<OutlineSide> sides_;  // ascending
    bool is_simple_ = false;
};

/// Less area than this share of the polygon's is none.
constexpr double kFlat = 1e-12;

/// Of corners 0 .. n - 1, from one of them.
std::vector<Triangle> fan(uint32_t n, uint32_t from) {
    std::vector<Triangle> triangles;
    for (uint32_t k = 1; k + 1 < n; ++k) triangles.push_back({from, (from + k) % n, (from + k + 1) % n});
    return triangles;
}

}  // namespace

PlaneProjection::PlaneProjection(const Vec3& normal) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u, v);
}

std::optional<std::vector<Triangle>> triangulate_outline(std::span<const Vec3> points, Loops loops,
                                                         const PlaneProjection& project) {
    return Filling(points, loops, project).run();
}

std::optional<std::vector<Triangle>> triangulate_polygon(std::span<const Vec3> points,
                                                         std::span<const uint32_t> vertex) {
    const auto n = static_cast<uint32_t>(vertex.size());
    const auto at = [&](uint32_t k) -> const Vec3& { return points[vertex[k % n]]; };
    Vec3 normal = Vec3::Zero();  // twice the area vector (Newell)
    for (uint32_t k = 1; k + 1 < n; ++k) normal += (at(k) - at(0)).cross(at(k + 1) - at(0));
    const auto is_left = [&](uint32_t i, uint32_t j, uint32_t k) {
        return (at(j) - at(i)).cross(at(k) - at(i)).dot(normal) > kFlat * normal.squaredNorm();
    };
    std::vector<uint32_t> blunt;  // corners at which it does not turn left
    bool is_fan = true;           // seen from the first corner the others follow one another
    for (uint32_t k = 0; k < n; ++k) {
        if (!is_left(k + n - 1, k, k + 1)) blunt.push_back(k);
        is_fan &= k == 0 || k + 1 == n || is_left(0, k, k + 1);
    }
    if (blunt.empty() && is_fan) return fan(n, 0);
    if (n == 4 && blunt.size() == 1) return fan(n, blunt[0]);
    auto triangles = triangulate_outline(points, {&vertex, 1}, PlaneProjection(normal));
    if (!triangles) return std::nullopt;
    for (Triangle& t : *triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::sort(triangles->begin(), triangles->end());  // CGAL's order goes by addresses
    return triangles;
}

}  // namespace sunder
