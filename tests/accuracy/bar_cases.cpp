#include "tests/accuracy/bar_cases.h"

#include <fstream>
#include <stdexcept>

namespace sunder::test {
namespace {

const std::string kFolder = SUNDER_TEST_DATA "/reference/";
constexpr double kFoot = 0.1, kHead = 0.9;  // m: ends of the free part
constexpr double kLength = kHead - kFoot;

bool is_free(const Vec3& rest) { return rest.z() > kFoot && rest.z() < kHead; }

// Angle by which the points of [first, first + count) turned from rest about `axis`, through their mean; rad.
double mean_turn(const Bar& bar, const std::vector<uint32_t>& particles, int axis) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    Vec3 rest_center = Vec3::Zero(), center = Vec3::Zero();
    for (uint32_t i : particles) rest_center += bar.scene.rest.rest_position[i], center += bar.state.position[i];
    rest_center /= double(particles.size()), center /= double(particles.size());
    double cosine = 0, sine = 0;
    for (uint32_t i : particles) {
        const Vec3 r = bar.scene.rest.rest_position[i] - rest_center, x = bar.state.position[i] - center;
        cosine += r(a) * x(a) + r(b) * x(b), sine += r(a) * x(b) - r(b) * x(a);
    }
    return std::atan2(sine, cosine);
}

}  // namespace

Pose head_pose(Load load, double amount) {
    if (load == Load::stretch) return {Vec3(0, 0, amount / 100 * kLength), Quat::Identity()};
    if (load == Load::twist) return Bar::turned(amount * kDegree);
    const double angle = amount * kDegree;
    const Quat turn(Eigen::AngleAxisd(angle, Vec3::UnitX()));
    const Vec3 center(0, 0, kHead);
    Vec3 moved = center;
    if (angle != 0)
        moved = Vec3(0, -kLength / angle * (1 - std::cos(angle)), kFoot + kLength / angle * std::sin(angle));
    return {moved - turn * center, turn};
}

LoadedBar::LoadedBar(const BarSetup& setup)
    : load_(setup.load), frame_time_(1 / setup.frame_rate), bar_(setup.n, setup.neighbours) {
    bar_.material.poisson_ratio = setup.poisson_ratio;
    bar_.material.youngs_modulus = 2 * kShearModulus * (1 + setup.poisson_ratio);
    bar_.material.yield = setup.yield;
    bar_.material.flow_rate = setup.flow_rate;
    bar_.material.slender = setup.slender ? 1 : 0;
    bar_.settings = setup.settings;
    bar_.settings.self_collision = false;  // the field alone
    bar_.start();
}

void LoadedBar::drive(double amount, double seconds) {
    const int frames = std::max(1, static_cast<int>(std::lround(seconds / frame_time_)));
    const double from = amount_;
    for (int f = 0; f < frames; ++f)
        bar_.frame(seconds / frames, head_pose(load_, from + (amount - from) * f / frames),
                   head_pose(load_, from + (amount - from) * (f + 1) / frames));
    amount_ = amount;
}

double LoadedBar::settle(double tolerance) {
    const Pose pose = head_pose(load_, amount_);
    const SimulationMesh& rest = bar_.scene.rest;
    const double start = bar_.state.time;
    while (bar_.state.time - start < 20) {
        const std::vector<Vec3> before = bar_.state.position;
        bar_.frame(frame_time_, pose, pose);
        double moved = 0, displacement = 0;
        for (size_t i = 0; i < before.size(); ++i) {
            moved += (bar_.state.position[i] - before[i]).squaredNorm();
            displacement += (bar_.state.position[i] - rest.rest_position[i]).squaredNorm();
        }
        if (std::sqrt(moved / displacement) * 0.01 / frame_time_ < tolerance) return bar_.state.time - start;
    }
    return -1;
}

void LoadedBar::release(double seconds) {
    const int frames = static_cast<int>(std::lround(seconds / frame_time_));
    for (int f = 0; f < frames; ++f) bar_.frame(frame_time_, {}, {}, false);
}

double LoadedBar::reaction() const {
    constexpr double h = 1e-6;
    const SimulationMesh& rest = bar_.scene.rest;
    FrameState state = bar_.state;
    for (Vec3& v : state.velocity) v.setZero();
    for (Vec3& w : state.angular_velocity) w.setZero();
    Material elastic = bar_.material;
    elastic.flow_rate = elastic.damping_time = 0;
    FrameInput in = quiet_input(bar_.scene, elastic, h);
    const Pose pose = head_pose(load_, amount_);
    in.pins[1] = {pose, pose, false};
    SolverSettings settings = bar_.settings;
    settings.substeps = 1, settings.damping = 0;
    advance(*bar_.solver, in, settings, state);

    const Vec3 center = pose.apply(Vec3(0, 0, kHead));
    double force = 0;
    Vec3 momentum = Vec3::Zero();
    for (uint32_t i : bar_.scene.pins[1].particles) {
        const Vec3 squared = rest.radii[i].cwiseProduct(rest.radii[i]);
        const Mat3 Q = bar_.state.orientation[i].toRotationMatrix();
        const Mat3 inertia =
            rest.mass[i] / 5 * Q * (squared.sum() * Vec3::Ones() - squared).asDiagonal() * Q.transpose();
        force += rest.mass[i] * state.velocity[i].z() / h;
        momentum += rest.mass[i] * (bar_.state.position[i] - center).cross(state.velocity[i]) +
                    inertia * state.angular_velocity[i];
    }
    return load_ == Load::stretch ? -force : -momentum(load_ == Load::bend ? 0 : 2) / h;
}

