#include "tests/support/plain_method.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "solver/matching/polar_decomposition.h"
#include "solver/scene/motion.h"
#include "tests/support/reference_stretch.h"

namespace sunder::test {
namespace {

Mat3 cross_matrix(const Vec3& r) {
    Mat3 m;
    m << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    return m;
}

}  // namespace

PlainMethod::PlainMethod(Scene scene) : scene_(std::move(scene)) {
    build_one_rings(scene_.rest);
    const SimulationMesh& rest = scene_.rest;
    for (size_t j = 0; j < rest.n_particles(); ++j) {
        moment_.push_back(rest.mass[j] / 5 * rest.radii[j].cwiseProduct(rest.radii[j]));
        rest_rotation_.push_back(rest.rest_orientation[j].toRotationMatrix());
        moment_rest_.push_back(moment_[j].asDiagonal() * rest_rotation_[j].transpose());
    }
    groups_.resize(rest.n_particles());
    particles_.resize(rest.n_particles());
}

void PlainMethod::synchronise(const FrameState& state) {
    if (synced_edges_ != state.edge_intact || synced_plastic_ != state.plastic_deformation) {
        live_.reset(scene_.rest, state.edge_intact);
        for (uint32_t g = 0; g < groups_.size(); ++g) rebuild_group(state.plastic_deformation[g], g);
        synced_edges_ = state.edge_intact;
        synced_plastic_ = state.plastic_deformation;
    }
    for (size_t g = 0; g < groups_.size(); ++g) groups_[g].rotation = state.group_rotation[g];
}

// A_qq = sum ( Rbar A Rbar^T + m xbar xbar^T ) - M cbar cbar^T,  then  F_P A_qq F_P^T.
void PlainMethod::rebuild_group(const Mat3& F_P, uint32_t g) {
    Group& group = groups_[g];
    group.mass = 0, group.rest_center.setZero(), group.A_qq.setZero();
    for (uint32_t s = live_.begin(g); s < live_.end(g); ++s) {
        const uint32_t j = live_.member(s);
        const double m = scene_.rest.mass[j];
        const Vec3& xbar = scene_.rest.rest_position[j];
        group.mass += m, group.rest_center += m * xbar;
        group.A_qq += rest_rotation_[j] * moment_rest_[j] + m * xbar * xbar.transpose();
    }
    group.rest_center /= group.mass;
    group.A_qq -= group.mass * group.rest_center * group.rest_center.transpose();
    group.stretch = stretch_basis(F_P * group.A_qq * F_P.transpose());
}

void PlainMethod::predict(const FrameInput& input, double h, double end, const FrameState& state) {
    for (size_t j = 0; j < particles_.size(); ++j) {
        Particle& p = particles_[j];
        p.x0 = state.position[j], p.q0 = state.orientation[j];
        p.x = p.x0 + h * (state.velocity[j] + h * input.gravity);
        p.q = (rotation_of(h * state.angular_velocity[j]) * p.q0).normalized();
        p.held = false;
        p.dv.setZero(), p.dw.setZero();
    }
    for (size_t k = 0; k < scene_.pins.size(); ++k) {
        if (!input.pins[k].active) continue;
        const Pose pose = interpolate(input.pins[k], end);
        for (uint32_t j : scene_.pins[k].particles) {
            particles_[j].x = pose.apply(scene_.rest.rest_position[j]);
            particles_[j].q = pose.orientation * scene_.rest.rest_orientation[j];
            particles_[j].held = true;
        }
    }
    for (Particle& p : particles_) p.R = p.q.toRotationMatrix();
}

// A_pq = sum ( R A Rbar^T + m x xbar^T ) - M c cbar^T, without F_P.
Mat3 PlainMethod::covariance(uint32_t g, Vec3& center) const {
    Mat3 A_pq = Mat3::Zero();
    center.setZero();
    for (uint32_t s = live_.begin(g); s < live_.end(g); ++s) {
        const uint32_t j = live_.member(s);
        const Particle& p = particles_[j];
        const Vec3 mx = scene_.rest.mass[j] * p.x;
        center += mx;
        A_pq.noalias() += p.R * moment_rest_[j];
        A_pq.noalias() += mx * scene_.rest.rest_position[j].transpose();
    }
    center /= groups_[g].mass;
    return A_pq - groups_[g].mass * center * groups_[g].rest_center.transpose();
}

Mat3 PlainMethod::inertia(uint32_t j) const {
    const Vec3 h = moment_[j].sum() * Vec3::Ones() - moment_[j];
    return particles_[j].R * h.asDiagonal() * particles_[j].R.transpose();
}

// L = sum ( H_j w_j + m_j r_j x v_j ), velocities read back from where the particles are now.
Vec3 PlainMethod::angular_momentum(uint32_t g, const Vec3& center, double h) const {
    Vec3 L = Vec3::Zero();
    for (uint32_t s = live_.begin(g); s < live_.end(g); ++s) {
        const uint32_t j = live_.member(s);
        const Particle& p = particles_[j];
        const Vec3 v = (p.x - p.x0) / h, w = rotation_vector(p.q * p.q0.conjugate()) / h;
        L += inertia(j) * w + scene_.rest.mass[j] * (p.x - center).cross(v);
    }
    return L;
}

void PlainMethod::match_group(const PlainSettings& settings, double k, double h, const Mat3& F_P, uint32_t g) {
    if (live_.count(g) == 1) return;
    Group& group = groups_[g];
    bool correct = settings.correct_momentum;
    for (uint32_t s = live_.begin(g); s < live_.end(g) && correct; ++s) correct = !particles_[live_.member(s)].held;

    Vec3 center;
    const Mat3 A_pq = covariance(g, center) * F_P.transpose();
    group.rotation = optimal_rotation(A_pq, group.rotation);
    const Mat3 G = group.rotation.toRotationMatrix() * F_P;
    const Vec3 before = correct ? angular_momentum(g, center, h) : Vec3::Zero();

    for (uint32_t s = live_.begin(g); s < live_.end(g); ++s) {
        const uint32_t j = live_.member(s);
        Particle& p = particles_[j];
        if (p.held) continue;
        const Vec3 goal = G * (scene_.rest.rest_position[j] - group.rest_center) + center;
        const Quat turned = group.rotation * scene_.rest.rest_orientation[j];
        p.x += k * (goal - p.x);
        p.q = k < 1 ? p.q.slerp(k, turned) : turned;
        p.R = p.q.toRotationMatrix();
    }
    if (!correct) return;

    Mat3 H = Mat3::Zero();
    for (uint32_t s = live_.begin(g); s < live_.end(g); ++s) {
        const uint32_t j = live_.member(s);
        const Mat3 r = cross_matrix(particles_[j].x - center);
        H += inertia(j) - scene_.rest.mass[j] * r * r;
    }
    const Vec3 turn = H.inverse() * (before - angular_momentum(g, center, h));
    for (uint32_t s = live_.begin(g); s < live_.end(g); ++s) {
        Particle& p = particles_[live_.member(s)];
        p.dv += turn.cross(p.x - center);
        p.dw += turn;
    }
}

void PlainMethod::update_velocities(const PlainSettings& settings, double h, FrameState& io_state) const {
    const double keep = std::exp(-settings.damping * h);
    for (size_t j = 0; j < particles_.size(); ++j) {
        const Particle& p = particles_[j];
        io_state.velocity[j] = keep * ((p.x - p.x0) / h + p.dv);
        io_state.angular_velocity[j] = keep * (rotation_vector(p.q * p.q0.conjugate()) / h + p.dw);
        io_state.position[j] = p.x;
        io_state.orientation[j] = p.q;
    }
}

// Section 3.4; what is left of the strain is Eq. 9.
PlainMethod::Strain PlainMethod::flow(const PlainSettings& settings, const Material& material, double h, uint32_t g,
                                      FrameState& io_state) {
    Group& group = groups_[g];
    Mat3& F_P = io_state.plastic_deformation[g];
    Vec3 center;
    const Mat3 A_pq = covariance(g, center) * F_P.transpose();
    group.rotation = optimal_rotation(A_pq, group.rotation);
    const Mat3 S = optimal_stretch(group.stretch, group.rotation.toRotationMatrix(), A_pq);
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(S);
    const Vec3 log_strain = eigen.eigenvalues().array().log();
    Strain strain{log_strain, eigen.eigenvectors()};
    const double size = log_strain.cwiseAbs().maxCoeff();
    io_state.strain[g] = size;
    if (!(size > io_state.yield[g])) return strain;

    const double gamma = std::min(settings.flow_per_step * (size - io_state.yield[g]) / size, 1.0);
    const double volume = log_strain.sum() / 3;  // of |Lambda|^(1/3)
    const Vec3 flowed = gamma * (log_strain.array() - volume);
    const Mat3& V = strain.directions;
    F_P = V * Vec3(flowed.array().exp()).asDiagonal() * V.transpose() * F_P;
    strain.elastic_log = (1 - gamma) * log_strain.array() + gamma * volume;
    io_state.yield[g] += material.hardening * size * h;
    group.stretch = stretch_basis(F_P * group.A_qq * F_P.transpose());
    return strain;
}

// Section 3.5: at once, so that the groups that come later see the cut.
void PlainMethod::fracture(const Strain& strain, double toughness, uint32_t g, FrameState& io_state) {
    int largest;
    if (!(strain.elastic_log.cwiseAbs().maxCoeff(&largest) > toughness)) return;
    Vec3 center;
    covariance(g, center);
    const Vec3 normal = groups_[g].rotation * strain.directions.col(largest);
    const double side = normal.dot(particles_[g].x - center);
    std::vector<EdgeId> cut;
    for (uint32_t s = live_.begin(g); s < live_.end(g); ++s)
        if (live_.member(s) != g && side * normal.dot(particles_[live_.member(s)].x - center) < 0)
            cut.push_back(live_.edge(s));
    for (const EdgeId e : cut) {
        io_state.edge_intact[e] = 0;
        io_state.broken.push_back({e, io_state.time, strain.elastic_log(largest)});
    }
    if (cut.empty()) return;
    for (const ParticleId changed : live_.remove_edges(scene_.rest, cut))
        rebuild_group(io_state.plastic_deformation[changed], changed);
}

bool PlainMethod::advance(const FrameInput& input, const PlainSettings& settings, FrameState& io_state) {
    synchronise(io_state);
    io_state.broken.clear();
    const uint32_t n = static_cast<uint32_t>(particles_.size());
    const double h = input.duration / settings.substeps;
    auto material = [&](uint32_t g) -> const Material& { return input.materials[scene_.rest.body[g]]; };
    bool sound = true;
    for (int step = 0; step < settings.substeps && sound; ++step) {
        predict(input, h, double(step + 1) / settings.substeps, io_state);
        for (int sweep = 0; sweep < settings.iterations; ++sweep)
            for (uint32_t i = 0; i < n; ++i) {
                const uint32_t g = settings.backward ? n - 1 - i : i;
                match_group(settings, material(g).stiffness, h, io_state.plastic_deformation[g], g);
            }
        update_velocities(settings, h, io_state);
        io_state.time += h;
        for (uint32_t g = 0; g < n; ++g) {
            if (live_.count(g) == 1 || (io_state.yield[g] == kNever && material(g).toughness == kNever)) continue;
            const Strain strain = flow(settings, material(g), h, g, io_state);
            fracture(strain, material(g).toughness, g, io_state);
        }
        for (uint32_t j = 0; j < n && sound; ++j)
            sound = io_state.position[j].allFinite() && io_state.plastic_deformation[j].allFinite() &&
                    io_state.velocity[j].norm() < settings.max_speed;
    }
    for (uint32_t g = 0; g < n; ++g) io_state.group_rotation[g] = groups_[g].rotation;
    synced_edges_ = io_state.edge_intact;
    synced_plastic_ = io_state.plastic_deformation;
    return sound;
}

}  // namespace sunder::test
