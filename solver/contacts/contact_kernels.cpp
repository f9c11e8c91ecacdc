// Compiled once for each instruction set (lanes.h).
#define SUNDER_LANES Float8

#include "solver/contacts/contact_kernels.h"

#include "solver/lanes/lane_vectors.h"

namespace sunder {
namespace {

static_assert(kLanes == kContactLanes);

struct Side {
    V3 moved, lever, arm;
    V3 shift, turn, spin;
    Lanes own, orbit_share, whole;
    Sym J;
};

SUNDER_INLINE Side side_of(const ContactArrays& a, const ContactBatch& c, int which) {
    const float *movables = a.movables->moved, *pieces = a.pieces->shift;
    Lanes m[2][4], p[4][4];
    for (size_t k = 0; k < 2; ++k) gather4<1>(movables, c.movable[which], 4 * k, m[k]);
    for (size_t k = 0; k < 4; ++k) gather4<1>(pieces, c.piece[which], 4 * k, p[k]);
    return {{m[0][0], m[0][1], m[0][2]},
            {m[1][0], m[1][1], m[1][2]},
            load3(c.arm[which]),
            {p[0][0], p[0][1], p[0][2]},
            {p[1][0], p[1][1], p[1][2]},
            {p[2][0], p[2][1], p[2][2]},
            m[0][3],
            m[1][3],
            p[0][3],
            {p[1][3], p[2][3], p[3][0], p[3][1], p[3][2], p[3][3]}};
}

// What a push changes.
struct Change {
    V3 moved, shift, turn, spin;
};

// By an impulse f at the touching point.
SUNDER_INLINE Change by_push(const Side& s, V3 f) {
    const V3 by_arm = s.J * cross(s.arm, f), by_lever = s.J * cross(s.lever, f);
    return {s.own * f, s.whole * f, by_arm + s.orbit_share * by_lever, by_arm + by_lever};
}

// Of the touching point.
SUNDER_INLINE V3 displacement(const Side& s, const Change& by) {
    return by.moved + by.shift + cross(by.turn, s.lever) + cross(by.spin, s.arm);
}

SUNDER_INLINE V3 moved(const Side& s) { return displacement(s, {s.moved, s.shift, s.turn, s.spin}); }

SUNDER_INLINE void turn_by(const Side& s, V3 couple, Change& io) {
    const V3 turned = s.J * couple;
    io.turn = io.turn + turned;
    io.spin = io.spin + turned;
}

// Adds to the first three numbers from `offset` on of the records of eight lanes, one after the other: two lanes may
// have the same record.
SUNDER_INLINE void scatter_add(float* records, const uint32_t* lanes, size_t offset, V3 v) {
    Lanes rows[4];
    transpose({v.x, v.y, v.z, all(0)}, rows);
    const auto add = [&](uint32_t lane, Float4 row) {
        float* to = records + lane + offset;
        store(to, load<Float4>(to) + row);
    };
    for (int i = 0; i < 4; ++i) add(lanes[i], low(rows[i]));
    for (int i = 0; i < 4; ++i) add(lanes[i + 4], high(rows[i]));
}

SUNDER_INLINE void add(const ContactArrays& a, const ContactBatch& c, int which, const Change& by) {
    scatter_add(a.movables->moved, c.movable[which], 0, by.moved);
    scatter_add(a.pieces->shift, c.piece[which], 0, by.shift);
    scatter_add(a.pieces->shift, c.piece[which], 4, by.turn);
    scatter_add(a.pieces->shift, c.piece[which], 8, by.spin);
}

// No eigenvalue of the symmetric, positive matrix is larger, and this one by little where they are alike.
SUNDER_INLINE Lanes largest_eigenvalue_bound(const Sym& m) {
    const Lanes mean = (m.xx + m.yy + m.zz) / all(3), scale = all(1) / larger(mean, all(kTiny));
    const Lanes x = scale * m.xx - all(1), y = scale * m.yy - all(1), z = scale * m.zz - all(1);
    const Lanes xy = scale * m.xy, xz = scale * m.xz, yz = scale * m.yz;
    const Lanes squared = x * x + y * y + z * z + all(2) * (xy * xy + xz * xz + yz * yz);
    return mean * (all(1) + all(2) * root(squared / all(6)));
}

SUNDER_INLINE void take_up(const ContactArrays& arrays, size_t k) {
    constexpr size_t kStride = sizeof(RoundContact) / sizeof(float), kRows = kStride / 4;
    Lanes row[kRows][4];
    for (size_t i = 0; i < kRows; ++i)
        gather4<kStride>(arrays.contacts->normal, arrays.contact_of_lane + kLanes * k, 4 * i, row[i]);
    const auto vector = [&](size_t i) { return V3{row[i][0], row[i][1], row[i][2]}; };
    ContactBatch& c = arrays.batches[k];
    store3(c.normal, vector(0)), store3(c.arm[0], vector(1)), store3(c.arm[1], vector(2));
    store(arrays.starts[k].missing, row[0][3]), store3(arrays.starts[k].motion, vector(3));
    store(c.friction, row[1][3]), store(c.rolling_arm, row[2][3]), store(c.inverse_mass, row[3][3]);
    store(c.normal_impulse, row[4][3]);
    for (size_t i = 0; i < 3; ++i) store(c.impulse[i], row[4][i]), store(c.impulse[3 + i], row[5][i]);
    for (size_t which = 0; which < 2; ++which)
        store(c.movable[which], row[6][which]), store(c.piece[which], row[6][2 + which]);
}

void describe(const ContactArrays& arrays, size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k) {
        take_up(arrays, k);
        ContactBatch& c = arrays.batches[k];
        const Side a = side_of(arrays, c, 0), b = side_of(arrays, c, 1);
        const auto response = [&](V3 f) { return displacement(a, by_push(a, f)) + displacement(b, by_push(b, f)); };
        const V3 n = load3(c.normal);
        const V3 along = response(n);
        store3(c.along_normal, along);
        const Lanes let = load<Lanes>(c.inverse_mass), inverse_mass = let * dot(n, along);
        const LaneMask counts = inverse_mass > all(0);
        store(c.inverse_mass, select<Lanes>(counts, inverse_mass, all(0)));
        store(c.mass, select<Lanes>(counts, all(1) / larger(inverse_mass, all(kTiny)), all(0)));

        // The larger eigenvalue of the response to tangents.
        const auto [t, u] = tangents_of(n);
        const V3 along_t = response(t);
        const Lanes tt = dot(t, along_t), tu = dot(u, along_t), uu = dot(u, response(u));
        const Lanes half = all(0.5) * (tt + uu), apart = all(0.5) * (tt - uu);
        const Lanes slip = half + root(apart * apart + tu * tu);
        store(c.slip_mass, select<Lanes>(counts, all(1) / larger(slip, all(kTiny)), all(0)));

        const Sym turning = {a.J.xx + b.J.xx, a.J.yy + b.J.yy, a.J.zz + b.J.zz,
                             a.J.xy + b.J.xy, a.J.xz + b.J.xz, a.J.yz + b.J.yz};
        const Lanes arm = load<Lanes>(c.rolling_arm);
        const LaneMask rolls = counts & (arm > all(0));
        const Lanes inertia = all(1) / larger(largest_eigenvalue_bound(turning), all(kTiny));
        store(c.rolling_inertia, select<Lanes>(rolls, inertia, all(0)));
        store(c.rolling_weight, select<Lanes>(rolls, all(1) / larger(arm * arm, all(kTiny)), all(0)));
    }
}

struct Began {
    Double4 shift[2][3];  // of four lanes each, l
    V3 turned;            // rad
};

SUNDER_INLINE Began began_of(const ContactArrays& arrays, const uint32_t* movable) {
    constexpr size_t kNumbers = sizeof(RoundBegan) / sizeof(double) / kMovableStride;  // for one of a movable
    Began s;
    for (int half = 0; half < 2; ++half) {
        Double4 shift[4];
        gather4<kNumbers>(arrays.began->shift, movable + 4 * half, 0, shift);
        for (int i = 0; i < 3; ++i) s.shift[half][i] = shift[i];
    }
    Lanes turned[4];
    gather4<2 * kNumbers>(arrays.began->turned, movable, 0, turned);
    s.turned = {turned[0], turned[1], turned[2]};
    return s;
}

SUNDER_INLINE bool is_zero(const ContactBatch& c) {
    Lanes sum = absolute(load<Lanes>(c.normal_impulse)) + absolute(load<Lanes>(c.normal_change)) +
                absolute(load<Lanes>(c.normal_direction));
    for (int k = 0; k < 6; ++k)
        sum = sum + absolute(load<Lanes>(c.impulse[k])) + absolute(load<Lanes>(c.change[k])) +
              absolute(load<Lanes>(c.direction[k]));
    return !any(sum > all(0));
}

void start(const ContactArrays& arrays, size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k) {
        ContactBatch& c = arrays.batches[k];
        const BatchStart& from = arrays.starts[k];
        const Began a = began_of(arrays, c.movable[0]), b = began_of(arrays, c.movable[1]);
        const auto apart = [&](int i) {
            float shift[kLanes];
            put_numbers(a.shift[0][i] - b.shift[0][i], shift), put_numbers(a.shift[1][i] - b.shift[1][i], shift + 4);
            return load<Lanes>(shift);
        };
        const V3 motion = load3(from.motion) + V3{apart(0), apart(1), apart(2)} + cross(a.turned, load3(c.arm[0])) -
                          cross(b.turned, load3(c.arm[1]));
        store3(c.motion, motion);
        store3(c.rolled, a.turned - b.turned);
        store(c.missing, load<Lanes>(from.missing) - dot(load3(c.normal), motion));
        store(c.normal_change, all(0)), store(c.normal_direction, all(0));
        for (int i = 0; i < 6; ++i) store(c.change[i], all(0)), store(c.direction[i], all(0));
        arrays.idle[k] = is_zero(c);
    }
}

