#include "solver/matching/shape_matching.h"

#include "solver/data/invariant.h"

namespace sunder {
namespace {

// A += D M for symmetric M, written out: this is the inner loop.
inline void add_product(Mat3& A, const Mat3& D, const Sym3& M) {
    for (int r = 0; r < 3; ++r) {
        A(r, 0) += D(r, 0) * M[0] + D(r, 1) * M[3] + D(r, 2) * M[4];
        A(r, 1) += D(r, 0) * M[3] + D(r, 1) * M[1] + D(r, 2) * M[5];
        A(r, 2) += D(r, 0) * M[4] + D(r, 1) * M[5] + D(r, 2) * M[2];
    }
}

}  // namespace

GroupMoments group_moments(const LiveTopology& live, const GroupShapes& shapes,
                           std::span<const MovingParticle> particles, ParticleIndex g) {
    GroupMoments m{Mat3::Zero(), Mat3::Zero(), Vec3::Zero()};
    const Vec3 origin = particles[g].x;  // relative to the centre particle: exact far from the world's origin
    for (uint32_t s = live.begin(g); s < live.end(g); ++s) {
        const MovingParticle& p = particles[live.member(s)];
        const MemberShape& member = shapes.member[s];
        const Vec3 mp = shapes.member_mass(live, s) * (p.x - origin);
        m.center += mp;
        m.positions.noalias() += mp * member.q.transpose();  // sum m q = 0, so the centre of mass drops out
        add_product(m.ellipsoids, p.d.toRotationMatrix(), shapes.member_moment(live, s));
    }
    m.center = origin + m.center / shapes.group[g].mass;
    return m;
}

void restore_linear_momentum(const SimulationMesh& rest, const LiveTopology& live, std::span<const uint8_t> piece_held,
                             size_t begin_piece, size_t end_piece, std::span<MovingParticle> io_particles) {
    SUNDER_ASSERT(begin_piece <= end_piece && end_piece <= live.n_pieces() && piece_held.size() == live.n_pieces());
    for (size_t piece = begin_piece; piece < end_piece; ++piece) {
        const auto particles = live.piece_particles(piece);
        if (piece_held[piece] || particles.size() == 1) continue;
        Vec3 departure = Vec3::Zero();
        double mass = 0;
        for (const ParticleId j : particles) {
            departure += rest.mass[j] * (io_particles[j].x - io_particles[j].x_inertial);
            mass += rest.mass[j];
        }
        departure /= mass;
        for (const ParticleId j : particles) io_particles[j].x -= departure;
    }
}

}  // namespace sunder