double LoadedBar::angle() const {
    const SimulationMesh& rest = bar_.scene.rest;
    std::vector<uint32_t> low, high;
    const auto by_height = [&](uint32_t a, uint32_t b) {
        return rest.rest_position[a].z() < rest.rest_position[b].z();
    };
    std::vector<uint32_t> all(rest.n_particles());
    for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    std::stable_sort(all.begin(), all.end(), by_height);
    const size_t layer = static_cast<size_t>(std::lround(std::pow(all.size() / 5.0, 2.0 / 3)));
    low.assign(all.begin(), all.begin() + layer), high.assign(all.end() - layer, all.end());
    const int axis = load_ == Load::bend ? 0 : 2;
    return (mean_turn(bar_, high, axis) - mean_turn(bar_, low, axis)) / kDegree;
}

Reference read_reference(Load load, double poisson_ratio, int n) {
    const std::string path = kFolder + reference_name(load, poisson_ratio) + ".csv";
    std::ifstream file(path);
    if (!file) throw std::runtime_error(path + ": cannot be read");
    Reference reference;
    std::string line;
    while (std::getline(file, line)) {
        int lattice = 0;
        double x, y, z;
        std::sscanf(line.c_str(), "# reaction: %lf", &reference.reaction);
        if (std::sscanf(line.c_str(), "%d,%lf,%lf,%lf", &lattice, &x, &y, &z) == 4 && lattice == n)
            reference.position.emplace_back(x, y, z);
    }
    if (reference.position.size() != size_t(4 * n * n * n))
        throw std::runtime_error(path + ": no field for n = " + std::to_string(n));
    return reference;
}

double reference_residual(const std::string& name) {
    const std::string path = kFolder + name + ".csv";
    std::ifstream file(path);
    std::string line;
    double residual = 0;
    while (std::getline(file, line))
        if (std::sscanf(line.c_str(), "# residual angle at zero moment: %lf", &residual) == 1) return residual;
    throw std::runtime_error(path + ": no residual angle");
}

FieldError field_error(const Bar& bar, int n, const Reference& reference) {
    const SimulationMesh& rest = bar.scene.rest;
    const double d = 0.2 / n;
    double sum = 0, reference_sum = 0, most = 0, reference_most = 0;
    size_t found = 0;
    for (size_t p = 0; p < rest.n_particles(); ++p) {
        const Vec3& X = rest.rest_position[p];
        if (!is_free(X)) continue;
        const auto i = std::lround((X.x() + 0.1) / d - 0.5), j = std::lround((X.y() + 0.1) / d - 0.5),
                   k = std::lround((X.z() - kFoot) / d - 0.5);
        const Vec3& x = reference.position.at(static_cast<size_t>((k * n + j) * n + i));
        sum += (bar.state.position[p] - x).squaredNorm(), reference_sum += (x - X).squaredNorm();
        most = std::max(most, (bar.state.position[p] - x).norm());
        reference_most = std::max(reference_most, (x - X).norm());
        ++found;
    }
    if (found != reference.position.size()) throw std::runtime_error("the bar has not the reference's lattice");
    return {std::sqrt(sum / reference_sum), most / reference_most};
}

std::string reference_name(Load load, double poisson_ratio) {
    char text[32];
    const char* name = load == Load::stretch ? "stretch20" : load == Load::twist ? "twist90" : "bend60";
    std::snprintf(text, sizeof text, "%s_nu%.2f", name, poisson_ratio);
    return text;
}

double reference_amount(Load load) { return load == Load::stretch ? 20 : load == Load::twist ? 90 : 60; }

namespace {

LoadedBar loaded(const BarSetup& setup, double most) {
    LoadedBar bar(setup);
    bar.drive(most, most / 45);
    bar.drive(most, 0.5);  // flow comes to an end
    return bar;
}

}  // namespace

PlasticOutcome load_and_unload(const BarSetup& setup, double most) {
    LoadedBar bar = loaded(setup, most);
    PlasticOutcome outcome;
    outcome.moment = bar.reaction();
    double angle = most, moment = outcome.moment;
    constexpr double step = 5;
    while (moment > 0 && angle > -most) {
        bar.drive(angle - step, 0.125);
        const double next = bar.reaction();
        if (next <= 0) outcome.residual = angle - step * moment / (moment - next);
        angle -= step, moment = next;
    }
    return outcome;
}

double load_and_let_go(const BarSetup& setup, double most) {
    LoadedBar bar = loaded(setup, most);
    bar.release(2);
    return bar.angle();
}

}  // namespace sunder::test