void give(const ContactArrays& arrays, size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k) {
        if (arrays.idle[k]) continue;
        const ContactBatch& c = arrays.batches[k];
        const V3 friction = {load<Lanes>(c.impulse[0]), load<Lanes>(c.impulse[1]), load<Lanes>(c.impulse[2])};
        const V3 rolling = {load<Lanes>(c.impulse[3]), load<Lanes>(c.impulse[4]), load<Lanes>(c.impulse[5])};
        const V3 impulse = load<Lanes>(c.normal_impulse) * load3(c.normal) + friction;
        for (int which = 0; which < 2; ++which) {
            const Side s = side_of(arrays, c, which);
            Change by = by_push(s, which == 0 ? impulse : -impulse);
            turn_by(s, which == 0 ? rolling : -rolling, by);
            add(arrays, c, which, by);
        }
    }
}

// A pass is a step down the gradient; as much of the last direction is added to it as the steps' shrinking allows.
template <class V>
struct Follower {
    V share, keeps;  // keeps: 1 or 0

    explicit SUNDER_INLINE Follower(Following f) {
        float shares[kLanes], keep[kLanes];
        for (size_t i = 0; i < kLanes; ++i) shares[i] = static_cast<float>(f.share), keep[i] = f.keeps ? 1 : 0;
        share = load<V>(shares), keeps = load<V>(keep);
    }
    SUNDER_INLINE V operator()(V value, V change, float* io_direction) const {
        const V along = share * load<V>(io_direction);
        store(io_direction, keeps * (change + along));
        return value + along;
    }
    SUNDER_INLINE V operator()(const float* value, const float* change, float* io_direction) const {
        return (*this)(load<V>(value), load<V>(change), io_direction);
    }
};

// Not beyond length `limit`; of a limit of zero nothing is left, however small its square is.
SUNDER_INLINE V3 within(V3 v, Lanes limit) {
    const Lanes squared = dot(v, v);
    return select<Lanes>(squared < limit * limit, all(1), limit / root(larger(squared, all(kTiny)))) * v;
}

struct LaneResult {
    Lanes largest = all(0), size = all(0);
};

SUNDER_INLINE void visit(const ContactArrays& arrays, uint32_t batch, const Follower<Lanes>& follow,
                         LaneResult& io_result) {
    ContactBatch& c = arrays.batches[batch];
    const Side a = side_of(arrays, c, 0), b = side_of(arrays, c, 1);
    const V3 n = load3(c.normal), moved_by = moved(a) - moved(b);
    const Lanes missing = load<Lanes>(c.missing) - dot(n, moved_by);
    if (arrays.idle[batch] && !any(missing > all(0))) return;

    const Lanes before = follow(c.normal_impulse, c.normal_change, c.normal_direction);
    Lanes was[6];
    for (int k = 0; k < 6; ++k) was[k] = follow(c.impulse[k], c.change[k], c.direction[k]);
    const V3 friction = {was[0], was[1], was[2]}, rolling = {was[3], was[4], was[5]};

    const Lanes normal = larger(before + missing * load<Lanes>(c.mass), all(0)), change = normal - before;
    const V3 slip = load3(c.motion) + moved_by + change * load3(c.along_normal);
    const V3 wanted = friction - load<Lanes>(c.slip_mass) * (slip - dot(n, slip) * n);
    const V3 new_friction = within(wanted, load<Lanes>(c.friction) * normal);
    const V3 friction_change = new_friction - friction;
    const V3 impulse = change * n + friction_change;
    Change by_a = by_push(a, impulse), by_b = by_push(b, -impulse);

    const V3 rolled = load3(c.rolled) + (a.spin + by_a.spin) - (b.spin + by_b.spin);
    const V3 resisted = rolling - load<Lanes>(c.rolling_inertia) * rolled;
    const V3 new_rolling = within(resisted, load<Lanes>(c.rolling_arm) * normal);
    const V3 rolling_change = new_rolling - rolling;
    turn_by(a, rolling_change, by_a);
    turn_by(b, -rolling_change, by_b);
    add(arrays, c, 0, by_a);
    add(arrays, c, 1, by_b);

    store(c.normal_impulse, normal), store(c.normal_change, change);
    const V3 now[2] = {new_friction, new_rolling}, changes[2] = {friction_change, rolling_change};
    for (int k = 0; k < 2; ++k) {
        store(c.impulse[3 * k], now[k].x), store(c.impulse[3 * k + 1], now[k].y), store(c.impulse[3 * k + 2], now[k].z);
        store(c.change[3 * k], changes[k].x), store(c.change[3 * k + 1], changes[k].y);
        store(c.change[3 * k + 2], changes[k].z);
    }
    arrays.idle[batch] = !any(normal > all(0)) && is_zero(c);

    const Lanes inverse_mass = load<Lanes>(c.inverse_mass);
    io_result.largest = larger(io_result.largest, absolute(change) * inverse_mass);
    const Lanes squared = change * change + dot(friction_change, friction_change) +
                          load<Lanes>(c.rolling_weight) * dot(rolling_change, rolling_change);
    io_result.size = io_result.size + inverse_mass * squared;
}

PassResult pass(const ContactArrays& arrays, const uint32_t* batches, size_t n, Following following) {
    const Follower<Lanes> follow(following);
    LaneResult lanes;
    for (size_t k = 0; k < n; ++k) visit(arrays, batches[k], follow, lanes);
    float largest[kLanes];
    store(largest, lanes.largest);
    PassResult result{0, sum(lanes.size)};
    for (float x : largest) result.largest = x > result.largest ? x : result.largest;
    return result;
}

template <size_t numbers, size_t stride>
SUNDER_INLINE void follow_records(float* records, float* before, float* direction, size_t n, Following following) {
    const Follower<Float4> follow(following);
    for (size_t k = 0; k < n; ++k)
        for (size_t i = 0; i < numbers; i += 4) {
            float* at = records + stride * k + i;
            float* was = before + numbers * k + i;
            const Float4 value = load<Float4>(at);
            const Float4 now = follow(value, value - load<Float4>(was), direction + numbers * k + i);
            store(at, now), store(was, now);
        }
}

// The fourth number of each four says how pushes divide: it never changes, and nothing is followed.
void follow_movables(RoundMovable* m, float* before, float* direction, size_t n, Following following) {
    follow_records<kMovedNumbers, kMovableStride>(m->moved, before, direction, n, following);
}
void follow_pieces(RoundPiece* p, float* before, float* direction, size_t n, Following following) {
    follow_records<kPieceMovedNumbers, kPieceStride>(p->shift, before, direction, n, following);
}

}  // namespace

const ContactKernels SUNDER_KERNELS(kContactKernels) = {describe, start, give, pass, follow_movables, follow_pieces};

}  // namespace sunder
